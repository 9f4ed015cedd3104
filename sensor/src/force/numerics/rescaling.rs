//! Measures requantization against exact rational arithmetic, and accumulators at their limits.

use std::format;
use std::vec::Vec;

use super::row;
use crate::force::features::{FEATURES, Features};
use crate::force::model::{Model, samples::spec};
use crate::force::network::Network;
use crate::force::rescale::{rescale_input, rescale_sum};
use hivtac_terms::units::Px;

/// Multipliers that the exporter can produce with a shift. They are as large as their `bits` allow;
/// smaller ones occur only at the largest shift. All powers of two with their neighbours, and 2048
/// more, evenly spaced over the upper half.
fn multipliers(bits: u32, shift: u8) -> Vec<u32> {
    let half = 1_u32 << (bits - 1);
    let last = half + (half - 1);
    let step = half / 2048;
    let mut all: Vec<u32> = (0..2048).map(|i| half + i * step + i % 7).collect();
    all.extend([half, half + 1, half + 2, last - 2, last - 1, last]);
    if shift == 62 {
        let powers = (0..bits).flat_map(|power| [(1 << power) - 1, 1 << power, (1 << power) + 1]);
        all.extend(powers.filter(|&m| m >= 1 && m <= last));
    }
    all
}

/// Values at the ends, at powers of two with their neighbours, and on both sides of where the
/// product is half way between two results.
fn values(multiplier: u32, shift: u8, limit: i64) -> Vec<i64> {
    let mut all: Vec<i64> = (0..40)
        .flat_map(|power| [(1_i64 << power) - 1, 1 << power, (1 << power) + 1])
        .filter(|&value| value <= limit)
        .flat_map(|value| [value, -value])
        .chain([limit, -limit])
        .collect();
    for result in [0_i128, 1, 2, 63, 126, 127, 4095, 100_000, 1 << 20] {
        let half_way = ((2 * result + 1) << shift) / (2 * i128::from(multiplier));
        for near in -1..=1 {
            if let Ok(value) = i64::try_from(half_way + near)
                && value <= limit
            {
                all.extend([value, -value]);
            }
        }
    }
    all
}

/// The error of `found` for value · multiplier / 2^shift, in units of the last place; `None` if it
/// is saturated.
fn error(found: i64, value: i64, multiplier: u32, shift: u8, limits: [i64; 2]) -> Option<f64> {
    let exact = i128::from(value) * i128::from(multiplier);
    let rounded = (2 * exact + (1 << shift)) >> (shift + 1);
    let limited = rounded.clamp(limits[0].into(), limits[1].into());
    assert_eq!(
        i128::from(found),
        limited,
        "{value}·{multiplier} / 2^{shift}"
    );
    let off = (i128::from(found) << shift) - exact;
    (limited == rounded).then(|| (off as f64 / (1_i128 << shift) as f64).abs())
}

#[test]
fn requantization_is_the_nearest_integer() {
    let (mut tried, mut worst) = (0_u64, 0.0_f64);
    for shift in 1..=62 {
        for multiplier in multipliers(31, shift) {
            for value in values(multiplier, shift, i32::MAX.into()) {
                let found = rescale_sum(value as i32, multiplier, shift);
                let limits = [i32::MIN.into(), i32::MAX.into()];
                tried += 1;
                let off = error(found.into(), value, multiplier, shift, limits);
                worst = worst.max(off.unwrap_or(0.0));
            }
        }
    }
    assert!(worst <= 0.5, "{worst}");
    let tried = format!("all shifts 1–62, up to 2,150 multipliers each, {tried} sums");
    row(
        "requantization of a sum",
        tried,
        "½ step",
        format!("{worst:.9}"),
    );
}

#[test]
fn inputs_are_the_nearest_integer() {
    let (mut tried, mut worst) = (0_u64, 0.0_f64);
    for shift in 1..=62 {
        for multiplier in multipliers(24, shift) {
            for value in values(multiplier, shift, (1 << 38) - 1) {
                let found = rescale_input(value, multiplier, shift);
                let limits = [i16::MIN.into(), i16::MAX.into()];
                tried += 1;
                let off = error(found.into(), value, multiplier, shift, limits);
                worst = worst.max(off.unwrap_or(0.0));
            }
        }
    }
    assert!(worst <= 0.5, "{worst}");
    let tried = format!("all shifts 1–62, up to 2,130 multipliers each, {tried} differences");
    row(
        "standardization of an input",
        tried,
        "½ step (σ/8192)",
        format!("{worst:.9}"),
    );
}

/// Every int8 weight at ±127 over 512 inputs of 127: the sum that the kernels' composite lanes must
/// hold, too.
#[test]
fn the_widest_int8_sum_is_exact() {
    for sign in [-1, 1_i16] {
        let mut spec = spec(&[11, 512, 512, 3]);
        for (index, layer) in spec.layers.iter_mut().enumerate() {
            // The first layer only makes all activations 127.
            layer
                .weights
                .fill(if index == 2 { 127 * sign } else { 127 });
            layer.biases.fill(0);
            (layer.multipliers, layer.shifts) = (
                std::vec![1 << 30; layer.outputs.into()],
                std::vec![30; layer.outputs.into()],
            );
        }
        spec.input.multipliers = [1 << 23; FEATURES];
        spec.input.shifts = [1; FEATURES];
        let bytes = spec.encode().unwrap();
        let model = Model::parse(&bytes).unwrap();
        let far = Features {
            centroids: [(Px(800 << 16), Px(800 << 16)); 4].into(),
            ..Features::default()
        };
        let output = Network::new().run(&model, &far, &Features::default());
        let largest = 512 * 127 * 127 * i32::from(sign);
        assert_eq!(output.values, [largest; 3]);
    }
    let sum = 512.0 * 127.0 * 127.0_f64;
    row(
        "int8 accumulator",
        "512 weights of ±127 on activations of 127".into(),
        "2³¹ (kernels’ lanes: 2²³)",
        format!("±{sum} = 2^{:.4}", sum.log2()),
    );
}
