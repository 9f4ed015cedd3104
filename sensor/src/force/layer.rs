//! Gives access to one layer of a model, in place in the file.

use crate::force::packing::{LOADED_AHEAD, ROWS_TOGETHER, WeightWidth, unpack8, unpack16};

/// The widest layer a model may have, and the size of the network's two activation buffers.
pub const MAX_WIDTH: usize = 512;

/// A fully connected layer: `outputs` rows of `inputs` weights, and for each row a bias and a
/// rescaling.
#[derive(Clone, Copy, Debug, Default)]
pub struct Layer<'a> {
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    pub(crate) weight_width: WeightWidth,
    pub(crate) largest_activation: u16,
    /// Packed, followed by [`LOADED_AHEAD`] zeros.
    pub(crate) weights: &'a [u8],
    /// Four bytes each.
    pub(crate) biases: &'a [u8],
    /// Four bytes each.
    pub(crate) multipliers: &'a [u8],
    pub(crate) shifts: &'a [u8],
    /// Every shift is 33 or more.
    #[cfg_attr(not(armv7em), allow(dead_code))]
    pub(crate) rescales_by_high_word: bool,
}

impl<'a> Layer<'a> {
    /// Number of inputs, 1–512.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of outputs, 1–512.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// The width of its weights.
    pub fn weight_width(&self) -> WeightWidth {
        self.weight_width
    }

    /// Upper limit of its activations, 1–32,767; 0 in the last layer, which has no activations.
    pub fn largest_activation(&self) -> u16 {
        self.largest_activation
    }

    /// A weight, −127 to 127 or −32,767 to 32,767; 0 beyond the layer's rows and columns. Slow: for
    /// inspection only.
    pub fn weight(&self, row: usize, column: usize) -> i16 {
        let per_word = self.weight_width.per_word();
        let group = self.groups().nth(row / ROWS_TOGETHER);
        let words = group.and_then(|words| words.get(column / per_word));
        let word = words.map_or([0; 4], |words| words[row % ROWS_TOGETHER]);
        match self.weight_width {
            WeightWidth::Int8 => unpack8(word)[column % per_word],
            WeightWidth::Int16 => unpack16(word)[column % per_word],
        }
    }

    /// Bias and rescaling of each row, one for each output.
    pub fn rows(&self) -> impl Iterator<Item = Row> + use<'a> {
        let (biases, _) = self.biases.as_chunks();
        let (multipliers, _) = self.multipliers.as_chunks();
        let words = biases.iter().zip(multipliers);
        words
            .zip(self.shifts)
            .map(|((&bias, &multiplier), &shift)| Row {
                bias: i32::from_le_bytes(bias),
                multiplier: u32::from_le_bytes(multiplier),
                shift,
            })
    }

    /// Its weights in groups of four rows: for each word's worth of columns, one word of each row.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &'a [[[u8; 4]; ROWS_TOGETHER]]> + use<'a> {
        let packed = self.weights.len().saturating_sub(LOADED_AHEAD);
        let (words, _) = self.weights[..packed].as_chunks::<4>();
        let (words, _) = words.as_chunks::<ROWS_TOGETHER>();
        words.chunks_exact((self.padded_inputs() / self.weight_width.per_word()).max(1))
    }

    /// Number of columns of the packed weights.
    pub(crate) fn padded_inputs(&self) -> usize {
        self.inputs.next_multiple_of(self.weight_width.block())
    }

    /// Number of rows of the packed weights.
    pub(crate) fn padded_outputs(&self) -> usize {
        self.outputs.next_multiple_of(ROWS_TOGETHER)
    }

    /// Biases, multipliers (both four bytes each) and shifts.
    #[cfg(armv7em)]
    pub(crate) fn scaling(&self) -> (&'a [u8], &'a [u8], &'a [u8]) {
        (self.biases, self.multipliers, self.shifts)
    }

    /// Whether every shift is 33 or more, so that the high word of a product is enough.
    #[cfg(armv7em)]
    pub(crate) fn rescales_by_high_word(&self) -> bool {
        self.rescales_by_high_word
    }

    /// The packed weights, followed by [`LOADED_AHEAD`] readable bytes.
    #[cfg(armv7em)]
    pub(crate) fn weights_and_more(&self) -> &'a [u8] {
        self.weights
    }
}

/// Converts a row's sum to an output.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Added to the sum.
    pub bias: i32,
    /// m of the rescaling, 1 to 2³¹ − 1.
    pub multiplier: u32,
    /// s of the rescaling, 1–62.
    pub shift: u8,
}
