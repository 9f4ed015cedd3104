//! Models with made-up numbers, for tests of the arithmetic.

use std::vec::Vec;

use hivtac_sensor::force::features::{FEATURES, Features};
use hivtac_sensor::force::model::{
    CalibratedRange, Conditions, InputScaling, Origin, OutputKind, Uncertainty, UncertaintyKnot,
};
use hivtac_sensor::force::model::{encode::LayerSpec, encode::ModelSpec, encode::with_steps};
use hivtac_sensor::force::packing::WeightWidth;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::settings::Settings;
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_terms::units::{MicroNewtons, Micrometres, MilliDegrees, Px};

use crate::pictures::Random;

/// How the dots of `8v` move under two needles of 50 mN, 4 mm apart, mm: as the sensing's model has
/// it.
pub const UNDER_TWO_MM: [[f64; 3]; 8] = [
    [-0.0416, -0.0186, -2.4960],
    [0.0795, -0.0470, -2.3924],
    [0.0847, 0.0770, -2.4918],
    [-0.1164, 0.0968, -2.6532],
    [-0.1098, -0.0247, -4.0313],
    [0.0040, -0.0228, -3.6958],
    [0.1502, -0.0105, -3.8936],
    [0.0081, 0.0931, -3.9629],
];

/// The source of a layer's weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Any value from −127 to 127.
    Random,
    /// All at one of the two ends, by the neuron: −127 for odd ones, 127 for even ones.
    Extreme,
    /// Any int16 value that the proof of the sums allows, with activations of 12 bits.
    Wide,
    /// All at one of the two ends that the proof of the sums allows, with activations of 12 bits.
    WideExtreme,
}

impl Weights {
    fn are_extreme(self) -> bool {
        matches!(self, Weights::Extreme | Weights::WideExtreme)
    }
}

/// Largest activation of a model with int16 weights.
const WIDE_ACTIVATION: i64 = 4095;

/// Area of a dilated marker at rest in pixels, as in the rendered sensor.
const REST_AREA: u32 = 245;

/// Returns the rest position of the sensor with the default preset, in whole pixels.
pub fn rest() -> Features {
    let [left, right, top, bottom] = [99, 220, 59, 180].map(Px::from_int);
    let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
    let area = REST_AREA;
    Features::of_markers(&corners.map(|(x, y)| Marker { x, y, area }))
}

/// Returns the file of a model with these layer widths, for QVGA frames of the default preset. The
/// first width is 11, the last the number of outputs.
pub fn file(widths: &[u16], weights: Weights, output: OutputKind, seed: u64) -> Vec<u8> {
    encoded(&spec(qvga(), qvga_rest(), widths, weights, output, seed))
}

/// As `file`, for weighted centroids, and for a pixel format with its usual threshold.
pub fn weighted_file(
    format: PixelFormat,
    widths: &[u16],
    weights: Weights,
    output: OutputKind,
    seed: u64,
) -> Vec<u8> {
    let mut spec = spec(qvga(), qvga_rest(), widths, weights, output, seed);
    spec.conditions.centroid = CentroidEstimator::RednessWeighted;
    spec.conditions.threshold = Threshold::red(format);
    encoded(&spec)
}

/// Returns a model of int8 weights with these layer widths, for frames of another geometry and
/// pixel format. Its rest position is this estimator's in such frames.
pub fn file_for(
    geometry: Geometry,
    format: PixelFormat,
    (centroid, rest): (CentroidEstimator, Rest),
    widths: &[u16],
) -> Vec<u8> {
    let (weights, output) = (Weights::Random, OutputKind::ForceVector);
    let mut spec = spec(geometry, rest, widths, weights, output, 1);
    spec.conditions.threshold = Threshold::red(format);
    spec.conditions.centroid = centroid;
    encoded(&spec)
}

/// Returns a small model for frames with these settings, for this meaning of the labels and these
/// outputs.
pub fn file_read_so(
    settings: &Settings,
    rest: Rest,
    contact: ContactReading,
    output: OutputKind,
) -> Vec<u8> {
    let mut spec = spec(
        settings.geometry,
        rest,
        &[11, output.count() as u16],
        Weights::Random,
        output,
        1,
    );
    spec.conditions.threshold = settings.threshold;
    spec.conditions.centroid = settings.centroid;
    spec.conditions.contact = contact;
    encoded(&spec)
}

/// Returns the committed model that gives forces and places anywhere, with this number of steps
/// from its network's answer.
pub fn anywhere(steps: u8) -> Vec<u8> {
    let file = include_bytes!("../../calibration/models/default.hvtm");
    with_steps(file, steps).expect("the committed model takes steps")
}

/// Returns the committed model of eight dots, which has no network.
pub fn eight_dots() -> Vec<u8> {
    include_bytes!("../../calibration/models/8v/default.hvtm").to_vec()
}

