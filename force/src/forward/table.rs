//! Numbers that depend on a load: splines over its place, sums of terms in its size and tilt.
//!
//! Coefficients are steps of 16 bits of a size for each output and term. Along both axes they are
//! summed up in integers, which cannot overflow whatever a file says (`kernels::spline`); what is
//! left is single precision.

use super::axis::{Axis, Weights};
use super::terms::{MOST_TERMS, Sizes, Terms, Tilts};
use crate::kernels::{Parts, spline};

/// Steps that a sum over both axes is in parts of: Q15 · Q15 / 2¹⁶.
const SUM: f32 = 1.0 / 16_384.0;

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

/// What presses, as terms see it.
#[derive(Clone, Copy, Debug)]
pub struct Load<'l> {
    /// How strongly.
    pub sizes: &'l Sizes,
    /// In which direction.
    pub tilts: &'l Tilts,
}

/// Room for the sums of an output's coefficients.
#[derive(Clone, Debug)]
pub struct Sums([[i32; 3]; MOST_TERMS]);

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

    /// An output at a place.
    pub fn value(&self, output: usize, place: &Place, load: &Load<'_>, sums: &mut Sums) -> f32 {
        self.answer(output, place, load, sums).value
    }

    /// An output with its slopes.
    pub fn answer(&self, output: usize, place: &Place, load: &Load<'_>, sums: &mut Sums) -> Answer {
        let (mut sums, mut steps) = self.sums(output, place, sums);
        let mut sum = Answer::default();
        let mut tilts = load.tilts.values.iter().zip(&load.tilts.slopes);
        for (count, groups) in self.terms.sizes_of_degrees() {
            for (whole, by_tilt) in tilts.by_ref().take(groups) {
                let (here, step);
                (here, sums) = sums.split_at(count.min(sums.len()));
                (step, steps) = steps.split_at(count.min(steps.len()));
                let group = load.sizes.group(here, step);
                sum.value += group.value * whole;
                sum.slopes[0] += group.by_size * whole;
                sum.slopes[1] += group.value * by_tilt[0];
                sum.slopes[2] += group.value * by_tilt[1];
                sum.slopes[3] += group.by_x * whole;
                sum.slopes[4] += group.by_y * whole;
            }
        }
        let along = SUM * self.axis.slope_unit();
        let [by_size, by_a, by_b, by_x, by_y] = sum.slopes;
        Answer {
            value: SUM * sum.value,
            slopes: [
                SUM * by_size,
                SUM * by_a,
                SUM * by_b,
                along * by_x,
                along * by_y,
            ],
        }
    }

    /// The sums of an output's coefficients around a place, and the size of a step of each.
    fn sums<'s>(
        &self,
        output: usize,
        place: &Place,
        sums: &'s mut Sums,
    ) -> (&'s [[i32; 3]], &'a [[u8; 4]]) {
        let count = self.terms.count();
        let node = 2 * self.axis.count();
        let before = (place.y.first * self.outputs + output) * count * node + 2 * place.x.first;
        let parts = Parts {
            y: core::array::from_fn(|j| [place.y.values[j], place.y.slopes[j]]),
            x: [place.x.values, place.x.slopes],
        };
        let sums = sums.0.get_mut(..count).unwrap_or_default();
        let line = self.outputs * count * node;
        let steps = self.steps.get(before..).unwrap_or_default();
        spline(steps, line, node, &parts, sums);
        let sizes = self.sizes.get(output * count..(output + 1) * count);
        (sums, sizes.unwrap_or_default())
    }
}

impl Sums {
    /// Of nothing yet.
    pub const fn new() -> Sums {
        Sums([[0; 3]; MOST_TERMS])
    }
}

/// What the terms of a group add up to, before the tilt.
#[derive(Default)]
struct Group {
    value: f32,
    by_size: f32,
    by_x: f32,
    by_y: f32,
}

impl Sizes {
    /// Of as many terms as there are sums: loops whose length the compiler knows take half the
    /// time.
    fn group(&self, sums: &[[i32; 3]], steps: &[[u8; 4]]) -> Group {
        match sums.len() {
            1 => self.group_of::<1>(sums, steps),
            2 => self.group_of::<2>(sums, steps),
            3 => self.group_of::<3>(sums, steps),
            4 => self.group_of::<4>(sums, steps),
            5 => self.group_of::<5>(sums, steps),
            6 => self.group_of::<6>(sums, steps),
            7 => self.group_of::<7>(sums, steps),
            8 => self.group_of::<8>(sums, steps),
            _ => Group::default(),
        }
    }

    #[inline(always)]
    fn group_of<const N: usize>(&self, sums: &[[i32; 3]], steps: &[[u8; 4]]) -> Group {
        let mut group = Group::default();
        let powers = self
            .values
            .first_chunk::<N>()
            .zip(self.slopes.first_chunk::<N>());
        let Some(((sums, steps), (values, slopes))) = sums
            .first_chunk::<N>()
            .zip(steps.first_chunk::<N>())
            .zip(powers)
        else {
            return group;
        };
        let powers = values.iter().zip(slopes);
        for (([here, along_x, along_y], step), (power, slope)) in sums.iter().zip(steps).zip(powers)
        {
            let step = f32::from_le_bytes(*step);
            let here = *here as f32 * step;
            group.value += here * power;
            group.by_size += here * slope;
            let power = step * power;
            group.by_x += *along_x as f32 * power;
            group.by_y += *along_y as f32 * power;
        }
        group
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forward::terms::Limits;
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
        (Sizes::at(size, &LIMITS), Tilts::at([a, b], &LIMITS))
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
            let answer = |[s, a, b, x, y]: [f32; 5]| {
                let ((sizes, tilts), place) = (load([s, a, b]), at(x, y));
                let load = Load {
                    sizes: &sizes,
                    tilts: &tilts,
                };
                let mut sums = Sums::new();
                let answer = table.answer(1, &place, &load, &mut sums);
                let value = table.value(1, &place, &load, &mut sums);
                assert!((value - answer.value).abs() < 1e-5);
                answer
            };
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
                        let mut groups = tilts.values.iter();
                        let mut of_degree = |(count, groups_of): (usize, usize)| {
                            let tilts: f32 = groups.by_ref().take(groups_of).sum();
                            tilts * sizes.values[..count].iter().sum::<f32>()
                        };
                        let sum: f32 = table.terms.sizes_of_degrees().map(&mut of_degree).sum();
                        let load = Load {
                            sizes: &sizes,
                            tilts: &tilts,
                        };
                        let value = table.answer(0, &at(x, y), &load, &mut Sums::new()).value;
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
            let part = |parts: &Weights, k: usize| {
                parts
                    .slopes
                    .get(k.wrapping_sub(parts.first))
                    .copied()
                    .unwrap_or(1)
            };
            let negative = (part(&place.x, i) < 0) != (part(&place.y, j) < 0);
            if negative { i16::MIN } else { i16::MAX }
        };
        with(sign, |table| {
            let (sizes, tilts) = load([0.6, 0.6, 0.6]);
            let load = Load {
                sizes: &sizes,
                tilts: &tilts,
            };
            let answer = table.answer(0, &place, &load, &mut Sums::new());
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
