//! Derives a model's uncertainties from its errors on frames that were not used to make it.
//!
//! Errors are larger for some forces than for others and have long tails. The noise of a centroid
//! depends on its place in the pixel grid, and each session has an error of its own. So they are
//! not averaged. Over |F|, a table holds the limit below which some 96 of 100 errors lie, as the
//! standard uncertainty of a normal distribution with that 95 % bound.

use anyhow::{Result, ensure};
use hivtac_sensor::force::model::Uncertainty as ChipUncertainty;
use serde::{Deserialize, Serialize};

use crate::data::loads::norm;
use crate::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use crate::evaluation::errors::angle_deg;

/// The part of errors that the 95 % bounds must contain on the rows that they are made from. It is
/// a little more than they promise, in view of future sessions.
const COVERED: f64 = 0.965;
/// The least weight of rows around a knot.
const FEWEST: f64 = 60.0;

const KNOTS: usize = ChipUncertainty::KNOTS;

/// Standard uncertainties over |F|, as in [`hivtac_sensor::force::model::Uncertainty`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Uncertainty {
    /// The distance between knots is 2 to the power of this, µN.
    pub step_bits: u8,
    /// Of the force's component across itself, at |F| = 0, one distance, two distances …, N.
    pub across_n: [f64; KNOTS],
    /// Of |F| at the same knots, N.
    pub along_n: [f64; KNOTS],
    /// Of each coordinate of the place at the same knots, mm; 0 in a model without places.
    #[serde(default, skip_serializing_if = "tells_no_place")]
    pub place_mm: [f64; KNOTS],
}

fn tells_no_place(place_mm: &[f64; KNOTS]) -> bool {
    *place_mm == [0.0; KNOTS]
}

/// The error of a force and of its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Miss {
    /// |F| found, N.
    pub found_n: f64,
    /// The angle between found and true force (radians) times |F| found, N.
    pub across_n: f64,
    /// Absolute value of |F| found minus |F| true, N.
    pub along_n: f64,
    /// Distance between the found and the true place, mm; 0 if the model gives none.
    pub place_mm: f64,
}

impl Miss {
    /// From a found and a true force, N.
    pub fn of(found: [f64; 3], truth: [f64; 3]) -> Self {
        let found_n = norm(found);
        // If one of them has size 0, there is no direction error.
        let angle = angle_deg(found, truth).unwrap_or(0.0).to_radians();
        Self {
            found_n,
            across_n: angle * found_n,
            along_n: (found_n - norm(truth)).abs(),
            place_mm: 0.0,
        }
    }

    /// With a place at this distance from the true one, mm.
    pub fn with_place_mm(self, place_mm: f64) -> Self {
        Self { place_mm, ..self }
    }
}

impl Uncertainty {
    /// From a model's errors on rows that were not used to make it, for forces up to `largest_n`.
    ///
    /// # Errors
    /// When there is no row.
    pub fn of(misses: &[Miss], largest_n: f64) -> Result<Self> {
        ensure!(
            !misses.is_empty(),
            "no row was held out: nothing says how uncertain the forces are"
        );
        let far = |bits: u8| f64::from((KNOTS as u32 - 1) << bits) * 1e-6;
        let step_bits = (0..27).find(|&bits| far(bits) >= largest_n).unwrap_or(27);
        let step_n = f64::from(1_u32 << step_bits) * 1e-6;
        let at = |of: fn(&Miss) -> f64, bound: f64| {
            let knot = |i| covering(misses, of, step_n * i as f64, step_n) / bound;
            std::array::from_fn(knot)
        };
        Ok(Self {
            step_bits,
            across_n: at(|miss| miss.across_n, DIRECTION_BOUND),
            along_n: at(|miss| miss.along_n, MAGNITUDE_BOUND),
            place_mm: at(|miss| miss.place_mm, PLACE_BOUND),
        })
    }
}

