//! Tests the limits of both widths of weights, and that no file content has two encodings.

use super::samples::{read_back, spec, spec16};
use super::tests::reseal;
use super::*;
use crate::force::packing::WeightWidth;
use std::{string::ToString, vec};

/// Int16 weights reach their limits if the proof allows it, which depends on the layer's inputs.
#[test]
fn int16_accumulators_are_proven_with_what_feeds_them() {
    let mut spec = spec16(&[11, 2, 3], 32_767);
    spec.layers[1].weights = vec![32_767, -32_767, 32_767, 32_767, 1, 1];
    spec.layers[1].biases = vec![0, 0, 0];
    let bytes = spec.encode().unwrap();
    assert_eq!(read_back(&Model::parse(&bytes).unwrap()), spec);
    spec.layers[1].biases[1] = 131_070;
    assert!(matches!(
        spec.encode(),
        Err(ModelError::Accumulator {
            layer: 1,
            row: 1,
            bound: 0x8000_0000
        })
    ));
    spec.layers[0].largest_activation = 32_766;
    assert!(spec.encode().is_ok());
}

#[test]
fn int8_weights_take_seven_bits() {
    let mut spec = spec(&[11, 5, 3]);
    spec.layers[0].largest_activation = 128;
    let error = spec.encode().unwrap_err();
    assert_eq!(
        error,
        ModelError::WideInputs {
            layer: 1,
            largest: 128
        }
    );
    assert!(error.to_string().contains("fed up to 128"), "{error}");
    spec.layers[0].largest_activation = 127;
    spec.layers[0].weight_width = WeightWidth::Int8;
    spec.layers[0].weights = vec![0; 55];
    let features = ModelError::WideInputs {
        layer: 0,
        largest: 32_768,
    };
    assert_eq!(spec.encode(), Err(features));
}

/// A second encoding of the same weights would give the same model a second identity.
#[test]
fn weights_beyond_rows_and_columns_are_zero() {
    let good = spec(&[11, 5, 3]).encode().unwrap();
    // Rows 0–3 of 16 columns, two to a word, then rows 4–7: column 11 of row 2, row 5, row 3 of the
    // second layer.
    let (layer_0, layer_1) = (396, 724);
    for (offset, layer, row) in [
        (layer_0 + 5 * 16 + 2 * 4 + 2, 0, 2),
        (layer_0 + 128 + 4, 0, 5),
        (layer_1 + 3 * 4, 1, 3),
        (layer_1 + 16 + 4 + 1, 1, 1),
    ] {
        let mut bytes = good.clone();
        bytes[offset] = 1;
        reseal(&mut bytes);
        match Model::parse(&bytes) {
            Err(ModelError::Row {
                layer: l,
                row: r,
                name: "a weight",
                ..
            }) => {
                assert_eq!((l, r), (layer, row), "byte {offset}");
            }
            other => panic!("byte {offset}: {other:?}"),
        }
    }
}

#[test]
fn an_aligned_file_is_reported() {
    let bytes = spec(&[11, 5, 3]).encode().unwrap();
    let mut file = AlignedFile([0; 1024]);
    for shift in 0..8 {
        file.0[shift..][..bytes.len()].copy_from_slice(&bytes);
        let model = Model::parse(&file.0[shift..][..bytes.len()]).unwrap();
        assert_eq!(model.is_aligned(), shift % 4 == 0);
    }
}
