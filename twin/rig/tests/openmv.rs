//! Tests of the second board, an OpenMV Cam H7 with an MT9V034: it has the properties of the first
//! one.

use crate::common::{Run, Setup, assert_usual, command, firmware, openmv, set_threshold};
use crate::led;
use hivtac_rig::board;
use hivtac_rig::camera::part;
use hivtac_rig::chip::Revision;
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{HsvBox, Mono, Threshold, Yuv422};
use hivtac_wire::message::{Outcome, Request};

pub fn assert_good(run: &Run) {
    let samples = run.samples();
    assert!(samples.len() >= 6, "{}: {}", samples.len(), run.log());
    for sample in &samples {
        assert!(sample.force.is_some(), "{sample:?}");
        assert_usual(sample);
    }
    run.assert_times();
    run.assert_only_setup_drops();
}

/// At least 230 forces a second, each at most 7 ms after the middle of its exposure.
#[test]
fn every_frame_is_measured_at_230_a_second_within_7_ms() {
    let run = openmv(420).protected().run();
    assert_good(&run);
    assert_eq!(run.missing_frames(), Vec::<u32>::new());
    let hello = run.hellos()[0];
    assert_eq!((hello.width, hello.height), (160, 152));
    assert_eq!(hello.board.as_str(), "openmv-h7 + mt9v034");
    assert_eq!(hello.preset.as_str(), "mt9v034");
    let rate_hz = run.rate_hz();
    assert!(rate_hz >= 230.0, "{rate_hz} forces a second");
    for (frame, latency_s) in run.latencies() {
        assert!(latency_s <= 0.007, "{latency_s} s of {frame}");
    }
}

/// The firmware's forces are those of the tip.
#[test]
fn forces_are_the_true_ones() {
    let run = openmv(420).run();
    let worst_un = run.worst_force_un(&run.samples());
    assert!(worst_un < 600.0, "{worst_un} µN");
}

/// A camera of the other kind is reported by its name, on either board, and nothing is written to
/// it.
#[test]
fn a_camera_of_the_other_kind_is_named() {
    for (setup, camera, name) in [
        (openmv(700), part::Kind::Ov7725, "this is an OV7725"),
        (
            Setup::new(firmware(), 700),
            part::Kind::Mt9v034,
            "this is an MT9V034",
        ),
    ] {
        let run = Setup { camera, ..setup }.run();
        assert!(run.log().contains(name), "{}", run.log());
        assert!(run.samples().is_empty());
        assert_eq!(run.report.sccb_writes, 0);
    }
}

/// An MT9V032 is not among this firmware's cameras.
#[test]
fn a_camera_with_another_version_is_refused() {
    let run = openmv(700).fault("camera-wrong-id").run();
    assert!(run.log().contains("ID 13 13"), "{}", run.log());
    assert_eq!((run.samples().len(), run.report.sccb_writes), (0, 0));
}

/// The camera sees no colours: a threshold of its luma is accepted at once, others are refused.
#[test]
fn only_thresholds_of_its_luma_are_taken() {
    let red = Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255]));
    let yuv = Threshold::Yuv422(Yuv422 { cr_low: 162 });
    let mono = |high| Threshold::Mono(Mono { low: 0, high });
    let run = openmv(420)
        .at(340, set_threshold(61, red))
        .at(345, set_threshold(62, yuv))
        .at(350, set_threshold(63, mono(80)))
        .at(355, set_threshold(64, mono(88)))
        .run();
    let outcomes = [61, 62, 63, 64].map(|id| run.answers(id)[0].0);
    use Outcome::{Done, Unsupported};
    assert_eq!(outcomes, [Unsupported, Unsupported, Done, Done]);
    let last = run.samples().pop().unwrap().status;
    assert!(!last.contains(Status::MODEL_MISMATCH), "{last:?}");
}

#[test]
#[ignore = "as on the other board"]
fn exposure_is_found_anew_on_command() {
    let run = openmv(560)
        .at(340, Action::Send(command(50, Request::Expose)))
        .run();
    assert_eq!(run.answers(50)[0].0, Outcome::Done);
    let samples = run.samples();
    assert!(samples.iter().all(|sample| sample.force.is_some()));
    let missing = run.missing_frames();
    assert_eq!(run.frames_after_a_loss(), [missing.last().unwrap() + 1]);
    assert!(samples.last().unwrap().frame > missing.last().unwrap() + 3);
    assert_eq!(run.stats().camera_restarts, 0);
    run.assert_times();
}

/// Revision Y, which some of these boards have: the LED flashes and nothing else is set up.
#[test]
fn an_old_revision_is_refused_with_a_flashing_led() {
    let setup = Setup {
        revision: Revision::Y,
        ..openmv(1_600)
    };
    let directory = tempfile::tempdir().unwrap();
    let outcome = setup.try_run(&directory.path().join("truth")).unwrap();
    assert_eq!((outcome.report.exposures, outcome.report.resets), (0, 0));
    led::assert_flashes_twice(&outcome.report);
}

/// The first board's crystal is twice as fast: on it, this firmware sets clocks that are too fast.
#[test]
fn on_the_other_board_it_breaks_a_rule_of_the_chip() {
    let setup = Setup {
        board: board::Kind::Weact,
        ..openmv(420)
    };
    let directory = tempfile::tempdir().unwrap();
    let error = setup.try_run(&directory.path().join("truth")).unwrap_err();
    assert!(error.to_string().contains("HCLK"), "{error}");
}
