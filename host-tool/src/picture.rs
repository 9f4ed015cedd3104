//! Reads and writes pictures: rows of pixels, as a camera delivers them.

use std::io::Cursor;

use image::codecs::png::PngEncoder;
use image::{
    DynamicImage, ExtendedColorType, GrayImage, ImageDecoder, ImageEncoder, ImageFormat,
    ImageReader,
};

use crate::failure::Failure;
use crate::files::read_at_most;
use crate::frame::pixels;
use crate::one_picture::rgb565;
use crate::raw;
use hivtac_sensor::markers::scanner::{MAX_HEIGHT, MAX_WIDTH};
use hivtac_terms::hsv::Hsv;
use hivtac_terms::threshold::PixelFormat;

/// A picture in a format of the sensing, or a frame of the device.
pub struct Picture {
    /// Columns, 1 to [`MAX_WIDTH`].
    pub width: u16,
    /// Rows, 1 to [`MAX_HEIGHT`].
    pub height: u16,
    /// Its pixel format.
    pub format: PixelFormat,
    /// Rows from the top; RGB565 has red in the high bits.
    pub pixels: Vec<u16>,
}

impl Picture {
    /// Reads a PNG, JPEG, BMP or PPM file, or a raw frame of `hivtac snapshot`, by its content. A
    /// raw frame has its own format. Any other file is read as mono by its luma if `format` is
    /// mono; else its levels of 8 bits are rounded to the nearest of RGB565.
    ///
    /// # Errors
    /// When the file cannot be read, has another format, or is larger than a frame can be.
    pub fn load(path: &str, format: PixelFormat) -> Result<Picture, Failure> {
        let file = read_at_most(path, LARGEST_FILE).map_err(|error| unreadable(path, &error))?;
        let too_long = || unreadable(path, &format_args!("it has more than {LARGEST_FILE} bytes"));
        Picture::parse(path, &file.ok_or_else(too_long)?, format)
    }

    /// Reads the bytes of such a file; errors name `path`.
    ///
    /// # Errors
    /// When the bytes have another format, or the picture is larger than a frame can be.
    pub fn parse(path: &str, file: &[u8], format: PixelFormat) -> Result<Picture, Failure> {
        if raw::is_one(file) {
            let raw = raw::parse(file).map_err(|error| unreadable(path, &error))?;
            let (width, height) = size(path, raw.width.into(), raw.height.into())?;
            return Ok(Picture {
                width,
                height,
                format: raw.format,
                pixels: pixels(raw.format, raw.bytes),
            });
        }
        let image = decode(path, file)?;
        let (width, height) = size(path, image.width(), image.height())?;
        let (format, pixels) = match format {
            PixelFormat::Mono => (PixelFormat::Mono, mono(&image.into_luma8())),
            _ => {
                let image = image.into_rgb8();
                let pixels = image.pixels().map(|pixel| rgb565(pixel.0));
                (PixelFormat::Rgb565, pixels.collect())
            }
        };
        Ok(Picture {
            width,
            height,
            format,
            pixels,
        })
    }

    /// Makes the pixels for which `is_looked_at(column, row)` is false as no marker is: black, in a
    /// mono camera's picture white.
    pub fn hide(&mut self, is_looked_at: impl Fn(u16, u16) -> bool) {
        let words = self.format.row_length(self.width);
        for (row, pixels) in (0..).zip(self.pixels.chunks_mut(words)) {
            match self.format {
                PixelFormat::Rgb565 => blacken(pixels, 0, |column| is_looked_at(column, row)),
                // Luma 0, and no colour.
                PixelFormat::Yuv422 => blacken(pixels, 0x8000, |column| is_looked_at(column, row)),
                PixelFormat::Mono => {
                    for (pair, word) in (0..).zip(pixels) {
                        let [left, right] = [2 * pair, 2 * pair + 1];
                        let shown = |level: u8, column| match is_looked_at(column, row) {
                            true => level,
                            false => u8::MAX,
                        };
                        let [low, high] = word.to_le_bytes();
                        *word = u16::from_le_bytes([shown(low, left), shown(high, right)]);
                    }
                }
            }
        }
    }

    /// The level of a pixel of a mono picture; 0 outside of it.
    pub fn level(&self, column: u16, row: u16) -> u8 {
        let words = PixelFormat::Mono.row_length(self.width);
        let word = self
            .pixels
            .get(usize::from(row) * words + usize::from(column / 2));
        word.map_or(0, |word| word.to_le_bytes()[usize::from(column % 2)])
    }

