//! Tests the follower alone, with events that a tracker sends rarely or never.

use crate::capture::{Action, Band, Delivery, Edge, Ending, Event, Follower, Shape, Tally};

const SHAPE: Shape = Shape::new(3, 8);

fn edge(number: u32) -> Edge {
    Edge {
        number,
        time_us: 6_400 * u64::from(number),
    }
}

fn band(number: u32, index: u16) -> Band {
    Band {
        sequence: 3 * number + u32::from(index),
        index,
        edge: edge(number),
    }
}

fn ended(number: u32, how: Ending) -> Event {
    Event::Ended {
        edge: edge(number),
        how,
    }
}

/// Lets the follower scan all bands of a frame.
fn scan(follower: &mut Follower, number: u32) {
    for index in 0..3 {
        let band = band(number, index);
        assert_eq!(follower.event(Event::Band(band)), Action::Scan(band));
        follower.scanned(true);
    }
}

/// Returns the delivery of a whole frame.
fn delivered(follower: &mut Follower, number: u32) -> Delivery {
    scan(follower, number);
    match follower.event(ended(number, Ending::Whole)) {
        Action::Deliver(delivery) => delivery,
        other => panic!("{other:?}"),
    }
}

fn first() -> Follower {
    let mut follower = Follower::new(SHAPE);
    assert_eq!(delivered(&mut follower, 1).edge, edge(1));
    follower.take_tally();
    follower
}

#[test]
fn a_frame_is_scanned_until_it_is_complete_and_delivered() {
    let mut follower = Follower::new(SHAPE);
    assert!(!follower.is_scanning() && !follower.is_complete());
    for index in 0..3 {
        follower.event(Event::Band(band(1, index)));
        assert!(follower.is_scanning() && !follower.is_complete());
        assert_eq!(follower.deliver(), Action::None, "band {index}");
        follower.scanned(true);
    }
    assert!(follower.is_scanning() && follower.is_complete());
    assert!(matches!(follower.deliver(), Action::Deliver(_)));
    assert!(!follower.is_scanning() && !follower.is_complete());
}

/// An event is lost when the queue is full.
#[test]
fn a_band_that_does_not_follow_loses_the_frame() {
    let mut follower = first();
    follower.event(Event::Band(band(2, 0)));
    follower.scanned(true);
    assert_eq!(follower.event(Event::Band(band(2, 2))), Action::None);
    assert!(!follower.is_scanning());
    let busy = Tally {
        busy: 1,
        ..Tally::default()
    };
    assert_eq!(follower.take_tally(), busy);
}

#[test]
fn nothing_that_is_passed_over_is_no_loss() {
    let mut follower = first();
    follower.pass_over(1);
    assert!(!delivered(&mut follower, 2).after_loss);
    follower.pass_over(3);
    assert!(delivered(&mut follower, 4).after_loss);
}

#[test]
fn a_frame_that_was_delivered_is_lost_to_nothing() {
    let mut follower = first();
    follower.event(ended(1, Ending::Overrun));
    let next = delivered(&mut follower, 2);
    assert!(!next.after_overrun && !next.after_loss);
}

#[test]
fn a_set_up_and_a_restart_are_reported() {
    let passed = |from: u32, restart: bool| Event::Passed {
        from,
        to: from + 1,
        restart,
    };
    let mut follower = Follower::new(SHAPE);
    let mut after = |event: Option<Event>, number: u32| {
        event.map(|event| follower.event(event));
        let delivery = delivered(&mut follower, number);
        (delivery.after_loss, delivery.after_restart)
    };
    assert_eq!(
        after(Some(passed(0, false)), 2),
        (false, false),
        "the first"
    );
    assert_eq!(after(Some(passed(2, false)), 4), (true, false));
    assert_eq!(after(Some(passed(4, true)), 6), (true, true));
    assert_eq!(after(None, 7), (false, false));
}
