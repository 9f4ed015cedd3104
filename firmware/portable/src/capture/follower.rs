//! Decides on the processing side which bands to scan and which frames are good, and counts all
//! frames.

use crate::capture::event::{Band, Edge, Ending, Event};
use crate::capture::shape::Shape;

/// The caller's next action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// No action.
    None,
    /// Scan this band, as the first of a frame if its index is 0; then call [`Follower::scanned`].
    Scan(Band),
    /// Every band of a frame was scanned: finish the frame.
    Deliver(Delivery),
}

/// A whole frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// The edge that began it.
    pub edge: Edge,
    /// True if a frame since the previous delivery was not delivered, or the previous delivery
    /// turned out to be too long.
    pub after_loss: bool,
    /// True if one of these was lost to an overrun.
    pub after_overrun: bool,
    /// True if the camera was restarted since the previous delivery.
    pub after_restart: bool,
}

/// The results of frames. Each frame is counted once. The sum is the newest frame's number minus
/// the frames that are counted elsewhere ([`Event::Passed`]), once that frame's end is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Delivered, and not too long.
    pub processed: u32,
    /// Not captured, or overwritten before they were read, or their interrupt came too late.
    pub busy: u32,
    /// Lost to an overrun.
    pub overrun: u32,
    /// Too short or too long.
    pub size: u32,
    /// [Passed over](Follower::pass_over).
    pub passed: u32,
}

/// The progress of the current frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Under {
    /// There is no current frame, or it is already lost.
    Nothing,
    /// The bands before `next` were scanned.
    Scanning { edge: Edge, next: u16 },
    /// It was delivered before its end was known.
    Delivered { edge: Edge },
}

/// Follows the events of one [`Tracker`](crate::capture::Tracker).
#[derive(Debug)]
pub struct Follower {
    shape: Shape,
    under: Under,
    /// The newest frame that was counted.
    accounted: u32,
    tally: Tally,
    after_loss: bool,
    after_overrun: bool,
    after_restart: bool,
}

impl Follower {
    /// A follower before the first event.
    pub const fn new(shape: Shape) -> Self {
        Follower {
            shape,
            under: Under::Nothing,
            accounted: 0,
            tally: Tally {
                processed: 0,
                busy: 0,
                overrun: 0,
                size: 0,
                passed: 0,
            },
            after_loss: false,
            after_overrun: false,
            after_restart: false,
        }
    }

    /// Returns the results of frames since the previous call.
    pub fn take_tally(&mut self) -> Tally {
        core::mem::take(&mut self.tally)
    }

    /// Returns whether a frame is being scanned.
    pub fn is_scanning(&self) -> bool {
        matches!(self.under, Under::Scanning { .. })
    }

    /// Returns whether every band of a frame was scanned while its end is not yet known. If no
    /// event waits and no data has come since its last band, it may already be
    /// [delivered](Self::deliver).
    pub fn is_complete(&self) -> bool {
        matches!(self.under, Under::Scanning { next, .. } if next == self.shape.bands())
    }

    /// Takes the next event.
    pub fn event(&mut self, event: Event) -> Action {
        match event {
            Event::Band(band) => self.band(band),
            Event::Ended { edge, how } => self.ended(edge, how),
            Event::Passed { from, to, restart } => {
                self.passed(from, to, restart);
                Action::None
            }
        }
    }

    /// Call after the band of [`Action::Scan`] was scanned. If `intact` is false, the band was
    /// overwritten meanwhile ([`Shape::intact`]), and its frame is lost.
    pub fn scanned(&mut self, intact: bool) {
        if let Under::Scanning { edge, next, .. } = &mut self.under {
            *next += 1;
            if !intact {
                let edge = *edge;
                self.lost(edge.number, |tally| &mut tally.busy);
            }
        }
    }

