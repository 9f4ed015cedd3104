//! Windows that do not overlap.

use super::{MAX_WINDOWS, rectangle::Rectangle};
use heapless::Vec;

/// A few windows of a frame, none of which overlaps another, even when each is [widened to words](Rectangle::in_words).
#[derive(Clone, Debug, Default)]
pub(crate) struct Windows(Vec<Rectangle, MAX_WINDOWS>);

impl Windows {
    /// Adds one; those that overlap it are joined with it.
    ///
    /// # Errors
    /// When there are too many.
    pub fn add(&mut self, window: Rectangle, frame: Rectangle) -> Result<(), TooMany> {
        let mut window = window;
        while let Some(other) = self.take_overlapping(&window, frame) {
            window = window.joined(&other);
        }
        self.0.push(window).map_err(|_| TooMany)
    }

    /// Takes one out.
    pub fn pop(&mut self) -> Option<Rectangle> {
        self.0.pop()
    }

    /// Takes one out that overlaps `window`.
    pub fn take_overlapping(&mut self, window: &Rectangle, frame: Rectangle) -> Option<Rectangle> {
        let widened = window.in_words(frame);
        let overlaps = |other: &Rectangle| other.in_words(frame).overlaps(&widened);
        let other = self.0.iter().position(overlaps)?;
        Some(self.0.swap_remove(other))
    }
}

/// There is no room for another window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooMany;