/// The limit below which [`COVERED`] of the errors near a force lie, rows weighted by nearness.
/// Includes rows from farther away where there are few.
fn covering(misses: &[Miss], of: fn(&Miss) -> f64, force_n: f64, step_n: f64) -> f64 {
    let all = misses.len() as f64;
    let mut reach = step_n;
    loop {
        let near = |miss: &Miss| 1.0 - (miss.found_n - force_n).abs() / reach;
        let mut near: Vec<(f64, f64)> = misses
            .iter()
            .map(|miss| (of(miss), near(miss)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect();
        let total: f64 = near.iter().map(|(_, weight)| weight).sum();
        if total >= FEWEST.min(0.5 * all) {
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            return quantile(&near, COVERED * total);
        }
        reach *= 1.5;
    }
}

/// The first value at which the weights of sorted values reach `wanted`.
fn quantile(sorted: &[(f64, f64)], wanted: f64) -> f64 {
    let mut sum = 0.0;
    let reached = sorted.iter().find(|(_, weight)| {
        sum += weight;
        sum >= wanted
    });
    reached.or(sorted.last()).map_or(0.0, |(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Errors in all directions whose spread changes with |F|: across 1 mN at 0 and 3 mN at 0.2 N,
    /// along a tenth of it.
    fn misses(count: usize) -> Vec<Miss> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut miss = || {
            let found_n: f64 = random.random_range(0.0..0.22);
            let sigma = 1e-3 + 0.01 * found_n;
            let mut rayleigh = || (-random.random_range(1e-12..1.0_f64).ln()).sqrt();
            let across_n = sigma * rayleigh();
            // A component of a two-dimensional normal distribution of variance 1.
            let along_n = 0.1 * sigma * std::f64::consts::SQRT_2 * rayleigh();
            // The place error in millimetres equals the error across in millinewtons.
            let place_mm = 1e3 * std::f64::consts::SQRT_2 * sigma * rayleigh();
            let turn: f64 = random.random_range(0.0..std::f64::consts::TAU);
            Miss {
                found_n,
                across_n,
                along_n: (along_n * turn.cos()).abs(),
                place_mm,
            }
        };
        (0..count).map(|_| miss()).collect()
    }

    #[test]
    fn it_is_what_a_normal_distribution_with_that_bound_has() {
        let found = Uncertainty::of(&misses(200_000), 0.2).unwrap();
        assert_eq!(found.step_bits, 14, "15 · 16.4 mN are 246 mN");
        // 96.5 of 100, although the bounds promise 95.
        let wider = [
            (-(1.0 - COVERED).ln()).sqrt() / DIRECTION_BOUND,
            2.1084 / MAGNITUDE_BOUND,
        ];
        for knot in 1..13 {
            let sigma = 1e-3 + 0.01 * 16_384e-6 * knot as f64;
            let across = found.across_n[knot] / (sigma * wider[0]);
            let along = found.along_n[knot] / (0.1 * sigma * wider[1]);
            assert!((0.97..1.03).contains(&across), "knot {knot}: {across}");
            assert!((0.96..1.04).contains(&along), "knot {knot}: {along}");
            let place = found.place_mm[knot] / (1e3 * sigma * wider[0]);
            assert!((0.97..1.03).contains(&place), "knot {knot}: {place}");
        }
    }

    #[test]
    fn where_there_are_few_rows_farther_ones_count() {
        let few = misses(30);
        let found = Uncertainty::of(&few, 0.2).unwrap();
        let largest = few.iter().map(|miss| miss.across_n).fold(0.0, f64::max) / DIRECTION_BOUND;
        assert!(found.across_n.iter().all(|&n| n > 0.0 && n <= largest));
        let one = Uncertainty::of(&few[..1], 0.2).unwrap();
        assert_eq!(one.across_n, [few[0].across_n / DIRECTION_BOUND; KNOTS]);
        assert!(Uncertainty::of(&[], 0.2).is_err());
    }

    #[test]
    fn a_miss_is_reported_along_and_across_the_force() {
        let miss = Miss::of([0.0, 0.003, -0.1], [0.0, 0.0, -0.1]);
        assert!((miss.across_n - 0.003).abs() < 2e-6, "{miss:?}");
        assert!((miss.along_n - 45e-6).abs() < 1e-7, "{miss:?}");
        let opposite = Miss::of([0.0, 0.0, 1e-3], [0.0, 0.0, -1e-3]);
        assert!((opposite.across_n - std::f64::consts::PI * 1e-3).abs() < 1e-12);
        assert_eq!(Miss::of([0.0; 3], [0.0, 0.0, -1e-3]).across_n, 0.0);
    }
}
