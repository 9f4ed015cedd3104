//! Numbers that depend on a load: splines over its place, sums of terms in its size and tilt.
//!
//! Coefficients are steps of 16 bits of a size for each output and term. Along both axes they are
//! summed up in integers, which cannot overflow whatever a file says (`kernels::spline`); what is
//! left is single precision.

use super::axis::{Axis, ONE, Weights};
use super::terms::{MOST_TERMS, Sizes, Terms, Tilts};
use crate::kernels::{Factors, Parts, spline};
use heapless::Vec;

/// Steps that a sum over both axes is in parts of: what weights are parts of, squared, / 2¹⁶.
const SUM: f32 = 65_536.0 / (ONE * ONE);

/// Outputs, each a sum of terms whose coefficients are splines over the place. Borrowed from a
/// file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table<'a> {
    axis: Axis,
    terms: Terms,
    outputs: usize,
    /// The size of a step by output and term, f32 each.
    sizes: &'a [[u8; 4]],
    /// By node along y, output, term and node along x, i16 each.
    steps: &'a [u8],
}

/// A place on a table's axes.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Along x.
    pub x: Weights,
    /// Along y.
    pub y: Weights,
}

/// What a step of each of an output's terms is under a load, with its slopes by size and by tilt
/// along x and y.
#[derive(Clone, Debug, Default)]
pub struct Steps(Vec<Factors, MOST_TERMS>);

/// An output with its slopes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// The output.
    pub value: f32,
    /// Its slopes by size, tilt along x and y (1/rad), place along x and y (1/mm).
    pub slopes: [f32; 5],
}

