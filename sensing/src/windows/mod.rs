//! Markers of a frame in memory without looking at all of it.
//!
//! *Coarse*: a marker is many rows high, so that testing every n-th row finds each one; the windows around what was hit
//! are then scanned fully, and grow until no blob is cut. *Tracking*: windows where the markers were in the frame
//! before. Both give the very blobs of the full scan, whole or not at all, and give up in doubt: `None` means that the
//! frame has to be scanned in full (or, when tracking, coarsely). So they cost time at worst, never a marker.
//!
//! Bounded: what is scanned in windows is at most half of the frame (`scan::Budget`), whatever the frame shows.

mod coarse;
mod list;
mod lone;
mod rectangle;
mod scan;
#[cfg(test)]
mod tests;
mod tracking;

pub use rectangle::Rectangle;
pub use tracking::{Tally, Tracks};

pub(crate) use coarse::{coarse_blobs, step as coarse_step};
pub(crate) use scan::{Frame, is_whole, settings_within};

use crate::blob::Blob;
use heapless::Vec;

/// Most windows at a time; more hits than that are no four markers.
const MAX_WINDOWS: usize = 16;
/// Most blobs in all windows; of more than eight that may be markers nothing is made anyway.
const MAX_BLOBS: usize = 16;

/// What was found.
pub(crate) type Blobs = Vec<Blob, MAX_BLOBS>;
