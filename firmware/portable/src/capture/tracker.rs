//! Directs the DMA in the interrupts, and detects where frames begin and end.

use crate::capture::event::{Band, Edge, Ending, Event};
use crate::capture::shape::Shape;

/// The camera interface and its double-buffered DMA, as the tracker uses them.
pub trait Interface {
    /// Stops everything, discards incomplete data, and begins again: the next frame that begins
    /// goes to slot `first`, then to slot `second`.
    fn restart(&mut self, first: u16, second: u16);

    /// Stops everything.
    fn stop(&mut self);

    /// Returns whether the DMA has finished a band since the previous call.
    fn take_finished(&mut self) -> bool;

    /// Returns whether the DMA now writes to the second of its two targets. It begins with the
    /// first after a restart, and then alternates.
    fn writes_second(&self) -> bool;

    /// Makes `slot` the next target of the DMA, in place of the one that it does not write to now.
    fn aim(&mut self, slot: u16);

    /// Returns whether data has come since the newest band was finished.
    fn has_begun_a_band(&self) -> bool;

    /// Returns the newest VSYNC edge that began a frame.
    fn newest_edge(&self) -> Edge;
}

/// Follows one camera. Its methods are called in interrupts of one priority, so that none
/// interrupts another.
#[derive(Debug)]
pub struct Tracker {
    shape: Shape,
    running: bool,
    finished: u32,
    /// True if the DMA's last known target is the second one.
    second: bool,
    /// Index, in its frame, of the next band.
    index: u16,
    /// The frame that `index` belongs to, or the newest one if `index` is 0.
    frame: Edge,
}

impl Tracker {
    /// A tracker that does not run.
    pub const fn new(shape: Shape) -> Self {
        Tracker {
            shape,
            running: false,
            finished: 0,
            second: false,
            index: 0,
            frame: Edge {
                number: 0,
                time_us: 0,
            },
        }
    }

    /// Number of bands finished since boot, modulo 2³².
    pub fn finished(&self) -> u32 {
        self.finished
    }

    /// Starts with the next frame.
    pub fn start(&mut self, interface: &mut impl Interface) {
        self.running = true;
        self.frame = interface.newest_edge();
        self.restart(interface);
    }

    /// Stops. When capture continues, [`Event::Passed`] accounts for a frame that was incomplete.
    pub fn stop(&mut self, interface: &mut impl Interface) {
        self.running = false;
        interface.stop();
    }

    /// Call when the DMA has finished a band.
    pub fn band_finished(&mut self, interface: &mut impl Interface, tell: &mut impl FnMut(Event)) {
        if !interface.take_finished() || !self.running {
            return;
        }
        self.second = !self.second;
        if interface.writes_second() != self.second {
            // A second band was finished meanwhile, so the DMA is back at its previous target.
            return self.broken(Ending::Late, interface, tell);
        }
        let edge = interface.newest_edge();
        match (self.index, edge == self.frame) {
            (0, true) => return self.broken(Ending::Long, interface, tell),
            (0, false) => self.frame = edge,
            (_, true) => {}
            (_, false) => return self.broken(Ending::Late, interface, tell),
        }
        tell(Event::Band(Band {
            sequence: self.finished,
            index: self.index,
            edge,
        }));
        self.finished = self.finished.wrapping_add(1);
        self.index += 1;
        if self.index >= self.shape.bands() {
            self.index = 0;
        }
        interface.aim(self.shape.slot(self.finished.wrapping_add(1)));
    }

    /// Call when the camera interface reports the end of a frame.
    pub fn frame_ended(&mut self, interface: &mut impl Interface, tell: &mut impl FnMut(Event)) {
        self.band_finished(interface, tell);
        if !self.running {
            return;
        }
        let edge = interface.newest_edge();
        let complete = self.index == 0 && edge == self.frame;
        match (complete, interface.has_begun_a_band()) {
            (true, false) => tell(Event::Ended {
                edge,
                how: Ending::Whole,
            }),
            (true, true) => self.broken(Ending::Long, interface, tell),
            (false, _) => self.broken(Ending::Short, interface, tell),
        }
    }

    /// Call when the camera interface or the DMA has lost data.
    pub fn overrun(&mut self, interface: &mut impl Interface, tell: &mut impl FnMut(Event)) {
        if self.running {
            self.broken(Ending::Overrun, interface, tell);
        }
    }

    /// Call when no data has come for too long.
    pub fn silence(&mut self, interface: &mut impl Interface, tell: &mut impl FnMut(Event)) {
        if self.running {
            self.give_up_begun(interface, tell);
            self.restart(interface);
        }
    }

    /// Reports a frame that has begun and not ended as short.
    fn give_up_begun(&mut self, interface: &mut impl Interface, tell: &mut impl FnMut(Event)) {
        let edge = interface.newest_edge();
        if self.index > 0 || edge != self.frame {
            tell(Event::Ended {
                edge,
                how: Ending::Short,
            });
            self.frame = edge;
        }
    }

    /// Gives the frame up and restarts with the next one.
    fn broken(
        &mut self,
        how: Ending,
        interface: &mut impl Interface,
        tell: &mut impl FnMut(Event),
    ) {
        let edge = interface.newest_edge();
        self.frame = edge;
        self.restart(interface);
        tell(Event::Ended { edge, how });
    }

    fn restart(&mut self, interface: &mut impl Interface) {
        self.index = 0;
        self.second = false;
        let next = self.shape.slot(self.finished.wrapping_add(1));
        interface.restart(self.shape.slot(self.finished), next);
    }
}
