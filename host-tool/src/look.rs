//! Converts a frame to levels of red, green and blue, and marks the pixels that the sensing takes
//! for markers.

use crate::frame::Frame;
use hivtac_sensor::markers::formats::Formats;
use hivtac_sensor::markers::tables::{ByteTable, Pixels};
use hivtac_terms::hsv::rgb888;
use hivtac_terms::threshold::{ByteOrder, PixelFormat};

/// Value in the mask's picture of a pixel that passes the threshold.
pub const PASSED: u8 = 255;
/// Value in the mask's picture of a pixel that only dilation adds.
pub const ADDED: u8 = 128;

/// Levels of red, green and blue, three bytes a pixel. Those of RGB565 repeat their high bits
/// below, and rounding them to RGB565 returns the frame.
pub fn levels(frame: &Frame) -> Vec<u8> {
    let pixels = frame.pixels();
    match frame.format() {
        PixelFormat::Rgb565 => pixels.into_iter().flat_map(rgb888).collect(),
        PixelFormat::Yuv422 => {
            let pairs = pixels.as_chunks().0.iter();
            pairs.flat_map(|pair| of_yuyv(*pair)).flatten().collect()
        }
        PixelFormat::Mono => frame.bytes.iter().flat_map(|&grey| [grey; 3]).collect(),
    }
}

/// Converts by BT.601 in full range, as in the camera's data sheet.
fn of_yuyv([left, right]: [u16; 2]) -> [[u8; 3]; 2] {
    let (cb, cr) = (f64::from(left >> 8) - 128.0, f64::from(right >> 8) - 128.0);
    [left, right].map(|pixel| {
        let luma = f64::from(pixel & 0xFF);
        let colour = [
            luma + 1.402 * cr,
            luma - 0.344 * cb - 0.714 * cr,
            luma + 1.772 * cb,
        ];
        colour.map(|level| level.round().clamp(0.0, 255.0) as u8)
    })
}

/// The sensing's mask of a frame: a byte a pixel, [`PASSED`], [`ADDED`] or 0. `None` when the
/// threshold is invalid.
pub fn mask(frame: &Frame, dilations: u8) -> Option<Vec<u8>> {
    let mut formats = Box::new(Formats::<ByteTable>::CLOSED);
    formats.set(&frame.threshold, ByteOrder::Native).ok()?;
    let width = usize::from(frame.width);
    let mut words = vec![0; width.div_ceil(32)];
    let mut mask = Vec::new();
    for row in frame.pixels().chunks(formats.row_length(frame.width)) {
        formats.mask_row(row, &mut words);
        mask.extend((0..width).map(|x| match words[x / 32] >> (x % 32) & 1 {
            1 => PASSED,
            _ => 0,
        }));
    }
    for _ in 0..dilations {
        mask = dilated(&mask, width);
    }
    Some(mask)
}

/// One dilation by 3 × 3.
fn dilated(mask: &[u8], width: usize) -> Vec<u8> {
    let rows = mask.len() / width;
    let is_set = |x: usize, y: usize| {
        let around = |at: usize, end: usize| at.saturating_sub(1)..end.min(at + 2);
        around(y, rows).any(|y| around(x, width).any(|x| mask[y * width + x] != 0))
    };
    let pixel = |index: usize| match (mask[index], is_set(index % width, index / width)) {
        (0, true) => ADDED,
        (level, _) => level,
    };
    (0..mask.len()).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::threshold::Yuv422;
    use hivtac_terms::threshold::{HsvBox, Threshold};

    const RED: [u8; 2] = [0xD8, 0xA3];
    const GREY: [u8; 2] = [0x84, 0x10];

    fn frame(threshold: Threshold, bytes: Vec<u8>) -> Frame {
        Frame {
            number: 1,
            time_us: 2,
            width: 4,
            height: 3,
            threshold,
            bytes,
        }
    }

    /// A red pixel in a corner passes, and dilation adds the three pixels around it.
    #[test]
    fn the_mask_shows_what_passes_and_what_dilation_adds() {
        let bytes = [vec![RED], vec![GREY; 11]].concat().concat();
        let frame = frame(HsvBox::RED.into(), bytes);
        let mut expected = [0; 12];
        expected[0] = PASSED;
        assert_eq!(mask(&frame, 0).unwrap(), expected);
        for index in [1, 4, 5] {
            expected[index] = ADDED;
        }
        assert_eq!(mask(&frame, 1).unwrap(), expected);
    }

    #[test]
    fn a_pair_of_yuv422_passes_together() {
        let bytes = [vec![[100, 128, 100, 200]], vec![[100, 128, 100, 128]; 5]];
        let frame = frame(Threshold::Yuv422(Yuv422::RED), bytes.concat().concat());
        let passed = mask(&frame, 0).unwrap();
        assert_eq!(passed[..3], [PASSED, PASSED, 0]);
        assert_eq!(levels(&frame)[..3], [201, 49, 100]);
        assert_eq!(levels(&frame)[6..9], [100; 3]);
    }

    #[test]
    fn levels_of_rgb565_fill_their_range() {
        assert_eq!(rgb888(0xFFFF), [255; 3]);
        assert_eq!(rgb888(0x8410), [132, 130, 132]);
    }
}