fn qvga() -> Geometry {
    Geometry::preset(Preset::Ov7725, 320, 240)
}

fn qvga_rest() -> Rest {
    Rest {
        features: rest(),
        areas: [REST_AREA; 4].into(),
    }
}

fn encoded(spec: &ModelSpec) -> Vec<u8> {
    spec.encode()
        .expect("the numbers lie within the format's ranges")
}

fn spec(
    geometry: Geometry,
    rest: Rest,
    widths: &[u16],
    weights: Weights,
    output: OutputKind,
    seed: u64,
) -> ModelSpec {
    let mut random = Random::new(seed);
    let layers = widths
        .windows(2)
        .enumerate()
        .map(|(i, pair)| layer(pair, i + 2 == widths.len(), weights, &mut random));
    ModelSpec {
        conditions: conditions(geometry),
        input: input_scaling(rest.features),
        rest,
        layers: layers.collect(),
        forward: None,
        output,
        range: CalibratedRange {
            magnitude: MicroNewtons(200_000),
            alpha: MilliDegrees(10_000),
            beta: MilliDegrees(8_000),
            place: match output.tells_place() {
                true => Micrometres(4_000),
                false => Micrometres(0),
            },
        },
        uncertainty: Uncertainty {
            step_bits: 14,
            knots: std::array::from_fn(|i| UncertaintyKnot {
                across: MicroNewtons(1_300 - 37 * i as i32),
                along: MicroNewtons(500 + 91 * i as i32),
                place: match output.tells_place() {
                    true => Micrometres(200 - 9 * i as u32),
                    false => Micrometres(0),
                },
            }),
        },
    }
}

fn conditions(geometry: Geometry) -> Conditions {
    Conditions {
        preset: Preset::Ov7725,
        geometry,
        threshold: Threshold::red(PixelFormat::Rgb565),
        dilations: 1,
        centroid: CentroidEstimator::BinaryMask,
        contact: ContactReading::Force,
        origin: Origin::Simulated,
    }
}

/// One standard deviation, 4096 steps, is four pixels for a coordinate and 512 px² for the area.
fn input_scaling(mean: Features) -> InputScaling {
    let mut multipliers = [1 << 20; FEATURES];
    multipliers[FEATURES - 1] = 1 << 13;
    InputScaling {
        mean,
        multipliers,
        shifts: [26; FEATURES],
    }
}

fn layer(widths: &[u16], last: bool, weights: Weights, random: &mut Random) -> LayerSpec {
    let (inputs, outputs) = (widths[0], widths[1]);
    let first = usize::from(inputs) == FEATURES;
    let wide = matches!(weights, Weights::Wide | Weights::WideExtreme);
    let activation = if wide { WIDE_ACTIVATION } else { 127 };
    let largest_input = if first { 32_768 } else { activation };
    let largest = match wide {
        true => ((1 << 31) - (1 << 16)) / i64::from(inputs) / largest_input,
        false => 127,
    };
    let (extreme, neurons) = (weights.are_extreme(), usize::from(outputs));
    let weight = |neuron: usize, random: &mut Random| match (extreme, neuron % 2) {
        (false, _) => random.between(-largest, largest),
        (true, 1) => -largest,
        (true, _) => largest,
    };
    LayerSpec {
        inputs,
        outputs,
        weight_width: match first || wide {
            true => WeightWidth::Int16,
            false => WeightWidth::Int8,
        },
        largest_activation: if last { 0 } else { activation as u16 },
        weights: (0..neurons * usize::from(inputs))
            .map(|i| weight(i / usize::from(inputs), random).clamp(-32_767, 32_767) as i16)
            .collect(),
        biases: (0..neurons)
            .map(|_| random.between(-20_000, 20_000) as i32)
            .collect(),
        multipliers: (0..neurons)
            .map(|_| random.between(1 << 26, 1 << 28) as u32)
            .collect(),
        // Extreme sums reach every limit, and shifts on both sides of 32.
        shifts: (0..neurons)
            .map(|neuron| {
                shift(first, last, largest, activation) - if extreme { neuron as u8 % 8 } else { 0 }
            })
            .collect(),
    }
}

/// Keeps activations within their range and outputs within a newton for most inputs. The size of a
/// sum is about √inputs · 70 · 4096 in the first layer, √inputs · 70 · 60 in others, and more with
/// wider numbers.
fn shift(first: bool, last: bool, largest_weight: i64, activation: i64) -> u8 {
    let usual = match (first, last) {
        (true, false) => 40,
        (false, false) => 37,
        (true, true) => 31,
        (false, true) => 25,
    };
    let wider = |number: i64| number.ilog2() - 127_i64.ilog2();
    let fed = if first { 0 } else { wider(activation) };
    let gives = if last { 0 } else { wider(activation) };
    (usual + wider(largest_weight) + fed - gives) as u8
}
