//! Decides which rows belong to which frame while a camera is captured without a pause: the logic
//! alone, without registers.
//!
//! A frame is written by DMA as *bands* of several rows into a ring of *slots*, one band after the
//! other, frame after frame. The [`Tracker`] runs in the interrupts. It directs the DMA from slot
//! to slot, detects where frames begin and end, and resynchronizes after a broken frame. The
//! [`Follower`] runs where frames are processed. It takes the tracker's [`Event`]s in order,
//! selects the bands to scan, and counts every frame exactly once.
//!
//! They share only the events and one number, [`Tracker::finished`]. The camera never waits: a band
//! that is not read in time is overwritten, which [`Shape::intact`] detects.
//!
//! ```text
//! DMA: band finished ─┐             events            ┌→ scan this band
//! DCMI: frame end ────┼→ Tracker ────────────→ Follower ─→ deliver this frame
//! DCMI: overrun ──────┘     └→ Interface: next slot, start again
//! ```

mod event;
mod follower;
mod shape;
mod tracker;

#[cfg(test)]
mod tests;

pub use event::{Band, Edge, Ending, Event};
pub use follower::{Action, Delivery, Follower, Tally};
pub use shape::Shape;
pub use tracker::{Interface, Tracker};
