//! The part of a frame that is captured.

use crate::shape::Shape;

/// Windows begin and end at multiples of so many columns. With bands of a multiple of 4 rows that makes a band a multiple of
/// 128 bytes, which is what DMA moves at once; and rows are whole words.
const COLUMNS: u16 = 16;

/// A rectangle of a frame, in pixels: the whole frame, or what the camera interface crops it to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Window {
    /// First column.
    pub left: u16,
    /// First row.
    pub top: u16,
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
}

impl Window {
    /// A whole frame.
    pub const fn whole(width: u16, height: u16) -> Self {
        Window {
            left: 0,
            top: 0,
            width,
            height,
        }
    }

    /// Bands it is divided into.
    pub const fn bands(&self, shape: Shape) -> u16 {
        self.height / shape.rows()
    }

    /// The smallest window around this one that can be captured out of `frame`: columns in sixteens, rows in bands. What
    /// lies outside the frame is cut off; `None` when nothing is left. `frame` must be capturable itself.
    pub const fn capturable(&self, frame: Window, shape: Shape) -> Option<Window> {
        let (Some(across), Some(down)) = (
            aligned(self.left, self.width, frame.width, COLUMNS),
            aligned(self.top, self.height, frame.height, shape.rows()),
        ) else {
            return None;
        };
        Some(Window {
            left: across.0,
            top: down.0,
            width: across.1,
            height: down.1,
        })
    }
}

/// Start and length of the smallest span around the given one that lies within `0..limit` and is aligned to `step`,
/// which divides `limit`.
const fn aligned(start: u16, length: u16, limit: u16, step: u16) -> Option<(u16, u16)> {
    let wanted = start as u32 + length as u32;
    let end = if wanted < limit as u32 {
        wanted
    } else {
        limit as u32
    };
    let first = start as u32 / step as u32 * step as u32;
    let last = end.div_ceil(step as u32) * step as u32;
    if start as u32 >= end {
        return None;
    }
    Some((first as u16, (last - first) as u16))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FRAME: Window = Window::whole(320, 240);
    const SHAPE: Shape = Shape::new(4, 8);

    #[test]
    fn a_window_is_widened_to_words_and_bands() {
        let window = Window {
            left: 33,
            top: 41,
            width: 10,
            height: 4,
        };
        let expected = Window {
            left: 32,
            top: 40,
            width: 16,
            height: 8,
        };
        assert_eq!(window.capturable(FRAME, SHAPE), Some(expected));
        assert_eq!(expected.bands(SHAPE), 2);
    }

    proptest! {
        #[test]
        fn what_is_capturable_lies_in_the_frame_and_covers_the_window(
            left in 0..400u16, top in 0..300u16, width in 0..=u16::MAX, height in 0..=u16::MAX,
        ) {
            let window = Window { left, top, width, height };
            let inside = left < 320 && top < 240 && width > 0 && height > 0;
            let Some(got) = window.capturable(FRAME, SHAPE) else {
                prop_assert!(!inside);
                return Ok(());
            };
            prop_assert!(inside && got.left <= left && got.top <= top);
            let right = (u32::from(left) + u32::from(width)).min(320);
            let bottom = (u32::from(top) + u32::from(height)).min(240);
            prop_assert!(u32::from(got.left + got.width) >= right && got.left + got.width <= 320);
            prop_assert!(u32::from(got.top + got.height) >= bottom && got.top + got.height <= 240);
            prop_assert!(got.left % 16 == 0 && got.width % 16 == 0 && got.height % 4 == 0);
            prop_assert_eq!(got.capturable(FRAME, SHAPE), Some(got));
        }
    }
}
