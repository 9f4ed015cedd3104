//! Attacks on tracker and follower by a camera interface that reports anything at any time. Each
//! delivered frame was scanned whole and in order, and every frame is counted exactly once.

use std::collections::VecDeque;

use arbitrary::{Result, Unstructured};
use hivtac_portable::capture::{
    Action, Band, Delivery, Edge, Event, Follower, Interface, Shape, Tally, Tracker,
};

const SHAPE: Shape = Shape::new(3, 8);
/// The largest number of steps of one attack.
const STEPS: usize = 256;

/// An interface whose answers are the values that the attack set last.
#[derive(Default)]
struct Chip {
    finished: bool,
    second: bool,
    begun: bool,
    edge: Edge,
}

impl Interface for Chip {
    fn restart(&mut self, first: u16, second: u16) {
        assert!(first < 8 && second < 8 && first != second);
        self.second = false;
    }

    fn stop(&mut self) {}

    fn take_finished(&mut self) -> bool {
        core::mem::take(&mut self.finished)
    }

    fn writes_second(&self) -> bool {
        self.second
    }

    fn aim(&mut self, slot: u16) {
        assert!(slot < 8);
    }

    fn has_begun_a_band(&self) -> bool {
        self.begun
    }

    fn newest_edge(&self) -> Edge {
        self.edge
    }
}

struct World {
    chip: Chip,
    tracker: Tracker,
    follower: Follower,
    events: VecDeque<Event>,
    /// Number of the frame at which the camera was stopped.
    stopped_at: Option<u32>,
    /// Frames that the set-up counts.
    elsewhere: u64,
    counted: u64,
    /// Total number of frames.
    newest: u64,
    /// Scanned bands of the present frame.
    scanned: Vec<Band>,
    /// The last delivered frame, or the newest one after years have passed.
    newest_delivered: u32,
    delivered: usize,
}

/// Attacks with the steps that the input describes.
pub fn attack(input: &[u8]) -> bool {
    let mut world = World::new();
    // The end of the input ends the attack.
    let _ = world.live(&mut Unstructured::new(input));
    world.end();
    world.delivered > 0
}

impl World {
    fn new() -> World {
        let mut world = World {
            chip: Chip::default(),
            tracker: Tracker::new(SHAPE),
            follower: Follower::new(SHAPE),
            events: VecDeque::new(),
            stopped_at: None,
            elsewhere: 0,
            counted: 0,
            newest: 0,
            scanned: Vec::new(),
            newest_delivered: 0,
            delivered: 0,
        };
        world.tracker.start(&mut world.chip);
        world
    }

    fn live(&mut self, input: &mut Unstructured<'_>) -> Result<()> {
        for _ in 0..STEPS {
            if input.is_empty() {
                break;
            }
            self.step(input)?;
        }
        Ok(())
    }

    fn step(&mut self, input: &mut Unstructured<'_>) -> Result<()> {
        let mut reported = Vec::new();
        let tell = &mut |event| reported.push(event);
        match input.int_in_range(0..=9)? {
            0 => self.next_edge(input.int_in_range(1..=3)?),
            1 => self.years_pass(),
            // The usual step: the next band, in the other target.
            2 | 3 => {
                (self.chip.finished, self.chip.second) = (true, !self.chip.second);
                self.tracker.band_finished(&mut self.chip, tell);
            }
            4 => {
                (self.chip.finished, self.chip.second) = (input.arbitrary()?, input.arbitrary()?);
                self.tracker.band_finished(&mut self.chip, tell);
            }
            5 => {
                self.chip.begun = input.arbitrary()?;
                self.tracker.frame_ended(&mut self.chip, tell);
            }
            6 => self.tracker.overrun(&mut self.chip, tell),
            7 => self.tracker.silence(&mut self.chip, tell),
            8 => self.set_up(input.arbitrary()?),
            _ => self.follow(input)?,
        }
        self.events.extend(reported);
        Ok(())
    }

    fn next_edge(&mut self, further: u32) {
        let Edge { number, time_us } = self.chip.edge;
        self.newest += u64::from(further);
        self.chip.edge = Edge {
            number: number.wrapping_add(further),
            time_us: time_us.saturating_add(u64::from(further)),
        };
    }

    /// Lets enough time pass for the frame numbers to wrap around after several such steps. All
    /// events are followed before and after it.
    fn years_pass(&mut self) {
        if self.stopped_at.is_some() {
            self.set_up(false);
        }
        self.catch_up();
        self.next_edge(1 << 30);
        self.catch_up();
        self.newest_delivered = self.chip.edge.number;
    }

    /// Stops the camera, or starts a stopped one and counts the frames of the time between.
    fn set_up(&mut self, restart: bool) {
        let newest = self.chip.edge.number;
        let Some(from) = self.stopped_at.take() else {
            self.tracker.stop(&mut self.chip);
            self.stopped_at = Some(newest);
            return;
        };
        self.tracker.start(&mut self.chip);
        self.elsewhere += u64::from(newest.wrapping_sub(from));
        self.events.push_back(Event::Passed {
            from,
            to: newest,
            restart,
        });
    }

    /// Lets the follower take some events; the input decides for each band whether it stayed whole.
    fn follow(&mut self, input: &mut Unstructured<'_>) -> Result<()> {
        for _ in 0..input.int_in_range(1..=8)? {
            let Some(event) = self.events.pop_front() else {
                break;
            };
            let intact = input.ratio(7, 8)?;
            self.take(event, intact);
        }
        if self.events.is_empty() && self.follower.is_complete() && input.arbitrary()? {
            let action = self.follower.deliver();
            self.act(action, true);
        }
        Ok(())
    }

    fn take(&mut self, event: Event, intact: bool) {
        let action = self.follower.event(event);
        self.act(action, intact);
        self.count();
    }

    fn act(&mut self, action: Action, intact: bool) {
        match action {
            Action::None => {}
            Action::Scan(band) => {
                if band.index == 0 {
                    self.scanned.clear();
                }
                self.scanned.push(band);
                self.follower.scanned(intact);
            }
            Action::Deliver(delivery) => self.check(&delivery),
        }
    }

    /// Checks that a delivered frame was scanned whole, band after band, and is newer than the one
    /// before.
    fn check(&mut self, delivery: &Delivery) {
        let number = delivery.edge.number;
        assert!(number.wrapping_sub(self.newest_delivered).cast_signed() > 0);
        assert_eq!(self.scanned.len(), usize::from(SHAPE.bands()));
        for (index, band) in (0..).zip(&self.scanned) {
            assert_eq!((band.index, band.edge), (index, delivery.edge));
            let first = self.scanned[0].sequence;
            assert_eq!(band.sequence, first.wrapping_add(index.into()));
        }
        self.newest_delivered = number;
        self.delivered += 1;
    }

    fn count(&mut self) {
        let Tally {
            processed,
            busy,
            overrun,
            size,
            passed,
        } = self.follower.take_tally();
        let all = [processed, busy, overrun, size, passed].map(u64::from);
        self.counted += all.iter().sum::<u64>();
    }

    /// Checks, after all events were followed, that the counted frames are all frames.
    fn end(&mut self) {
        if self.stopped_at.is_some() {
            self.set_up(false);
        }
        self.catch_up();
        assert_eq!(self.counted + self.elsewhere, self.newest);
    }

    /// Follows all events, and skips the present frame.
    fn catch_up(&mut self) {
        while let Some(event) = self.events.pop_front() {
            self.take(event, true);
        }
        self.follower.pass_over(self.chip.edge.number);
        self.count();
    }
}
