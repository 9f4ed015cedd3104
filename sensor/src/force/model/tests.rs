use super::encode::LayerSpec;
use super::samples::{place_spec, read_back, scramble, spec};
use super::*;
use proptest::prelude::*;
use std::{string::ToString, vec, vec::Vec};

/// Corrects the checksum of changed bytes.
pub(super) fn reseal(bytes: &mut [u8]) {
    let end = bytes.len() - 4;
    let crc = layout::CRC.checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
}

#[test]
fn what_is_written_is_read() {
    for widths in [
        &[11, 3][..],
        &[11, 64, 64, 3],
        &[11, 512, 512, 512, 3],
        &[11, 1, 3],
    ] {
        let spec = spec(widths);
        let bytes = spec.encode().unwrap();
        assert_eq!(read_back(&Model::parse(&bytes).unwrap()), spec);
    }
}

#[test]
fn a_model_of_places_is_written_and_read() {
    for widths in [&[11, 5][..], &[11, 64, 64, 5]] {
        let spec = place_spec(widths);
        let bytes = spec.encode().unwrap();
        assert_eq!(bytes[4..6], [7, 0], "its version");
        let model = Model::parse(&bytes).unwrap();
        assert_eq!(read_back(&model), spec);
        assert_eq!(model.range.place, Micrometres(4_000));
    }
    assert_eq!(spec(&[11, 3]).encode().unwrap()[4..6], [3, 0]);
}

/// Offsets of `docs/model-file.md`, with a forbidden value for each.
#[test]
fn every_field_of_places_is_checked() {
    let good = place_spec(&[11, 5]).encode().unwrap();
    for (offset, value, name) in [
        (4, 3, "output kind"),
        (14, 0, "output kind"),
        (14, 1, "output kind"),
        (15, 1, "beside the layers"),
        (15, 3, "beside the layers"),
        (391, 1, "largest place"),
        (395, 1, "uncertainty of the place"),
        (455, 0x80, "uncertainty of the place"),
        (457, 4, "layer inputs"),
    ] {
        let mut bytes = good.clone();
        bytes[offset] = value;
        reseal(&mut bytes);
        match Model::parse(&bytes) {
            Err(ModelError::Field { name: found, .. }) => assert_eq!(found, name, "byte {offset}"),
            other => panic!("byte {offset}: {other:?}"),
        }
    }
    let mut nowhere = place_spec(&[11, 5]);
    nowhere.range.place = Micrometres(0);
    assert!(nowhere.encode().is_err());
}

#[test]
fn as_many_outputs_as_the_kind_says() {
    for (spec, outputs, fed) in [(spec(&[11, 5]), 3, 5), (place_spec(&[11, 3]), 5, 3)] {
        let wrong = ModelError::Chain {
            layer: 1,
            inputs: outputs,
            fed,
        };
        assert_eq!(spec.encode(), Err(wrong));
    }
}

#[test]
fn a_file_reads_the_same_at_any_alignment() {
    let bytes = spec(&[11, 5, 3]).encode().unwrap();
    let mut shifted = vec![0xFF];
    shifted.extend(&bytes);
    let model = Model::parse(&shifted[1..]).unwrap();
    assert_eq!(read_back(&model), spec(&[11, 5, 3]));
}

#[test]
fn name_and_identity() {
    let bytes = spec(&[11, 64, 64, 3]).encode().unwrap();
    let model = Model::parse(&bytes).unwrap();
    assert_eq!(model.name(), "11-64-64-3 ov7725");
    assert_eq!(bytes[bytes.len() - 4..], model.crc().to_le_bytes());
    let long = spec(&[11, 512, 512, 512, 512, 512, 512, 512, 3])
        .encode()
        .unwrap();
    assert_eq!(
        Model::parse(&long).unwrap().name(),
        "11-512-512-512-512-512-512-512-3"
    );
}

