//! Tables of numbers that depend on a load: splines over its place, sums of terms in its size and
//! tilt.

use super::axis::{Axis, SPAN};
use super::pose::Pose;
use super::terms::{LANES, Terms, Values};
use crate::film::FilmError;

/// A coefficient is stored in steps; this many steps are the largest coefficient of its term and
/// output.
const STEPS: f64 = 32_767.0;

/// Outputs, each a sum of terms whose coefficients are splines over the place.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    axis: Axis,
    terms: Terms,
    outputs: usize,
    /// By node along y, node along x, output and term, padded to whole lanes.
    coefficients: Vec<f32>,
}

/// The weights of a table's coefficients at a pose.
pub struct At {
    /// For 16 pairs of nodes: the index of their coefficients, and their weight.
    nodes: [(usize, f32); SPAN * SPAN],
    values: Values,
}

impl Table {
    /// Returns the table of coefficients by node along y, node along x, output and term.
    pub fn new(axis: Axis, terms: Terms, outputs: usize, coefficients: &[f64]) -> Table {
        let (count, padded) = (terms.count(), terms.padded());
        let rows = coefficients.chunks(count).flat_map(|row| {
            let filled = row.iter().copied().chain(std::iter::repeat(0.0));
            filled.take(padded).map(|value| value as f32)
        });
        Table {
            coefficients: rows.collect(),
            axis,
            terms,
            outputs,
        }
    }

    /// Returns the weights of the outputs at a pose.
    pub fn at(&self, pose: &Pose) -> At {
        let [along_x, along_y] = pose.place_mm.map(|part| self.axis.at(part));
        let length = self.outputs * self.terms.padded();
        let across = self.axis.nodes().len();
        let node = |k: usize| {
            let (i, j) = (k % SPAN, k / SPAN);
            let place = (along_y.first + j) * across + along_x.first + i;
            let part = along_x.values[i] * along_y.values[j];
            (place * length, part as f32)
        };
        At {
            nodes: std::array::from_fn(node),
            values: self.terms.values(pose),
        }
    }

    /// Returns `N` outputs from `first` on.
    pub fn sums<const N: usize>(&self, at: &At, first: usize) -> [f64; N] {
        let padded = self.terms.padded();
        let values = at.values[..padded].as_chunks::<LANES>().0;
        let mut sums = [[0.0_f32; LANES]; N];
        for (begin, part) in at.nodes {
            let begin = begin + first * padded;
            let rows = &self.coefficients[begin..begin + N * padded];
            for (sum, row) in sums.iter_mut().zip(rows.chunks_exact(padded)) {
                let mut own = [0.0_f32; LANES];
                for (group, values) in row.as_chunks::<LANES>().0.iter().zip(values) {
                    for lane in 0..LANES {
                        own[lane] += group[lane] * values[lane];
                    }
                }
                for lane in 0..LANES {
                    sum[lane] += part * own[lane];
                }
            }
        }
        sums.map(|lanes| lanes.iter().map(|part| f64::from(*part)).sum())
    }

    /// Returns the coefficients as a file stores them: the size of a step for each output and term,
    /// then the steps.
    pub fn to_bytes(&self) -> Vec<u8> {
        let rows = self.coefficients.chunks(self.row());
        let mut largest = vec![0.0_f32; self.row()];
        for row in rows.clone() {
            for (most, value) in largest.iter_mut().zip(row) {
                *most = most.max(value.abs());
            }
        }
        let sizes: Vec<f32> = largest.iter().map(|most| most / STEPS as f32).collect();
        let mut bytes: Vec<u8> = self.kept(&sizes).flat_map(|s| s.to_le_bytes()).collect();
        for row in rows {
            let steps = row.iter().zip(&sizes).map(|(value, size)| match size {
                0.0 => 0,
                _ => (f64::from(*value) / f64::from(*size)).round() as i16,
            });
            let steps: Vec<i16> = steps.collect();
            bytes.extend(self.kept(&steps).flat_map(i16::to_le_bytes));
        }
        bytes
    }

