//! Runs the quantized network. This is the portable definition that every kernel matches bit for
//! bit.
//!
//! Every number is an integer, and every rescaling rounds once, half up: `rescale(a, m, s) = (a·m +
//! 2^(s−1)) >> s`.
//!
//! 1. Input: `x_i = sat16(rescale(f_i − tare_i + rest_i − mean_i, m_i, s_i))`. The difference is
//!    first limited to ±(2³⁸ − 1), which no two frames of up to 800 × 800 px exceed. With m < 2²⁴
//!    the product stays below 2⁶².
//! 2. Hidden layer: `acc_j = bias_j + Σ w_ji·x_i`, `a_j = clamp(rescale(acc_j, m_j, s_j), 0, A)`
//!    with the layer's largest activation A.
//! 3. Output layer: `y_j = sat32(rescale(acc_j, m_j, s_j))`.
//!
//! [`Model::parse`] proves that `acc_j` fits `i32`; with m < 2³¹ the product stays below 2⁶².

use crate::force::features::{COORDINATES, FEATURES, Features};
use crate::force::kernels::{Inputs, Sums, activate, multiply};
use crate::force::layer::{Layer, MAX_WIDTH};
use crate::force::model::{InputScaling, Model, OUTPUTS, PLACE_OUTPUTS};
use crate::force::rescale::{rescale_input, rescale_small_input, rescale_sum};
use hivtac_terms::fixed::Q;

/// Buffers for the numbers of one layer.
#[derive(Clone, Debug)]
pub struct Network {
    /// The inputs of the layer.
    inputs: Inputs,
    /// The sums of its rows.
    sums: Sums,
}

/// The network's outputs for one set of features.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// The force, in the units of the model's output kind.
    pub values: [i32; OUTPUTS],
    /// The place, p_x and p_y in µm; 0 if the model has no place outputs.
    pub place: [i32; PLACE_OUTPUTS],
    /// True if an input reached the limits of `i16` (8 σ): far from all training data.
    pub input_saturated: bool,
}

impl Network {
    /// Buffers for any model.
    pub const fn new() -> Network {
        Network {
            inputs: Inputs::new(),
            sums: [0; MAX_WIDTH],
        }
    }

    /// Runs `model` on `features`, relative to the rest position `tare`.
    pub fn run(&mut self, model: &Model<'_>, features: &Features, tare: &Features) -> Output {
        let scaled = scale_inputs(&model.input, features, tare, &model.rest.features);
        let inputs = self.inputs.values_mut().iter_mut().zip(&scaled);
        inputs.for_each(|(input, scaled)| *input = scaled.bits());
        let mut outputs = [0; OUTPUTS + PLACE_OUTPUTS];
        // A parsed model has at least one layer.
        if let Some((last, hidden)) = model.layers().split_last() {
            for layer in hidden {
                multiply(layer, &mut self.inputs, &mut self.sums);
                activate(layer, &self.sums, &mut self.inputs);
            }
            multiply(last, &mut self.inputs, &mut self.sums);
            output(last, &self.sums, &mut outputs);
        }
        let [x, y, z, place @ ..] = outputs;
        Output {
            values: [x, y, z],
            place,
            input_saturated: scaled
                .iter()
                .any(|x| x.bits() == i16::MIN || x.bits() == i16::MAX),
        }
    }
}

impl Default for Network {
    fn default() -> Self {
        Network::new()
    }
}

/// Step 1: standardized inputs, σ.
pub fn scale_inputs(
    scaling: &InputScaling,
    features: &Features,
    tare: &Features,
    rest: &Features,
) -> [Q<12, i16>; FEATURES] {
    let mean = &scaling.mean;
    let mut inputs = [Q::default(); FEATURES];
    let all = [features, tare, rest, mean].map(Features::coordinates);
    for i in 0..COORDINATES {
        let [feature, tare, rest, mean] =
            [all[0][i], all[1][i], all[2][i], all[3][i]].map(|px| px.0);
        let (multiplier, shift) = (scaling.multipliers[i], scaling.shifts[i]);
        let difference = feature
            .checked_sub(tare)
            .and_then(|moved| moved.checked_add(rest));
        let scaled = match difference.and_then(|now| now.checked_sub(mean)) {
            Some(difference) => rescale_small_input(difference, multiplier, shift),
            None => {
                let [feature, tare, rest, mean] = [feature, tare, rest, mean].map(i64::from);
                rescale_input(feature - tare + rest - mean, multiplier, shift)
            }
        };
        inputs[i] = Q::from_bits(scaled);
    }
    let moved = features.rect_area.saturating_sub(tare.rect_area);
    let difference = moved
        .saturating_add(rest.rect_area)
        .saturating_sub(mean.rect_area);
    let (multiplier, shift) = (
        scaling.multipliers[COORDINATES],
        scaling.shifts[COORDINATES],
    );
    inputs[COORDINATES] = Q::from_bits(rescale_input(difference.bits(), multiplier, shift));
    inputs
}

