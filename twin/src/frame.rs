//! A rendered frame and its ground truth.

use std::borrow::Cow;

use crate::film::Dots;
use crate::format::{levels_of_rgb565, levels_of_yuyv, rgb565_of_levels};
use crate::{Format, Load};

/// One exposure with its ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The code of its pixels.
    pub format: Format,
    /// Pixels row by row, `width · height` of them, coded as [`Format`] defines, in native order.
    /// Empty in [`Format::Mono`].
    pub pixels: Vec<u16>,
    /// Pixels row by row, `width · height` of them, in [`Format::Mono`]; empty in other formats.
    pub mono: Vec<u8>,
    /// The ground truth.
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

/// The ground truth of a scene at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The load as it is labelled, by a stage and its gauge.
    pub force: Load,
    /// The tip's force on the film, N. It equals the label's force in the contact reading `force`,
    /// and differs otherwise.
    pub on_film_n: [f64; 3],
    /// The tip's displacement, mm, film frame.
    pub tip_mm: [f64; 3],
    /// The point of the film that the tip touches, given by its place at rest, mm from the middle.
    /// `None` without a force.
    pub touches_mm: Option<[f64; 2]>,
    /// The markers by identity; `None` if a marker is missing or no part of it is in the frame.
    pub markers: Dots<Option<MarkerTruth>>,
}

/// The ground truth of one marker's image. Patches over it are not subtracted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerTruth {
    /// Centroid of the disc's whole image in this frame, as its shutter exposes it, px. The centre
    /// of pixel (0, 0) is the origin.
    pub centroid_px: [f64; 2],
    /// Area of the disc's whole image, px².
    pub area_px2: f64,
    /// The part of that area inside the frame, > 0; 1 if the border does not cut it.
    pub visible: f64,
}

impl Frame {
    /// Iterates over the rows of [`Self::pixels`] from top to bottom; no rows in [`Format::Mono`].
    pub fn rows(&self) -> impl Iterator<Item = &[u16]> {
        self.pixels.chunks_exact(self.width as usize)
    }

    /// Iterates over the rows of [`Self::mono`] from top to bottom; no rows in the other formats.
    pub fn mono_rows(&self) -> impl Iterator<Item = &[u8]> {
        self.mono.chunks_exact(self.width as usize)
    }

    /// Returns the frame as 16-bit words: [`Self::pixels`], or two pixels of [`Self::mono`] in each
    /// word, the left one in the low byte.
    pub fn words(&self) -> Cow<'_, [u16]> {
        if self.format == Format::Mono {
            let (pairs, _) = self.mono.as_chunks();
            return pairs.iter().map(|pair| u16::from_le_bytes(*pair)).collect();
        }
        Cow::Borrowed(&self.pixels)
    }

    /// Returns the picture in 8-bit red, green and blue, three bytes per pixel, row by row, for
    /// every format. RGB565 is widened by repeating the upper bits of a channel.
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

    /// Returns the picture in RGB565 for every format: [`Self::pixels`] if they are RGB565,
    /// otherwise the nearest codes.
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
}
