//! Standard uncertainties of a load that come from what is not known of the unit, beside those that
//! the markers' noise makes: interpolated between sizes and places.

use super::pose::{Pose, limited};
use super::terms::Limits;

/// Sizes at which they are told, evenly from nothing to the largest.
pub const SIZES: usize = 5;
/// Places along x, and along y, at which they are, evenly from one end to the other.
pub const PLACES: usize = 9;
/// Numbers at each: of the force across itself, |F|, the place and the residual.
pub const PARTS: usize = 4;
/// Sizes and places together.
pub const KNOTS: usize = SIZES * PLACES * PLACES;
/// Bytes of a number of every part.
const KNOT: usize = 2 * PARTS;

/// What is not known of a unit, borrowed from a model file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystematicGrid<'a> {
    end_mm: f32,
    /// What the numbers of each part are steps of.
    steps: [f32; PARTS],
    /// By size, place along y and place along x: a little-endian u16 of each part.
    knots: &'a [[u8; KNOT]],
}

/// Standard uncertainties that come from what is not known of the unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Systematic {
    /// Of the force across itself, both ways together, N.
    pub across_n: f32,
    /// Of |F|, as sizes.
    pub size: f32,
    /// Of each coordinate of the place, mm.
    pub place_mm: f32,
    /// Of what is left over where it is largest, in parts of the noise's.
    pub residual: f32,
}

impl<'a> SystematicGrid<'a> {
    /// Of places to `end_mm` either way, and [`KNOTS`] times [`PARTS`] numbers of 16 bits in
    /// `steps`; `None` of another count, or of an end or a step that is none.
    pub fn new(end_mm: f32, steps: [f32; PARTS], knots: &'a [u8]) -> Option<SystematicGrid<'a>> {
        let (knots, rest) = knots.as_chunks();
        let sound = (0.1..=100.0).contains(&end_mm)
            && steps.iter().all(|step| (0.0..=1.0).contains(step))
            && rest.is_empty()
            && knots.len() == KNOTS;
        sound.then_some(SystematicGrid {
            end_mm,
            steps,
            knots,
        })
    }

    /// At a load; beyond the last size or place as there.
    pub fn at(&self, pose: &Pose, limits: &Limits) -> Systematic {
        let along = |at_mm: f32| between(0.5 + 0.5 * at_mm / self.end_mm, PLACES);
        let size = between(pose.size / limits.size, SIZES);
        let [x, y] = pose.place_mm.map(along);
        let mut sums = [0.0; PARTS];
        for (i, of_size) in size {
            for (j, of_y) in y {
                for (k, of_x) in x {
                    let knot = self.knots.get((i * PLACES + j) * PLACES + k);
                    let weight = of_size * of_y * of_x;
                    let parts = knot.map_or(&[][..], |knot| knot.as_chunks::<2>().0);
                    for (sum, part) in sums.iter_mut().zip(parts) {
                        *sum += weight * f32::from(u16::from_le_bytes(*part));
                    }
                }
            }
        }
        for (sum, step) in sums.iter_mut().zip(self.steps) {
            *sum *= step;
        }
        let [across_n, size, place_mm, residual] = sums;
        Systematic {
            across_n,
            size,
            place_mm,
            residual,
        }
    }
}

/// The two of `count` even knots from 0 to 1 that a value lies between, and how much each counts.
fn between(value: f32, count: usize) -> [(usize, f32); 2] {
    let last = count - 1;
    let at = limited(value, 0.0, 1.0) * last as f32;
    let first = (at as usize).min(last - 1);
    let second = at - first as f32;
    [(first, 1.0 - second), (first + 1, second)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const LIMITS: Limits = Limits {
        size: 0.8,
        tilt: 0.67,
    };
    const STEPS: [f32; PARTS] = [1e-4, 2e-4, 3e-4, 4e-4];

    fn pose(size: f32, place_mm: [f32; 2]) -> Pose {
        Pose {
            size,
            tilt: [0.1, -0.2],
            place_mm,
        }
    }

    fn parts(of: &Systematic) -> [f32; PARTS] {
        [of.across_n, of.size, of.place_mm, of.residual]
    }

    /// Knots of numbers by size, y, x and part.
    fn knots(number: impl Fn([usize; 4]) -> u16) -> Vec<u8> {
        let at = |k: usize| {
            let (knot, part) = (k / PARTS, k % PARTS);
            let (x, line) = (knot % PLACES, knot / PLACES);
            [line / PLACES, line % PLACES, x, part]
        };
        (0..KNOTS * PARTS)
            .flat_map(|k| number(at(k)).to_le_bytes())
            .collect()
    }

    /// What is linear along each axis comes out as it is, at knots, between them and beyond.
    #[test]
    fn planes_come_back() {
        let number = |[size, y, x, part]: [usize; 4]| (50 * size + 7 * y + 900 * x + part) as u16;
        let bytes = knots(number);
        let grid = SystematicGrid::new(4.0, STEPS, &bytes).unwrap();
        for (size, [x, y]) in [
            (0.0, [-4.0, -4.0]),
            (0.2, [1.0, -2.0]),
            (0.53, [0.3, 3.9]),
            (0.8, [4.0, 4.0]),
            (1.1, [9.0, -7.0]),
        ] {
            let told = parts(&grid.at(&pose(size, [x, y]), &LIMITS));
            let along = |at: f32| at.clamp(-4.0, 4.0) + 4.0;
            let sum = 250.0 * size.min(0.8) + 7.0 * along(y) + 900.0 * along(x);
            for (k, told) in told.into_iter().enumerate() {
                let expected = STEPS[k] * (sum + k as f32);
                assert!(
                    (told - expected).abs() < 1e-5 * (1.0 + expected),
                    "{told} {expected}"
                );
            }
        }
    }

    proptest! {
        /// Whatever the numbers and the load are: never below nothing, never above the largest
        /// number.
        #[test]
        fn it_stays_between_its_numbers(
            seed in any::<u16>(),
            size in prop_oneof![-1.0f32..2.0, any::<f32>()],
            x in prop_oneof![-6.0f32..6.0, any::<f32>()],
            y in -6.0f32..6.0,
        ) {
            let number = |[size, y, x, part]: [usize; 4]| {
                let k = (size * PLACES + y) * PLACES + x + 400 * part;
                seed.wrapping_mul(k as u16 | 1)
            };
            let bytes = knots(number);
            let grid = SystematicGrid::new(4.0, STEPS, &bytes).unwrap();
            let load = pose(size, [x, y]);
            for (told, step) in parts(&grid.at(&load, &LIMITS)).into_iter().zip(STEPS) {
                let no_number = size.is_nan() || x.is_nan();
                prop_assert!(no_number || (0.0..=65_535.1 * step).contains(&told), "{told}");
            }
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let bytes = knots(|_| 3);
        let is_sound = |end_mm, steps, bytes| SystematicGrid::new(end_mm, steps, bytes).is_some();
        assert!(is_sound(4.0, STEPS, &bytes[..]));
        assert!(!is_sound(4.0, STEPS, &bytes[1..]) && !is_sound(4.0, STEPS, &bytes[8..]));
        for end_mm in [0.0, -4.0, 101.0, f32::NAN] {
            assert!(!is_sound(end_mm, STEPS, &bytes[..]), "{end_mm}");
        }
        for step in [-1e-4, 1.1, f32::NAN, f32::INFINITY] {
            assert!(
                !is_sound(4.0, [1e-4, 1e-4, step, 1e-4], &bytes[..]),
                "{step}"
            );
        }
    }
}
