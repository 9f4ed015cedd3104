//! Writes the model file.

use super::{
    CalibratedRange, Conditions, ForwardSpec, InputScaling, Model, ModelError, Origin, OutputKind,
    Uncertainty,
    layout::{
        CRC, FORWARD_BESIDE, HEADER_LENGTH, MAGIC, NOTHING_BESIDE, PACKING, padded_name, version,
    },
    place,
};
use crate::force::features::Features;
use crate::force::packing::{LOADED_AHEAD, WeightWidth, pack};
use crate::force::rest::Rest;
use alloc::vec::Vec;
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::marker::LEAST_MARKERS;
use hivtac_terms::threshold::PixelFormat;

/// Offset of the forward model in models with a network: after the places.
pub const FORWARD_OFFSET: usize = 456;

/// The contents of a model file, to be written. The fields are those of [`Model`].
#[derive(Clone, Debug, PartialEq)]
pub struct ModelSpec {
    /// The frames that it was made for.
    pub conditions: Conditions,
    /// The rest position of the sensor it was made on.
    pub rest: Rest,
    /// How features become the network's input.
    pub input: InputScaling,
    /// Its layers, first to last: 1 to 8, or none for a forward model without a network.
    pub layers: Vec<LayerSpec>,
    /// The forward model.
    pub forward: Option<ForwardSpec>,
    /// The kind of outputs.
    pub output: OutputKind,
    /// The forces it was trained or calibrated on.
    pub range: CalibratedRange,
    /// How uncertain its forces are.
    pub uncertainty: Uncertainty,
}

/// One layer, to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerSpec {
    /// Number of inputs, 1–512: 11 in the first layer, the outputs of the layer before in the
    /// others.
    pub inputs: u16,
    /// Number of outputs, 1–512; in the last layer [`OutputKind::count`].
    pub outputs: u16,
    /// Width of the weights: int16 in the first layer.
    pub weight_width: WeightWidth,
    /// Upper limit of the activations: 1–32,767, at most 127 before a layer with int8 weights; 0 in
    /// the last layer.
    pub largest_activation: u16,
    /// `outputs` rows of `inputs` weights, −127 to 127 or −32,767 to 32,767.
    pub weights: Vec<i16>,
    /// `outputs` biases, in units of the accumulator.
    pub biases: Vec<i32>,
    /// `outputs` multipliers m, 1 to 2³¹ − 1.
    pub multipliers: Vec<u32>,
    /// `outputs` shifts s, 1–62.
    pub shifts: Vec<u8>,
}

impl ModelSpec {
    /// Returns the bytes of the model file. They have been read back successfully.
    ///
    /// # Errors
    /// [`ModelError`], as from [`Model::parse`] of such a file, or because a list has the wrong
    /// length.
    pub fn encode(&self) -> Result<Vec<u8>, ModelError> {
        for (index, layer) in self.layers.iter().enumerate() {
            layer.check_lengths(index)?;
            layer.check_weights(index)?;
        }
        let mut bytes = self.body();
        let length = (bytes.len() + 4) as u32;
        bytes[8..HEADER_LENGTH].copy_from_slice(&length.to_le_bytes());
        let crc = CRC.checksum(&bytes);
        bytes.extend(crc.to_le_bytes());
        Model::parse(&bytes)?;
        Ok(bytes)
    }

    fn body(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend(MAGIC);
        bytes.extend(version(self.output).to_le_bytes());
        bytes.extend([PACKING, 0]);
        bytes.extend([0; 4]); // the length, filled in when it is known
        // More layers than 16 bits can count are more than the reader accepts.
        let count = u16::try_from(self.layers.len()).unwrap_or(u16::MAX);
        bytes.extend(count.to_le_bytes());
        bytes.extend([
            output_number(self.output),
            match self.forward {
                None => NOTHING_BESIDE,
                Some(_) => FORWARD_BESIDE,
            },
        ]);
        push_conditions(&mut bytes, &self.conditions, self.rest.areas.len());
        push_features(&mut bytes, &self.rest.features);
        for area in &self.rest.areas {
            bytes.extend(area.to_le_bytes());
        }
        if !self.layers.is_empty() {
            push_input(&mut bytes, &self.input);
        }
        let range = &self.range;
        for value in [range.magnitude.0, range.alpha.0, range.beta.0] {
            bytes.extend(value.to_le_bytes());
        }
        self.uncertainty.push(&mut bytes);
        if self.output.tells_place() {
            place::push(&mut bytes, range.place, &self.uncertainty);
        }
        if let Some(forward) = &self.forward {
            forward.push(&mut bytes);
        }
        for layer in &self.layers {
            push_layer(&mut bytes, layer);
        }
        bytes
    }
}

/// Returns the model file with another number of steps; `None` if the model has no network or takes
/// no steps, or the file is not a model.
pub fn with_steps(file: &[u8], steps: u8) -> Option<Vec<u8>> {
    let model = Model::parse(file).ok()?;
    model
        .forward
        .as_ref()
        .filter(|_| !model.layers().is_empty())?;
    let mut bytes = file[..file.len() - 4].to_vec();
    bytes[FORWARD_OFFSET] = steps;
    let crc = CRC.checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    Model::parse(&bytes).is_ok().then_some(bytes)
}

