//! A rendered frame and the truth behind it.

use crate::Load;
use crate::light::WHITE;

/// One exposure with what is true of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// RGB565 in native order (red in bits 15–11), row by row, `width · height` of them.
    pub pixels: Vec<u16>,
    /// What is true of it.
    pub truth: Truth,
}

/// What is true of a scene at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The force on the film.
    pub force: Load,
    /// The markers by identity; `None` where a marker is missing or no part of it is in the frame.
    pub markers: [Option<MarkerTruth>; 4],
}

/// What is true of one marker's image. Patches over it are not taken off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerTruth {
    /// Centroid of the disc's whole image, px; the centre of pixel (0, 0) is the origin.
    pub centroid_px: [f64; 2],
    /// Area of the disc's whole image, px².
    pub area_px2: f64,
    /// The part of that area inside the frame: 1 where the border does not cut it, > 0.
    pub visible: f64,
}

impl Frame {
    /// The frame as a binary PPM picture, its colours widened to 8 bits by repeating their upper bits.
    pub fn to_ppm(&self) -> Vec<u8> {
        let mut ppm = format!("P6\n{} {}\n255\n", self.width, self.height).into_bytes();
        ppm.extend(self.pixels.iter().flat_map(|&pixel| rgb888(pixel)));
        ppm
    }
}

fn rgb888(pixel: u16) -> [u8; 3] {
    let five = |v: u16| ((v << 3) | (v >> 2)) as u8;
    let six = |v: u16| ((v << 2) | (v >> 4)) as u8;
    [five(pixel >> 11), six((pixel >> 5) & 63), five(pixel & 31)]
}

/// RGB565 from channels in steps of 1/64 level, clipped and rounded to the nearest code.
pub(crate) fn rgb565(steps: [i32; 3]) -> u16 {
    let code = |value: i32, highest: u32| {
        let value = value.clamp(0, WHITE) as u32;
        (value * highest + WHITE as u32 / 2) / WHITE as u32
    };
    let [red, green, blue] = steps;
    (code(red, 31) << 11 | code(green, 63) << 5 | code(blue, 31)) as u16
}
