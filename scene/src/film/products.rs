//! Products of powers of tilt and offset as each marker sees them.

use super::curves::{Pose, to_diagonal};
use crate::MARKERS;

/// Different products at most, among them 1 and those on the way to a higher one.
pub(super) const MOST_PRODUCTS: usize = 96;

/// Products of powers of (q_r, q_t, o_r, o_t), each from another by one multiplication.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Products {
    powers: Vec<[u8; 4]>,
    /// Product k + 1 is the product at the first index times the variable at the second; product 0 is 1.
    steps: Vec<(u8, u8)>,
    /// Steps that the tip's curves need.
    tip_steps: usize,
}

impl Products {
    /// Where the product of these powers is, added if need be; `None` when there is no room for it.
    pub(super) fn place(&mut self, powers: [u8; 4]) -> Option<u8> {
        let Some(variable) = powers.iter().position(|power| *power > 0) else {
            return Some(0);
        };
        if let Some(known) = self.find(powers) {
            return Some(known);
        }
        let mut fewer = powers;
        fewer[variable] -= 1;
        let from = self.place(fewer)?;
        let place = self.powers.len() + 1;
        if place >= MOST_PRODUCTS {
            return None;
        }
        self.powers.push(powers);
        self.steps.push((from, variable as u8));
        Some(place as u8)
    }

    /// Where the product of these powers is.
    pub(super) fn find(&self, powers: [u8; 4]) -> Option<u8> {
        let known = self.powers.iter().position(|known| *known == powers);
        match powers {
            [0, 0, 0, 0] => Some(0),
            _ => known.and_then(|known| u8::try_from(known + 1).ok()),
        }
    }

    /// What is there so far is what the tip's curves need.
    pub(super) fn mark_tip(&mut self) {
        self.tip_steps = self.steps.len();
    }

    /// Each product as the first two markers see it; the others lie opposite.
    pub(super) fn values(&self, pose: &Pose, values: &mut Values<2>) {
        multiply(&self.steps, [0, 1].map(|marker| seen(pose, marker)), values);
    }

    /// The tip's products as the first marker sees them.
    pub(super) fn tip_values(&self, pose: &Pose, values: &mut Values<1>) {
        multiply(&self.steps[..self.tip_steps], [seen(pose, 0)], values);
    }
}

/// Each product's value as some markers see it.
pub(super) type Values<const MARKERS: usize> = [[f64; MOST_PRODUCTS]; MARKERS];

/// Products of each marker's variables; the first is 1.
#[inline(always)]
fn multiply<const MARKERS: usize>(
    steps: &[(u8, u8)],
    variables: [[f64; 4]; MARKERS],
    values: &mut Values<MARKERS>,
) {
    values.iter_mut().for_each(|values| values[0] = 1.0);
    for (k, (from, variable)) in steps.iter().enumerate() {
        for (values, variables) in values.iter_mut().zip(&variables) {
            values[k + 1] = values[usize::from(*from)] * variables[usize::from(*variable)];
        }
    }
}

/// (q_r, q_t, o_r, o_t) as a marker sees them.
pub(super) fn seen(pose: &Pose, marker: usize) -> [f64; 4] {
    let corner = MARKERS[marker].centre_mm;
    let [qr, qt] = to_diagonal(pose.tilt, corner);
    let [or, ot] = to_diagonal(pose.offset, corner);
    [qr, qt, or, ot]
}

/// The product of these powers of (q_r, q_t, o_r, o_t) as a marker sees them, and its derivatives by the pose's tilt
/// and offset along x and along y.
pub fn product(powers: [u8; 4], pose: &Pose, marker: usize) -> (f64, [f64; 4]) {
    let variables = seen(pose, marker);
    let factor = |k: usize| libm::pow(variables[k], f64::from(powers[k]));
    let without = |k: usize| {
        let others = (0..4).filter(|other| *other != k).map(factor);
        others.product::<f64>()
    };
    let slopes: [f64; 4] = std::array::from_fn(|k| match powers[k] {
        0 => 0.0,
        power => f64::from(power) * libm::pow(variables[k], f64::from(power) - 1.0) * without(k),
    });
    // The variables are linear in tilt and offset.
    let along = |tilt, offset| {
        let unit = Pose {
            size: 0.0,
            tilt,
            offset,
        };
        let parts = seen(&unit, marker).into_iter().zip(slopes);
        parts.map(|(a, b)| a * b).sum::<f64>()
    };
    let (x, y) = ([1.0, 0.0], [0.0, 1.0]);
    let none = [0.0; 2];
    let derivatives = [
        along(x, none),
        along(y, none),
        along(none, x),
        along(none, y),
    ];
    ((0..4).map(factor).product(), derivatives)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_of_powers() {
        let pose = Pose {
            size: 1.0,
            tilt: [0.3, -0.4],
            offset: [0.5, 0.2],
        };
        let half = std::f64::consts::FRAC_1_SQRT_2;
        // Marker 2 is in the (+, +) corner.
        let [qr, qt, or, ot] = [-0.1, -0.7, 0.7, -0.3].map(|x| x * half);
        let expected = qr * qr * qt * or * ot;
        let (value, slopes) = product([2, 1, 1, 1], &pose, 2);
        assert!((value - expected).abs() < 1e-15);
        assert_eq!(product([0; 4], &pose, 2), (1.0, [0.0; 4]));
        let mut products = Products::default();
        let place = products.place([2, 1, 1, 1]).unwrap();
        assert_eq!(products.find([2, 1, 1, 1]), Some(place));
        products.mark_tip();
        let place = usize::from(place);
        // Marker 0 lies opposite, and the degree is odd.
        let (mut values, mut tip_values) = ([[0.0; MOST_PRODUCTS]; 2], [[0.0; MOST_PRODUCTS]]);
        products.values(&pose, &mut values);
        products.tip_values(&pose, &mut tip_values);
        assert!((values[0][place] + expected).abs() < 1e-15);
        assert!((tip_values[0][place] + expected).abs() < 1e-15);
        for (k, slope) in slopes.into_iter().enumerate() {
            let moved = |step: f64| {
                let mut pose = pose;
                match k {
                    0 | 1 => pose.tilt[k] += step,
                    _ => pose.offset[k - 2] += step,
                }
                product([2, 1, 1, 1], &pose, 2).0
            };
            let expected = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((slope - expected).abs() < 1e-9, "{k}: {slope} {expected}");
        }
    }

    #[test]
    fn there_is_room_for_so_many() {
        let mut products = Products::default();
        let all =
            (0..4u8).flat_map(|a| (0..4).flat_map(move |b| (0..4).map(move |c| [a, b, c, 1])));
        let placed = all
            .chain((0..200).map(|a| [a, 0, 0, 2]))
            .filter(|powers| products.place(*powers).is_some());
        assert!(placed.count() < MOST_PRODUCTS);
        assert_eq!(products.powers.len(), MOST_PRODUCTS - 1);
        assert_eq!(products.place([250, 0, 0, 2]), None);
    }
}
