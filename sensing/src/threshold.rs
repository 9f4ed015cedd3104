//! HSV box threshold, compiled to a bit table over all 65,536 RGB565 values.

/// An inclusive box in OpenCV's 8-bit HSV (H 0–179). `hue_low > hue_high` wraps through 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HsvBox {
    /// Lowest hue, 0–179.
    pub hue_low: u8,
    /// Highest hue, 0–179.
    pub hue_high: u8,
    /// Lowest saturation.
    pub saturation_low: u8,
    /// Highest saturation.
    pub saturation_high: u8,
    /// Lowest value.
    pub value_low: u8,
    /// Highest value.
    pub value_high: u8,
}

impl HsvBox {
    /// The default for red markers: H ≥ 170 or ≤ 10, S ≥ 100, V ≥ 45.
    pub const RED: HsvBox = HsvBox {
        hue_low: 170,
        hue_high: 10,
        saturation_low: 100,
        saturation_high: 255,
        value_low: 45,
        value_high: 255,
    };
}

/// How the two bytes of an RGB565 pixel lie in the `u16` that a row is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ByteOrder {
    /// The `u16` is the pixel: red in bits 15–11.
    Native,
    /// The bytes are swapped: what DCMI leaves in memory from a camera that sends the high byte first.
    Swapped,
}
