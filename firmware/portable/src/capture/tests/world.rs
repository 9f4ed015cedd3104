//! Simulates the world of tracker and follower: camera, DMA, memory and processor, in steps of one
//! word.

use crate::capture::{Action, Edge, Event, Follower, Interface, Shape, Tally, Tracker};
use std::collections::VecDeque;
use std::vec::Vec;

pub const BAND: usize = 4;
const BANDS: u16 = 3;
const SLOTS: usize = 8;
pub const FRAME: usize = BAND * BANDS as usize;
/// Words of time from the last word to the VSYNC pulse, and the pulse's length.
const FRONT: usize = 4;
const PULSE: usize = 6;
/// Words of time from the end of the VSYNC pulse to the first word.
const BACK: usize = 3;
pub const SHAPE: Shape = Shape::new(BANDS, SLOTS as u16);
/// Most events that can wait.
const EVENTS: usize = SLOTS + 4;

/// One frame of the camera.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    pub words: usize,
    /// The interface overruns at this word.
    pub overrun_at: Option<usize>,
}

pub const GOOD: Sent = Sent {
    words: FRAME,
    overrun_at: None,
};

/// Camera interface, DMA and memory.
#[derive(Debug)]
pub struct Chip {
    memory: [u32; SLOTS * BAND],
    targets: [u16; 2],
    pub second: bool,
    position: usize,
    running: bool,
    pub capturing: bool,
    pub band_flag: bool,
    frame_flag: bool,
    overrun_flag: bool,
    pub edge: Edge,
    pub restarts: usize,
}

impl Chip {
    pub fn new() -> Self {
        Chip {
            memory: [0; SLOTS * BAND],
            targets: [0; 2],
            second: false,
            position: 0,
            running: false,
            capturing: false,
            band_flag: false,
            frame_flag: false,
            overrun_flag: false,
            edge: Edge::default(),
            restarts: 0,
        }
    }

    /// The camera sends a word.
    pub fn word(&mut self, value: u32) {
        if !self.capturing {
            return;
        }
        let slot = usize::from(self.targets[usize::from(self.second)]);
        self.memory[slot * BAND + self.position] = value;
        self.position += 1;
        if self.position == BAND {
            self.position = 0;
            self.second = !self.second;
            self.band_flag = true;
        }
    }

    fn slot(&self, slot: u16) -> [u32; BAND] {
        let at = usize::from(slot) * BAND;
        self.memory[at..at + BAND].try_into().unwrap()
    }
}

impl Interface for Chip {
    fn restart(&mut self, first: u16, second: u16) {
        self.stop();
        (self.targets, self.second, self.position) = ([first, second], false, 0);
        self.running = true;
        self.restarts += 1;
    }

    fn stop(&mut self) {
        (self.running, self.capturing) = (false, false);
        (self.band_flag, self.frame_flag, self.overrun_flag) = (false, false, false);
    }

    fn take_finished(&mut self) -> bool {
        core::mem::take(&mut self.band_flag)
    }

    fn writes_second(&self) -> bool {
        self.second
    }

    fn aim(&mut self, slot: u16) {
        self.targets[usize::from(!self.second)] = slot;
    }

    fn has_begun_a_band(&self) -> bool {
        self.position > 0
    }

    fn newest_edge(&self) -> Edge {
        self.edge
    }
}

/// How fast handlers and follower react.
#[derive(Clone, Debug)]
pub struct Pace {
    /// Words of time until interrupts are served, in turns.
    pub interrupts: Vec<usize>,
    /// Words of time from one step of the follower to the next, in turns.
    pub follower: Vec<usize>,
}

impl Pace {
    pub fn prompt() -> Self {
        Pace {
            interrupts: std::vec![0],
            follower: std::vec![0],
        }
    }
}

/// Everything together.
pub struct World {
    pub chip: Chip,
    pub tracker: Tracker,
    follower: Follower,
    pub events: VecDeque<Event>,
    pace: Pace,
    now: usize,
    interrupts_at: usize,
    follower_at: usize,
    /// When the follower passes over everything that came.
    pass_over_at: usize,
    turns: usize,
    scanned: Vec<u32>,
    pub delivered: Vec<(u32, Vec<u32>)>,
    pub after: Vec<(bool, bool)>,
    pub tally: Tally,
}

impl World {
    pub fn new(pace: Pace) -> Self {
        let mut world = World {
            chip: Chip::new(),
            tracker: Tracker::new(SHAPE),
            follower: Follower::new(SHAPE),
            events: VecDeque::new(),
            pace,
            now: 0,
            interrupts_at: 0,
            follower_at: 0,
            pass_over_at: 0,
            turns: 0,
            scanned: Vec::new(),
            delivered: Vec::new(),
            after: Vec::new(),
            tally: Tally::default(),
        };
        world.tracker.start(&mut world.chip);
        world
    }

