//! Holds the motion of one marker's image: splines over the tip's place, whose coefficients are
//! weighted by functions of size and tilt.
//!
//! Coefficients are 16-bit integers in steps; the step's size is part of the function. Sums along
//! both axes are integers, which cannot overflow for any file (`kernels::spline`). All else is
//! single precision.

use super::axis::{Axis, ONE, Weights};
use super::predict::MOST_FUNCTIONS;
use crate::force::kernels::{Factors, Parts, spline};

/// Unit of a sum over both axes: the weights' unit squared, over 2¹⁶.
const SUM: f32 = 65_536.0 / (ONE * ONE);
/// Outputs: motion along x and along y.
pub const OUTPUTS: usize = 2;

/// How a marker's image moves along x and y. Each is a sum of functions of size and tilt whose
/// coefficients are splines over the place. Borrowed from a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table<'a> {
    axes: [Axis<'a>; 2],
    /// The direction of the first part of the functions' tilt.
    away: [f32; 2],
    functions: usize,
    /// Coefficients by node along y, output, function and node along x, i16 each.
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

/// An output with its slopes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// The output.
    pub value: f32,
    /// Its slopes by size, tilt along x and y (1/rad), place along x and y (1/mm).
    pub slopes: [f32; 5],
}

impl<'a> Table<'a> {
    /// Takes the axes along x and y, the direction of the tilt's first part, and the steps. Returns
    /// `None` if the number of functions or of bytes ([`Table::length`]) is wrong.
    pub fn new(
        axes: [Axis<'a>; 2],
        away: [f32; 2],
        functions: usize,
        steps: &'a [u8],
    ) -> Option<Table<'a>> {
        let sound = (1..=MOST_FUNCTIONS).contains(&functions)
            && Table::length(&axes, functions) == steps.len();
        sound.then_some(Table {
            axes,
            away,
            functions,
            steps,
        })
    }

