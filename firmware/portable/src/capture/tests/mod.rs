//! Tests tracker and follower in a simulated world: every delivered frame is right and every frame
//! is counted.

mod follower;
mod world;

use crate::capture::{Ending, Event, Tally, Tracker};
use proptest::prelude::*;
use std::vec::Vec;
use world::{BAND, Chip, FRAME, GOOD, Pace, SHAPE, Sent, World, value};

/// Sends frames to prompt handlers, then a good one. Returns the world afterwards.
fn promptly(frames: &[Sent]) -> World {
    let mut world = World::new(Pace::prompt());
    for frame in frames {
        world.send(*frame);
    }
    world.settle();
    world.check_contents();
    world
}

#[test]
fn frames_without_a_gap_are_all_delivered() {
    let world = promptly(&[GOOD; 20]);
    assert_eq!(world.numbers(), (1..=21).collect::<Vec<_>>());
    assert_eq!((world.tally.processed, world.counted()), (21, 21));
    assert_eq!(world.chip.restarts, 1, "nothing was brought back in step");
    assert!(world.after.iter().all(|after| *after == (false, false)));
}

#[test]
fn a_short_frame_is_dropped_and_the_next_delivered() {
    for words in 0..FRAME {
        let world = promptly(&[GOOD, Sent { words, ..GOOD }, GOOD]);
        assert_eq!(world.numbers(), [1, 3, 4], "{words} words");
        assert_eq!(world.tally.size, 1, "{words} words");
        assert_eq!(world.after, [(false, false), (true, false), (false, false)]);
    }
}

#[test]
fn a_long_frame_counts_as_such_and_the_next_is_delivered() {
    for surplus in 1..3 * FRAME {
        let words = FRAME + surplus;
        let world = promptly(&[GOOD, Sent { words, ..GOOD }, GOOD]);
        let numbers = world.numbers();
        assert_eq!(numbers[numbers.len() - 2..], [3, 4], "{surplus} more");
        let Tally {
            processed, size, ..
        } = world.tally;
        assert_eq!((processed, size), (3, 1), "{surplus} more");
        // Whether or not it was delivered before it turned out too long, the next delivery reports
        // it.
        assert!(world.after[numbers.len() - 2].0, "{surplus} more");
    }
}

#[test]
fn an_overrun_costs_its_frame_and_no_more() {
    for word in 0..FRAME {
        let overrun = Sent {
            overrun_at: Some(word),
            ..GOOD
        };
        let world = promptly(&[GOOD, overrun, GOOD]);
        assert_eq!(world.numbers(), [1, 3, 4], "at word {word}");
        assert_eq!(world.tally.overrun, 1, "at word {word}");
        assert_eq!(world.after, [(false, false), (true, true), (false, false)]);
    }
}

#[test]
fn a_frame_is_delivered_before_its_end_is_known() {
    let mut world = World::new(Pace::prompt());
    world.chip.edge.number = 1;
    world.chip.capturing = true;
    for word in 0..FRAME {
        world.chip.word(value(1, word));
        world.pass(1);
    }
    world.pass(2);
    assert_eq!(world.numbers(), [1]);
    assert_eq!(world.tally.processed, 0, "it may still turn out too long");
}

