//! Curves tabled for speed: their coefficients at evenly spaced sizes, interpolated.

use super::curves::{Curve, Output, chebyshev};
use super::products::{MOST_PRODUCTS, Products};

/// Steps of size between 0 and 1. A cubic through four neighbours is then within 0.5 µm of the series (tested).
const STEPS: usize = 128;
/// Sums are made of so many curves at once, which a processor adds side by side.
const GROUP: usize = 4;
const OUTPUTS: usize = Output::ALL.len();
/// Where the tip's outputs begin.
const TIP: usize = 9;

/// Curves in the order of their outputs, each output's filled up to whole groups.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    /// The product of each place.
    products: Vec<u8>,
    /// Where each output's places begin, and where the last ends.
    begins: [usize; OUTPUTS + 1],
    /// A row of s · coefficient for each size.
    rows: Vec<Vec<f64>>,
}

impl Table {
    pub(super) fn new(curves: &[Curve], products: &Products) -> Table {
        let mut table = Table {
            products: Vec::new(),
            begins: [0; OUTPUTS + 1],
            rows: vec![Vec::new(); STEPS + 1],
        };
        for output in Output::ALL {
            for curve in curves.iter().filter(|curve| curve.output == output) {
                table.products.extend(products.find(curve.powers));
                for (step, row) in table.rows.iter_mut().enumerate() {
                    row.push(coefficient(curve, step as f64 / STEPS as f64));
                }
            }
            let whole = table.products.len().next_multiple_of(GROUP);
            table.products.resize(whole, 0);
            table.rows.iter_mut().for_each(|row| row.resize(whole, 0.0));
            table.begins[output.index() + 1] = whole;
        }
        table
    }

    /// Every output at a size, as each marker sees it by its products.
    pub(super) fn sums(
        &self,
        size: f64,
        products: &[[f64; 4]; MOST_PRODUCTS],
    ) -> [[f64; 4]; OUTPUTS] {
        let (rows, weights) = self.beside(size);
        let mut sums = [[0.0; 4]; OUTPUTS];
        for (output, sum) in sums.iter_mut().enumerate() {
            let range = self.begins[output]..self.begins[output + 1];
            let parts = rows.map(|row| &row[range.clone()]);
            let places = &self.products[range];
            for (k, group) in places.chunks_exact(GROUP).enumerate() {
                let [a, b, c, d] = interpolated(parts, weights, k);
                let [pa, pb, pc, pd] = [0, 1, 2, 3].map(|i| &products[usize::from(group[i])]);
                for marker in 0..4 {
                    sum[marker] +=
                        (a * pa[marker] + b * pb[marker]) + (c * pc[marker] + d * pd[marker]);
                }
            }
        }
        sums
    }

    /// The tip's outputs at a size, as the marker sees them whose products these are.
    pub(super) fn tip_sums(&self, size: f64, products: &[f64; MOST_PRODUCTS]) -> [f64; 3] {
        let (rows, weights) = self.beside(size);
        [0, 1, 2].map(|part| {
            let range = self.begins[TIP + part]..self.begins[TIP + part + 1];
            let parts = rows.map(|row| &row[range.clone()]);
            let groups = self.products[range].chunks_exact(GROUP).enumerate();
            let sums = groups.map(|(k, group)| {
                let [a, b, c, d] = interpolated(parts, weights, k);
                let [pa, pb, pc, pd] = [0, 1, 2, 3].map(|i| products[usize::from(group[i])]);
                (a * pa + b * pb) + (c * pc + d * pd)
            });
            sums.sum()
        })
    }

    /// The four rows around a size, and their weights: Lagrange's cubic.
    fn beside(&self, size: f64) -> ([&[f64]; 4], [f64; 4]) {
        let place = size * STEPS as f64;
        let first = (place as usize).clamp(1, STEPS - 2) - 1;
        let x = place - first as f64;
        let [a, b, c, d] = [x, x - 1.0, x - 2.0, x - 3.0];
        let weights = [
            -b * c * d / 6.0,
            a * c * d / 2.0,
            -a * b * d / 2.0,
            a * b * c / 6.0,
        ];
        let rows = [0, 1, 2, 3].map(|k| self.rows[first + k].as_slice());
        (rows, weights)
    }
}

/// A group's coefficients between four rows.
#[inline(always)]
fn interpolated(rows: [&[f64]; 4], weights: [f64; 4], group: usize) -> [f64; GROUP] {
    let mut sum = [0.0; GROUP];
    for (row, weight) in rows.iter().zip(weights) {
        let row = &row[GROUP * group..][..GROUP];
        for (sum, part) in sum.iter_mut().zip(row) {
            *sum += weight * part;
        }
    }
    sum
}

fn coefficient(curve: &Curve, size: f64) -> f64 {
    let parts = curve.series.iter().zip(chebyshev(size));
    size * parts.map(|(c, t)| c * t).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MARKERS;
    use crate::film::curves::{Curves, Pose, from_diagonal};
    use crate::film::products::seen;

    /// Of every committed file: where the outputs' curves come together, between the table's sizes.
    #[test]
    fn between_sizes_it_is_the_series() {
        let files = [
            include_str!("../../data/force.csv"),
            include_str!("../../data/slip.csv"),
            include_str!("../../data/force-overhang.csv"),
        ];
        for text in files {
            let curves: Curves = text.parse().unwrap();
            for (step, tilt) in (0..=600).flat_map(|step| TILTS.map(|tilt| (step, tilt))) {
                let pose = Pose {
                    size: f64::from(step) / 600.0,
                    tilt,
                    offset: [0.6, -0.9],
                };
                let (found, expected) = (curves.at(&pose).discs[1], by_series(&curves, &pose));
                for (found, expected) in found.moved_mm.iter().zip(expected) {
                    let error = (found - expected).abs();
                    assert!(error < 5e-4, "{error} at {pose:?}");
                }
            }
        }
    }

    const TILTS: [[f64; 2]; 4] = [[0.0, 0.0], [0.5, -0.3], [0.7, 0.7], [-0.2, 0.95]];

    /// How far marker 1 moves, mm, film frame.
    fn by_series(curves: &Curves, pose: &Pose) -> [f64; 3] {
        let mut sums = [0.0; OUTPUTS];
        for curve in &curves.curves {
            let seen = seen(pose, 1).into_iter().zip(curve.powers);
            let product: f64 = seen
                .map(|(part, power)| libm::pow(part, power.into()))
                .product();
            sums[curve.output.index()] += product * coefficient(curve, pose.size);
        }
        let [x, y] = from_diagonal([sums[0], sums[1]], MARKERS[1].centre_mm);
        [x, y, sums[2]]
    }
}