    /// Delivers a [complete](Self::is_complete) frame before its end is known. If it turns out to
    /// be too long, it is counted as such, and the next delivery reports it.
    pub fn deliver(&mut self) -> Action {
        match self.under {
            Under::Scanning { edge, next } if next == self.shape.bands() => {
                self.gap_before(edge.number);
                self.under = Under::Delivered { edge };
                Action::Deliver(Delivery {
                    edge,
                    after_loss: core::mem::take(&mut self.after_loss),
                    after_overrun: core::mem::take(&mut self.after_overrun),
                    after_restart: core::mem::take(&mut self.after_restart),
                })
            }
            _ => Action::None,
        }
    }

    /// Continues after frame `newest`: no data of frames up to it was, or will be, processed.
    pub fn pass_over(&mut self, newest: u32) {
        self.close();
        let passed = self.newer_by(newest);
        self.tally.passed += passed;
        self.accounted = self.accounted.wrapping_add(passed);
        self.after_loss |= passed > 0;
    }

    fn band(&mut self, band: Band) -> Action {
        if band.index == 0 {
            self.close();
            if self.newer_by(band.edge.number) > 0 {
                self.under = Under::Scanning {
                    edge: band.edge,
                    next: 0,
                };
            }
        }
        match self.under {
            Under::Scanning { edge, next, .. } if edge == band.edge && next == band.index => {
                Action::Scan(band)
            }
            // An event was lost, and the frame with it.
            Under::Scanning { .. } => {
                self.close();
                Action::None
            }
            _ => Action::None,
        }
    }

    fn ended(&mut self, edge: Edge, how: Ending) -> Action {
        if self.edge_under_way().is_some_and(|other| other != edge) {
            self.close();
        }
        if how == Ending::Whole && self.is_complete() {
            let action = self.deliver();
            self.close();
            return action;
        }
        if let (Ending::Whole, Under::Delivered { .. }) = (how, self.under) {
            self.close();
            return Action::None;
        }
        match how {
            Ending::Overrun => {
                self.after_overrun |= self.newer_by(edge.number) > 0;
                self.lost(edge.number, |tally| &mut tally.overrun);
            }
            Ending::Short | Ending::Long => self.lost(edge.number, |tally| &mut tally.size),
            Ending::Whole | Ending::Late => self.lost(edge.number, |tally| &mut tally.busy),
        }
        Action::None
    }

    fn passed(&mut self, from: u32, to: u32, restart: bool) {
        self.close();
        self.gap_before(from.wrapping_add(1));
        self.accounted = self.accounted.wrapping_add(self.newer_by(to));
        self.after_restart |= restart;
        self.after_loss |= restart || from > 0;
    }

    fn edge_under_way(&self) -> Option<Edge> {
        match self.under {
            Under::Nothing => None,
            Under::Scanning { edge, .. } | Under::Delivered { edge } => Some(edge),
        }
    }

    /// Counts the current frame; no further data of it will come.
    fn close(&mut self) {
        match self.under {
            Under::Nothing => {}
            Under::Scanning { edge, .. } => self.lost(edge.number, |tally| &mut tally.busy),
            Under::Delivered { edge } => {
                self.tally.processed += 1;
                self.accounted = edge.number;
                self.under = Under::Nothing;
            }
        }
    }

    /// Counts a bad frame, unless it was already counted.
    fn lost(&mut self, number: u32, reason: impl FnOnce(&mut Tally) -> &mut u32) {
        self.under = Under::Nothing;
        if self.newer_by(number) > 0 {
            self.gap_before(number);
            *reason(&mut self.tally) += 1;
            self.accounted = number;
            self.after_loss = true;
        }
    }

    /// Frames between the newest counted one and this one were not captured.
    fn gap_before(&mut self, number: u32) {
        let gap = self.newer_by(number).saturating_sub(1);
        if gap > 0 {
            self.tally.busy += gap;
            self.accounted = self.accounted.wrapping_add(gap);
            self.after_loss = true;
        }
    }

    /// Returns the number of frames after the newest counted one, up to this number; 0 if it is not
    /// newer. Numbers wrap after most of a year at the usual rate; numbers that are compared are
    /// never 2³¹ apart.
    fn newer_by(&self, number: u32) -> u32 {
        let further = number.wrapping_sub(self.accounted);
        if further < 1 << 31 { further } else { 0 }
    }
}
