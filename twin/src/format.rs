//! Pixel formats: how the camera codes a picture.
//!
//! Colours of YUV422 and JPEG follow BT.601 in full range, 0 to 255 in all three numbers. JFIF does
//! it in this way, and so do OmniVision's sensors with their output range set to 00–FF:
//!
//! ```text
//! Y  = 0.299 R + 0.587 G + 0.114 B
//! Cb = 128 + 0.564 (B − Y)      Cr = 128 + 0.713 (R − Y)
//! ```

use std::fmt;
use std::str::FromStr;

use crate::SceneError;
use crate::frame::Raster;
use crate::light::{Channel, WHITE};
use hivtac_terms::fixed::Q;

/// How a frame's pixels are coded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Format {
    /// One `u16` per pixel: red in bits 15–11, green in 10–5, blue in 4–0.
    #[default]
    Rgb565,
    /// YUYV, one `u16` per pixel as two bytes of the bus lie in little-endian memory: luma in the
    /// low byte, chroma in the high byte. Cb is in even columns and Cr in odd ones; both are the
    /// mean of the pair. Read as a little-endian `u32`, a pair has its Cr in the top byte. A
    /// marker's Cr is 191, the film's 132.
    Yuv422,
    /// One byte per pixel, from a monochrome sensor. [`Options::mono`](crate::Options::mono) has
    /// its weights of red, green and blue. Behind a green filter, or in green light, red markers
    /// are *dark*: 36 against the film's 141. (Without the filter red tape has half of the film's
    /// luma, behind a red one all of it.)
    Mono,
    /// The picture compressed and decompressed again, then coded as [`Format::Rgb565`]. A computer
    /// with a JPEG camera, as the paper's, works on such pictures. Chroma has half the resolution
    /// in each direction.
    #[cfg(feature = "jpeg")]
    Jpeg {
        /// Quality 1 to 100, on the scale of the Independent JPEG Group; cameras use 70 to 95.
        quality: u8,
    },
}

impl Format {
    /// Returns the name in files and on the command line: `rgb565`, `yuv422`, `mono` or `jpeg`.
    pub fn name(self) -> &'static str {
        match self {
            Format::Rgb565 => "rgb565",
            Format::Yuv422 => "yuv422",
            Format::Mono => "mono",
            #[cfg(feature = "jpeg")]
            Format::Jpeg { .. } => "jpeg",
        }
    }

    /// Codes a picture of a width, row by row. Its channels are not yet clipped.
    #[cfg_attr(not(feature = "jpeg"), expect(unused_variables))]
    pub(crate) fn code(self, width: u32, picture: impl Iterator<Item = [Channel; 3]>) -> Raster {
        let clipped = |channel: Channel| channel.clamp(Channel::default(), WHITE);
        let picture = picture.map(|pixel| pixel.map(clipped));
        match self {
            Format::Rgb565 => Raster::words(picture.map(rgb565).collect()),
            Format::Yuv422 => Raster::words(yuyv(picture)),
            Format::Mono => Raster::bytes(picture.map(|[_, green, _]| level(green)).collect()),
            #[cfg(feature = "jpeg")]
            Format::Jpeg { quality } => Raster::words(crate::jpeg::there_and_back(
                width,
                quality,
                picture.map(|pixel| pixel.map(level)),
            )),
        }
    }
}

/// The default quality of `jpeg`.
#[cfg(feature = "jpeg")]
pub const JPEG_QUALITY: u8 = 85;

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Format {
    type Err = SceneError;

    fn from_str(name: &str) -> Result<Format, SceneError> {
        match name {
            "rgb565" => Ok(Format::Rgb565),
            "yuv422" => Ok(Format::Yuv422),
            "mono" => Ok(Format::Mono),
            #[cfg(feature = "jpeg")]
            "jpeg" => Ok(Format::Jpeg {
                quality: JPEG_QUALITY,
            }),
            _ => Err(SceneError::UnknownFormat(name.to_owned())),
        }
    }
}

/// Returns the nearest 8-bit level.
fn level(channel: Channel) -> u8 {
    channel.rounded() as u8
}

/// Returns the channel of a whole level.
fn of_level(level: u8) -> Channel {
    Q::from_bits(i32::from(level) << 6)
}

/// Returns RGB565 from channels, 0 to white, rounded to the nearest code.
fn rgb565([red, green, blue]: [Channel; 3]) -> u16 {
    let white = WHITE.bits() as u32;
    let code =
        |channel: Channel, highest: u32| (channel.bits() as u32 * highest + white / 2) / white;
    (code(red, 31) << 11 | code(green, 63) << 5 | code(blue, 31)) as u16
}

/// Returns RGB565 from 8-bit levels, rounded to the nearest code.
pub(crate) fn rgb565_of_levels(levels: [u8; 3]) -> u16 {
    rgb565(levels.map(of_level))
}

/// Returns the 8-bit levels of an RGB565 code; the upper bits are repeated in the low ones.
pub(crate) fn levels_of_rgb565(pixel: u16) -> [u8; 3] {
    let five = |v: u16| ((v << 3) | (v >> 2)) as u8;
    let six = |v: u16| ((v << 2) | (v >> 4)) as u8;
    [five(pixel >> 11), six((pixel >> 5) & 63), five(pixel & 31)]
}

