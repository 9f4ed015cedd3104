//! The firmware with the feature `tracking`: only the rectangle around the markers is captured, and the forces are those
//! of whole frames.

mod common;

use std::path::PathBuf;

use common::{Run, Setup, bug, firmware};

/// Words of a whole frame.
const WHOLE: u64 = 320 * 240 / 2;

/// Frames of two runs on the same scene, as (in both, with equal results in both).
fn equal_samples(run: &Run, other: &Run) -> (usize, usize) {
    let (samples, others) = (run.samples(), other.samples());
    let pairs = samples.iter().filter_map(|sample| {
        let same_frame = others.iter().find(|other| other.frame == sample.frame);
        same_frame.map(|other| (sample, other))
    });
    pairs.fold((0, 0), |(both, equal), (sample, other)| {
        let is_equal = (sample.force, sample.status) == (other.force, other.status);
        (both + 1, equal + usize::from(is_equal))
    })
}

#[test]
fn cropped_frames_give_the_forces_of_whole_ones() {
    check_cropped(firmware(), bug("tracking"));
}

#[test]
fn cropped_frames_of_yuv422_give_the_forces_of_whole_ones() {
    check_cropped(bug("yuv422"), bug("yuv422-tracking"));
}

fn check_cropped(whole: PathBuf, cropped: PathBuf) {
    // Nothing moves: the two programs reset the camera some microseconds apart, so that their exposures are not of the
    // same instants. The noise is the same.
    let still = |elf| Setup {
        scene: "static",
        ..Setup::new(elf, 320)
    };
    let whole = still(whole).run();
    let cropped = still(cropped).run();
    assert!(cropped.samples().iter().all(|it| it.force.is_some()));
    assert_eq!(cropped.missing_frames(), Vec::<u32>::new());
    let (both, equal) = equal_samples(&cropped, &whole);
    assert!(both >= 12, "{both} frames in both runs");
    assert_eq!(equal, both);
    let dcmi = cropped.report.dcmi;
    assert!(dcmi.words < dcmi.frames * WHOLE * 7 / 10, "{dcmi:?}");
    let tracked = |run: &Run| (run.stats().frames_tracked, run.stats().tracking_lost);
    assert_eq!(tracked(&whole), (0, 0));
    assert!(
        tracked(&cropped).0 >= 12 && tracked(&cropped).1 == 0,
        "{:?}",
        cropped.stats()
    );
    assert_eq!(cropped.report.refused, [] as [String; 0]);
}

#[test]
fn a_moving_tip_is_followed() {
    let run = Setup::new(bug("tracking"), 320).run();
    assert_eq!(run.missing_frames(), Vec::<u32>::new());
    let followed = run.followed();
    let with_force = followed.iter().filter(|sample| sample.force.is_some());
    assert_eq!(with_force.count(), followed.len());
    run.assert_times();
}

/// An impact moves the markers farther between two frames than their windows reach: that frame has
/// no force, the next one is whole, and both are counted.
#[test]
fn what_jumps_is_lost_counted_and_found_again() {
    let setup = Setup {
        scene: "tests/catch.toml",
        ..Setup::new(bug("tracking"), 600)
    };
    let run = setup.run();
    let (samples, stats) = (run.samples(), run.stats());
    assert_eq!(run.missing_frames(), Vec::<u32>::new());
    assert!(stats.tracking_lost >= 1, "{stats:?}");
    let without = samples
        .iter()
        .filter(|sample| sample.force.is_none())
        .count();
    // The impact, and what it throws back, smear the markers for three frames each, whole ones too.
    assert!(
        (1..=8).contains(&without),
        "{without} without force, {stats:?}"
    );
    assert!(samples.last().is_some_and(|sample| sample.force.is_some()));
    assert!(stats.frames_tracked >= 8, "{stats:?}");
}

/// Half a frame does not reach down to all markers: it is counted, and the next one is captured whole or cropped.
#[test]
fn a_short_frame_costs_itself_and_no_other() {
    let run = Setup::new(bug("tracking"), 300)
        .fault("frame-short@230")
        .run();
    let (stats, missing) = (run.stats(), run.missing_frames());
    assert!((1..=2).contains(&stats.dropped_size), "{stats:?}");
    assert_eq!(missing.len(), stats.dropped_size as usize, "{missing:?}");
    let last = run.samples().last().map(|sample| sample.frame);
    assert!(last > missing.last().map(|frame| frame + 3), "{last:?}");
    // The frame after it has no markers where they were followed to, the next one no speeds.
    let followed = run.followed();
    let with_force = followed.iter().filter(|sample| sample.force.is_some());
    assert!(with_force.count() + 2 >= followed.len(), "{followed:?}");
}

#[test]
fn an_overrun_costs_a_frame_and_no_other() {
    let run = Setup::new(bug("tracking"), 300)
        .fault("dcmi-overrun@240")
        .run();
    let (stats, missing) = (run.stats(), run.missing_frames());
    assert!(stats.capture_overruns <= 1, "{stats:?}");
    assert_eq!(missing.len(), stats.dropped_overrun as usize, "{missing:?}");
}
