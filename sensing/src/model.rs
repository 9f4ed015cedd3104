//! The model file: a quantized network, its input scaling, and the conditions it was made under.

/// A model, borrowed from the bytes of its file.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    /// The whole file.
    pub bytes: &'a [u8],
}
