//! Tests of a new threshold during a stream: its table is made in place, frames that pass meanwhile
//! are counted, and no frame mixes two thresholds.

use crate::common::{Setup, firmware, set_threshold};
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{HsvBox, Threshold};
use hivtac_wire::message::{Outcome, Sample};

/// A threshold that accepts nothing in the scene.
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

/// The command comes at several times within a frame (one takes 6.4 ms).
#[test]
fn no_frame_is_of_two_thresholds_and_those_that_pass_are_counted() {
    for ms in [230, 232, 234, 236] {
        let run = Setup::new(firmware(), 340).at(ms, set(ASKED, GREEN)).run();
        run.assert_only_setup_drops();
        let [(Outcome::Done, before)] = run.answers(ASKED)[..] else {
            panic!("{ms} ms: {:?}", run.answers(ASKED));
        };
        let samples = run.samples();
        // With the markers' red every frame has a force; without it no marker is seen. A mix of
        // both would differ from either.
        let is_old = |sample: &&&Sample| !sample.status.contains(Status::MODEL_MISMATCH);
        let old = samples.iter().take_while(is_old).count();
        assert_eq!(old, before, "{ms} ms");
        // The first frame may have no predecessor; it is then measured as it is seen.
        assert!(samples[1..old].iter().all(|sample| sample.force.is_some()));
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
        // 15 ms for the table, and twice that at half the speed.
        let missing = run.missing_frames();
        assert!((2..=8).contains(&missing.len()), "{ms} ms: {missing:?}");
        assert_eq!(missing[0], samples[old - 1].frame + 1, "{ms} ms");
        assert_eq!(run.frames_after_a_loss(), [samples[old].frame], "{ms} ms");
    }
}

#[test]
fn each_is_obeyed_in_its_turn_and_nonsense_is_refused() {
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
        .run();
    let outcome = |asked| run.answers(asked).first().map(|(outcome, _)| *outcome);
    assert_eq!(outcome(1001), Some(Outcome::Done));
    assert_eq!(outcome(1002), Some(Outcome::Done));
    assert_eq!(outcome(1003), Some(Outcome::InvalidArgument));
    run.assert_only_setup_drops();
    assert!(
        run.samples()
            .last()
            .is_some_and(|sample| sample.force.is_some())
    );
}