/// Offsets of `docs/model-file.md`, with a forbidden value for each.
#[test]
fn every_field_is_checked() {
    let good = spec(&[11, 5, 3]).encode().unwrap();
    for (offset, value, name) in [
        (7, 1, "reserved byte"),
        (63, 1, "layer count"),
        (12, 0, "layer count"),
        (12, 9, "layer count"),
        (14, 2, "output kind"),
        (14, 3, "output kind"),
        (15, 1, "beside the layers"),
        (15, 2, "beside the layers"),
        (16, b'O', "preset name"),
        (31, b'x', "preset name"),
        (33, 4, "width"),
        (35, 4, "height"),
        (39, 0x80, "focal length"),
        (43, 0x80, "geometry"),
        (47, 0xFF, "geometry"),
        (51, 0x80, "geometry"),
        (52, 180, "threshold"),
        (53, 180, "threshold"),
        (55, 0, "threshold"),
        (58, 4, "dilations"),
        (59, 1, "threshold"),
        (59, 3, "pixel format"),
        (60, 2, "centroid estimator"),
        (61, 3, "contact reading"),
        (62, 2, "origin"),
        (63, 13, "markers beyond four"),
        (64, 1, "unit id"),
        (123, 0x80, "rectangle area"),
        (121, 1, "rectangle area"),
        (79, 4, "rest position"),
        (127, 0x80, "rest position"),
        (187, 0x80, "rectangle area"),
        (191, 1, "input multiplier"),
        (232, 0, "input shift"),
        (232, 63, "input shift"),
        (243, 1, "reserved byte"),
        (247, 0x80, "largest force"),
        (251, 1, "largest alpha"),
        (255, 0xFF, "largest beta"),
        (256, 28, "distance of uncertainties"),
        (257, 1, "reserved byte"),
        (259, 1, "reserved byte"),
        (263, 0x40, "uncertainty"),
        (387, 0x80, "uncertainty"),
        (389, 4, "layer inputs"),
        (391, 4, "layer outputs"),
        (392, 2, "weight width"),
        (393, 1, "reserved byte"),
        (395, 0x80, "largest activation"),
        (652, 1, "padding"),
        (667, 1, "padding"),
        (713, 1, "padding"),
        (716 + 6, 1, "largest activation"),
        (852, 1, "padding"),
    ] {
        let mut bytes = good.clone();
        bytes[offset] = value;
        reseal(&mut bytes);
        match Model::parse(&bytes) {
            Err(ModelError::Field { name: found, .. }) => assert_eq!(found, name, "byte {offset}"),
            other => panic!("byte {offset}: {other:?}"),
        }
    }
}

#[test]
fn a_closed_form_is_refused_by_its_name() {
    let mut bytes = spec(&[11, 5, 3]).encode().unwrap();
    bytes[15] = 1;
    reseal(&mut bytes);
    let error = Model::parse(&bytes).unwrap_err().to_string();
    assert!(
        error.contains("at byte 15") && error.contains("a closed form"),
        "{error}"
    );
}

