//! Pixels as bytes on the sensor's data lines.

use super::output::{Format, Output};
use crate::frame_source::Picture;

/// COM3 bits.
const FLIP: u8 = 0x80;
const MIRROR: u8 = 0x40;
const SWAP_RED_BLUE: u8 = 0x20;
const SWAP_Y_UV: u8 = 0x10;
const REVERSE_BITS: u8 = 0x08;
const COLOUR_BARS: u8 = 0x01;

/// White, yellow, cyan, green, magenta, red, blue, black: the sensor's test picture.
const BARS: [[u8; 3]; 8] = [
    [255, 255, 255],
    [255, 255, 0],
    [0, 255, 255],
    [0, 255, 0],
    [255, 0, 255],
    [255, 0, 0],
    [0, 0, 255],
    [0, 0, 0],
];

/// The bytes of one row, as `output` says, of a picture of the whole pixel array.
pub fn row(output: &Output, picture: &Picture, row: u32) -> Vec<u8> {
    let columns = output.window.output[0];
    let pixels: Vec<[u8; 3]> = (0..columns)
        .map(|column| pixel(output, picture, column, row))
        .collect();
    let mut bytes = encode(output, &pixels, row);
    for byte in &mut bytes {
        if output.com3 & REVERSE_BITS != 0 {
            *byte = byte.reverse_bits();
        }
        if output.inverted {
            *byte = !*byte;
        }
    }
    bytes
}

/// Red, green, blue of one output pixel. Outside the array it is black.
fn pixel(output: &Output, picture: &Picture, column: u32, row: u32) -> [u8; 3] {
    let [columns, rows] = output.window.output;
    if output.com3 & COLOUR_BARS != 0 {
        return BARS[(column * 8 / columns) as usize];
    }
    let column = if output.com3 & MIRROR != 0 {
        columns - 1 - column
    } else {
        column
    };
    let row = if output.com3 & FLIP != 0 {
        // A faulty sensor sends rows beyond the last one; they are black.
        (rows - 1).checked_sub(row).unwrap_or(rows)
    } else {
        row
    };
    let place = |at: u32, axis: usize, size: u32| -> Option<u32> {
        let window = &output.window;
        let array = window.start[axis] + (at * window.size[axis] / window.output[axis]) as i32;
        let array = u32::try_from(array)
            .ok()
            .filter(|&a| a < window.array[axis])?;
        Some(array * size / window.array[axis])
    };
    match (
        place(column, 0, picture.width),
        place(row, 1, picture.height),
    ) {
        (Some(x), Some(y)) => rgb888(picture.pixels[(y * picture.width + x) as usize]),
        _ => [0; 3],
    }
}

fn encode(output: &Output, pixels: &[[u8; 3]], row: u32) -> Vec<u8> {
    let ordered = |p: &[u8; 3]| {
        if output.com3 & SWAP_RED_BLUE != 0 {
            [p[2], p[1], p[0]]
        } else {
            *p
        }
    };
    let word =
        |p: &[u8; 3], pack: fn([u16; 3]) -> u16| pack(ordered(p).map(u16::from)).to_be_bytes();
    match output.format {
        Format::Yuv => yuv(output, pixels),
        Format::Rgb565 => pixels
            .iter()
            .flat_map(|p| word(p, |[r, g, b]| r >> 3 << 11 | g >> 2 << 5 | b >> 3))
            .collect(),
        Format::Rgb555 => pixels
            .iter()
            .flat_map(|p| word(p, |[r, g, b]| r >> 3 << 10 | g >> 3 << 5 | b >> 3))
            .collect(),
        Format::Rgb444 => pixels
            .iter()
            .flat_map(|p| word(p, |[r, g, b]| r >> 4 << 8 | g >> 4 << 4 | b >> 4))
            .collect(),
        Format::Gbr => pixels
            .iter()
            .enumerate()
            .flat_map(|(i, p)| [p[1], if i % 2 == 0 { p[2] } else { p[0] }])
            .collect(),
        Format::Bayer => (pixels.iter().enumerate())
            .map(|(i, p)| match (i % 2, row % 2) {
                (0, 0) => p[2],
                (1, 1) => p[0],
                _ => p[1],
            })
            .collect(),
    }
}

