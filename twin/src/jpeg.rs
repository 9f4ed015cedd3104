//! Passes a picture through JPEG and back, with the same bytes on every machine. Both crates
//! transform in integers: the encoder is built without its `simd`, and the decoder has it switched
//! off.

use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder, SamplingFactor};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::format::rgb565_of_levels;

/// Compresses a picture of 8-bit channels, decompresses it and codes it as RGB565.
pub(crate) fn there_and_back(
    width: u32,
    quality: u8,
    picture: impl Iterator<Item = [u8; 3]>,
) -> Vec<u16> {
    let levels: Vec<u8> = picture.flatten().collect();
    let decoded = decompress(&compress(width, quality, &levels));
    let pixels = decoded.chunks_exact(3);
    pixels
        .map(|pixel| rgb565_of_levels([pixel[0], pixel[1], pixel[2]]))
        .collect()
}

fn compress(width: u32, quality: u8, levels: &[u8]) -> Vec<u8> {
    // A camera's pictures are at most 800 pixels wide.
    let columns = width as u16;
    let rows = (levels.len() / 3 / usize::from(columns)) as u16;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    // The default takes chroma from every fourth pixel, which shifts colours by half a pixel.
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
    encoder
        .encode(levels, columns, rows, ColorType::Rgb)
        .expect("a picture of a camera's size in memory can be encoded");
    bytes
}

fn decompress(bytes: &[u8]) -> Vec<u8> {
    let options = DecoderOptions::new_safe()
        .set_use_unsafe(false)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    JpegDecoder::new_with_options(ZCursor::new(bytes), options)
        .decode()
        .expect("what was just encoded can be decoded")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::levels_of_rgb565;

    /// Red on grey stays in place: the column of its weight is that of the square.
    #[test]
    fn colours_do_not_move() {
        let inside = |i: u32| (60..75).contains(&(i % 160)) && (41..52).contains(&(i / 160));
        let colour = |i: u32| {
            if inside(i) {
                [160, 36, 40]
            } else {
                [150, 141, 128]
            }
        };
        let pixels = there_and_back(160, 85, (0..160 * 120).map(colour));
        let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
        for (i, pixel) in (0..).zip(pixels) {
            let [red, green, blue] = levels_of_rgb565(pixel).map(f64::from);
            let weight = red - (green + blue) / 2.0 - 15.5;
            if weight > 20.0 {
                sum += weight;
                x += weight * f64::from(i % 160);
                y += weight * f64::from(i / 160);
            }
        }
        let (x, y) = (x / sum - 67.0, y / sum - 46.0);
        assert!(x.abs() < 0.2 && y.abs() < 0.2, "{x} {y}");
    }

    /// A plain picture keeps its colour, up to rounding.
    #[test]
    fn a_plain_picture_stays() {
        let colour = [160, 36, 40];
        let pixels = there_and_back(160, 85, std::iter::repeat_n(colour, 160 * 120));
        assert_eq!(pixels.len(), 160 * 120);
        for pixel in pixels {
            for (found, expected) in levels_of_rgb565(pixel).into_iter().zip(colour) {
                assert!(found.abs_diff(expected) <= 8, "{found} for {expected}");
            }
        }
    }

    #[test]
    fn less_quality_is_less_like_it() {
        let stripe = |i: u32| {
            if i % 7 < 3 {
                [160, 36, 40]
            } else {
                [150, 141, 128]
            }
        };
        let error = |quality| {
            let pixels = there_and_back(160, quality, (0..160 * 120).map(stripe));
            let apart = |(i, pixel): (u32, &u16)| {
                let found = levels_of_rgb565(*pixel);
                (0..3)
                    .map(|c| u64::from(found[c].abs_diff(stripe(i)[c])))
                    .sum::<u64>()
            };
            (0..).zip(&pixels).map(apart).sum::<u64>()
        };
        assert!(2 * error(20) > 3 * error(95), "{} {}", error(20), error(95));
    }
}