    /// Reads a table again that a file begins with and that [`Table::new`] has taken before: the
    /// numbers of nodes along x and y, two zeros, the nodes, the direction, and the steps. Returns
    /// `None` if the bytes end too early.
    pub(super) fn taken(
        bytes: &'a [u8],
        slope_units: [f32; 2],
        functions: usize,
    ) -> Option<Table<'a>> {
        let ([x, y, ..], rest) = bytes.split_first_chunk::<4>()?;
        let (words, _) = rest.as_chunks::<4>();
        let (along_x, words) = words.split_at_checked(usize::from(*x))?;
        let (along_y, words) = words.split_at_checked(usize::from(*y))?;
        let ([c, s], _) = words.split_first_chunk()?;
        let axes = [
            Axis::taken(along_x, slope_units[0]),
            Axis::taken(along_y, slope_units[1]),
        ];
        let from = 4 * (along_x.len() + along_y.len() + 2);
        let steps = rest.get(from..)?.get(..Table::length(&axes, functions))?;
        Some(Table {
            axes,
            away: [*c, *s].map(f32::from_le_bytes),
            functions,
            steps,
        })
    }

    /// Bytes of a table's steps.
    pub fn length([x, y]: &[Axis<'_>; 2], functions: usize) -> usize {
        2 * OUTPUTS * functions * x.count() * y.count()
    }

    /// Its axes, along x and y.
    pub fn axes(&self) -> &[Axis<'a>; 2] {
        &self.axes
    }

    /// Number of functions.
    pub fn functions(&self) -> usize {
        self.functions
    }

    /// The direction of the tilt's first part.
    pub(super) fn away(&self) -> [f32; 2] {
        self.away
    }

    /// A tilt split along the table's direction and across it.
    pub fn tilt(&self, [a, b]: [f32; 2]) -> [f32; 2] {
        let [c, s] = self.away;
        [c * a + s * b, c * b - s * a]
    }

    /// A place, mm, on its axes.
    pub fn place(&self, [x, y]: [f32; 2]) -> Place {
        let [along_x, along_y] = &self.axes;
        Place {
            x: along_x.at(x),
            y: along_y.at(y),
        }
    }

    /// Returns an output (0 along x, 1 along y) with its slopes. `functions` holds the functions
    /// under a load, and their slopes by size, by the tilt along the table's direction and across
    /// it.
    pub fn answer(&self, output: usize, place: &Place, functions: &[Factors]) -> Answer {
        let count = self.functions.min(functions.len());
        let functions = functions.get(..count).unwrap_or_default();
        let sums = self.spline(output, place, functions);
        let [value, by_size, by_a, by_b, by_x, by_y] = sums.map(|sum| SUM * sum);
        let [along_x, along_y] = self.axes.each_ref().map(Axis::slope_unit);
        let [c, s] = self.away;
        Answer {
            value,
            slopes: [
                by_size,
                c * by_a - s * by_b,
                s * by_a + c * by_b,
                along_x * by_x,
                along_y * by_y,
            ],
        }
    }

    /// Sums an output's coefficients around a place, times the factors.
    fn spline(&self, output: usize, place: &Place, factors: &[Factors]) -> [f32; 6] {
        let node = 2 * self.axes[0].count();
        let before = (place.y.first * OUTPUTS + output) * self.functions * node + 2 * place.x.first;
        let parts = Parts {
            y: core::array::from_fn(|j| [place.y.values[j], place.y.slopes[j]]),
            x: [place.x.values, place.x.slopes],
        };
        let line = OUTPUTS * self.functions * node;
        let steps = self.steps.get(before..).unwrap_or_default();
        spline(steps, line, node, &parts, factors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const FUNCTIONS: usize = 3;
    const STEP: f32 = 1e-4;
    /// Cosine and sine of 30°.
    const AWAY: [f32; 2] = [0.866_025_4, 0.5];

    /// Nodes every mm from −3 to 3.
    const NODES: [[u8; 4]; 7] = {
        let mut nodes = [[0; 4]; 7];
        let mut k = 0;
        while k < 7 {
            nodes[k] = (k as f32 - 3.0).to_le_bytes();
            k += 1;
        }
        nodes
    };

    fn axes() -> [Axis<'static>; 2] {
        [&NODES[1..], &NODES].map(|nodes| Axis::new(nodes).unwrap())
    }

    /// s, s·a² and s²·b in steps, of the tilt as the table sees it.
    fn functions(table: &Table, [size, a, b]: [f32; 3]) -> [Factors; FUNCTIONS] {
        let [a, b] = table.tilt([a, b]);
        let all = [
            [size, 1.0, 0.0, 0.0],
            [size * a * a, a * a, 2.0 * size * a, 0.0],
            [size * size * b, 2.0 * size * b, 0.0, size * size],
        ];
        all.map(|function| function.map(|part| STEP * part))
    }

    /// A table whose steps are a function of their index.
    fn with<R>(step: impl Fn(usize) -> i16, use_it: impl FnOnce(&Table) -> R) -> R {
        let steps = Table::length(&axes(), FUNCTIONS);
        let steps: Vec<u8> = (0..steps / 2).flat_map(|k| step(k).to_le_bytes()).collect();
        use_it(&Table::new(axes(), AWAY, FUNCTIONS, &steps).unwrap())
    }

    #[test]
    fn slopes_are_the_values_differences() {
        let wild = |k: usize| (20_000.0 * (k as f64).sin()) as i16;
        with(wild, |table| {
            let answer = |[s, a, b, x, y]: [f32; 5]| {
                table.answer(1, &table.place([x, y]), &functions(table, [s, a, b]))
            };
            let here = [0.4, 0.3, -0.2, 0.7, 1.3];
            let reported = answer(here).slopes;
            for axis in 0..5 {
                let step = 1e-2;
                let [mut back, mut forth] = [here; 2];
                back[axis] -= step;
                forth[axis] += step;
                let slope = (answer(forth).value - answer(back).value) / (2.0 * step);
                assert!(
                    (slope - reported[axis]).abs() < 0.02,
                    "{axis}: {slope} {reported:?}"
                );
            }
        });
    }

    #[test]
    fn a_tilt_is_seen_from_the_markers_side() {
        with(
            |_| 0,
            |table| {
                let [along, across] = table.tilt([0.866_025_4, 0.5]);
                assert!((along - 1.0).abs() < 1e-6 && across.abs() < 1e-6);
                let [along, across] = table.tilt([-0.5, 0.866_025_4]);
                assert!(along.abs() < 1e-6 && (across - 1.0).abs() < 1e-6);
            },
        );
    }

    /// The largest steps of either sign everywhere: nothing overflows (tests check overflow), and
    /// the sum is right.
    #[test]
    fn the_largest_steps_add_up() {
        for step in [i16::MIN, i16::MAX] {
            with(
                |_| step,
                |table| {
                    for place in [[-2.0, -2.0], [0.4, 2.9], [3.0, 3.0]] {
                        let functions = functions(table, [0.6, 0.6, 0.6]);
                        let sum: f32 = functions.iter().map(|[whole, ..]| whole).sum();
                        let value = table.answer(1, &table.place(place), &functions).value;
                        let expected = f32::from(step) * sum;
                        assert!(
                            (value - expected).abs() < 2e-3 * expected.abs(),
                            "{value} {expected}"
                        );
                    }
                },
            );
        }
        // Steps with the signs of the slopes' weights.
        let [x, y] = axes().map(|axis| axis.at(0.4));
        let sign = |k: usize| {
            let (i, j) = (k % 6, k / (OUTPUTS * FUNCTIONS * 6));
            let is_negative = |parts: &Weights, k: usize| {
                let part = parts.slopes.get(k.wrapping_sub(parts.first));
                part.is_some_and(|part| part.bits() < 0)
            };
            match is_negative(&x, i) != is_negative(&y, j) {
                true => i16::MIN,
                false => i16::MAX,
            }
        };
        with(sign, |table| {
            let functions = functions(table, [0.6, 0.6, 0.6]);
            let answer = table.answer(0, &table.place([0.4, 0.4]), &functions);
            assert!(answer.slopes.iter().all(|part| part.is_finite()));
        });
    }

    #[test]
    fn wrong_lengths_are_refused() {
        let length = Table::length(&axes(), FUNCTIONS);
        assert_eq!(length, 2 * 6 * 42);
        let steps = std::vec![0; length];
        let new =
            |functions: usize, steps: &[u8]| Table::new(axes(), AWAY, functions, steps).is_some();
        assert!(new(FUNCTIONS, &steps) && !new(FUNCTIONS, &steps[2..]));
        assert!(!new(2, &steps) && !new(0, &[]));
    }
}
