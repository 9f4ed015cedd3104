//! Tests that the other cameras have the properties of the first one: the second board's MT9V034,
//! and an OV5640 in the first board's socket. Tests of a single camera are in its file.

use crate::common::{Bug, Run, Setup, other};
use crate::{openmv, ov5640};
use hivtac_terms::status::Status;

/// A camera on its board.
struct Part {
    setup: fn(u64) -> Setup,
    /// Its firmware with seeded bugs.
    bugs: &'static str,
    assert_good: fn(&Run),
    /// The same after a search for the exposure.
    assert_found: fn(&Run),
    /// Durations of runs, ms: with some frames, with a camera that is found late or was silent, and
    /// with an exposure that is found in small steps.
    lasts: [u64; 4],
    /// Faults: the camera is silent, and a frame is short.
    faults: [&'static str; 2],
    /// The message while it is absent.
    absent: &'static str,
}

const PARTS: [Part; 2] = [
    Part {
        setup: crate::common::openmv,
        bugs: "openmv-h7-seeded-bugs",
        assert_good: openmv::assert_good,
        assert_found: openmv::assert_good,
        lasts: [420, 1_340, 840, 700],
        faults: ["camera-silent@330-400", "frame-short@340"],
        absent: "no MT9V034",
    },
    Part {
        setup: ov5640::ov5640,
        bugs: "seeded-bugs",
        assert_good: ov5640::assert_good,
        assert_found: |run| drop(ov5640::forces(run)),
        lasts: [700, 1_700, 1_300, 2_200],
        faults: ["camera-silent@600-700", "frame-short@600-608"],
        absent: "no OV7725 or OV5640",
    },
];

#[test]
#[ignore = "20 s: as with the first camera"]
fn half_as_many_instructions_per_second_are_enough() {
    for part in PARTS {
        let setup = (part.setup)(part.lasts[0]);
        let instructions_per_second = setup.instructions_per_second / 2;
        let run = Setup {
            instructions_per_second,
            ..setup
        }
        .run();
        (part.assert_good)(&run);
        assert_eq!(run.missing_frames(), Vec::<u32>::new());
    }
}

#[test]
#[ignore = "20 s: as with the first camera"]
fn an_absent_camera_is_reported_and_found_later() {
    for part in PARTS {
        let run = (part.setup)(part.lasts[1]).fault("camera-absent@0-700");
        let run = run.run();
        assert!(run.log().contains(part.absent), "{}", run.log());
        assert!(run.samples().len() >= 6, "{:?}", run.stats());
    }
}

/// Its reset line or its register reset undoes the settings of another program.
#[test]
#[ignore = "10 s: as with the first camera"]
fn what_another_program_left_in_the_camera_is_reset() {
    for part in PARTS {
        (part.assert_good)(&(part.setup)(part.lasts[0]).fault("camera-used").run());
    }
}

#[test]
#[ignore = "20 s: as with the first camera"]
fn a_silent_camera_is_restarted() {
    for part in PARTS {
        let run = (part.setup)(part.lasts[2]).fault(part.faults[0]).run();
        let stats = run.stats();
        let restarted = stats.camera_timeouts >= 1 && stats.camera_restarts >= 1;
        assert!(restarted, "{stats:?}");
        let reported = |status: Status| status.contains(Status::CAMERA_RESTARTED);
        let samples = run.samples();
        let restarted = samples.iter().find(|sample| reported(sample.status));
        let restarted = restarted.expect("a sample says so").frame;
        assert!(samples.iter().any(|sample| sample.frame > restarted + 3));
        run.assert_times();
    }
}

/// A frame of the wrong size costs itself and no other.
#[test]
#[ignore = "10 s: as with the first camera"]
fn a_short_frame_is_dropped() {
    for part in PARTS {
        let run = (part.setup)(part.lasts[0]).fault(part.faults[1]).run();
        assert!(run.stats().dropped_size >= 1, "{:?}", run.stats());
        let after = run.frames_after_a_loss();
        assert_eq!(after.len(), 1, "{after:?}");
    }
}

/// Its automatic control may move in small steps, too.
#[test]
#[ignore = "20 s: as with the first camera"]
fn an_exposure_that_is_found_in_small_steps_is_waited_for() {
    for part in PARTS {
        let run = (part.setup)(part.lasts[3]).fault("camera-hesitant").run();
        (part.assert_found)(&run);
    }
}

/// In one bug DCMI takes blank rows for a frame; in the other the camera sends YUV for RGB, or,
/// without binning, four times the data.
#[test]
#[ignore = "17 s: as with the first camera"]
fn seeded_bugs_are_noticed() {
    for part in PARTS {
        for bug in [Bug::Polarities, Bug::CameraRegister] {
            let setup = Setup {
                elf: other(part.bugs),
                ..(part.setup)(part.lasts[0])
            };
            let run = setup.run_with(bug);
            let samples = run.samples();
            assert!(
                samples.iter().all(|sample| sample.force.is_none()),
                "{bug:?}"
            );
            let stats = run.stats();
            let dropped = stats.dropped_size + stats.dropped_overrun;
            let noticed = samples.len() >= 3 || dropped >= 2 && stats.frames_processed == 0;
            assert!(noticed, "{bug:?}: {stats:?}");
        }
    }
}
