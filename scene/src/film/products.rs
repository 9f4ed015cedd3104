//! Products of powers of tilt and offset as each marker sees them.

use super::curves::{Pose, to_diagonal};
use crate::MARKERS;

/// Different products at most, among them those on the way to a higher one.
pub(super) const MOST_PRODUCTS: usize = 128;

/// Products of powers of (q_r, q_t, o_r, o_t), each from another by one multiplication.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Products {
    powers: Vec<[u8; 4]>,
    /// Product k + 1 is the product at the first index times the variable at the second; product 0 is 1.
    steps: Vec<(usize, usize)>,
}

impl Products {
    /// Leaves out what does not fit.
    pub(super) fn truncate(&mut self) {
        self.powers.truncate(MOST_PRODUCTS - 1);
        self.steps.truncate(MOST_PRODUCTS - 1);
    }

    /// Where the product of these powers is, added if need be.
    pub(super) fn place(&mut self, powers: [u8; 4]) -> usize {
        let Some(variable) = powers.iter().position(|power| *power > 0) else {
            return 0;
        };
        if let Some(known) = self.powers.iter().position(|known| *known == powers) {
            return known + 1;
        }
        let mut fewer = powers;
        fewer[variable] -= 1;
        let from = self.place(fewer);
        self.powers.push(powers);
        self.steps.push((from, variable));
        self.powers.len()
    }

    /// Each product as each marker sees it.
    pub(super) fn values(&self, pose: &Pose) -> [[f64; 4]; MOST_PRODUCTS] {
        let mut variables = [[0.0; 4]; 4];
        for (k, marker) in MARKERS.iter().enumerate() {
            let [qr, qt] = to_diagonal(pose.tilt, marker.centre_mm);
            let [or, ot] = to_diagonal(pose.offset, marker.centre_mm);
            for (variable, value) in variables.iter_mut().zip([qr, qt, or, ot]) {
                variable[k] = value;
            }
        }
        let mut values = [[1.0; 4]; MOST_PRODUCTS];
        for (k, (from, variable)) in self.steps.iter().enumerate() {
            let (from, variable) = (values[*from], variables[*variable]);
            values[k + 1] = std::array::from_fn(|marker| from[marker] * variable[marker]);
        }
        values
    }
}

/// The product of these powers of (q_r, q_t, o_r, o_t) as a marker sees them.
pub fn product(powers: [u8; 4], pose: &Pose, marker: usize) -> f64 {
    let mut products = Products::default();
    let place = products.place(powers);
    products.values(pose)[place][marker]
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
        assert!((product([2, 1, 1, 1], &pose, 2) - expected).abs() < 1e-15);
        assert_eq!(product([0; 4], &pose, 2), 1.0);
    }
}
