//! Converts RGB565 pixels to OpenCV's 8-bit HSV, in integers.
//!
//! `cv2.cvtColor(…, COLOR_RGB2HSV)` on 8-bit pictures multiplies by tables of rounded reciprocals
//! with twelve fractional bits. The same products are used here, so every pixel gives the same
//! result. `tests/opencv.rs` compares all 65,536 of them with OpenCV's own output.

use crate::fixed::Q;

/// Fractional bits of OpenCV's reciprocals.
const SHIFT: u32 = 12;

/// A colour in OpenCV's 8-bit HSV.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Hsv {
    /// Hue in steps of two degrees, 0–179; 0 for a grey.
    pub hue: u8,
    /// Saturation, 0–255.
    pub saturation: u8,
    /// Value, the largest of red, green and blue, 0–255.
    pub value: u8,
}

/// The 8-bit red, green and blue of an RGB565 pixel (red in bits 15–11). The high bits are repeated
/// below the low ones: black stays 0 and white becomes 255.
pub const fn rgb888(pixel: u16) -> [u8; 3] {
    let red = (pixel >> 11) as u8;
    let green = (pixel >> 5 & 63) as u8;
    let blue = (pixel & 31) as u8;
    [
        red << 3 | red >> 2,
        green << 2 | green >> 4,
        blue << 3 | blue >> 2,
    ]
}

impl Hsv {
    /// OpenCV's HSV of an RGB565 pixel (red in bits 15–11), replicated to 8 bits a channel.
    pub fn from_rgb565(pixel: u16) -> Hsv {
        Hsv::from_rgb888(rgb888(pixel))
    }

    /// OpenCV's HSV of an 8-bit red, green and blue.
    pub fn from_rgb888([red, green, blue]: [u8; 3]) -> Hsv {
        let value = red.max(green).max(blue);
        let chroma = i32::from(value - red.min(green).min(blue));
        Hsv {
            hue: hue([red, green, blue], value, chroma),
            // Below 255.5 before rounding, since chroma ≤ value.
            saturation: (reciprocal(255, i32::from(value)) * chroma).rounded() as u8,
            value,
        }
    }
}

/// Hue in units of 1/180 turn: the position within the third around the largest channel. If two
/// channels are largest, both thirds give the same hue.
fn hue([red, green, blue]: [u8; 3], value: u8, chroma: i32) -> u8 {
    let [r, g, b] = [i32::from(red), i32::from(green), i32::from(blue)];
    let sixths = match value {
        v if v == red => g - b,
        v if v == green => b - r + 2 * chroma,
        _ => r - g + 4 * chroma,
    };
    let hue = (reciprocal(30, chroma) * sixths).rounded();
    // From −30 to 150 before adding a turn, and never so close below 0 that the sum would be 180.
    (if hue < 0 { hue + 180 } else { hue }) as u8
}

/// `scale / divisor`, rounded to nearest (no quotient is a tie for divisors below 256); 0 for a
/// divisor of 0.
const fn reciprocal(scale: i32, divisor: i32) -> Q<SHIFT> {
    Q::from_bits(match divisor {
        0 => 0,
        _ => ((scale << (SHIFT + 1)) + divisor) / (2 * divisor),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hsv(rgb: [u8; 3]) -> (u8, u8, u8) {
        let Hsv {
            hue,
            saturation,
            value,
        } = Hsv::from_rgb888(rgb);
        (hue, saturation, value)
    }

    #[test]
    fn primaries_and_greys() {
        assert_eq!(hsv([255, 0, 0]), (0, 255, 255));
        assert_eq!(hsv([255, 255, 0]), (30, 255, 255));
        assert_eq!(hsv([0, 255, 0]), (60, 255, 255));
        assert_eq!(hsv([0, 0, 255]), (120, 255, 255));
        assert_eq!(hsv([255, 0, 255]), (150, 255, 255));
        assert_eq!(hsv([0, 0, 0]), (0, 0, 0));
        assert_eq!(hsv([77, 77, 77]), (0, 0, 77));
    }

    #[test]
    fn hue_stays_below_180_for_every_colour() {
        for rgb in 0..1_u32 << 24 {
            let [_, red, green, blue] = rgb.to_be_bytes();
            assert!(Hsv::from_rgb888([red, green, blue]).hue < 180, "{rgb:06x}");
        }
    }

    #[test]
    fn rgb565_reaches_both_ends_of_each_channel() {
        assert_eq!(rgb888(0xffff), [255, 255, 255]);
        assert_eq!(rgb888(0), [0, 0, 0]);
        assert_eq!(rgb888(0x8410), [0x84, 0x82, 0x84]);
    }
}