    /// The camera sends a frame.
    pub fn send(&mut self, frame: Sent) {
        let number = self.chip.edge.number.wrapping_add(1);
        self.chip.edge = Edge {
            number,
            time_us: self.now as u64,
        };
        self.chip.capturing = self.chip.running;
        self.pass(BACK);
        for word in 0..frame.words {
            if frame.overrun_at == Some(word) && self.chip.capturing {
                self.chip.capturing = false;
                self.chip.overrun_flag = true;
            }
            self.chip.word(value(number, word));
            self.pass(1);
        }
        self.pass(FRONT);
        if core::mem::take(&mut self.chip.capturing) {
            self.chip.frame_flag = true;
        }
        self.pass(PULSE);
    }

    /// Simulates years without processing, until the newest frame has this number.
    pub fn grow_old(&mut self, newest: u32) {
        for quarter in [1 << 30, 2 << 30, 3 << 30, newest] {
            self.follower.pass_over(quarter);
        }
        self.chip.edge.number = newest;
        self.follower.take_tally();
        self.tracker.start(&mut self.chip);
    }

    /// For the next `words` of time the follower is busy; then it passes over what came.
    pub fn busy_for(&mut self, words: usize) {
        self.follower_at = usize::MAX;
        self.pass_over_at = self.now + words;
    }

    /// Lets time pass.
    pub fn pass(&mut self, words: usize) {
        for _ in 0..words {
            self.now += 1;
            if self.now >= self.interrupts_at && self.serve() {
                let delays = &self.pace.interrupts;
                self.interrupts_at = self.now + 1 + delays[self.now % delays.len()];
            }
            if self.now == self.pass_over_at {
                self.events.clear();
                self.follower.pass_over(self.chip.edge.number);
                self.follower_at = self.now;
            }
            if self.now >= self.follower_at {
                let delays = &self.pace.follower;
                self.follower_at = self.now + 1 + delays[self.turns % delays.len()];
                self.turns += 1;
                self.follow();
            }
        }
    }

    /// Handles pending interrupts; returns whether there were any.
    fn serve(&mut self) -> bool {
        let Chip {
            band_flag,
            frame_flag,
            overrun_flag,
            ..
        } = self.chip;
        let events = &mut self.events;
        let mut tell = |event| {
            if events.len() < EVENTS {
                events.push_back(event);
            }
        };
        if band_flag {
            self.tracker.band_finished(&mut self.chip, &mut tell);
        }
        if core::mem::take(&mut self.chip.overrun_flag) {
            self.tracker.overrun(&mut self.chip, &mut tell);
        } else if core::mem::take(&mut self.chip.frame_flag) {
            self.tracker.frame_ended(&mut self.chip, &mut tell);
        }
        band_flag | frame_flag | overrun_flag
    }

    /// One step of the processor: one event, or an early delivery.
    fn follow(&mut self) {
        let early =
            self.events.is_empty() && self.follower.is_complete() && !self.chip.has_begun_a_band();
        let action = match self.events.pop_front() {
            Some(event) => self.follower.event(event),
            None if early => self.follower.deliver(),
            None => Action::None,
        };
        match action {
            Action::None => {}
            Action::Scan(band) => {
                if band.index == 0 {
                    self.scanned.clear();
                }
                self.scanned
                    .extend(self.chip.slot(SHAPE.slot(band.sequence)));
                let intact = SHAPE.intact(band.sequence, self.tracker.finished());
                self.follower.scanned(intact);
            }
            Action::Deliver(delivery) => {
                self.delivered
                    .push((delivery.edge.number, self.scanned.clone()));
                self.after
                    .push((delivery.after_loss, delivery.after_overrun));
            }
        }
        let Tally {
            processed,
            busy,
            overrun,
            size,
            passed,
        } = self.follower.take_tally();
        self.tally.processed += processed;
        self.tally.busy += busy;
        self.tally.overrun += overrun;
        self.tally.size += size;
        self.tally.passed += passed;
    }

    pub fn numbers(&self) -> Vec<u32> {
        self.delivered.iter().map(|(number, ..)| *number).collect()
    }

    /// Checks that every delivered frame equals the camera's, word by word, and none comes twice or
    /// late.
    pub fn check_contents(&self) {
        for (number, words) in &self.delivered {
            let sent: Vec<u32> = (0..FRAME).map(|word| value(*number, word)).collect();
            assert_eq!(words, &sent, "frame {number}");
        }
        assert!(
            self.numbers().is_sorted_by(|a, b| a < b),
            "{:?}",
            self.numbers()
        );
    }

    /// Sends a good frame at the end, with time for all handlers, so that every frame's end is
    /// known.
    pub fn settle(&mut self) {
        self.pace = Pace::prompt();
        (self.interrupts_at, self.follower_at) = (0, 0);
        self.pass(10 * FRAME);
        self.send(GOOD);
        self.pass(10 * FRAME);
    }

    pub fn counted(&self) -> u32 {
        let Tally {
            processed,
            busy,
            overrun,
            size,
            passed,
        } = self.tally;
        processed + busy + overrun + size + passed
    }
}

pub fn value(frame: u32, word: usize) -> u32 {
    frame << 16 | word as u32
}
