//! Models with made-up numbers, for tests of the arithmetic.

use std::vec;
use std::vec::Vec;

use hivtac_sensing::features::{FEATURES, Features};
use hivtac_sensing::geometry::{Geometry, Preset};
use hivtac_sensing::model::encode::{LayerSpec, ModelSpec};
use hivtac_sensing::model::{
    CalibratedRange, CentroidEstimator, Conditions, ContactReading, InputScaling, OUTPUTS, Origin,
    OutputKind, PixelFormat, Rest, Uncertainty,
};
use hivtac_sensing::threshold::HsvBox;
use hivtac_sensing::units::{MicroNewtons, MilliDegrees};

use crate::pictures::Random;
use crate::script::features;

/// Where the weights of a layer come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Any value from −127 to 127.
    Random,
    /// All at one of the two ends, by the neuron: odd ones −127, even ones 127.
    Extreme,
}

/// Pixels of a marker at rest, dilated, as the rendered sensor shows it.
const REST_AREA: u32 = 245;

/// The rest position of the sensor with the default preset, in whole pixels.
pub fn rest() -> Features {
    let px = |number: i64| number << 16;
    let [left, right, top, bottom] = [99, 220, 59, 180].map(px);
    let area = (right - left) * ((bottom - top) >> 16);
    let corners = [left, top, right, top, right, bottom, left, bottom];
    let middle = [(left + right) / 2, (top + bottom) / 2, area];
    features(std::array::from_fn(|i| {
        *corners.iter().chain(&middle).nth(i).unwrap_or(&0)
    }))
}

/// The file of a model with these layer widths (first 11, last 3), for QVGA frames of the default preset.
pub fn file(widths: &[u16], weights: Weights, output: OutputKind, seed: u64) -> Vec<u8> {
    let mut random = Random::new(seed);
    let layers = widths
        .windows(2)
        .map(|pair| layer(pair[0], pair[1], weights, &mut random));
    let spec = ModelSpec {
        conditions: conditions(),
        rest: Rest {
            features: rest(),
            areas: [REST_AREA; 4],
        },
        input: input_scaling(),
        layers: layers.collect(),
        output,
        range: CalibratedRange {
            magnitude: MicroNewtons(200_000),
            alpha: MilliDegrees(10_000),
            beta: MilliDegrees(8_000),
        },
        uncertainty: Uncertainty {
            lateral: MicroNewtons(900),
            normal: MicroNewtons(800),
        },
    };
    spec.encode()
        .expect("the numbers lie within the format's ranges")
}

fn conditions() -> Conditions {
    Conditions {
        preset: Preset::Ov7725,
        geometry: Geometry::preset(Preset::Ov7725, 320, 240),
        pixel_format: PixelFormat::Rgb565,
        threshold: HsvBox::RED,
        dilations: 1,
        centroid: CentroidEstimator::BinaryMask,
        contact: ContactReading::Force,
        origin: Origin::Simulated,
    }
}

/// One standard deviation, 4096 steps, is four pixels for a coordinate and 512 px² for the area.
fn input_scaling() -> InputScaling {
    let mut multipliers = [1 << 20; FEATURES];
    multipliers[FEATURES - 1] = 1 << 13;
    InputScaling {
        mean: rest(),
        multipliers,
        shifts: [26; FEATURES],
    }
}

fn layer(inputs: u16, outputs: u16, weights: Weights, random: &mut Random) -> LayerSpec {
    let neurons = usize::from(outputs);
    let row = |neuron: usize, random: &mut Random| -> Vec<i8> {
        (0..inputs)
            .map(|_| weight(weights, neuron, random))
            .collect()
    };
    // Keeps activations within 0–127 and outputs within a newton for most inputs: a sum has about √inputs · 70 · 4096
    // as its size in the first layer, √inputs · 70 · 60 in others.
    let first = usize::from(inputs) == FEATURES;
    let last = usize::from(outputs) == OUTPUTS;
    let shift = match (first, last) {
        (true, false) => 40,
        (false, false) => 37,
        (true, true) => 31,
        (false, true) => 25,
    };
    LayerSpec {
        inputs,
        outputs,
        weights: (0..neurons)
            .flat_map(|neuron| row(neuron, random))
            .collect(),
        biases: (0..neurons)
            .map(|_| random.between(-20_000, 20_000) as i32)
            .collect(),
        multipliers: (0..neurons)
            .map(|_| random.between(1 << 26, 1 << 28) as u32)
            .collect(),
        shifts: vec![shift; neurons],
    }
}

fn weight(weights: Weights, neuron: usize, random: &mut Random) -> i8 {
    match weights {
        Weights::Random => random.between(-127, 127) as i8,
        Weights::Extreme if neuron % 2 == 1 => -127,
        Weights::Extreme => 127,
    }
}
