//! One layer of a model, in place in the file.

/// A fully connected layer: `outputs` rows of `inputs` weights, and a bias and rescaling a row.
#[derive(Clone, Copy, Debug, Default)]
pub struct Layer<'a> {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// Row by row, each byte an `i8`.
    pub(super) weights: &'a [u8],
    /// Four bytes each.
    pub(super) biases: &'a [u8],
    /// Four bytes each.
    pub(super) multipliers: &'a [u8],
    pub(super) shifts: &'a [u8],
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

    /// Its rows, one for each output.
    pub fn rows(&self) -> impl Iterator<Item = Row<'a>> {
        let words = self
            .biases
            .chunks_exact(4)
            .zip(self.multipliers.chunks_exact(4));
        self.weights
            .chunks_exact(self.inputs.max(1))
            .zip(words)
            .zip(self.shifts)
            .map(|((weights, (bias, multiplier)), &shift)| Row {
                weights,
                bias: word(bias) as i32,
                multiplier: word(multiplier),
                shift,
            })
    }
}

/// What makes one output.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// One byte for each input, to be read as `i8`, −127 to 127.
    pub weights: &'a [u8],
    /// Added to the sum.
    pub bias: i32,
    /// m of the rescaling, 1 to 2³¹ − 1.
    pub multiplier: u32,
    /// s of the rescaling, 1–62.
    pub shift: u8,
}

impl Row<'_> {
    /// The largest |acc| that inputs of magnitude up to `largest_input` can make.
    pub fn accumulator_bound(&self, largest_input: u32) -> u64 {
        let weights: u64 = self
            .weights
            .iter()
            .map(|&w| u64::from((w as i8).unsigned_abs()))
            .sum();
        weights * u64::from(largest_input) + u64::from(self.bias.unsigned_abs())
    }
}

fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}