    /// Median of the pixels' value (RGB565) or luma, 0 to 255.
    pub fn brightness(&self) -> u8 {
        let mut values: Vec<u8> = match self.format {
            PixelFormat::Rgb565 => {
                let value = |pixel: &u16| Hsv::from_rgb565(*pixel).value;
                self.pixels.iter().map(value).collect()
            }
            PixelFormat::Yuv422 => self.pixels.iter().map(|pixel| *pixel as u8).collect(),
            PixelFormat::Mono => self
                .pixels
                .iter()
                .flat_map(|pair| pair.to_le_bytes())
                .collect(),
        };
        let middle = values.len() / 2;
        *values.select_nth_unstable(middle).1
    }
}

fn unreadable(path: &str, why: &dyn std::fmt::Display) -> Failure {
    Failure::input(format!("cannot read the picture {path}: {why}"))
}

fn blacken(pixels: &mut [u16], black: u16, is_looked_at: impl Fn(u16) -> bool) {
    for (column, pixel) in (0..).zip(pixels) {
        if !is_looked_at(column) {
            *pixel = black;
        }
    }
}

/// The channels of a written picture.
#[derive(Clone, Copy, Debug)]
pub enum Channels {
    /// One byte a pixel.
    Grey,
    /// Red, green and blue, a byte each.
    Colour,
}

/// Most bytes of a file that is read. A picture of the largest frame has a fiftieth of it.
const LARGEST_FILE: u64 = 100 << 20;

/// Decodes a picture and turns it by its EXIF data. Its claimed size is checked against a frame's
/// before memory is taken.
fn decode(path: &str, bytes: &[u8]) -> Result<DynamicImage, Failure> {
    let damaged = |error: image::ImageError| unreadable(path, &error);
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|error| unreadable(path, &error))?;
    match reader.format() {
        None => return Err(unreadable(path, &"it is no PNG, JPEG, BMP or PPM file")),
        Some(ImageFormat::Jpeg) if !is_whole_jpeg(bytes) => {
            return Err(unreadable(path, &"it is cut: a JPEG file without its end"));
        }
        Some(_) => (),
    }
    let mut decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    size(path, width, height)?;
    let orientation = decoder.orientation().map_err(damaged)?;
    let mut image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    image.apply_orientation(orientation);
    Ok(image)
}

/// Whether a JPEG file has its end-of-image marker: decoders paint missing parts grey.
///
/// A segment has its length. After a start of scan come coded bytes, where FF is followed by 0 or a
/// restart's number. The end of a thumbnail lies within a segment.
fn is_whole_jpeg(bytes: &[u8]) -> bool {
    const END: u8 = 0xD9;
    let mut at = 2;
    while let Some(rest) = bytes.get(at..) {
        let Some(marker) = rest
            .windows(2)
            .position(|pair| pair[0] == 0xFF && !matches!(pair[1], 0 | 0xFF | 0xD0..=0xD8 | 0x01))
        else {
            return false;
        };
        match rest[marker + 1..] {
            [END, ..] => return true,
            [_, high, low, ..] => {
                at += marker + 2 + usize::from(u16::from_be_bytes([high, low]));
            }
            _ => return false,
        }
    }
    false
}

/// A PNG file for `path`.
///
/// # Errors
/// When its encoder fails.
pub fn encode(
    path: &str,
    channels: Channels,
    width: u16,
    height: u16,
    levels: &[u8],
) -> Result<Vec<u8>, Failure> {
    let color = match channels {
        Channels::Grey => ExtendedColorType::L8,
        Channels::Colour => ExtendedColorType::Rgb8,
    };
    let mut file = Vec::new();
    PngEncoder::new(&mut file)
        .write_image(levels, width.into(), height.into(), color)
        .map_err(|error| Failure::input(format!("cannot make the picture {path}: {error}")))?;
    Ok(file)
}

fn size(path: &str, width: u32, height: u32) -> Result<(u16, u16), Failure> {
    if width == 0 || height == 0 {
        return Err(Failure::input(format!("the picture {path} is empty")));
    }
    match (u16::try_from(width), u16::try_from(height)) {
        (Ok(columns @ ..=MAX_WIDTH), Ok(rows @ ..=MAX_HEIGHT)) => Ok((columns, rows)),
        _ => Err(Failure::input(format!(
            "the picture {path} has {width} × {height} px, more than the {MAX_WIDTH} × \
             {MAX_HEIGHT} px of the largest frame; scale it down, for example to 640 px wide"
        ))),
    }
}

