//! Attacks with model files, and with forces from the models that are accepted.

use arbitrary::{Result, Unstructured};
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::model::samples::{place_spec, spec, spec16};
use hivtac_sensor::force::network::Network;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::force::{Force, Resting, of_outputs};
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::ByteOrder;
use hivtac_wire::frame::CRC32;

use crate::markers;

const DEFAULT: &[u8] = include_bytes!("../../../calibration/models/default.hvtm");

/// Bytes of the checksum at a file's end.
const CRC_BYTES: usize = 4;

/// The first byte decides the file: the rest of the input, or a valid file in which the input
/// changes some bytes.
pub fn attack(input: &[u8]) -> bool {
    let mut input = Unstructured::new(input);
    let file = file(&mut input).unwrap_or_default();
    match Model::parse(&file) {
        Ok(model) => {
            // The end of the input ends the attack.
            let _ = gives_forces(&model, &mut input);
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

fn file(input: &mut Unstructured<'_>) -> Result<Vec<u8>> {
    let kind: u8 = input.arbitrary()?;
    let mut file = match kind % 8 {
        0 => return Ok(input.bytes(input.len())?.to_vec()),
        1 => spec(&[11, 8, 3]).encode().unwrap_or_default(),
        2 => place_spec(&[11, 8, 8, 5]).encode().unwrap_or_default(),
        3 => spec16(&[11, 8, 3], 1_000).encode().unwrap_or_default(),
        _ => DEFAULT.to_vec(),
    };
    for _ in 0..input.int_in_range(0..=8)? {
        let at = input.choose_index(file.len())?;
        file[at] = input.arbitrary()?;
    }
    if input.ratio(15, 16)? {
        file.truncate(file.len());
    } else {
        file.truncate(input.choose_index(file.len())?);
    }
    repair(&mut file);
    Ok(file)
}

/// Gives a file its right checksum, which random bytes would not have.
fn repair(file: &mut [u8]) {
    if let Some((body, sum)) = file.split_last_chunk_mut::<CRC_BYTES>() {
        *sum = CRC32.checksum(body).to_le_bytes();
    }
}

/// Checks that the forces of an accepted model are numbers within their ranges.
fn gives_forces(model: &Model<'_>, input: &mut Unstructured<'_>) -> Result<()> {
    assert!(!model.layers().is_empty() && !model.name().is_empty());
    let settings = model.conditions.settings(ByteOrder::Native);
    assert_eq!(settings.check(), Ok(()));
    let rest = match input.arbitrary()? {
        true => model.rest,
        false => Rest::of_markers(&markers::anywhere(input)?),
    };
    for _ in 0..4 {
        let markers = match input.arbitrary()? {
            true => markers::near(&rest, input)?,
            false => markers::anywhere(input)?,
        };
        force(model, &rest, &markers);
    }
    Ok(())
}

fn force(model: &Model<'_>, rest: &Rest, markers: &[Marker; 4]) {
    let features = Features::of_markers(markers);
    let output = Network::new().run(model, &features, &rest.features);
    let (force, _) = of_outputs(model, &output);
    is_sound(&force);
    if let (Some(forward), Some(resting)) = (&model.forward, Resting::of_model(model, rest)) {
        let (force, _) = resting.force(forward, &model.range, markers, &output);
        is_sound(&force);
    }
}

fn is_sound(force: &Force) {
    assert!((-180_000..=180_000).contains(&force.alpha.0), "{force:?}");
    assert!((-90_000..=90_000).contains(&force.beta.0), "{force:?}");
    assert!(force.magnitude.0 >= 0, "{force:?}");
}
