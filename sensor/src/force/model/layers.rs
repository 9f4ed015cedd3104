//! Reads a model's layers, and proves that none of their sums can overflow.

use super::{MAX_LAYERS, ModelError, reader::Reader};
use crate::force::features::FEATURES;
use crate::force::layer::{Layer, MAX_WIDTH, Row};
use crate::force::packing::{
    LOADED_AHEAD, MAX_ACTIVATION8, MAX_ACTIVATION16, ROWS_TOGETHER, WeightWidth, unpack8, unpack16,
};

/// Magnitude of the first layer's inputs: they are `i16`.
const LARGEST_INPUT: u16 = 1 << 15;

pub(super) fn layers<'a>(
    reader: &mut Reader<'a>,
    count: usize,
    outputs: usize,
) -> Result<[Layer<'a>; MAX_LAYERS], ModelError> {
    let mut layers = [Layer::default(); MAX_LAYERS];
    let (mut fed, mut largest) = (FEATURES, LARGEST_INPUT);
    for (index, slot) in layers.iter_mut().take(count).enumerate() {
        let layer = layer(reader, index + 1 == count)?;
        if layer.inputs != fed {
            return Err(ModelError::Chain {
                layer: index,
                inputs: layer.inputs,
                fed,
            });
        }
        if layer.weight_width == WeightWidth::Int8 && largest > MAX_ACTIVATION8 {
            return Err(ModelError::WideInputs {
                layer: index,
                largest,
            });
        }
        check_rows(index, &layer, largest)?;
        (fed, largest) = (layer.outputs, layer.largest_activation);
        *slot = layer;
    }
    if fed != outputs {
        return Err(ModelError::Chain {
            layer: count,
            inputs: outputs,
            fed,
        });
    }
    Ok(layers)
}

fn layer<'a>(reader: &mut Reader<'a>, last: bool) -> Result<Layer<'a>, ModelError> {
    let mut layer = Layer {
        inputs: reader.u16_in("layer inputs", 1, MAX_WIDTH as u16, "1 to 512")? as usize,
        outputs: reader.u16_in("layer outputs", 1, MAX_WIDTH as u16, "1 to 512")? as usize,
        weight_width: reader.choice(
            "weight width",
            &[WeightWidth::Int8, WeightWidth::Int16],
            "0 or 1",
        )?,
        ..Layer::default()
    };
    reader.zero("reserved byte")?;
    layer.largest_activation = match last {
        true => reader.u16_in("largest activation", 0, 0, "0 in the last layer")?,
        false => reader.u16_in("largest activation", 1, MAX_ACTIVATION16, "1 to 32767")?,
    };
    let packed = layer.padded_outputs() * layer.padded_inputs() * 4 / layer.weight_width.per_word();
    layer.weights = reader.take(packed + LOADED_AHEAD)?;
    let ahead = reader.offset - LOADED_AHEAD;
    if layer.weights[packed..].iter().any(|byte| *byte != 0) {
        return Err(ModelError::Field {
            name: "padding",
            offset: ahead,
            allowed: "0",
        });
    }
    layer.biases = reader.take(4 * layer.outputs)?;
    layer.multipliers = reader.take(4 * layer.outputs)?;
    layer.shifts = reader.take(layer.outputs)?;
    layer.rescales_by_high_word = layer.shifts.iter().all(|shift| *shift >= 33);
    reader.pad()?;
    Ok(layer)
}

fn check_rows(index: usize, layer: &Layer<'_>, largest_input: u16) -> Result<(), ModelError> {
    let mut rows = layer.rows().enumerate();
    for (group, words) in layer.groups().enumerate() {
        let weights = match layer.weight_width {
            WeightWidth::Int8 => check_group(layer, words, unpack8),
            WeightWidth::Int16 => check_group(layer, words, unpack16),
        };
        let weights = weights.map_err(|(row, allowed)| ModelError::Row {
            layer: index,
            row: ROWS_TOGETHER * group + row,
            name: "a weight",
            allowed,
        })?;
        for (sum, (number, row)) in weights.into_iter().zip(&mut rows) {
            check_row(index, number, row, sum * u64::from(largest_input))?;
        }
        let filled_up = layer.outputs.saturating_sub(ROWS_TOGETHER * group);
        if weights.iter().skip(filled_up).any(|sum| *sum != 0) {
            return Err(ModelError::Row {
                layer: index,
                row: layer.outputs,
                name: "a weight",
                allowed: "0 beyond the last row",
            });
        }
    }
    Ok(())
}

/// Σ|w| of each row of a group; for a wrong weight the error names its row and the allowed values.
fn check_group<const N: usize>(
    layer: &Layer<'_>,
    words: &[[[u8; 4]; ROWS_TOGETHER]],
    unpack: impl Fn([u8; 4]) -> [i16; N],
) -> Result<[u64; ROWS_TOGETHER], (usize, &'static str)> {
    let largest = layer.weight_width.largest_weight();
    let mut sums = [0_u32; ROWS_TOGETHER];
    for (columns, words) in (0..).step_by(N).zip(words) {
        for (row, (sum, word)) in sums.iter_mut().zip(words).enumerate() {
            for (column, weight) in (columns..).zip(unpack(*word)) {
                let weight = weight.unsigned_abs();
                if weight > largest {
                    return Err((row, layer.weight_width.range()));
                }
                if column >= layer.inputs && weight != 0 {
                    return Err((row, "0 beyond the last column"));
                }
                // At most 512 · 32,767.
                *sum += u32::from(weight);
            }
        }
    }
    Ok(sums.map(u64::from))
}

/// Checks a row's values, and its sum; `products` is the largest |Σ w·x|.
fn check_row(layer: usize, number: usize, row: Row, products: u64) -> Result<(), ModelError> {
    let error = |name, allowed| ModelError::Row {
        layer,
        row: number,
        name,
        allowed,
    };
    if !(1..1 << 31).contains(&row.multiplier) {
        return Err(error("the multiplier", "1 to 2147483647"));
    }
    if !(1..=62).contains(&row.shift) {
        return Err(error("the shift", "1 to 62"));
    }
    let bound = products + u64::from(row.bias.unsigned_abs());
    if bound > i32::MAX as u64 {
        return Err(ModelError::Accumulator {
            layer,
            row: number,
            bound,
        });
    }
    Ok(())
}
