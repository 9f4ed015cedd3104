//! A new threshold while frames are streamed: the old one serves until the new one is whole, no frame is lost, and none is of
//! two thresholds.

mod common;

use common::{Setup, firmware, set_threshold};
use hivtac_rig::script::Action;
use hivtac_wire::message::{HsvBox, Outcome, Threshold};
use hivtac_wire::status::Status;

/// Accepts nothing that the scene shows.
const GREEN: HsvBox = HsvBox {
    hue_low: 50,
    hue_high: 70,
    saturation_low: 100,
    saturation_high: 255,
    value_low: 45,
    value_high: 255,
};
const ASKED: u16 = 77;

fn set(id: u16, threshold: HsvBox) -> Action {
    set_threshold(id, Threshold::Rgb565(threshold))
}

/// At whatever time of a frame it comes (one takes 6.4 ms).
#[test]
fn no_frame_is_lost_or_of_two_thresholds() {
    for ms in [230, 232, 234, 236] {
        let run = Setup::new(firmware(), 340).at(ms, set(ASKED, GREEN)).run();
        assert_eq!(run.missing_frames(), Vec::<u32>::new(), "{ms} ms");
        assert_eq!(run.frames_after_a_loss(), Vec::<u32>::new(), "{ms} ms");
        let [(Outcome::Done, before)] = run.answers(ASKED)[..] else {
            panic!("{ms} ms: {:?}", run.answers(ASKED));
        };
        let samples = run.samples();
        // With the markers' red every frame has a force; without it nothing is seen. Half of both would be something else.
        let old = samples
            .iter()
            .take_while(|sample| sample.force.is_some())
            .count();
        assert!(old.abs_diff(before) <= 1, "{ms} ms: {old} before {before}");
        assert!(
            old >= 2 && samples.len() >= old + 2,
            "{ms} ms: {old} of {}",
            samples.len()
        );
        for sample in &samples[old..] {
            assert!(
                sample.status.contains(Status::IMAGE_DARK),
                "{ms} ms: {sample:?}"
            );
            assert!(
                sample.status.contains(Status::MODEL_MISMATCH),
                "{ms} ms: {sample:?}"
            );
        }
        // Made within 80 ms, at half the speed as well.
        let asked_us = i64::from(ms as u32) * 1000;
        let first_new = samples[old].frame;
        let exposed = run.truth.iter().find(|truth| truth["frame"] == first_new);
        let exposed_us = exposed.unwrap()["time_us"].as_i64().unwrap();
        assert!(exposed_us - asked_us <= 80_000, "{ms} ms: {exposed_us}");
    }
}

#[test]
fn a_second_one_waits_its_turn_and_nonsense_is_refused() {
    let nonsense = HsvBox {
        hue_low: 180,
        ..GREEN
    };
    let red = HsvBox {
        hue_low: 170,
        hue_high: 10,
        ..GREEN
    };
    let run = Setup::new(firmware(), 400)
        .at(220, set(1001, GREEN))
        .at(221, set(1002, red))
        .at(222, set(1003, nonsense))
        .at(300, set(1004, nonsense))
        .at(305, set(1005, red))
        .run();
    let outcome = |asked| run.answers(asked).first().map(|(outcome, _)| *outcome);
    assert_eq!(outcome(1001), Some(Outcome::Done));
    assert_eq!(outcome(1002), Some(Outcome::Busy));
    assert_eq!(outcome(1003), Some(Outcome::Busy));
    assert_eq!(outcome(1004), Some(Outcome::InvalidArgument));
    assert_eq!(outcome(1005), Some(Outcome::Done));
    assert_eq!(run.missing_frames(), Vec::<u32>::new());
    assert!(
        run.samples()
            .last()
            .is_some_and(|sample| sample.force.is_some())
    );
}
