//! Measures the worst cases of the moments: the largest frame, and the rounding of centroids,
//! against their bounds. Each test prints a row of `docs/numerics.md`.

use std::{format, println};

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use crate::markers::blob::Blob;
use crate::markers::runs::Run;
use crate::markers::tables::Weights;
use hivtac_terms::units::Px;

/// Columns and rows of the largest frame.
const SIDE: u16 = 800;
/// The largest weight of a pixel.
const LARGEST_WEIGHT: u32 = 127;

/// The largest frame with every pixel set and of the largest weight.
fn full() -> Blob {
    let columns = u32::from(SIDE);
    let weights = Weights {
        sum: columns * LARGEST_WEIGHT,
        sum_x: LARGEST_WEIGHT * columns * (columns - 1) / 2,
    };
    let run = Run {
        x0: 0,
        x1: SIDE - 1,
    };
    let mut blob = Blob::of_run(run, 0, weights);
    (1..SIDE).for_each(|y| blob.add(&Blob::of_run(run, y, weights)));
    blob
}

#[test]
fn the_largest_frames_moments_are_exact() {
    let blob = full();
    // Σxᵃyᵇ over a square is the product of two sums of powers.
    let sum = |power: u32| (0..u128::from(SIDE)).map(|x| x.pow(power)).sum::<u128>();
    for (found, a, b) in [
        (u64::from(blob.area), 0, 0),
        (blob.sum_x, 1, 0),
        (blob.sum_y, 0, 1),
        (blob.sum_xx, 2, 0),
        (blob.sum_xy, 1, 1),
        (blob.sum_yy, 0, 2),
        (blob.sum_xxx, 3, 0),
        (blob.sum_xxy, 2, 1),
        (blob.sum_xyy, 1, 2),
        (blob.sum_yyy, 0, 3),
    ] {
        assert_eq!(u128::from(found), sum(a) * sum(b), "x^{a} y^{b}");
    }
    let weight = u128::from(LARGEST_WEIGHT);
    assert_eq!(u128::from(blob.weight), weight * sum(0) * sum(0));
    assert_eq!(u128::from(blob.weight_x), weight * sum(1) * sum(0));
    assert_eq!(u128::from(blob.weight_y), weight * sum(1) * sum(0));
    let bits = |value: f64| format!("2^{:.2}", value.log2());
    println!(
        "| third moments | 800 × 800, every pixel set | 2⁶⁴ (proven: 2⁴⁹) | {} |",
        bits(blob.sum_xxx as f64)
    );
}

/// The error of a mean, in steps of 1/65,536 px.
fn error(mean: Px, sum: u64, count: u64) -> f64 {
    let off = i128::from(mean.0) * i128::from(count) - (i128::from(sum) << Px::FRACTION_BITS);
    (off as f64 / count as f64).abs()
}

#[test]
fn a_centroid_is_the_nearest_step() {
    let run = (0..SIDE, 0..SIDE, 0..SIDE, 0..LARGEST_WEIGHT);
    let blobs = proptest::collection::vec(run, 1..30).prop_map(|runs| {
        let one = |(a, b, y, weight): (u16, u16, u16, u32)| {
            let (x0, x1) = (a.min(b), a.max(b));
            let columns = (x0..=x1).map(u32::from);
            let weights = Weights {
                sum: columns.clone().map(|x| (weight + x) % 128).sum(),
                sum_x: columns.map(|x| x * ((weight + x) % 128)).sum(),
            };
            Blob::of_run(Run { x0, x1 }, y, weights)
        };
        let blobs = runs.into_iter().map(one);
        blobs.reduce(|mut sum, blob| {
            sum.add(&blob);
            sum
        })
    });
    let worst = core::cell::Cell::new(0.0_f64);
    let cases = 20_000;
    let mut runner = TestRunner::new(Config {
        cases,
        failure_persistence: None,
        ..Config::default()
    });
    let measured = runner.run(&blobs, |blob| {
        let blob = blob.unwrap_or_else(full);
        let area = u64::from(blob.area);
        let (x, y) = blob.centroid();
        let mut errors = std::vec![error(x, blob.sum_x, area), error(y, blob.sum_y, area)];
        if let Some((x, y)) = blob.weighted_centroid() {
            let weight = u64::from(blob.weight);
            errors.extend([
                error(x, blob.weight_x, weight),
                error(y, blob.weight_y, weight),
            ]);
        }
        for off in errors {
            prop_assert!(off <= 0.5, "{off}");
            worst.set(worst.get().max(off));
        }
        Ok(())
    });
    measured.unwrap();
    println!(
        "| centroid, both estimators | {cases} random blobs of the largest frame | \
         ½ step of 1/65,536 px | {:.6} steps |",
        worst.get()
    );
}