/// ITU-R BT.601, full range; chroma is that of the first pixel of a pair.
fn yuv(output: &Output, pixels: &[[u8; 3]]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(pixels.len() * 2);
    let mut chroma = [128; 2];
    for (i, &pixel) in pixels.iter().enumerate() {
        let [r, g, b] = pixel.map(i32::from);
        let y = (19_595 * r + 38_470 * g + 7_471 * b + 32_768) >> 16;
        if i % 2 == 0 {
            let u = (-11_059 * r - 21_709 * g + 32_768 * b + 32_768) >> 16;
            let v = (32_768 * r - 27_439 * g - 5_329 * b + 32_768) >> 16;
            chroma = [u + 128, v + 128];
        }
        let pair = [y, chroma[i % 2]].map(|v| v.clamp(0, 255) as u8);
        bytes.extend(if output.com3 & SWAP_Y_UV != 0 {
            [pair[1], pair[0]]
        } else {
            pair
        });
    }
    bytes
}

fn rgb888(pixel: u16) -> [u8; 3] {
    let five = |v: u16| (v << 3 | v >> 2) as u8;
    let six = |v: u16| (v << 2 | v >> 4) as u8;
    [five(pixel >> 11), six(pixel >> 5 & 63), five(pixel & 31)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::registers::{self as reg, Registers};

    fn picture() -> Picture {
        let pixels = (0..320 * 240u32)
            .map(|i| (i.wrapping_mul(40_503) >> 3) as u16)
            .collect();
        Picture {
            width: 320,
            height: 240,
            pixels,
        }
    }

    fn qvga(extra: &[(u8, u8)]) -> Output {
        let mut registers = Registers::default();
        let size = [
            (reg::COM7, 0x46),
            (reg::COM3, 0),
            (reg::HSTART, 0x3F),
            (reg::HSIZE, 0x50),
            (reg::VSTRT, 0x03),
            (reg::VSIZE, 0x78),
            (reg::HOUTSIZE, 0x50),
            (reg::VOUTSIZE, 0x78),
        ];
        for &(address, value) in size.iter().chain(extra) {
            registers.write(address, value);
        }
        Output::new(&registers, 24_000_000).unwrap()
    }

    fn rgb565(bytes: &[u8]) -> Vec<u16> {
        bytes
            .chunks(2)
            .map(|b| u16::from_be_bytes([b[0], b[1]]))
            .collect()
    }

    #[test]
    fn rgb565_is_the_picture_bit_for_bit_high_byte_first() {
        let (output, picture) = (qvga(&[]), picture());
        for y in [0, 1, 120, 239] {
            let expected = &picture.pixels[y * 320..][..320];
            assert_eq!(rgb565(&row(&output, &picture, y as u32)), expected);
        }
    }

    #[test]
    fn mirror_and_flip_turn_the_picture() {
        let picture = picture();
        let mut first = picture.pixels[..320].to_vec();
        first.reverse();
        assert_eq!(
            rgb565(&row(&qvga(&[(reg::COM3, MIRROR)]), &picture, 0)),
            first
        );
        assert_eq!(
            rgb565(&row(&qvga(&[(reg::COM3, FLIP)]), &picture, 239)),
            picture.pixels[..320]
        );
    }

    #[test]
    fn a_shifted_window_shows_other_columns_and_black_outside() {
        let picture = picture();
        let shifted = rgb565(&row(&qvga(&[(reg::HSTART, 0x40)]), &picture, 0));
        assert_eq!(shifted[..316], picture.pixels[4..320]);
        assert_eq!(shifted[316..], [0; 4]);
    }

    #[test]
    fn yuv_of_grey_has_no_chroma_and_power_up_sends_chroma_first() {
        let grey = Picture {
            width: 2,
            height: 1,
            pixels: vec![0x8410; 2],
        };
        let output = Output::new(&Registers::default(), 24_000_000).unwrap();
        let bytes = row(&output, &grey, 0);
        assert_eq!(bytes.len(), 1280);
        assert!(
            bytes.iter().step_by(2).all(|&c| (127..=129).contains(&c)),
            "{:?}",
            &bytes[..4]
        );
        assert!(
            bytes
                .iter()
                .skip(1)
                .step_by(2)
                .all(|&y| (130..=133).contains(&y)),
            "{:?}",
            &bytes[..4]
        );
    }

    #[test]
    fn the_power_up_format_is_not_rgb565() {
        let picture = picture();
        let output = Output::new(&Registers::default(), 24_000_000).unwrap();
        assert_ne!(
            row(&output, &picture, 0)[..640],
            row(&qvga(&[]), &picture, 0)[..]
        );
    }
}
