//! Provides models for tests.

use super::encode::{LayerSpec, ModelSpec};
use super::*;
use crate::force::packing::WeightWidth;
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::threshold::HsvBox;
#[cfg(test)]
use hivtac_terms::threshold::{Mono, Threshold, Yuv422};
use hivtac_terms::units::Px;

/// A model of these layer widths whose values all lie in range and differ from each other.
pub fn spec(widths: &[u16]) -> ModelSpec {
    let features = Features {
        centroids: [
            (Px(1), Px(2)),
            (Px(3), Px(4)),
            (Px(5), Px(6)),
            (Px(7), Px(8)),
        ]
        .into(),
        rect_center: (Px(9), Px(10)),
        rect_area: Q::from_bits(11),
    };
    ModelSpec {
        conditions: Conditions {
            preset: Preset::Ov7725,
            geometry: Geometry::preset(Preset::Ov7725, 320, 240),
            threshold: HsvBox::RED.into(),
            dilations: 1,
            centroid: CentroidEstimator::BinaryMask,
            contact: ContactReading::Force,
            origin: Origin::Simulated,
        },
        rest: Rest {
            features,
            areas: [131, 132, 133, 134].into(),
        },
        input: InputScaling {
            mean: features,
            multipliers: [1 << 20; 11],
            shifts: [24; 11],
        },
        layers: widths
            .windows(2)
            .enumerate()
            .map(|(i, pair)| layer(pair[0], pair[1], i == 0, i + 2 == widths.len()))
            .collect(),
        forward: None,
        output: OutputKind::ForceVector,
        range: CalibratedRange {
            magnitude: MicroNewtons(1_000_000),
            alpha: MilliDegrees(15_000),
            beta: MilliDegrees(14_000),
            place: Micrometres(0),
        },
        uncertainty: Uncertainty::constant(UncertaintyKnot {
            across: MicroNewtons(1_270),
            along: MicroNewtons(800),
            place: Micrometres(0),
        }),
    }
}

/// As [`spec`], for a force and its place: places to 4 mm, known to 120 µm.
pub fn place_spec(widths: &[u16]) -> ModelSpec {
    let mut spec = spec(widths);
    spec.output = OutputKind::ForceAndPlace;
    spec.range.place = Micrometres(4_000);
    for knot in &mut spec.uncertainty.knots {
        knot.place = Micrometres(120);
    }
    spec
}

/// As [`spec`], with int16 weights and activations of up to `largest_activation` in every layer.
pub fn spec16(widths: &[u16], largest_activation: u16) -> ModelSpec {
    let mut spec = spec(widths);
    for layer in &mut spec.layers {
        layer.weight_width = WeightWidth::Int16;
        layer.largest_activation = layer.largest_activation.min(1) * largest_activation;
        layer.weights.iter_mut().for_each(|w| *w *= 5);
    }
    spec
}

/// Int16 weights for the features, int8 weights and seven-bit activations for the other layers.
fn layer(inputs: u16, outputs: u16, first: bool, last: bool) -> LayerSpec {
    let weights = usize::from(inputs) * usize::from(outputs);
    LayerSpec {
        inputs,
        outputs,
        weights: (0..weights)
            .map(|i| ((i * 37) % 255) as i16 - 127)
            .collect(),
        weight_width: if first {
            WeightWidth::Int16
        } else {
            WeightWidth::Int8
        },
        largest_activation: if last { 0 } else { 127 },
        biases: (0..i32::from(outputs)).map(|i| 1000 - 7 * i).collect(),
        multipliers: (0..u32::from(outputs)).map(|i| (1 << 30) + i).collect(),
        shifts: (0..outputs).map(|i| 30 + (i % 8) as u8).collect(),
    }
}