impl LayerSpec {
    fn check_lengths(&self, layer: usize) -> Result<(), ModelError> {
        let outputs = usize::from(self.outputs);
        for (name, expected, actual) in [
            (
                "weights",
                outputs * usize::from(self.inputs),
                self.weights.len(),
            ),
            ("biases", outputs, self.biases.len()),
            ("multipliers", outputs, self.multipliers.len()),
            ("shifts", outputs, self.shifts.len()),
        ] {
            if expected != actual {
                return Err(ModelError::SpecLength {
                    layer,
                    name,
                    expected,
                    actual,
                });
            }
        }
        Ok(())
    }

    /// A weight out of range would be packed as a different one.
    fn check_weights(&self, layer: usize) -> Result<(), ModelError> {
        let largest = self.weight_width.largest_weight();
        let wrong = |weight: &i16| weight.unsigned_abs() > largest;
        match self.weights.iter().position(wrong) {
            None => Ok(()),
            Some(place) => Err(ModelError::Row {
                layer,
                row: place / usize::from(self.inputs).max(1),
                name: "a weight",
                allowed: self.weight_width.range(),
            }),
        }
    }
}

fn push_conditions(bytes: &mut Vec<u8>, conditions: &Conditions, markers: usize) {
    let geometry = &conditions.geometry;
    bytes.extend(padded_name(conditions.preset));
    bytes.extend(geometry.width.to_le_bytes());
    bytes.extend(geometry.height.to_le_bytes());
    bytes.extend(geometry.focal.0.to_le_bytes());
    bytes.extend(geometry.marker_diameter.0.to_le_bytes());
    bytes.extend(geometry.marker_radius.0.to_le_bytes());
    bytes.extend(geometry.film_distance.0.to_le_bytes());
    bytes.extend(conditions.threshold.limits());
    bytes.push(conditions.dilations);
    bytes.push(match conditions.threshold.format() {
        PixelFormat::Rgb565 => 0,
        PixelFormat::Yuv422 => 1,
        PixelFormat::Mono => 2,
    });
    bytes.push(match conditions.centroid {
        CentroidEstimator::BinaryMask => 0,
        CentroidEstimator::RednessWeighted => 1,
    });
    bytes.push(match conditions.contact {
        ContactReading::Force => 0,
        ContactReading::Stick => 1,
        ContactReading::Slip => 2,
    });
    push_origin(bytes, conditions.origin, markers);
}

fn push_origin(bytes: &mut Vec<u8>, origin: Origin, markers: usize) {
    let (number, unit) = match origin {
        Origin::Simulated => (0, [0; 12]),
        Origin::Unit(unit) => (1, unit),
    };
    // More markers than a model may have are more than the reader accepts.
    let more = markers.checked_sub(LEAST_MARKERS);
    let more = more.and_then(|more| u8::try_from(more).ok());
    bytes.extend([number, more.unwrap_or(u8::MAX)]);
    bytes.extend(unit);
}

fn output_number(output: OutputKind) -> u8 {
    match output {
        OutputKind::ForceVector => 0,
        OutputKind::AnglesMagnitude => 1,
        OutputKind::ForceAndPlace => 2,
    }
}

fn width_number(width: WeightWidth) -> u8 {
    match width {
        WeightWidth::Int8 => 0,
        WeightWidth::Int16 => 1,
    }
}

fn push_features(bytes: &mut Vec<u8>, features: &Features) {
    for (x, y) in features.centroids.iter().chain([&features.rect_center]) {
        bytes.extend(x.0.to_le_bytes());
        bytes.extend(y.0.to_le_bytes());
    }
    bytes.extend(features.rect_area.bits().to_le_bytes());
}

fn push_input(bytes: &mut Vec<u8>, input: &InputScaling) {
    push_features(bytes, &input.mean);
    for multiplier in input.multipliers {
        bytes.extend(multiplier.to_le_bytes());
    }
    bytes.extend(input.shifts);
    bytes.push(0);
}

fn push_layer(bytes: &mut Vec<u8>, layer: &LayerSpec) {
    bytes.extend(layer.inputs.to_le_bytes());
    bytes.extend(layer.outputs.to_le_bytes());
    bytes.extend([width_number(layer.weight_width), 0]);
    bytes.extend(layer.largest_activation.to_le_bytes());
    let columns = usize::from(layer.inputs);
    bytes.extend(pack(layer.weight_width, &layer.weights, columns));
    bytes.extend([0; LOADED_AHEAD]);
    bytes.extend(layer.biases.iter().flat_map(|b| b.to_le_bytes()));
    bytes.extend(layer.multipliers.iter().flat_map(|m| m.to_le_bytes()));
    bytes.extend(&layer.shifts);
    pad(bytes);
}

/// Zeros up to a multiple of four.
fn pad(bytes: &mut Vec<u8>) {
    bytes.resize(bytes.len().next_multiple_of(4), 0);
}