/// Codes pairs of pixels as Y₀ Cb, Y₁ Cr. Rows have an even number of pixels.
fn yuyv(picture: impl Iterator<Item = [Channel; 3]>) -> Vec<u16> {
    let pixels: Vec<_> = picture.collect();
    let (pairs, _) = pixels.as_chunks::<2>();
    let words = pairs.iter().flat_map(|[even, odd]| {
        let mean = std::array::from_fn(|c| Q::from_bits((even[c] + odd[c]).bits() / 2));
        let [cb, cr] = chroma(mean);
        [word(luma(*even), cb), word(luma(*odd), cr)]
    });
    words.collect()
}

fn word(low: u8, high: u8) -> u16 {
    u16::from_le_bytes([low, high])
}

/// Weights of the channels in the luma. They add up to one.
const LUMA: [Q<16>; 3] = [
    Q::from_bits(19_595),
    Q::from_bits(38_470),
    Q::from_bits(7_471),
];
/// 0.564.
const CB_SCALE: Q<16> = Q::from_bits(36_984);
/// 0.713.
const CR_SCALE: Q<16> = Q::from_bits(46_745);

fn luma_channel([red, green, blue]: [Channel; 3]) -> Channel {
    let sum = LUMA[0] * red.bits() + LUMA[1] * green.bits() + LUMA[2] * blue.bits();
    Q::from_bits(sum.rounded())
}

fn luma(pixel: [Channel; 3]) -> u8 {
    level(luma_channel(pixel))
}

/// Returns Cb and Cr.
fn chroma(pixel: [Channel; 3]) -> [u8; 2] {
    let luma = luma_channel(pixel);
    let scaled = |channel: Channel, scale: Q<16>| {
        let off = Q::from_bits((scale * (channel - luma).bits()).floor());
        level((of_level(128) + off).clamp(Channel::default(), WHITE))
    };
    [scaled(pixel[2], CB_SCALE), scaled(pixel[0], CR_SCALE)]
}

/// Returns the 8-bit red, green and blue of the two pixels in two words of YUYV.
pub(crate) fn levels_of_yuyv(pair: [u16; 2]) -> [[u8; 3]; 2] {
    let [[y0, cb], [y1, cr]] = pair.map(|word| word.to_le_bytes().map(i32::from));
    let (cb, cr) = (cb - 128, cr - 128);
    // The factors 1.402, 0.344, 0.714 and 1.772 in 1/65,536.
    let red = (91_881 * cr) >> 16;
    let green = -((22_554 * cb + 46_802 * cr) >> 16);
    let blue = (116_130 * cb) >> 16;
    [y0, y1].map(|y| [y + red, y + green, y + blue].map(|v| v.clamp(0, 255) as u8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn channels(levels: [u8; 3]) -> [Channel; 3] {
        levels.map(of_level)
    }

    fn pair(levels: [u8; 3]) -> [u16; 2] {
        let words = yuyv([channels(levels); 2].into_iter());
        [words[0], words[1]]
    }

    #[test]
    fn known_colours() {
        // Black, white, and pure red, green and blue of JFIF.
        for (colour, y, cb, cr) in [
            ([0, 0, 0], 0, 128, 128),
            ([255, 255, 255], 255, 128, 128),
            ([255, 0, 0], 76, 85, 255),
            ([0, 255, 0], 150, 44, 21),
            ([0, 0, 255], 29, 255, 107),
        ] {
            assert_eq!(pair(colour), [word(y, cb), word(y, cr)], "{colour:?}");
        }
    }

    #[test]
    fn a_pair_shares_its_chroma_and_has_cr_on_top() {
        let red_and_black = yuyv([channels([255, 0, 0]), channels([0, 0, 0])].into_iter());
        assert_eq!(red_and_black, [word(76, 106), word(0, 192)]);
        let bytes: Vec<u8> = red_and_black.iter().flat_map(|w| w.to_le_bytes()).collect();
        let read = u32::from_le_bytes(bytes.try_into().unwrap());
        assert_eq!(read >> 24, 192, "Cr of the pair");
    }

    #[test]
    fn names_parse_back() {
        for format in [Format::Rgb565, Format::Yuv422, Format::Mono] {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
        let error = "bayer".parse::<Format>().unwrap_err().to_string();
        assert!(
            error.contains("bayer") && error.contains("yuv422"),
            "{error}"
        );
    }

    #[test]
    fn what_is_out_of_range_is_clipped() {
        let [below, above] = [-500, WHITE.bits() + 900].map(|bits| [Q::from_bits(bits); 3]);
        let coded = |format: Format| format.code(2, [below, above].into_iter());
        assert_eq!(coded(Format::Rgb565).words, [0, 0xffff]);
        assert_eq!(coded(Format::Yuv422).words, [word(0, 128), word(255, 128)]);
        assert_eq!(coded(Format::Mono).bytes, [0, 255]);
    }

    proptest! {
        #[test]
        fn yuyv_of_a_pair_of_one_colour_gives_it_back(levels: [u8; 3]) {
            for pixel in levels_of_yuyv(pair(levels)) {
                for c in 0..3 {
                    // The error of three rounded numbers, each times at most 1.772.
                    prop_assert!(pixel[c].abs_diff(levels[c]) <= 2, "{pixel:?} for {levels:?}");
                }
            }
        }

        #[test]
        fn rgb565_is_the_nearest_code(levels: [u8; 3]) {
            let back = levels_of_rgb565(rgb565(channels(levels)));
            for c in 0..3 {
                let half_step = if c == 1 { 3 } else { 5 };
                prop_assert!(back[c].abs_diff(levels[c]) <= half_step);
            }
        }
    }
}