#[test]
fn a_slow_reader_loses_frames_and_never_mixes_them() {
    let pace = Pace {
        interrupts: std::vec![0],
        follower: std::vec![5 * FRAME, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    };
    let mut world = World::new(pace);
    for _ in 0..30 {
        world.send(GOOD);
    }
    world.settle();
    world.check_contents();
    assert!(
        world.tally.busy > 0 && world.tally.processed > 1,
        "{:?}",
        world.tally
    );
    assert_eq!(world.counted(), 31);
}

#[test]
fn frames_go_on_when_their_numbers_begin_again() {
    let mut world = World::new(Pace::prompt());
    world.grow_old(u32::MAX - 2);
    for _ in 0..4 {
        world.send(GOOD);
    }
    let overrun = Sent {
        overrun_at: Some(0),
        ..GOOD
    };
    world.send(overrun);
    world.settle();
    assert_eq!(world.numbers(), [u32::MAX - 1, u32::MAX, 0, 1, 3]);
    assert_eq!((world.tally.processed, world.tally.overrun), (5, 1));
    assert_eq!(world.counted(), 6);
}

#[test]
fn a_late_interrupt_loses_its_frame_and_never_mixes_bands() {
    let mut world = World::new(Pace {
        interrupts: std::vec![0, 3 * BAND, 0, 0, 0, 2 * BAND, 0],
        follower: std::vec![0],
    });
    for _ in 0..40 {
        world.send(GOOD);
    }
    world.settle();
    world.check_contents();
    assert_eq!(world.counted(), 41);
}

#[test]
fn silence_gives_the_begun_frame_up() {
    let mut world = World::new(Pace::prompt());
    world.chip.edge.number = 1;
    world.chip.capturing = true;
    for word in 0..BAND + 1 {
        world.chip.word(value(1, word));
        world.pass(1);
    }
    let events = &mut world.events;
    let mut tell = |event| events.push_back(event);
    world.tracker.silence(&mut world.chip, &mut tell);
    world.tracker.silence(&mut world.chip, &mut tell);
    world.settle();
    assert_eq!(world.numbers(), [2]);
    assert_eq!((world.tally.size, world.counted()), (1, 2));
}

fn silence(tracker: &mut Tracker, chip: &mut Chip) -> Vec<Event> {
    let mut reported = Vec::new();
    tracker.silence(chip, &mut |event| reported.push(event));
    reported
}

#[test]
fn silence_tells_of_a_frame_that_began_and_of_no_other() {
    let (mut tracker, mut chip) = (Tracker::new(SHAPE), Chip::new());
    tracker.start(&mut chip);
    assert_eq!(silence(&mut tracker, &mut chip), []);
    let how = Ending::Short;
    for (number, bands) in [(1, 0), (2, 1)] {
        chip.edge.number = number;
        for _ in 0..bands {
            (chip.band_flag, chip.second) = (true, !chip.second);
            tracker.band_finished(&mut chip, &mut |_| ());
        }
        let edge = chip.edge;
        let expected = [Event::Ended { edge, how }];
        assert_eq!(silence(&mut tracker, &mut chip), expected);
        assert_eq!(silence(&mut tracker, &mut chip), []);
    }
}

#[test]
fn frames_that_passed_during_set_up_are_not_counted_here() {
    let mut world = promptly(&[GOOD, GOOD]);
    world.tracker.stop(&mut world.chip);
    let from = world.chip.edge.number;
    world.send(GOOD);
    world.send(GOOD);
    world.tracker.start(&mut world.chip);
    world.events.push_back(Event::Passed {
        from,
        to: from + 2,
        restart: true,
    });
    world.settle();
    assert_eq!(world.numbers(), [1, 2, 3, 6]);
    assert_eq!((world.tally.processed, world.counted()), (4, 4));
}

#[test]
fn a_frame_under_way_at_a_stop_is_not_captured_and_the_next_one_says_so() {
    let mut world = promptly(&[GOOD]);
    world.chip.edge.number += 1;
    world.chip.capturing = true;
    let cut = world.chip.edge.number;
    for word in 0..BAND + 1 {
        world.chip.word(value(cut, word));
        world.pass(1);
    }
    world.tracker.stop(&mut world.chip);
    world.send(GOOD);
    world.tracker.start(&mut world.chip);
    world.events.push_back(Event::Passed {
        from: cut,
        to: cut + 1,
        restart: false,
    });
    world.settle();
    world.check_contents();
    assert_eq!(world.numbers(), [1, 2, 5]);
    assert_eq!(
        (world.tally.processed, world.tally.busy, world.counted()),
        (3, 1, 4)
    );
    assert_eq!(world.after, [(false, false), (false, false), (true, false)]);
}

/// While the pipeline is reconfigured it processes no data, and no frame mixes data from before and
/// after.
#[test]
fn frames_that_are_passed_over_are_counted_and_never_mixed() {
    for words in 1..3 * FRAME {
        let mut world = promptly(&[GOOD]);
        world.busy_for(words);
        for _ in 0..6 {
            world.send(GOOD);
        }
        let first = world.numbers()[2];
        world.settle();
        world.check_contents();
        let passed = world.tally.passed;
        assert!((1..=3).contains(&passed), "{words} words: {passed}");
        assert_eq!(first, 3 + passed, "{words} words");
        assert_eq!((world.tally.processed, world.counted()), (9 - passed, 9));
        assert_eq!(world.after[2], (true, false), "{words} words");
    }
}

#[test]
fn a_stopped_tracker_tells_nothing() {
    let mut chip = Chip::new();
    let mut tracker = Tracker::new(SHAPE);
    let mut reported = 0;
    let mut tell = |_| reported += 1;
    chip.band_flag = true;
    tracker.band_finished(&mut chip, &mut tell);
    tracker.frame_ended(&mut chip, &mut tell);
    tracker.overrun(&mut chip, &mut tell);
    tracker.silence(&mut chip, &mut tell);
    assert_eq!((reported, chip.restarts), (0, 0));
}

#[test]
fn the_reason_of_a_late_interrupt_is_reported() {
    let mut chip = Chip::new();
    let mut tracker = Tracker::new(SHAPE);
    tracker.start(&mut chip);
    chip.edge.number = 1;
    // Two bands were finished, but only one interrupt came.
    (chip.band_flag, chip.second) = (true, false);
    let mut reported = Vec::new();
    tracker.band_finished(&mut chip, &mut |event| reported.push(event));
    let edge = chip.edge;
    let how = Ending::Late;
    assert_eq!(reported, [Event::Ended { edge, how }]);
}

fn sent() -> impl Strategy<Value = Sent> {
    let words = prop_oneof![
        6 => Just(FRAME),
        1 => 0..FRAME,
        1 => FRAME + 1..3 * FRAME,
    ];
    let overrun_at = prop_oneof![6 => Just(None), 1 => (0..FRAME).prop_map(Some)];
    (words, overrun_at).prop_map(|(words, overrun_at)| Sent { words, overrun_at })
}

fn delays(most: usize) -> impl Strategy<Value = Vec<usize>> {
    prop::collection::vec(prop_oneof![3 => Just(0), 1 => 0..most], 1..40)
}

fn check_everything(frames: &[Sent], pace: Pace) -> Result<(), TestCaseError> {
    let mut world = World::new(pace);
    for frame in frames {
        world.send(*frame);
    }
    world.settle();
    world.check_contents();
    prop_assert_eq!(world.counted() as usize, frames.len() + 1);
    prop_assert_eq!(world.numbers().pop(), Some(frames.len() as u32 + 1));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2048))]

    /// For any frames of the camera, and however slow the follower is: every delivered frame is
    /// right, and every frame is counted once. Interrupts may come up to two bands late, so that
    /// one is missed.
    #[test]
    fn nothing_is_lost_or_duplicated_silently(
        frames in prop::collection::vec(sent(), 1..40),
        interrupts in delays(2 * BAND - 1),
        follower in delays(3 * FRAME),
    ) {
        check_everything(&frames, Pace { interrupts, follower })?;
    }

    /// The same with later interrupts, unless a frame is too long by exactly the missed part.
    #[test]
    fn late_interrupts_are_noticed(
        frames in prop::collection::vec(sent(), 1..40),
        interrupts in delays(2 * FRAME),
        follower in delays(3 * FRAME),
    ) {
        let not_long = |sent: &Sent| Sent { words: sent.words.min(FRAME), ..*sent };
        let frames: Vec<Sent> = frames.iter().map(not_long).collect();
        check_everything(&frames, Pace { interrupts, follower })?;
    }

    /// With prompt handlers, exactly the good frames are delivered and counted as processed: a
    /// broken frame costs no other frame.
    #[test]
    fn a_broken_frame_costs_no_other(frames in prop::collection::vec(sent(), 1..40)) {
        let world = promptly(&frames);
        let good = |frame: &&Sent| frame.words == FRAME && frame.overrun_at.is_none();
        let count = frames.iter().filter(good).count() as u32;
        prop_assert_eq!(world.tally.processed, count + 1);
        prop_assert_eq!(world.tally.busy, 0);
    }
}
