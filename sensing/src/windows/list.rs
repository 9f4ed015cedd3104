//! Windows that do not overlap.

use super::{MAX_WINDOWS, rectangle::Rectangle};
use heapless::Vec;

/// A few windows, none of which overlaps another.
#[derive(Clone, Debug, Default)]
pub(crate) struct Windows(Vec<Rectangle, MAX_WINDOWS>);

impl Windows {
    /// Adds one; those that overlap it are joined with it.
    ///
    /// # Errors
    /// When there are too many.
    pub fn add(&mut self, window: Rectangle) -> Result<(), TooMany> {
        let mut window = window;
        while let Some(other) = self.0.iter().position(|other| other.overlaps(&window)) {
            window = window.joined(&self.0.swap_remove(other));
        }
        self.0.push(window).map_err(|_| TooMany)
    }

    /// Takes one out.
    pub fn pop(&mut self) -> Option<Rectangle> {
        self.0.pop()
    }

    /// Takes one out that overlaps `window`.
    pub fn take_overlapping(&mut self, window: &Rectangle) -> Option<Rectangle> {
        let other = self.0.iter().position(|other| other.overlaps(window))?;
        Some(self.0.swap_remove(other))
    }
}

/// There is no room for another window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooMany;