    /// Takes a table from the front of a file's bytes.
    ///
    /// # Errors
    /// If the bytes end too early.
    pub fn take(
        axis: Axis,
        terms: Terms,
        outputs: usize,
        bytes: &mut &[u8],
    ) -> Result<Table, FilmError> {
        let row = outputs * terms.count();
        let nodes = axis.nodes().len() * axis.nodes().len();
        let length = 4 * row + 2 * row * nodes;
        let Some((own, rest)) = bytes.split_at_checked(length) else {
            return Err(FilmError::Tables(format!(
                "a table of {length} bytes is cut off after {}: make the file anew",
                bytes.len()
            )));
        };
        *bytes = rest;
        let (sizes, steps) = own.split_at(4 * row);
        let sizes = sizes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
        let sizes: Vec<f64> = sizes.map(f64::from).collect();
        let steps = steps.as_chunks().0.iter().map(|b| i16::from_le_bytes(*b));
        let values = steps.zip(sizes.iter().cycle());
        let values: Vec<f64> = values.map(|(step, size)| f64::from(step) * size).collect();
        Ok(Table::new(axis, terms, outputs, &values))
    }

    /// Returns how many numbers a node has.
    fn row(&self) -> usize {
        self.outputs * self.terms.padded()
    }

    /// Iterates over a node's numbers without the padding of lanes.
    fn kept<T: Copy>(&self, row: &[T]) -> impl Iterator<Item = T> {
        let (count, padded) = (self.terms.count(), self.terms.padded());
        row.chunks(padded)
            .flat_map(move |own| own[..count].iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [f64; 6] = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0];

    fn table() -> Table {
        let terms = Terms::up_to(2, 1, 1);
        let count = 36 * 2 * terms.count();
        let values: Vec<f64> = (0..count).map(|k| libm::sin(k as f64)).collect();
        Table::new(Axis::new(&NODES), terms, 2, &values)
    }

    fn pose(x: f64, y: f64) -> Pose {
        Pose {
            size: 0.3,
            tilt: [0.2, -0.1],
            place_mm: [x, y],
        }
    }

    #[test]
    fn files_keep_tables() {
        let table = table();
        let bytes = table.to_bytes();
        let mut left = bytes.as_slice();
        let read = Table::take(Axis::new(&NODES), Terms::up_to(2, 1, 1), 2, &mut left).unwrap();
        assert!(left.is_empty());
        let pose = pose(0.3, 2.2);
        let [a, b]: [[f64; 2]; 2] = [&table, &read].map(|table| table.sums(&table.at(&pose), 0));
        for (a, b) in a.into_iter().zip(b) {
            assert!((a - b).abs() < 1e-4 && a != 0.0, "{a} {b}");
        }
        let cut = Table::take(
            Axis::new(&NODES),
            Terms::up_to(2, 1, 1),
            2,
            &mut &bytes[1..],
        );
        assert!(cut.unwrap_err().to_string().contains("cut off"));
    }

    #[test]
    fn sums_are_of_terms_and_nodes() {
        let table = table();
        let pose = pose(0.3, 2.2);
        let [_, second]: [f64; 2] = table.sums(&table.at(&pose), 0);
        let axis = Axis::new(&NODES);
        let [x, y] = pose.place_mm.map(|part| axis.at(part));
        let rows = Terms::up_to(2, 1, 1).rows(&pose);
        let count = rows[0].len();
        let mut expected = 0.0;
        for (j, along_y) in y.values.iter().enumerate() {
            for (i, along_x) in x.values.iter().enumerate() {
                let node = (y.first + j) * 6 + x.first + i;
                for (k, term) in rows[0].iter().enumerate() {
                    let value = libm::sin(((node * 2 + 1) * count + k) as f64);
                    expected += along_x * along_y * term * value;
                }
            }
        }
        assert!((second - expected).abs() < 1e-6, "{second} {expected}");
        let [alone]: [f64; 1] = table.sums(&table.at(&pose), 1);
        assert_eq!(alone, second);
    }
}
