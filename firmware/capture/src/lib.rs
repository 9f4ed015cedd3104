//! Which rows belong to which frame, when a camera is captured without a pause: the logic alone,
//! without a register.
//!
//! A frame is written by DMA as *bands* of some rows into a ring of *slots*, one band after the
//! other, frame after frame. The [`Tracker`] runs in the interrupts: it steers the DMA from slot to
//! slot, sees where frames begin and end, and brings everything back in step when a frame is
//! broken. The [`Follower`] runs where frames are processed: it takes the tracker's [`Event`]s in
//! order, says which bands to scan, and accounts for every frame exactly once.
//!
//! The two share no state but the events and one number, [`Tracker::finished`]. The camera never
//! waits: a band that is not read in time is overwritten, which [`Shape::intact`] tells.
//!
//! ```text
//! DMA: band finished ─┐             events            ┌→ scan this band
//! DCMI: frame end ────┼→ Tracker ────────────→ Follower ─→ deliver this frame
//! DCMI: overrun ──────┘     └→ Interface: next slot, start again
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod event;
mod follower;
mod shape;
mod tracker;

#[cfg(test)]
extern crate std;
#[cfg(test)]
mod tests;

pub use event::{Band, Edge, Ending, Event};
pub use follower::{Action, Delivery, Follower, Tally};
pub use shape::Shape;
pub use tracker::{Interface, Tracker};
