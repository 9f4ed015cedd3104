//! Writing scripts of golden cases.

use std::vec::Vec;

use hivtac_sensing::features::{FEATURES, Features};
use hivtac_sensing::threshold::{ByteOrder, HsvBox};

use crate::golden::Kind;

/// A script that is being written. Frames use the threshold and the model that were set before them.
#[derive(Clone, Debug)]
pub struct Script {
    bytes: Vec<u8>,
    order: ByteOrder,
}

impl Script {
    /// An empty script; pixels are `Native` until a threshold says otherwise.
    pub fn new() -> Script {
        Script {
            bytes: Vec::new(),
            order: ByteOrder::Native,
        }
    }

    /// The script's bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Uses this model file from here on.
    pub fn model(&mut self, file: &[u8]) -> &mut Script {
        self.model_at(0, file)
    }

    /// Uses this model file, laid `offset` bytes after a multiple of four.
    pub fn model_at(&mut self, offset: u8, file: &[u8]) -> &mut Script {
        let length = u32::try_from(file.len()).expect("a model file is smaller than 4 GiB");
        self.bytes.extend([Kind::Model as u8, offset]);
        self.bytes.extend(length.to_le_bytes());
        self.bytes.extend(file);
        self
    }

    /// Uses this threshold and byte order from here on.
    pub fn threshold(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> &mut Script {
        self.push_threshold(hsv_box, order, 0)
    }

    /// The same; the instruction counter counts what the table of 64 KiB takes.
    pub fn counted_threshold(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> &mut Script {
        self.push_threshold(hsv_box, order, 4)
    }

    /// The same; from here on the pixels of scans are weighed, and so are those of frames sensed without a model.
    pub fn weighted_threshold(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> &mut Script {
        self.push_threshold(hsv_box, order, 2)
    }

    fn push_threshold(&mut self, hsv_box: &HsvBox, order: ByteOrder, flags: u8) -> &mut Script {
        self.order = order;
        self.bytes.push(Kind::Threshold as u8);
        self.bytes
            .push(u8::from(order == ByteOrder::Swapped) | flags);
        self.bytes.extend(hsv_box.limits());
        self
    }

    /// Scans a frame of `width` columns into blobs. Pixels have red in bits 15–11, whatever the byte order.
    pub fn scan(&mut self, width: u16, pixels: &[u16], dilations: u8, min_area: u8) -> &mut Script {
        self.bytes.push(Kind::Scan as u8);
        self.put(&[width, rows(width, pixels)]);
        self.bytes.extend([dilations, min_area]);
        self.frame(pixels);
        self
    }

    /// Runs frames of one size, `width` columns each, through the whole pipeline. Pixels as in [`scan`](Self::scan).
    pub fn sense(&mut self, width: u16, frames: &[&[u16]]) -> &mut Script {
        let height = frames.first().map_or(0, |pixels| rows(width, pixels));
        let count = u16::try_from(frames.len()).expect("at most 65,535 frames");
        self.bytes.push(Kind::Sense as u8);
        self.put(&[width, height, count]);
        for pixels in frames {
            assert_eq!(rows(width, pixels), height, "frames of one size");
            self.frame(pixels);
        }
        self
    }

    /// Runs frames of one size through the pipeline as they lie in memory, in windows; `tracked`: those that follow the
    /// markers. Pixels as in [`scan`](Self::scan).
    pub fn windows(&mut self, width: u16, frames: &[&[u16]], tracked: bool) -> &mut Script {
        self.push_windows(width, frames, u8::from(tracked))
    }

    /// Runs frames of one size through the pipeline, each but the first cropped to the rectangle around the windows that
    /// follow the markers. Pixels as in [`scan`](Self::scan).
    pub fn cropped(&mut self, width: u16, frames: &[&[u16]]) -> &mut Script {
        self.push_windows(width, frames, 2)
    }

    fn push_windows(&mut self, width: u16, frames: &[&[u16]], how: u8) -> &mut Script {
        let height = frames.first().map_or(0, |pixels| rows(width, pixels));
        let count = u16::try_from(frames.len()).expect("at most 65,535 frames");
        self.bytes.push(Kind::Windows as u8);
        self.put(&[width, height, count]);
        self.bytes.push(how);
        for pixels in frames {
            assert_eq!(rows(width, pixels), height, "frames of one size");
            self.frame(pixels);
        }
        self
    }

    /// Runs the network on features, measured from a rest position.
    pub fn network(&mut self, features: &Features, tare: &Features) -> &mut Script {
        self.bytes.push(Kind::Network as u8);
        for number in features.to_array().into_iter().chain(tare.to_array()) {
            self.bytes.extend(number.to_le_bytes());
        }
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

    fn frame(&mut self, pixels: &[u16]) {
        // As they lie in memory: swapping is its own inverse.
        let order = self.order;
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

/// The eleven numbers as features; all but the last must fit 32 bits.
pub fn features(numbers: [i64; FEATURES]) -> Features {
    use hivtac_sensing::units::Px;
    let px = |i: usize| Px(i32::try_from(numbers[i]).expect("a coordinate fits 32 bits"));
    Features {
        centroids: core::array::from_fn(|marker| (px(2 * marker), px(2 * marker + 1))),
        rect_center: (px(8), px(9)),
        rect_area: numbers[10],
    }
}

fn rows(width: u16, pixels: &[u16]) -> u16 {
    assert_eq!(pixels.len() % usize::from(width), 0, "whole rows");
    u16::try_from(pixels.len() / usize::from(width)).expect("at most 65,535 rows")
}
