//! Tests of second looks: in frames full of salt, the firmware looks at each frame again in the
//! available time.

use crate::common::{Run, Setup, firmware, instructions_per_second};
use hivtac_terms::status::Status;

/// Runs a scene in which every frame needs a second look.
fn salted(instructions_per_second: u64) -> Run {
    let setup = Setup {
        scene: "tests/salt.toml",
        instructions_per_second,
        ..Setup::new(firmware(), 400)
    };
    let run = setup.run();
    assert_eq!((run.report.dcmi.overruns, run.report.resets), (0, 0));
    let (mut forces, mut wrong) = (0, Vec::new());
    for sample in run.followed() {
        let Some(force) = sample.force else { continue };
        assert!(
            sample.status.contains(Status::FRAME_DISTURBED),
            "{sample:?}"
        );
        forces += 1;
        let line = run.truth.iter().find(|line| line["frame"] == sample.frame);
        let truth = line.and_then(|line| line["magnitude_n"].as_f64()).unwrap();
        let (reported, sigma) = (force.magnitude.0, force.magnitude_sigma.0);
        let off = (f64::from(reported) - 1e6 * truth).abs();
        if off > 3.0 * f64::from(sigma) + 500.0 {
            wrong.push(format!("{sample:?}: truly {truth} N"));
        }
    }
    let samples = run.samples().len();
    println!("{forces} forces of {samples} samples; {:?}", run.stats());
    assert!(wrong.is_empty(), "{wrong:#?}");
    run
}

#[test]
#[ignore = "10 s"]
fn salted_frames_keep_their_force_and_their_rate() {
    let run = salted(instructions_per_second());
    let forces = run.samples().iter().filter(|s| s.force.is_some()).count();
    assert!(forces + 1 >= run.samples().len(), "{forces} forces");
    assert_eq!(run.missing_frames(), Vec::<u32>::new());
    run.assert_only_setup_drops();
}

/// The camera overwrites a frame before its second look: then the first look stands. Frames whose
/// second look comes too late are counted.
#[test]
#[ignore = "15 s"]
fn a_look_that_comes_too_late_is_given_up() {
    for fourths in [2, 3] {
        let run = salted(instructions_per_second() / 4 * fourths);
        for sample in run.samples() {
            let refused = sample.status.contains(Status::BLOB_OVERFLOW);
            assert_eq!(
                sample.force.is_none(),
                refused || sample.status.contains(Status::UNEXPLAINED),
                "{sample:?}"
            );
        }
        let stats = run.stats();
        let dropped = stats.dropped_busy + stats.dropped_overrun + stats.dropped_size;
        let counted = stats.frames_processed + dropped + stats.dropped_setup;
        // One is measured, one waits, and one is being exposed.
        assert!(stats.frames_exposed.abs_diff(counted) <= 3, "{stats:?}");
        assert!(run.missing_frames().len() <= dropped as usize, "{stats:?}");
        assert!(run.samples().len() >= 20, "{stats:?}");
    }
}
