//! Curves tabled for speed: their coefficients at evenly spaced sizes, interpolated.

use super::curves::{Curve, Output, Part, chebyshev};
use super::products::{MOST_PRODUCTS, Products, Values};

/// Steps of size between 0 and 1. A cubic through four neighbours is then within 0.5 µm of the series (tested).
const STEPS: usize = 128;
/// Sums are made of so many curves at once, which a processor adds side by side.
const GROUP: usize = 4;
const OUTPUTS: usize = Output::ALL.len();
/// Where the tip's outputs begin.
pub(super) const TIP: usize = 9;
/// The first terms of the tip's z and of its vector along the film: none, tilt, offset.
const LEADS: [(Output, [u8; 4]); 3] = [
    (Output::Tip(Part::Z), [0, 0, 0, 0]),
    (Output::Tip(Part::R), [1, 0, 0, 0]),
    (Output::Tip(Part::R), [0, 0, 1, 0]),
];

/// The first terms of the tip's vector: its z, and its part along the film for one unit of tilt and of offset.
pub(super) struct Lead {
    pub z: f64,
    pub by_tilt: f64,
    pub by_offset: f64,
}

/// Curves in the order of their outputs, each output's of even degree before those of odd, and each of these parts filled up
/// to whole groups.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    /// The product of each place of each group.
    products: Vec<[u8; GROUP]>,
    /// The group that each output's even and odd parts begin with, and where the last ends.
    begins: [usize; 2 * OUTPUTS + 1],
    /// The places of [`LEADS`].
    leads: [Option<usize>; 3],
    /// A row of s · coefficient for each size.
    rows: Vec<Vec<[f64; GROUP]>>,
}

impl Table {
    pub(super) fn new(curves: &[Curve], products: &Products) -> Table {
        let mut table = Table {
            products: Vec::new(),
            begins: [0; 2 * OUTPUTS + 1],
            leads: [None; 3],
            rows: vec![Vec::new(); STEPS + 1],
        };
        for part in 0..2 * OUTPUTS {
            let output = Output::ALL[part / 2];
            let odd = |curve: &Curve| curve.powers.iter().sum::<u8>() % 2 == 1;
            let own = |curve: &&Curve| curve.output == output && odd(curve) == (part % 2 == 1);
            let own: Vec<&Curve> = curves.iter().filter(own).collect();
            for group in own.chunks(GROUP) {
                let of_group = |tell: &dyn Fn(&Curve) -> f64| {
                    std::array::from_fn(|i| group.get(i).map_or(0.0, |curve| tell(curve)))
                };
                table.find_leads(group);
                let place = |i: usize| group.get(i).and_then(|curve| products.find(curve.powers));
                table
                    .products
                    .push(std::array::from_fn(|i| place(i).unwrap_or_default()));
                for (step, row) in table.rows.iter_mut().enumerate() {
                    row.push(of_group(&|curve| {
                        coefficient(curve, step as f64 / STEPS as f64)
                    }));
                }
            }
            table.begins[part + 1] = table.products.len();
        }
        table
    }

    /// Notes which of [`LEADS`] are in the next group.
    fn find_leads(&mut self, group: &[&Curve]) {
        for (lead, (output, powers)) in self.leads.iter_mut().zip(LEADS) {
            let is_it = |curve: &&Curve| curve.output == output && curve.powers == powers;
            let found = group.iter().position(is_it);
            *lead = lead.or(found.map(|place| GROUP * self.products.len() + place));
        }
    }

    /// The markers' outputs at a size, as each marker sees them, by the products of the first two: the others lie
    /// opposite, where what is odd has the other sign.
    pub(super) fn sums(&self, size: f64, products: &Values<2>) -> [[f64; 4]; TIP] {
        let parts: [[f64; 2]; 2 * TIP] = self.parts(0, size, products);
        let mut sums = [[0.0; 4]; TIP];
        for (sum, parts) in sums.iter_mut().zip(parts.as_chunks::<2>().0) {
            let [[a, b], [c, d]] = parts;
            *sum = [a + c, b + d, a - c, b - d];
        }
        sums
    }

    /// The tip's outputs at a size, as the marker sees them whose products these are.
    pub(super) fn tip_sums(&self, size: f64, products: &[f64; MOST_PRODUCTS]) -> [f64; 3] {
        let parts: [[f64; 1]; 6] = self.parts(2 * TIP, size, std::array::from_ref(products));
        [0, 1, 2].map(|part| parts[2 * part][0] + parts[2 * part + 1][0])
    }

    /// The sums of some parts' curves at a size, as some markers see them by their products.
    #[inline(always)]
    fn parts<const PARTS: usize, const MARKERS: usize>(
        &self,
        first: usize,
        size: f64,
        products: &Values<MARKERS>,
    ) -> [[f64; MARKERS]; PARTS] {
        let (rows, weights) = self.beside(size);
        let range = self.begins[first]..self.begins[first + PARTS];
        let [a, b, c, d] = rows.map(|row| &row[range.clone()]);
        let rows = a.iter().zip(b).zip(c).zip(d);
        let mut groups = rows.zip(&self.products[range]);
        let mut parts = [[0.0; MARKERS]; PARTS];
        for (part, sum) in parts.iter_mut().enumerate() {
            let count = self.begins[first + part + 1] - self.begins[first + part];
            let mut sums = [[0.0; GROUP]; MARKERS];
            for ((((a, b), c), d), places) in groups.by_ref().take(count) {
                let coefficients = interpolated([a, b, c, d], weights);
                for (sums, products) in sums.iter_mut().zip(products) {
                    let own = places.map(|place| products[usize::from(place)]);
                    for i in 0..GROUP {
                        sums[i] += coefficients[i] * own[i];
                    }
                }
            }
            *sum = sums.map(|[a, b, c, d]| (a + b) + (c + d));
        }
        parts
    }

    /// The first terms of the tip's vector at a size: 0 of one that has no curve.
    pub(super) fn lead(&self, size: f64) -> Lead {
        let (rows, weights) = self.beside(size);
        let [z, by_tilt, by_offset] = self.leads.map(|place| {
            let at = |row: &[[f64; GROUP]]| place.map_or(0.0, |place| row.as_flattened()[place]);
            let parts = rows.into_iter().zip(weights);
            parts.map(|(row, weight)| weight * at(row)).sum()
        });
        Lead {
            z,
            by_tilt,
            by_offset,
        }
    }

    /// The four rows around a size, and their weights: Lagrange's cubic.
    fn beside(&self, size: f64) -> ([&[[f64; GROUP]]; 4], [f64; 4]) {
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
fn interpolated(rows: [&[f64; GROUP]; 4], [w, x, y, z]: [f64; 4]) -> [f64; GROUP] {
    let [a, b, c, d] = rows;
    std::array::from_fn(|i| (w * a[i] + x * b[i]) + (y * c[i] + z * d[i]))
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
