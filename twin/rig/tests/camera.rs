//! Tests of the behaviour of a real OV7725 that its register table does not show. The firmware must
//! not rely on the table alone.

use crate::common::{Run, Setup, command, firmware};
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_wire::message::{Outcome, Request};

fn assert_good(run: &Run) {
    let samples = run.samples();
    assert!(
        samples.len() >= 4,
        "{} samples; {}",
        samples.len(),
        run.log()
    );
    for sample in samples {
        let dark = Status::IMAGE_DARK | Status::IMAGE_SATURATED;
        assert_eq!(sample.status.0 & dark.0, 0, "{sample:?}");
    }
    for sample in run.followed() {
        assert!(sample.force.is_some(), "{sample:?}");
    }
}

/// Data sheets and drivers disagree about the values of some registers after a reset. The rig gives
/// them different values for each seed, and ends a run that captures a frame which depends on one.
#[test]
fn no_frame_depends_on_a_register_that_nobody_wrote() {
    for seed in [2, 3, 4] {
        let setup = Setup {
            seed,
            ..Setup::new(firmware(), 220)
        };
        assert_good(&setup.run());
    }
}

/// Supplies and registers outlive the microcontroller's reset. Another program has changed each of
/// them.
#[test]
fn what_another_program_left_in_the_camera_is_reset() {
    assert_good(&Setup::new(firmware(), 220).fault("camera-used").run());
}

/// Exposure and gain begin with any values. The first sample's frame is as well exposed as the
/// later ones: its markers have the same size.
#[test]
fn the_first_sample_is_well_exposed() {
    let setup = Setup {
        scene: "static",
        // The first sample leaves before the shape could be set.
        shape: None,
        ..Setup::new(firmware(), 220)
    };
    let run = setup.run();
    assert_good(&run);
    let magnitude = |nth: usize| run.samples()[nth].force.unwrap().magnitude.0;
    let (first, later) = (magnitude(0), magnitude(3));
    assert!(first.abs_diff(later) < 500, "{first} and {later} µN");
}

/// On command, exposure and gain are searched anew. Frames pass meanwhile and are counted, and the
/// forces afterwards are as before.
#[test]
fn exposure_is_found_anew_on_command() {
    let run = Setup::new(firmware(), 330)
        .at(220, Action::Send(command(50, Request::Expose)))
        .at(221, Action::Send(command(51, Request::Expose)))
        .run();
    let outcomes = [50, 51].map(|id| run.answers(id)[0].0);
    assert_eq!(outcomes, [Outcome::Done, Outcome::Busy]);
    assert_good(&run);
    let missing = run.missing_frames();
    assert!((3..=12).contains(&missing.len()), "{missing:?}");
    assert_eq!(run.frames_after_a_loss(), [missing.last().unwrap() + 1]);
    assert_eq!(run.stats().camera_restarts, 0);
}