/// The rows of a mono camera: two pixels in each `u16`, the left one low.
fn mono(image: &GrayImage) -> Vec<u16> {
    let rows = image
        .rows()
        .map(|row| row.map(|pixel| pixel.0[0]).collect::<Vec<u8>>());
    let word = |pair: &[u8]| u16::from_le_bytes([pair[0], *pair.last().unwrap_or(&0)]);
    rows.flat_map(|row| row.chunks(2).map(word).collect::<Vec<u16>>())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 4 × 2 px in this many bits a pixel; BMP begins with the lowest row.
    fn bmp() -> Vec<u8> {
        let row: [[u8; 3]; 4] = [[0, 0, 0], [0, 0, 255], [255, 255, 255], [50, 100, 200]];
        let rows = [row, [[40; 3]; 4]].concat().concat();
        let header: [u32; 10] = [40, 4, 2, 24 << 16 | 1, 0, rows.len() as u32, 0, 0, 0, 0];
        let length = 54 + rows.len() as u32;
        let file: [u32; 3] = [length, 0, 54];
        let words = file.iter().chain(&header);
        let words = words.flat_map(|word| word.to_le_bytes());
        b"BM".iter().copied().chain(words).chain(rows).collect()
    }

    #[test]
    fn a_bmp_is_read_as_colours_and_as_luma() {
        let colours = Picture::parse("a.bmp", &bmp(), PixelFormat::Rgb565).unwrap();
        assert_eq!((colours.width, colours.height), (4, 2));
        assert_eq!(colours.format, PixelFormat::Rgb565);
        let grey = rgb565([40; 3]);
        let below = [0, 0xf800, 0xffff, rgb565([200, 100, 50])];
        assert_eq!(colours.pixels, [[grey; 4], below].concat());
        let luma = Picture::parse("a.bmp", &bmp(), PixelFormat::Mono).unwrap();
        assert_eq!(luma.format, PixelFormat::Mono);
        // 0.2126 R + 0.7152 G + 0.0722 B
        let pairs = [[40, 40], [40, 40], [0, 54], [255, 118]];
        assert_eq!(luma.pixels, pairs.map(u16::from_le_bytes));
        assert_eq!([colours.brightness(), luma.brightness()], [41, 40]);
    }

    /// Rows of an odd width end with half a pair, as in the sensing.
    #[test]
    fn mono_rows_are_pairs_of_pixels() {
        let image = GrayImage::from_raw(3, 2, vec![1, 2, 3, 4, 5, 6]).unwrap();
        assert_eq!(mono(&image), [0x0201, 0x0303, 0x0504, 0x0606]);
        assert_eq!(mono(&image).len(), 2 * PixelFormat::Mono.row_length(3));
    }

    /// A saved frame, with the bits of each channel repeated, is read back unchanged.
    #[test]
    fn every_rgb565_value_survives_the_way_through_a_picture() {
        for pixel in 0..=u16::MAX {
            let (red, green, blue) = (pixel >> 11, pixel >> 5 & 63, pixel & 31);
            let replicated = [
                red << 3 | red >> 2,
                green << 2 | green >> 4,
                blue << 3 | blue >> 2,
            ];
            assert_eq!(rgb565(replicated.map(|level| level as u8)), pixel);
        }
    }

    /// 8 columns and 4,194,303,749 rows: 100 GB of pixels in a file of 239 bytes.
    #[test]
    fn a_picture_that_claims_to_be_huge_takes_no_memory() {
        let file = include_bytes!("../../tests/fuzz/corpus/picture/claims_100_gb");
        let error = Picture::parse("it.png", file, PixelFormat::Rgb565)
            .err()
            .unwrap()
            .to_string();
        assert!(error.contains("it.png has 8 × 4194303749 px"), "{error}");
    }

    #[test]
    fn levels_are_rounded_to_the_nearest() {
        for level in 0..=255_u8 {
            let code = rgb565([level, 0, 0]) >> 11;
            assert_eq!(f64::from(code), (f64::from(level) * 31.0 / 255.0).round());
        }
    }
}