/// The rescaling of step 3.
fn output(layer: &Layer<'_>, sums: &Sums, outputs: &mut [i32; OUTPUTS + PLACE_OUTPUTS]) {
    for ((row, sum), output) in layer.rows().zip(sums).zip(outputs) {
        *output = rescale_sum(sum + row.bias, row.multiplier, row.shift);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::model::{
        encode::LayerSpec, encode::ModelSpec, samples::place_spec, samples::spec, samples::spec16,
    };
    use hivtac_terms::units::Px;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    /// The arithmetic of `docs/architecture.md` in 128 bits, which cannot overflow.
    fn reference(spec: &ModelSpec, features: &Features, tare: &Features) -> Vec<i128> {
        let rescale = |value: i128, multiplier: u32, shift: u8| {
            let exact = value * i128::from(multiplier);
            let unit = 1i128 << shift;
            // Half up: floor(exact / unit + ½).
            (2 * exact + unit).div_euclid(2 * unit)
        };
        let (rest, mean) = (spec.rest.features.to_array(), spec.input.mean.to_array());
        let (features, tare) = (features.to_array(), tare.to_array());
        let number = |feature: Q<16, i64>| i128::from(feature.bits());
        let mut values: Vec<i128> = (0..FEATURES)
            .map(|i| {
                let moved = number(features[i]) - number(tare[i]);
                let difference = moved + number(rest[i]) - number(mean[i]);
                let limited = difference.clamp(-(1 << 38) + 1, (1 << 38) - 1);
                rescale(limited, spec.input.multipliers[i], spec.input.shifts[i])
                    .clamp(-32_768, 32_767)
            })
            .collect();
        for (index, layer) in spec.layers.iter().enumerate() {
            let last = index + 1 == spec.layers.len();
            values = (0..usize::from(layer.outputs))
                .map(|row| {
                    let inputs = usize::from(layer.inputs);
                    let weights = &layer.weights[row * inputs..(row + 1) * inputs];
                    let products = weights.iter().zip(&values).map(|(w, x)| i128::from(*w) * x);
                    let sum = i128::from(layer.biases[row]) + products.sum::<i128>();
                    let value = rescale(sum, layer.multipliers[row], layer.shifts[row]);
                    if last {
                        value.clamp(i32::MIN.into(), i32::MAX.into())
                    } else {
                        value.clamp(0, layer.largest_activation.into())
                    }
                })
                .collect();
        }
        values
    }

    /// All outputs of the model.
    fn outputs(model: &Model<'_>, output: &Output) -> Vec<i128> {
        let all = output.values.iter().chain(&output.place);
        all.take(model.output.count())
            .map(|&value| value.into())
            .collect()
    }

    fn check(spec: &ModelSpec, features: &Features, tare: &Features) -> Output {
        let bytes = spec.encode().unwrap();
        let model = Model::parse(&bytes).unwrap();
        let mut network = Network::new();
        let output = network.run(&model, features, tare);
        let expected = reference(spec, features, tare);
        assert_eq!(outputs(&model, &output), expected);
        if !model.output.tells_place() {
            assert_eq!(output.place, [0; PLACE_OUTPUTS]);
        }
        assert_eq!(
            network.run(&model, features, tare),
            output,
            "buffers keep nothing"
        );
        output
    }

    /// Positions spread over a frame.
    fn features(seed: u64) -> Features {
        let mut state = seed;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            Px((state >> 39) as i32)
        };
        let mut features = Features {
            centroids: [(); 4].map(|()| (next(), next())).into(),
            ..Features::default()
        };
        features.rect_center = (next(), next());
        features.rect_area = Q::from(next()) * 400;
        features
    }

    /// Random weights as large as their width allows, and for int16 also the proof.
    fn randomize(layer: &mut LayerSpec, largest_input: u32, random: &mut impl FnMut() -> u32) {
        let proven = (1 << 30) / largest_input / u32::from(layer.inputs);
        let largest = proven.min(layer.weight_width.largest_weight().into());
        let mut weight = || (random() % (2 * largest + 1)) as i32 - largest as i32;
        layer.weights.iter_mut().for_each(|w| *w = weight() as i16);
        for bias in &mut layer.biases {
            *bias = random() as i32 >> 8;
        }
        for multiplier in &mut layer.multipliers {
            *multiplier = 1 + random() % ((1 << 31) - 1);
        }
        for shift in &mut layer.shifts {
            *shift = (28 + random() % 24) as u8;
        }
    }

    fn random_spec(mut spec: ModelSpec, seed: u64) -> ModelSpec {
        let mut state = seed;
        let mut random = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(7);
            (state >> 32) as u32
        };
        let mut largest = 1 << 15;
        for layer in &mut spec.layers {
            randomize(layer, largest, &mut random);
            largest = layer.largest_activation.into();
        }
        spec.input.multipliers = [0; FEATURES].map(|_: u32| 1 + random() % ((1 << 24) - 1));
        spec.input.shifts = [0; FEATURES].map(|_: u8| (20 + random() % 20) as u8);
        spec
    }

    #[test]
    fn the_small_and_the_papers_network_run() {
        for widths in [
            &[11, 64, 64, 3][..],
            &[11, 512, 512, 512, 3],
            &[11, 3],
            &[11, 1, 3],
        ] {
            for seed in 0..4 {
                for spec in [spec(widths), spec16(widths, 127), spec16(widths, 4095)] {
                    let spec = random_spec(spec, seed);
                    check(&spec, &features(seed), &features(seed + 9));
                }
            }
        }
    }

    #[test]
    fn a_place_comes_after_the_force() {
        for widths in [&[11, 5][..], &[11, 64, 64, 5]] {
            let spec = random_spec(place_spec(widths), 3);
            let found = check(&spec, &features(3), &features(4));
            assert_ne!(found.place, [0; PLACE_OUTPUTS]);
        }
    }

    /// Every weight, input and activation at its limit, in the widest layers.
    #[test]
    fn extremes_of_every_number() {
        for weight in [-127, 127] {
            let mut spec = spec(&[11, 512, 512, 512, 3]);
            for layer in &mut spec.layers {
                layer.weights.fill(weight);
                layer.biases.fill(i32::from(weight) * 1000);
                layer.multipliers.fill((1 << 31) - 1);
                // The largest values are not scaled down.
                layer.shifts.fill(1);
            }
            spec.input.multipliers = [(1 << 24) - 1; FEATURES];
            spec.input.shifts = [1; FEATURES];
            for sign in [-1, 1] {
                let far = 800 << 16;
                let extreme = Features {
                    centroids: [(Px(sign * far), Px(sign * far)); 4].into(),
                    rect_area: Q::from_int(i64::from(sign) * 640_000),
                    ..Features::default()
                };
                let output = check(&spec, &extreme, &Features::default());
                assert!(output.input_saturated);
            }
        }
    }

    #[test]
    fn any_number_saturates_and_none_overflows() {
        let mut spec = spec(&[11, 3]);
        spec.layers[0].multipliers = vec![(1 << 31) - 1; 3];
        spec.layers[0].shifts = vec![1; 3];
        spec.input.shifts = [1; FEATURES];
        let extreme = |value: i32, area: i64| Features {
            centroids: [(Px(value), Px(value)); 4].into(),
            rect_center: (Px(value), Px(value)),
            rect_area: Q::from_bits(area),
        };
        let values = [(i32::MIN, i64::MIN), (i32::MAX, i64::MAX), (0, 0)];
        for (a, area_a) in values {
            for (b, area_b) in values {
                let bytes = spec.encode().unwrap();
                let model = Model::parse(&bytes).unwrap();
                let far = (extreme(a, area_a), extreme(b, area_b));
                let found = Network::new().run(&model, &far.0, &far.1);
                // The reference does not saturate the difference itself, which matters only beyond
                // ±2⁶³.
                if area_a != i64::MIN && area_b != i64::MIN {
                    assert_eq!(outputs(&model, &found), reference(&spec, &far.0, &far.1));
                }
            }
        }
    }

    #[test]
    fn an_input_at_its_limit_is_reported() {
        let mut spec = spec(&[11, 3]);
        spec.input.mean = spec.rest.features;
        spec.input.multipliers = [1; FEATURES];
        spec.input.shifts = [1; FEATURES];
        let at = |x: i32| Features {
            rect_center: (Px(x), Px(0)),
            ..Features::default()
        };
        let reported = |x| check(&spec, &at(x), &at(0)).input_saturated;
        assert!(
            !reported(2 * 32_766)
                && reported(2 * 32_767)
                && reported(-2 * 32_768)
                && reported(i32::MAX)
        );
        assert!(!reported(-2 * 32_767));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn it_equals_the_reference(
            hidden in prop::collection::vec(1u16..=70, 0..4),
            seed: u64,
        ) {
            let widths: Vec<u16> = [11].into_iter().chain(hidden).chain([3]).collect();
            check(&random_spec(spec(&widths), seed), &features(seed), &features(!seed));
        }

        #[test]
        fn int16_equals_the_reference(
            hidden in prop::collection::vec(1u16..=70, 0..4),
            largest in 1u16..=32_767,
            seed: u64,
        ) {
            let widths: Vec<u16> = [11].into_iter().chain(hidden).chain([3]).collect();
            let spec = random_spec(spec16(&widths, largest), seed);
            check(&spec, &features(seed), &features(!seed));
        }

        /// The input is features − tare + rest: moving features and tare equally changes nothing.
        #[test]
        fn a_tare_moves_no_calibration(seed: u64, dx in -100_000i32..100_000) {
            let spec = random_spec(spec(&[11, 8, 3]), seed);
            let (mut now, mut tare) = (features(seed), features(seed + 1));
            let before = check(&spec, &now, &tare);
            for features in [&mut now, &mut tare] {
                features.centroids.iter_mut().for_each(|c| c.0.0 += dx);
                features.rect_center.0.0 += dx;
            }
            prop_assert_eq!(check(&spec, &now, &tare), before);
        }
    }
}