impl<'a> Table<'a> {
    /// Of these bytes, as many as [`Table::lengths`] says; `None` of others, or when the size of a
    /// step is no number.
    pub fn new(
        axis: Axis,
        terms: Terms,
        outputs: usize,
        sizes: &'a [u8],
        steps: &'a [u8],
    ) -> Option<Table<'a>> {
        let fits = Table::lengths(&axis, &terms, outputs) == [sizes.len(), steps.len()];
        let sizes = sizes.as_chunks().0;
        let sound = sizes.iter().all(|size| {
            let size = f32::from_le_bytes(*size);
            (0.0..=1.0).contains(&size)
        });
        let table = Table {
            axis,
            terms,
            outputs,
            sizes,
            steps,
        };
        (fits && sound).then_some(table)
    }

    /// Bytes of a table's sizes and of its steps.
    pub fn lengths(axis: &Axis, terms: &Terms, outputs: usize) -> [usize; 2] {
        let rows = outputs * terms.count();
        [4 * rows, 2 * rows * axis.count() * axis.count()]
    }

    /// Its axis, the same along x and y.
    pub fn axis(&self) -> &Axis {
        &self.axis
    }

    /// Writes down what steps of an output's terms are under a load.
    pub fn set(&self, steps: &mut Steps, output: usize, sizes: &Sizes, tilts: &Tilts) {
        steps.0.clear();
        let of_output = self.sizes.get(output * self.terms.count()..);
        let mut terms = of_output.unwrap_or_default().iter();
        let mut tilts = tilts.0.iter();
        for (count, groups) in self.terms.sizes_of_degrees() {
            for [whole, by_a, by_b] in tilts.by_ref().take(groups) {
                let sizes = sizes.values.iter().zip(&sizes.slopes).take(count);
                for ((value, slope), step) in sizes.zip(&mut terms) {
                    let step = SUM * f32::from_le_bytes(*step);
                    let (value, slope) = (step * value, step * slope);
                    let factors = [value * whole, slope * whole, value * by_a, value * by_b];
                    // There is room for all terms.
                    let _ = steps.0.push(factors);
                }
            }
        }
    }

    /// Turns the tilt's part along x (0) or y (1) around. Slopes stay those by the part as it was.
    pub fn turn(&self, steps: &mut Steps, along: usize) {
        let mut terms = &mut steps.0[..];
        for (degree, (count, groups)) in self.terms.sizes_of_degrees().enumerate() {
            for k in 0..groups {
                let group;
                (group, terms) = terms.split_at_mut(count.min(terms.len()));
                let power = if along == 0 { degree - k } else { k };
                if power % 2 == 1 {
                    for factor in group.as_flattened_mut() {
                        // By its sign bit: cheaper than in the floating-point unit.
                        *factor = f32::from_bits(factor.to_bits() ^ 1 << 31);
                    }
                }
            }
        }
    }

    /// An output with its slopes, by what its terms' steps are.
    pub fn answer(&self, output: usize, place: &Place, steps: &Steps) -> Answer {
        let [value, by_size, by_a, by_b, by_x, by_y] = self.spline(output, place, &steps.0);
        let along = self.axis.slope_unit();
        Answer {
            value,
            slopes: [by_size, by_a, by_b, along * by_x, along * by_y],
        }
    }

    /// The sums of an output's coefficients around a place, times factors.
    fn spline(&self, output: usize, place: &Place, factors: &[Factors]) -> [f32; 6] {
        let count = self.terms.count();
        let node = 2 * self.axis.count();
        let before = (place.y.first * self.outputs + output) * count * node + 2 * place.x.first;
        let parts = Parts {
            y: core::array::from_fn(|j| [place.y.values[j], place.y.slopes[j]]),
            x: [place.x.values, place.x.slopes],
        };
        let line = self.outputs * count * node;
        let steps = self.steps.get(before..).unwrap_or_default();
        spline(steps, line, node, &parts, factors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forward::terms::{Limits, Powers};
    use std::vec::Vec;

    const LIMITS: Limits = Limits {
        size: 0.63,
        tilt: 0.67,
    };

    fn axis() -> Axis {
        Axis::new(&[-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]).unwrap()
    }

    fn at(x: f32, y: f32) -> Place {
        Place {
            x: axis().at(x),
            y: axis().at(y),
        }
    }

    fn load([size, a, b]: [f32; 3]) -> (Sizes, Tilts) {
        let [a, b] = [a, b].map(|part| Powers::at(part, &LIMITS));
        let tilts = Tilts::of(&a, &b);
        (Sizes::at(size, &LIMITS), tilts)
    }

    fn answer(table: &Table, output: usize, place: &Place, load: [f32; 3]) -> Answer {
        let (sizes, tilts) = self::load(load);
        let mut steps = Steps::default();
        table.set(&mut steps, output, &sizes, &tilts);
        table.answer(output, place, &steps)
    }

    /// Of two outputs, the steps from a function of their index.
    fn with<R>(step: impl Fn(usize) -> i16, use_it: impl FnOnce(&Table) -> R) -> R {
        let (axis, terms) = (axis(), Terms::new([4, 3, 2, 0, 0]).unwrap());
        let [sizes, steps] = Table::lengths(&axis, &terms, 2);
        let sizes: Vec<u8> = (0..sizes / 4).flat_map(|_| 1e-4f32.to_le_bytes()).collect();
        let steps: Vec<u8> = (0..steps / 2).flat_map(|k| step(k).to_le_bytes()).collect();
        use_it(&Table::new(axis, terms, 2, &sizes, &steps).unwrap())
    }

    #[test]
    fn slopes_are_the_values_differences() {
        let wild = |k: usize| (20_000.0 * (k as f64).sin()) as i16;
        with(wild, |table| {
            let answer = |[s, a, b, x, y]: [f32; 5]| answer(table, 1, &at(x, y), [s, a, b]);
            let here = [0.4, 0.3, -0.2, 0.7, 1.3];
            let told = answer(here).slopes;
            for axis in 0..5 {
                let step = 1e-2;
                let [mut back, mut forth] = [here; 2];
                back[axis] -= step;
                forth[axis] += step;
                let slope = (answer(forth).value - answer(back).value) / (2.0 * step);
                assert!(
                    (slope - told[axis]).abs() < 0.02,
                    "{axis}: {slope} {told:?}"
                );
            }
        });
    }

    #[test]
    fn turned_steps_are_those_of_the_mirrored_load() {
        let wild = |k: usize| (20_000.0 * (k as f64).sin()) as i16;
        with(wild, |table| {
            for (along, signs) in [(0, [-1.0, 1.0]), (1, [1.0, -1.0])] {
                let (sizes, tilts) = load([0.4, 0.3, -0.2]);
                let mut steps = Steps::default();
                table.set(&mut steps, 0, &sizes, &tilts);
                table.turn(&mut steps, along);
                let turned = table.answer(0, &at(0.7, 1.3), &steps);
                let [sa, sb] = signs;
                let mut seen = answer(table, 0, &at(0.7, 1.3), [0.4, 0.3 * sa, -0.2 * sb]);
                // By the part of the tilt as it was.
                seen.slopes[1] *= sa;
                seen.slopes[2] *= sb;
                assert_eq!(turned, seen);
            }
        });
    }

    /// The largest steps everywhere, of either sign: nothing overflows (tests check it), and the
    /// sum is what it should be.
    #[test]
    fn the_largest_steps_add_up() {
        for step in [i16::MIN, i16::MAX] {
            with(
                |_| step,
                |table| {
                    for (x, y) in [(-2.0, -2.0), (0.4, 2.9), (3.0, 3.0)] {
                        let (sizes, tilts) = load([0.6, 0.6, 0.6]);
                        let mut groups = tilts.0.iter().map(|[value, ..]| value);
                        let mut of_degree = |(count, groups_of): (usize, usize)| {
                            let tilts: f32 = groups.by_ref().take(groups_of).sum();
                            tilts * sizes.values[..count].iter().sum::<f32>()
                        };
                        let sum: f32 = table.terms.sizes_of_degrees().map(&mut of_degree).sum();
                        let value = answer(table, 0, &at(x, y), [0.6, 0.6, 0.6]).value;
                        let expected = 1e-4 * f32::from(step) * sum;
                        assert!(
                            (value - expected).abs() < 2e-3 * expected.abs(),
                            "{value} {expected}"
                        );
                    }
                },
            );
        }
        // Signs as the slopes' parts have them.
        let place = at(0.4, 0.4);
        let along_y = |k: usize| k / (2 * 16 * 6);
        let sign = |k: usize| {
            let (i, j) = (k % 6, along_y(k));
            let is_negative = |parts: &Weights, k: usize| {
                let part = parts.slopes.get(k.wrapping_sub(parts.first));
                part.is_some_and(|part| part.bits() < 0)
            };
            match is_negative(&place.x, i) != is_negative(&place.y, j) {
                true => i16::MIN,
                false => i16::MAX,
            }
        };
        with(sign, |table| {
            let answer = answer(table, 0, &place, [0.6, 0.6, 0.6]);
            assert!(answer.slopes.iter().all(|part| part.is_finite()));
        });
    }

    #[test]
    fn wrong_lengths_and_sizes_are_refused() {
        let (axis, terms) = (axis(), Terms::new([4, 3, 2, 0, 0]).unwrap());
        let lengths = Table::lengths(&axis, &terms, 2);
        assert_eq!(lengths, [4 * 32, 2 * 32 * 36]);
        let [sizes, steps] = lengths.map(|length| std::vec![0; length]);
        let new = |sizes: &[u8], steps: &[u8]| Table::new(axis, terms, 2, sizes, steps).is_some();
        assert!(new(&sizes, &steps));
        assert!(!new(&sizes[4..], &steps) && !new(&sizes, &steps[2..]));
        for wrong in [f32::NAN, -1.0, f32::INFINITY, 1.1] {
            let mut sizes = sizes.clone();
            sizes[8..12].copy_from_slice(&wrong.to_le_bytes());
            assert!(!new(&sizes, &steps), "{wrong}");
        }
    }
}