#[test]
fn every_row_is_checked() {
    type Edit = fn(&mut LayerSpec);
    let edits: [(Edit, &str); 6] = [
        (|l| l.weights[3] = -128, "a weight"),
        (|l| l.weights[3] = 300, "a weight"),
        (|l| l.multipliers[0] = 0, "the multiplier"),
        (|l| l.multipliers[0] = 1 << 31, "the multiplier"),
        (|l| l.shifts[0] = 0, "the shift"),
        (|l| l.shifts[0] = 63, "the shift"),
    ];
    for (edit, name) in edits {
        let mut spec = spec(&[11, 5, 3]);
        edit(&mut spec.layers[1]);
        match spec.encode() {
            Err(ModelError::Row {
                layer: 1,
                row: 0,
                name: found,
                ..
            }) => assert_eq!(found, name),
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn an_accumulator_that_could_overflow_is_refused() {
    let mut spec = spec(&[11, 512, 3]);
    spec.layers[1].weights = vec![-127; 512 * 3];
    let reachable = 512 * 127 * 127;
    spec.layers[1].biases = vec![i32::MAX - reachable, -(i32::MAX - reachable), 0];
    assert!(spec.encode().is_ok());
    spec.layers[1].biases[1] -= 1;
    let refused = spec.encode().unwrap_err();
    assert_eq!(
        refused,
        ModelError::Accumulator {
            layer: 1,
            row: 1,
            bound: 1 << 31
        }
    );

    spec.layers[1].biases[1] = i32::MIN;
    assert!(matches!(
        spec.encode(),
        Err(ModelError::Accumulator { row: 1, .. })
    ));
    spec.layers[1].biases[1] = 0;
    spec.layers[0].weights = vec![5_000; 11 * 512];
    spec.layers[0].biases = vec![i32::MAX - 11 * 5_000 * 32_768; 512];
    assert!(spec.encode().is_ok());
    spec.layers[0].biases[511] += 1;
    assert!(matches!(
        spec.encode(),
        Err(ModelError::Accumulator {
            layer: 0,
            row: 511,
            ..
        })
    ));
}

#[test]
fn widths_must_chain() {
    let chain = |widths: &[u16]| spec(widths).encode().unwrap_err();
    let first = chain(&[10, 5, 3]);
    assert_eq!(
        first,
        ModelError::Chain {
            layer: 0,
            inputs: 10,
            fed: 11
        }
    );
    let last = chain(&[11, 5, 4]);
    assert_eq!(
        last,
        ModelError::Chain {
            layer: 2,
            inputs: 3,
            fed: 4
        }
    );
    assert!(matches!(
        chain(&[11, 513, 3]),
        ModelError::Field {
            name: "layer outputs",
            ..
        }
    ));
    assert!(matches!(
        chain(&[11, 0, 3]),
        ModelError::Field {
            name: "layer outputs",
            ..
        }
    ));
    assert!(matches!(
        chain(&[11; 10]),
        ModelError::Field {
            name: "layer count",
            ..
        }
    ));
    assert!(matches!(
        chain(&[11]),
        ModelError::Field {
            name: "layer count",
            ..
        }
    ));
    let mut lengths = spec(&[11, 3]);
    lengths.layers[0].shifts.pop();
    let short = ModelError::SpecLength {
        layer: 0,
        name: "shifts",
        expected: 3,
        actual: 2,
    };
    assert_eq!(lengths.encode(), Err(short));
}

#[test]
fn damage_is_named() {
    let good = spec(&[11, 5, 3]).encode().unwrap();
    assert_eq!(Model::parse(b"HVT").unwrap_err(), ModelError::NotAModel);
    assert_eq!(
        Model::parse(b"\x7fELF....").unwrap_err(),
        ModelError::NotAModel
    );
    let short = Model::parse(b"HVTM\x03\x00").unwrap_err();
    assert_eq!(
        short,
        ModelError::TooShort {
            offset: 6,
            length: 6
        }
    );
    let cut = Model::parse(&good[..good.len() - 1]).unwrap_err();
    assert!(matches!(cut, ModelError::Length { .. }), "{cut:?}");

    let mut newer = good.clone();
    newer[4] = 1;
    let error = Model::parse(&newer).unwrap_err();
    assert_eq!(error, ModelError::Version { found: 1 });
    assert!(error.to_string().contains("version 1"), "{error}");

    let mut repacked = good.clone();
    repacked[6] = 2;
    let error = Model::parse(&repacked).unwrap_err();
    assert_eq!(error, ModelError::Packing { found: 2 });
    assert!(error.to_string().contains("packed as 2"), "{error}");

    let mut longer = good.clone();
    let end = longer.len() - 4;
    longer.splice(end..end, [0; 4]);
    let length = longer.len() as u32;
    longer[8..12].copy_from_slice(&length.to_le_bytes());
    reseal(&mut longer);
    assert!(matches!(
        Model::parse(&longer),
        Err(ModelError::Length { .. })
    ));
}

#[test]
fn one_wrong_bit_anywhere_is_seen() {
    let good = spec(&[11, 5, 3]).encode().unwrap();
    for bit in 0..good.len() * 8 {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Model::parse(&bytes).is_err(), "bit {bit}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn a_changed_file_is_refused_or_sound(
        changes in prop::collection::vec((12usize..700, any::<u8>()), 1..4),
        tells_place: bool,
    ) {
        let spec = if tells_place { place_spec(&[11, 12, 5]) } else { spec(&[11, 12, 3]) };
        let mut bytes = spec.encode().unwrap();
        let end = bytes.len() - 4;
        for (offset, value) in changes {
            bytes[offset % end] = value;
        }
        reseal(&mut bytes);
        if let Ok(model) = Model::parse(&bytes) {
            prop_assert_eq!(read_back(&model).encode().unwrap(), bytes);
        }
    }

    #[test]
    fn any_sound_specification_round_trips(
        hidden in prop::collection::vec(1u16..40, 0..4),
        numbers in prop::collection::vec(any::<u32>(), 64),
        unit in prop::option::of(any::<[u8; 12]>()),
        tells_place: bool,
    ) {
        let of = |last| -> Vec<u16> {
            [11].into_iter().chain(hidden.clone()).chain([last]).collect()
        };
        let plain = if tells_place { place_spec(&of(5)) } else { spec(&of(3)) };
        let spec = scramble(plain, &numbers, unit);
        let bytes = spec.encode().unwrap();
        prop_assert_eq!(read_back(&Model::parse(&bytes).unwrap()), spec);
    }
}
