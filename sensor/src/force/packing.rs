//! Defines the order of weights in the model file, in which a kernel reads them word by word.
//!
//! Four rows form a group: for each word's worth of columns, one word of each row. Columns are
//! padded with zeros to a whole block of the kernel, rows to a group of four.

/// Rows whose words alternate.
pub const ROWS_TOGETHER: usize = 4;
/// Zeros after the weights: a kernel loads ahead and reads bytes that it does not use.
pub(crate) const LOADED_AHEAD: usize = 16;

/// Largest magnitude of an int8 weight.
pub const MAX_WEIGHT8: u16 = 127;
/// Largest input of a layer with int8 weights.
pub const MAX_ACTIVATION8: u16 = 127;
/// Largest magnitude of an int16 weight.
pub const MAX_WEIGHT16: u16 = 32_767;
/// Largest activation of any layer.
pub const MAX_ACTIVATION16: u16 = 32_767;

/// How wide the weights of a layer are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum WeightWidth {
    /// −127 to 127, for inputs of 0 to 127: four to a word.
    #[default]
    Int8,
    /// −32,767 to 32,767, for inputs of 16 bits: two to a word.
    Int16,
}

impl WeightWidth {
    /// Largest magnitude of a weight.
    pub const fn largest_weight(self) -> u16 {
        match self {
            WeightWidth::Int8 => MAX_WEIGHT8,
            WeightWidth::Int16 => MAX_WEIGHT16,
        }
    }

    /// The allowed weights, as text.
    pub(crate) const fn range(self) -> &'static str {
        match self {
            WeightWidth::Int8 => "-127 to 127",
            WeightWidth::Int16 => "-32767 to 32767",
        }
    }

    /// Columns are padded with zeros to a multiple of this, which a kernel takes at a time.
    pub const fn block(self) -> usize {
        match self {
            WeightWidth::Int8 => 32,
            WeightWidth::Int16 => 16,
        }
    }

    /// Weights in a word of 32 bits.
    pub const fn per_word(self) -> usize {
        match self {
            WeightWidth::Int8 => 4,
            WeightWidth::Int16 => 2,
        }
    }
}

/// The four weights of a word of int8. Each half is the 16-bit number 256·w₁ + w₀. Only words whose
/// weights exceed −127 to 127 give such results.
pub fn unpack8(word: [u8; 4]) -> [i16; 4] {
    let [[w0, w1], [w2, w3]] = unpack16(word).map(|lane| {
        let low = lane as i8;
        // 256·w₁ is at most 32,768, which just exceeds 16 bits.
        let high = (i32::from(lane) - i32::from(low)) >> 8;
        [i16::from(low), high as i16]
    });
    [w0, w1, w2, w3]
}

/// The two weights of a word of int16.
pub fn unpack16([a, b, c, d]: [u8; 4]) -> [i16; 2] {
    [i16::from_le_bytes([a, b]), i16::from_le_bytes([c, d])]
}

/// The word of four int8 weights, each −127 to 127.
#[cfg(any(test, feature = "encode"))]
pub fn pack8([w0, w1, w2, w3]: [i16; 4]) -> [u8; 4] {
    pack16([256 * w1 + w0, 256 * w3 + w2])
}

/// The word of two int16 weights.
#[cfg(any(test, feature = "encode"))]
pub fn pack16([w0, w1]: [i16; 2]) -> [u8; 4] {
    let ([a, b], [c, d]) = (w0.to_le_bytes(), w1.to_le_bytes());
    [a, b, c, d]
}

/// Packs a layer's rows of `columns` weights each.
#[cfg(any(test, feature = "encode"))]
pub(crate) fn pack(width: WeightWidth, weights: &[i16], columns: usize) -> alloc::vec::Vec<u8> {
    use alloc::vec::Vec;
    let weight = |row: usize, column: usize| match column < columns {
        true => weights.get(row * columns + column).copied().unwrap_or(0),
        false => 0,
    };
    let rows = weights.len().checked_div(columns).unwrap_or(0);
    let per_word = width.per_word();
    let mut bytes = Vec::new();
    for group in (0..rows).step_by(ROWS_TOGETHER) {
        for column in (0..columns.next_multiple_of(width.block())).step_by(per_word) {
            for row in group..group + ROWS_TOGETHER {
                bytes.extend(match width {
                    WeightWidth::Int8 => pack8(core::array::from_fn(|i| weight(row, column + i))),
                    WeightWidth::Int16 => pack16(core::array::from_fn(|i| weight(row, column + i))),
                });
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_pair_of_int8_weights_survives() {
        for even in -127..=127 {
            for odd in -127..=127 {
                assert_eq!(
                    unpack8(pack8([even, odd, odd, even])),
                    [even, odd, odd, even]
                );
            }
        }
    }

    #[test]
    fn every_other_word_shows_itself() {
        let sound = |lane: i16| {
            let [low, high, ..] = unpack8(pack16([lane, 0]));
            assert_eq!(256 * i32::from(high) + i32::from(low), i32::from(lane));
            low.abs() <= 127 && high.abs() <= 127
        };
        let count = (i16::MIN..=i16::MAX).filter(|&lane| sound(lane)).count();
        assert_eq!(count, 255 * 255, "no two words for the same weights");
    }

    /// The arithmetic of `hivtac_expand` and `hivtac_dot8` in a lane, in numbers that cannot
    /// overflow.
    #[test]
    fn composite_lanes_give_256_times_the_products() {
        let ends = [-127_i16, -1, 0, 1, 126, 127];
        for (w0, w1) in ends.iter().flat_map(|a| ends.map(|b| (*a, b))) {
            for (a0, a1) in [(0, 0), (127, 0), (0, 127), (127, 127), (1, 126)] {
                let [lane, _] = unpack16(pack8([w0, w1, 0, 0]));
                let (low, x) = (i32::from(lane as i8), 256 * a0 - a1);
                assert!(i16::try_from(x).is_ok());
                let sum = i32::from(lane) * a1 + low * x;
                assert_eq!(sum, 256 * (i32::from(w0) * a0 + i32::from(w1) * a1));
            }
        }
    }

    proptest! {
        #[test]
        fn int16_weights_survive(a: i16, b: i16) {
            prop_assert_eq!(unpack16(pack16([a, b])), [a, b]);
        }
    }
}