/// The specification that a reader of `model` would see.
#[cfg(test)]
pub(super) fn read_back(model: &Model<'_>) -> ModelSpec {
    let layers = model.layers().iter().map(|layer| LayerSpec {
        inputs: layer.inputs() as u16,
        outputs: layer.outputs() as u16,
        weight_width: layer.weight_width(),
        largest_activation: layer.largest_activation(),
        weights: (0..layer.outputs())
            .flat_map(|row| (0..layer.inputs()).map(move |column| layer.weight(row, column)))
            .collect(),
        biases: layer.rows().map(|r| r.bias).collect(),
        multipliers: layer.rows().map(|r| r.multiplier).collect(),
        shifts: layer.rows().map(|r| r.shift).collect(),
    });
    ModelSpec {
        conditions: model.conditions,
        rest: model.rest,
        input: model.input,
        layers: layers.collect(),
        forward: None,
        output: model.output,
        range: model.range,
        uncertainty: model.uncertainty,
    }
}

/// Puts random values, each in its range, into every field.
#[cfg(test)]
pub(super) fn scramble(mut spec: ModelSpec, numbers: &[u32], unit: Option<[u8; 12]>) -> ModelSpec {
    let mut numbers = numbers.iter().copied().cycle();
    let mut next = || numbers.next().unwrap();
    let c = &mut spec.conditions;
    c.origin = unit.map_or(Origin::Simulated, Origin::Unit);
    c.contact = [
        ContactReading::Force,
        ContactReading::Stick,
        ContactReading::Slip,
    ][next() as usize % 3];
    c.centroid = [
        CentroidEstimator::BinaryMask,
        CentroidEstimator::RednessWeighted,
    ][next() as usize % 2];
    c.preset = Preset::ALL[next() as usize % 2];
    c.geometry.width = 1 + (next() % 800) as u16;
    c.geometry.height = 1 + (next() % 800) as u16;
    c.geometry.focal = Px(1 + (next() >> 2) as i32);
    c.geometry.marker_diameter = Micrometres(1 + next() % 1000);
    c.geometry.marker_radius = Micrometres(1000 + next() % 999_001);
    c.geometry.film_distance = Micrometres(1 + next() % 1_000_000);
    c.dilations = (next() % 4) as u8;
    let low = next() as u8;
    let high = low.saturating_add(next() as u8);
    c.threshold = [
        Threshold::Rgb565(HsvBox {
            hue_low: (next() % 180) as u8,
            value_low: low,
            value_high: high,
            ..HsvBox::RED
        }),
        Threshold::Yuv422(Yuv422 { cr_low: low }),
        Threshold::Mono(Mono { low, high }),
    ][next() as usize % 3];
    for (x, y) in &mut spec.rest.features.centroids {
        (*x, *y) = (Px((next() >> 7) as i32), Px((next() >> 7) as i32));
    }
    spec.input.mean.rect_area = Q::from_bits(i64::from(next()));
    spec.rest.areas = [0; 4].map(|_: u32| 1 + next() % 640_000).into();
    spec.input.multipliers = [0; 11].map(|_: u32| 1 + (next() >> 9));
    spec.input.shifts = [0; 11].map(|_: u8| 1 + (next() % 62) as u8);
    if !spec.output.tells_place() {
        spec.output = [OutputKind::ForceVector, OutputKind::AnglesMagnitude][next() as usize % 2];
    } else {
        spec.range.place = Micrometres(1 + next() % 1_000_000);
        for knot in &mut spec.uncertainty.knots {
            knot.place = Micrometres(next() % 1_000_001);
        }
    }
    spec.range.magnitude = MicroNewtons(1 + (next() >> 2) as i32);
    spec.range.alpha = MilliDegrees((next() % 90_001) as i32);
    spec.uncertainty.step_bits = (next() % 28) as u8;
    for knot in &mut spec.uncertainty.knots {
        knot.across = MicroNewtons((next() >> 2) as i32);
        knot.along = MicroNewtons((next() >> 2) as i32);
    }
    for layer in &mut spec.layers {
        layer
            .weights
            .iter_mut()
            .for_each(|w| *w = i16::from(next() as i8).max(-127));
        layer
            .biases
            .iter_mut()
            .for_each(|b| *b = next() as i32 >> 3);
        layer
            .multipliers
            .iter_mut()
            .for_each(|m| *m = 1 + (next() >> 2));
        layer
            .shifts
            .iter_mut()
            .for_each(|s| *s = 1 + (next() % 62) as u8);
    }
    spec
}
