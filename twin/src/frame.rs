//! A rendered frame and the truth behind it.

use std::borrow::Cow;

use crate::format::{levels_of_rgb565, levels_of_yuyv, rgb565_of_levels};
use crate::{Format, Load};

/// One exposure with what is true of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// How its pixels are coded.
    pub format: Format,
    /// Row by row, `width · height` of them, coded as [`Format`] says, in native order; none in
    /// [`Format::Mono`].
    pub pixels: Vec<u16>,
    /// Row by row, `width · height` of them, in [`Format::Mono`]; otherwise none.
    pub mono: Vec<u8>,
    /// What is true of it.
    pub truth: Truth,
}

/// A coded picture.
#[derive(Debug, Default)]
pub(crate) struct Raster {
    pub(crate) words: Vec<u16>,
    pub(crate) bytes: Vec<u8>,
}

impl Raster {
    pub(crate) fn words(words: Vec<u16>) -> Raster {
        Raster {
            words,
            bytes: Vec::new(),
        }
    }

    pub(crate) fn bytes(bytes: Vec<u8>) -> Raster {
        Raster {
            words: Vec::new(),
            bytes,
        }
    }
}

/// What is true of a scene at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The load as it is labelled: what a stage and its gauge say.
    pub force: Load,
    /// The tip's force on the film, N: the label's in the contact reading `force`, another one
    /// otherwise.
    pub on_film_n: [f64; 3],
    /// Where the tip went, mm, film frame.
    pub tip_mm: [f64; 3],
    /// Which point of the film the tip is on, by where that rests, mm from the middle; `None`
    /// without a force.
    pub touches_mm: Option<[f64; 2]>,
    /// The markers by identity; `None` where a marker is missing or no part of it is in the frame.
    pub markers: [Option<MarkerTruth>; 4],
}

/// What is true of one marker's image. Patches over it are not taken off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerTruth {
    /// Centroid of the disc's whole image in this frame, as its shutter exposes it, px; the centre
    /// of pixel (0, 0) is the origin.
    pub centroid_px: [f64; 2],
    /// Area of the disc's whole image, px².
    pub area_px2: f64,
    /// The part of that area inside the frame: 1 where the border does not cut it, > 0.
    pub visible: f64,
}

impl Frame {
    /// The rows of [`Self::pixels`] from top to bottom; none in [`Format::Mono`].
    pub fn rows(&self) -> impl Iterator<Item = &[u16]> {
        self.pixels.chunks_exact(self.width as usize)
    }

    /// The rows of [`Self::mono`] from top to bottom; none in the other formats.
    pub fn mono_rows(&self) -> impl Iterator<Item = &[u8]> {
        self.mono.chunks_exact(self.width as usize)
    }

    /// The frame as 16-bit words: [`Self::pixels`], or two pixels of [`Self::mono`] in each, the
    /// left one below.
    pub fn words(&self) -> Cow<'_, [u16]> {
        if self.format == Format::Mono {
            let (pairs, _) = self.mono.as_chunks();
            return pairs.iter().map(|pair| u16::from_le_bytes(*pair)).collect();
        }
        Cow::Borrowed(&self.pixels)
    }

    /// The picture in 8-bit red, green and blue, three bytes per pixel, row by row, whatever its
    /// format. RGB565 is widened by repeating the upper bits of a channel.
    pub fn to_rgb888(&self) -> Vec<u8> {
        match self.format {
            Format::Mono => self.mono.iter().flat_map(|&grey| [grey; 3]).collect(),
            Format::Yuv422 => {
                let pairs = self.pixels.chunks_exact(2);
                let colours = pairs.flat_map(|pair| levels_of_yuyv([pair[0], pair[1]]));
                colours.flatten().collect()
            }
            _ => {
                let pixels = self.pixels.iter();
                pixels.flat_map(|&pixel| levels_of_rgb565(pixel)).collect()
            }
        }
    }

    /// The picture in RGB565, whatever its format: [`Self::pixels`] where they are that, otherwise
    /// the nearest codes.
    pub fn to_rgb565(&self) -> Cow<'_, [u16]> {
        if matches!(self.format, Format::Yuv422 | Format::Mono) {
            let levels = self.to_rgb888();
            let pixels = levels.chunks_exact(3);
            return pixels
                .map(|pixel| rgb565_of_levels([pixel[0], pixel[1], pixel[2]]))
                .collect();
        }
        Cow::Borrowed(&self.pixels)
    }

    /// The frame as a binary PPM picture.
    pub fn to_ppm(&self) -> Vec<u8> {
        let mut ppm = format!("P6\n{} {}\n255\n", self.width, self.height).into_bytes();
        ppm.extend(self.to_rgb888());
        ppm
    }
}
