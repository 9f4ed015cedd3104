//! Windows that do not overlap.

use super::{MAX_WINDOWS, rectangle::Rectangle};
use heapless::Vec;

/// A few windows of a frame, none of which overlaps another, even when each is [widened to words](Rectangle::in_words).
#[derive(Clone, Debug, Default)]
pub(crate) struct Windows(Vec<Window, MAX_WINDOWS>);

/// A window, and widened to words.
#[derive(Clone, Copy, Debug)]
struct Window {
    exact: Rectangle,
    in_words: Rectangle,
}

impl Windows {
    /// Adds one; those that overlap it are joined with it.
    ///
    /// # Errors
    /// When there are too many.
    pub fn add(&mut self, window: Rectangle, frame: Rectangle) -> Result<(), TooMany> {
        let mut exact = window;
        loop {
            let in_words = exact.in_words(frame);
            match self.take_overlapping(&in_words) {
                Some(other) => exact = exact.joined(&other),
                None => {
                    let window = Window { exact, in_words };
                    return self.0.push(window).map_err(|_| TooMany);
                }
            }
        }
    }

    /// Takes one out, widened to words.
    pub fn pop(&mut self) -> Option<Rectangle> {
        self.0.pop().map(|window| window.in_words)
    }

    /// Takes one out that overlaps `window`, which is widened to words, when it is so, too.
    pub fn take_overlapping(&mut self, window: &Rectangle) -> Option<Rectangle> {
        let other = self
            .0
            .iter()
            .position(|other| other.in_words.overlaps(window))?;
        Some(self.0.swap_remove(other).exact)
    }
}

/// There is no room for another window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooMany;
