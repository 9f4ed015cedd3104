//! Encodes pixels as bytes on the OV7725's data lines.

use super::output::{Format, Output};
use crate::frame_source::{Coding, Picture};

/// COM3 bits.
const FLIP: u8 = 0x80;
const MIRROR: u8 = 0x40;
const SWAP_RED_BLUE: u8 = 0x20;
/// Luma before chroma. The data sheet calls it "swap Y/UV" without the order that it starts from.
/// Common drivers of the sensor set it for Y Cb Y Cr, and it is set after power-up.
const LUMA_FIRST: u8 = 0x10;
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

/// Returns the bytes of one row, as `output` defines them, of a picture of the whole pixel array.
pub fn row(output: &Output, picture: &Picture, row: u32) -> Vec<u8> {
    let columns = 0..output.window.output[0];
    let bars = output.com3 & COLOUR_BARS != 0;
    let mut bytes = match (output.format, picture.coding) {
        (Format::Yuv, Coding::Yuv422) if !bars => yuv(
            output,
            columns.map(|column| luma_and_chroma(output, picture, column, row)),
        ),
        _ => {
            let pixels: Vec<[u8; 3]> = columns
                .map(|column| pixel(output, picture, column, row))
                .collect();
            encode(output, &pixels, row)
        }
    };
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

/// Returns red, green, blue of one output pixel; black outside the array.
fn pixel(output: &Output, picture: &Picture, column: u32, row: u32) -> [u8; 3] {
    if output.com3 & COLOUR_BARS != 0 {
        return BARS[(column * 8 / output.window.output[0]) as usize];
    }
    match place(output, picture, column, row) {
        Some(place) if picture.coding == Coding::Mono => [picture.pixels[place] as u8; 3],
        Some(place) => rgb888(picture.pixels[place]),
        None => [0; 3],
    }
}

/// Returns the luma of one output pixel, and Cb and Cr of its pair, of a picture in YUV422. The
/// result is black outside the array.
fn luma_and_chroma(output: &Output, picture: &Picture, column: u32, row: u32) -> (u8, [u8; 2]) {
    let Some(place) = place(output, picture, column, row) else {
        return (0, [128; 2]);
    };
    let bytes = |place: usize| picture.pixels[place].to_le_bytes();
    let chroma = [place & !1, place | 1].map(|place| bytes(place)[1]);
    (bytes(place)[0], chroma)
}

/// Returns the index of the picture's pixel that is sent; `None` outside the array.
fn place(output: &Output, picture: &Picture, column: u32, row: u32) -> Option<usize> {
    let window = &output.window;
    let [columns, rows] = window.output;
    let column = if output.com3 & MIRROR != 0 {
        columns - 1 - column
    } else {
        column
    };
    let row = if output.com3 & FLIP != 0 {
        // A faulty sensor sends black rows after the last one.
        (rows - 1).checked_sub(row).unwrap_or(rows)
    } else {
        row
    };
    let along = |at: u32, axis: usize, size: u32| -> Option<u32> {
        let array = window.start[axis] + (at * window.size[axis] / window.output[axis]) as i32;
        let array = u32::try_from(array)
            .ok()
            .filter(|&a| a < window.array[axis])?;
        Some(array * size / window.array[axis])
    };
    let x = along(column, 0, picture.width)?;
    let y = along(row, 1, picture.height)?;
    Some((y * picture.width + x) as usize)
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
        Format::Yuv => yuv(output, pixels.iter().map(|pixel| ycbcr(*pixel))),
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
        Format::Mono => pixels.iter().map(|pixel| pixel[1]).collect(),
        Format::Bayer => (pixels.iter().enumerate())
            .map(|(i, p)| match (i % 2, row % 2) {
                (0, 0) => p[2],
                (1, 1) => p[0],
                _ => p[1],
            })
            .collect(),
    }
}

/// Returns pixels in the order of the lines, from each one's luma, Cb and Cr. Of a pair, Cb and Cr
/// of the first pixel are sent.
fn yuv(output: &Output, pixels: impl Iterator<Item = (u8, [u8; 2])>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut chroma = [128; 2];
    for (i, (luma, own)) in pixels.enumerate() {
        if i % 2 == 0 {
            chroma = own;
            if output.cr_first {
                chroma.reverse();
            }
        }
        let chroma = chroma[i % 2];
        bytes.extend(match output.com3 & LUMA_FIRST {
            0 => [chroma, luma],
            _ => [luma, chroma],
        });
    }
    bytes
}

/// Returns luma, and Cb and Cr: ITU-R BT.601, full range.
fn ycbcr(pixel: [u8; 3]) -> (u8, [u8; 2]) {
    let [r, g, b] = pixel.map(i32::from);
    let y = (19_595 * r + 38_470 * g + 7_471 * b + 32_768) >> 16;
    let cb = (-11_059 * r - 21_709 * g + 32_768 * b + 32_768) >> 16;
    let cr = (32_768 * r - 27_439 * g - 5_329 * b + 32_768) >> 16;
    let byte = |value: i32| value.clamp(0, 255) as u8;
    (byte(y), [byte(cb + 128), byte(cr + 128)])
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
            coding: Coding::Rgb565,
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
    fn yuv_of_grey_has_no_chroma_and_power_up_sends_luma_first() {
        let grey = Picture {
            width: 2,
            height: 1,
            coding: Coding::Rgb565,
            pixels: vec![0x8410; 2],
        };
        let output = Output::new(&Registers::default(), 24_000_000).unwrap();
        let bytes = row(&output, &grey, 0);
        assert_eq!(bytes.len(), 1280);
        for pixel in bytes.chunks(2) {
            assert!((130..=133).contains(&pixel[0]), "{pixel:?}");
            assert!((127..=129).contains(&pixel[1]), "{pixel:?}");
        }
    }

    #[test]
    fn a_picture_in_yuv422_is_sent_byte_for_byte_in_the_order_of_the_registers() {
        let picture = Picture {
            coding: Coding::Yuv422,
            ..picture()
        };
        let order = |com3, dsp_ctrl3| {
            let output = qvga(&[
                (reg::COM7, 0x40),
                (reg::COM3, com3),
                (reg::DSP_CTRL3, dsp_ctrl3),
            ]);
            row(&output, &picture, 7)
        };
        let pixels = &picture.pixels[7 * 320..][..320];
        let in_memory: Vec<u8> = pixels.iter().flat_map(|p| p.to_le_bytes()).collect();
        assert_eq!(order(LUMA_FIRST, 0x10), in_memory);
        let turned = |turn: fn(&[u8]) -> [u8; 4]| -> Vec<u8> {
            in_memory.chunks(4).flat_map(turn).collect()
        };
        assert_eq!(order(0, 0x10), turned(|p| [p[1], p[0], p[3], p[2]]));
        assert_eq!(
            order(LUMA_FIRST, 0x90),
            turned(|p| [p[0], p[3], p[2], p[1]])
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
