//! A picture for drawings.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context, Result};
use font8x8::{BASIC_FONTS, GREEK_FONTS, LATIN_FONTS, UnicodeFonts};
use hivtac_twin::Frame;

/// Red, green and blue.
pub type Colour = [u8; 3];

pub const BLACK: Colour = [0, 0, 0];
/// Distinct from the film's grey and from the markers' red.
pub const CYAN: Colour = [0, 255, 255];

/// Side of a character, px.
pub const CHARACTER: u32 = 8;

/// A picture in 8-bit red, green and blue. Drawings outside of it are ignored.
pub struct Canvas {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A picture with a single colour.
    pub fn new(width: u32, height: u32, colour: Colour) -> Canvas {
        Canvas {
            width,
            height,
            rgb: colour.repeat(width as usize * height as usize),
        }
    }

    /// A frame with each pixel drawn as a square of `scale` × `scale`.
    pub fn of_frame(frame: &Frame, scale: u32) -> Canvas {
        let small = Canvas {
            width: frame.width,
            height: frame.height,
            rgb: frame.to_rgb888(),
        };
        let mut canvas = Canvas::new(scale * frame.width, scale * frame.height, BLACK);
        let side = i64::from(scale);
        for (x, y) in (0..frame.height).flat_map(|y| (0..frame.width).map(move |x| (x, y))) {
            let at = [x, y].map(|part| side * i64::from(part));
            canvas.fill(at, [side, side], small.pixel(x, y));
        }
        canvas
    }

    fn pixel(&self, x: u32, y: u32) -> Colour {
        let at = 3 * (y as usize * self.width as usize + x as usize);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    pub fn set(&mut self, x: i64, y: i64, colour: Colour) {
        if (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y) {
            let at = 3 * (y as usize * self.width as usize + x as usize);
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Fills a rectangle from its upper left pixel.
    pub fn fill(&mut self, [x, y]: [i64; 2], [width, height]: [i64; 2], colour: Colour) {
        for row in y..y + height {
            for column in x..x + width {
                self.set(column, row, colour);
            }
        }
    }

    /// Draws text from the upper left pixel of its first character; each of its pixels is a square
    /// of `scale`. Characters that the font lacks become question marks.
    fn text(&mut self, [x, y]: [i64; 2], scale: u32, text: &str, colour: Colour) {
        let side = i64::from(scale);
        let advance = side * i64::from(CHARACTER);
        for (nth, character) in (0..).zip(text.chars()) {
            let left = x + advance * nth;
            for (row, bits) in (0..).zip(glyph(character)) {
                for column in (0..8).filter(|column| bits >> column & 1 == 1) {
                    self.fill([left + side * column, y + side * row], [side, side], colour);
                }
            }
        }
    }

    /// Draws text with an edge in another colour, which is visible on every background.
    pub fn edged_text(&mut self, [x, y]: [i64; 2], scale: u32, text: &str, colour: Colour) {
        let edge = i64::from(scale);
        for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
            self.text([x + edge * dx, y + edge * dy], scale, text, BLACK);
        }
        self.text([x, y], scale, text, colour);
    }

    /// Writes it as a PNG file.
    pub fn save(&self, path: &Path) -> Result<()> {
        let said = || format!("cannot write {}", path.display());
        let file = File::create(path).with_context(said)?;
        let mut encoder = png::Encoder::new(BufWriter::new(file), self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().with_context(said)?;
        writer.write_image_data(&self.rgb).with_context(said)?;
        writer.finish().with_context(said)
    }
}

/// A character's eight rows, the leftmost pixel in bit 0.
fn glyph(character: char) -> [u8; 8] {
    let fonts = [
        BASIC_FONTS.get(character),
        LATIN_FONTS.get(character),
        GREEK_FONTS.get(character),
        BASIC_FONTS.get('?'),
    ];
    fonts.into_iter().flatten().next().unwrap_or_default()
}
