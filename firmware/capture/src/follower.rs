//! The processing side: which bands to scan, which frames are good, and what became of every other.

use crate::event::{Band, Edge, Ending, Event};
use crate::shape::Shape;

/// What is to be done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Nothing.
    None,
    /// Scan this band, as the first of a frame when its index is 0; then call
    /// [`Follower::scanned`].
    Scan(Band),
    /// Every band of a frame was scanned: finish it.
    Deliver(Delivery),
}

/// A whole frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// The edge that began it.
    pub edge: Edge,
    /// A frame before it, and after the delivery before, was not delivered, or the frame delivered
    /// before turned out to be too long.
    pub after_loss: bool,
    /// One of these was lost to an overrun.
    pub after_overrun: bool,
    /// The camera was started again since the delivery before.
    pub after_restart: bool,
}

/// What became of frames. Each is counted once; the sum is the newest frame's number, without those
/// accounted for elsewhere ([`Event::Passed`]), once its end is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Delivered, and not too long.
    pub processed: u32,
    /// Not captured, or overwritten before they were read, or an interrupt came too late.
    pub busy: u32,
    /// Lost to an overrun.
    pub overrun: u32,
    /// Too short or too long.
    pub size: u32,
    /// [Passed over](Follower::pass_over).
    pub passed: u32,
}

/// Where the frame under way stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Under {
    /// None is, or it is lost already.
    Nothing,
    /// The bands before `next` were scanned.
    Scanning { edge: Edge, next: u16 },
    /// It was delivered before its end was known.
    Delivered { edge: Edge },
}

/// Follows the events of one [`Tracker`](crate::Tracker).
#[derive(Debug)]
pub struct Follower {
    shape: Shape,
    under: Under,
    /// The newest frame accounted for.
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

    /// What became of frames since this was asked last.
    pub fn take_tally(&mut self) -> Tally {
        core::mem::take(&mut self.tally)
    }

    /// Whether a frame is being scanned.
    pub fn is_scanning(&self) -> bool {
        matches!(self.under, Under::Scanning { .. })
    }

    /// Whether every band of a frame was scanned and its end is not yet known. When no event waits
    /// and nothing more has come since its last band, it may be [delivered](Self::deliver) already.
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

    /// The band of [`Action::Scan`] was scanned; `intact` says whether it was whole all the while
    /// ([`Shape::intact`]). Otherwise its frame is lost.
    pub fn scanned(&mut self, intact: bool) {
        if let Under::Scanning { edge, next, .. } = &mut self.under {
            *next += 1;
            if !intact {
                let edge = *edge;
                self.lost(edge.number, |tally| &mut tally.busy);
            }
        }
    }

    /// Delivers a [complete](Self::is_complete) frame before its end is known. Should it turn out
    /// to be too long, it counts as such, and the next delivery says so.
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

    /// Goes on after frame `newest`: whatever has come of frames up to it was not, and will not be,
    /// looked at.
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
            // An event was lost, and with it the frame.
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

    /// Accounts for the frame under way, of which nothing more will come.
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

    /// Accounts for a frame that is not good, unless that was done already.
    fn lost(&mut self, number: u32, reason: impl FnOnce(&mut Tally) -> &mut u32) {
        self.under = Under::Nothing;
        if self.newer_by(number) > 0 {
            self.gap_before(number);
            *reason(&mut self.tally) += 1;
            self.accounted = number;
            self.after_loss = true;
        }
    }

    /// Frames between the newest one accounted for and this one were not captured.
    fn gap_before(&mut self, number: u32) {
        let gap = self.newer_by(number).saturating_sub(1);
        if gap > 0 {
            self.tally.busy += gap;
            self.accounted = self.accounted.wrapping_add(gap);
            self.after_loss = true;
        }
    }

    /// How many frames there are after the newest one accounted for, up to this number; 0 for one
    /// that is not newer. Numbers wrap, after most of a year at the usual rate; no two that are
    /// compared are 2³¹ apart.
    fn newer_by(&self, number: u32) -> u32 {
        let further = number.wrapping_sub(self.accounted);
        if further < 1 << 31 { further } else { 0 }
    }
}
