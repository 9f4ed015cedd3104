//! Writes scripts of golden cases.

use std::vec::Vec;

use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::rest::Rest;
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};

use crate::golden::Kind;

/// A script that is being written. Frames use the threshold and the model that were set before
/// them.
#[derive(Clone, Debug)]
pub struct Script {
    bytes: Vec<u8>,
    order: ByteOrder,
    format: PixelFormat,
}

impl Script {
    /// Returns an empty script. Pixels are RGB565, `Native`, until a threshold changes that.
    pub fn new() -> Script {
        Script {
            bytes: Vec::new(),
            order: ByteOrder::Native,
            format: PixelFormat::Rgb565,
        }
    }

    /// Returns the script's bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Uses this model file from now on.
    pub fn model(&mut self, file: &[u8]) -> &mut Script {
        self.model_at(0, file)
    }

    /// Uses this model file from now on, stored `offset` bytes after a multiple of four.
    pub fn model_at(&mut self, offset: u8, file: &[u8]) -> &mut Script {
        let length = u32::try_from(file.len()).expect("a model file is smaller than 4 GiB");
        self.bytes.extend([Kind::Model as u8, offset]);
        self.bytes.extend(length.to_le_bytes());
        self.bytes.extend(file);
        self
    }

    /// Uses this threshold, its pixel format and this byte order of RGB565 from now on.
    pub fn threshold(&mut self, threshold: impl Into<Threshold>, order: ByteOrder) -> &mut Script {
        self.push_threshold(threshold.into(), order, 0)
    }

    /// As [`Self::threshold`]; the instruction counter counts the work for the table of 64 KiB.
    pub fn counted_threshold(
        &mut self,
        threshold: impl Into<Threshold>,
        order: ByteOrder,
    ) -> &mut Script {
        self.push_threshold(threshold.into(), order, 4)
    }

    /// As [`Self::threshold`]; from now on the pixels of scans are weighed, and those of frames
    /// sensed without a model as well.
    pub fn weighted_threshold(
        &mut self,
        threshold: impl Into<Threshold>,
        order: ByteOrder,
    ) -> &mut Script {
        self.push_threshold(threshold.into(), order, 2)
    }

    fn push_threshold(&mut self, threshold: Threshold, order: ByteOrder, flags: u8) -> &mut Script {
        (self.order, self.format) = (order, threshold.format());
        let number = PixelFormat::ALL.iter().position(|it| *it == self.format);
        let flags = flags | u8::from(order == ByteOrder::Swapped);
        self.bytes.push(Kind::Threshold as u8);
        self.bytes.push(flags | (number.unwrap_or(0) as u8) << 3);
        self.bytes.extend(threshold.limits());
        self
    }

    /// Scans a frame of `width` columns into blobs. Pixels of RGB565 have red in bits 15–11, for
    /// every byte order.
    pub fn scan(&mut self, width: u16, pixels: &[u16], dilations: u8, min_area: u8) -> &mut Script {
        self.bytes.push(Kind::Scan as u8);
        self.put(&[width, self.rows(width, pixels)]);
        self.bytes.extend([dilations, min_area]);
        self.frame(pixels);
        self
    }

    /// Runs frames of one size, `width` columns each, through the whole pipeline. Pixels are as in
    /// [`scan`](Self::scan).
    pub fn sense(&mut self, width: u16, frames: &[&[u16]]) -> &mut Script {
        let height = frames.first().map_or(0, |pixels| self.rows(width, pixels));
        let count = u16::try_from(frames.len()).expect("at most 65,535 frames");
        self.bytes.push(Kind::Sense as u8);
        self.put(&[width, height, count]);
        for pixels in frames {
            assert_eq!(self.rows(width, pixels), height, "frames of one size");
            self.frame(pixels);
        }
        self
    }

    /// Runs the network on features, measured from a rest position.
    pub fn network(&mut self, features: &Features, tare: &Features) -> &mut Script {
        self.bytes.push(Kind::Network as u8);
        for number in features.to_array().into_iter().chain(tare.to_array()) {
            self.bytes.extend(number.bits().to_le_bytes());
        }
        self
    }

    /// Runs the network on markers, and the steps from its answer.
    pub fn press(&mut self, markers: &[Marker; 4], rest: &Rest) -> &mut Script {
        self.bytes.push(Kind::Press as u8);
        for Marker { x, y, area } in markers {
            self.bytes
                .extend([x.0, y.0].iter().flat_map(|part| part.to_le_bytes()));
            self.bytes.extend(area.to_le_bytes());
        }
        for number in rest.features.to_array() {
            self.bytes.extend(number.bits().to_le_bytes());
        }
        self.bytes
            .extend(rest.areas.iter().flat_map(|area| area.to_le_bytes()));
        self
    }

    /// Converts three numbers, taken as a vector and as angles and magnitude.
    pub fn force(&mut self, numbers: [i32; 3]) -> &mut Script {
        self.bytes.push(Kind::Force as u8);
        for number in numbers {
            self.bytes.extend(number.to_le_bytes());
        }
        self
    }

    fn rows(&self, width: u16, pixels: &[u16]) -> u16 {
        let length = self.format.row_length(width);
        assert_eq!(pixels.len() % length, 0, "whole rows");
        u16::try_from(pixels.len() / length).expect("at most 65,535 rows")
    }

    fn frame(&mut self, pixels: &[u16]) {
        // In the order in memory: swapping is its own inverse. Other formats have one order.
        let order = match self.format {
            PixelFormat::Rgb565 => self.order,
            PixelFormat::Yuv422 | PixelFormat::Mono => ByteOrder::Native,
        };
        self.put(
            &pixels
                .iter()
                .map(|&pixel| order.pixel(pixel))
                .collect::<Vec<_>>(),
        );
    }

    fn put(&mut self, numbers: &[u16]) {
        self.bytes
            .extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }
}

impl Default for Script {
    fn default() -> Self {
        Script::new()
    }
}
