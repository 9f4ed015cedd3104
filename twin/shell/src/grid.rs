//! The grid of cells over the film, and the coefficients that describe its motion.

use crate::point::V3;
use crate::shell::LOCAL;
use crate::sparse::COMPONENTS;
use crate::spline::{Axis, SUPPORT};

/// The film's cells: the products of the spans along x and along y.
pub struct Grid {
    /// Along x and along y.
    pub axes: [Axis; 2],
    /// Number of Gauss points along one side of a cell, 2 or 3.
    pub points: usize,
}

/// A point of the film, described by the functions that are not zero there.
pub struct Place {
    /// The first function along x and along y.
    pub origin: [usize; 2],
    /// The functions' values; function (i, j) after the first is at 4 · j + i.
    pub values: [f64; LOCAL],
    /// Their derivatives by x and by y.
    pub slopes: [[f64; LOCAL]; 2],
}

impl Grid {
    /// Returns the numbers of functions along x and along y.
    pub fn functions(&self) -> [usize; 2] {
        [self.axes[0].functions(), self.axes[1].functions()]
    }

    /// Returns the number of unknowns.
    pub fn unknowns(&self) -> usize {
        let [columns, rows] = self.functions();
        COMPONENTS * columns * rows
    }

    /// Returns the place that rests at (x, y) mm.
    pub fn place(&self, [x, y]: [f64; 2]) -> Place {
        let origin = [self.axes[0].span_of(x), self.axes[1].span_of(y)];
        let along_x = self.axes[0].basis(origin[0], x);
        let along_y = self.axes[1].basis(origin[1], y);
        let products = |dx: usize, dy: usize| {
            std::array::from_fn(|k| along_x[dx][k % SUPPORT] * along_y[dy][k / SUPPORT])
        };
        Place {
            origin,
            values: products(0, 0),
            slopes: [products(1, 0), products(0, 1)],
        }
    }

    /// Returns the index of a cell's coefficient `local`.
    #[inline]
    pub fn coefficient(&self, [i, j]: [usize; 2], local: usize) -> usize {
        (j + local / SUPPORT) * self.axes[0].functions() + i + local % SUPPORT
    }

    /// Returns the coefficients of the functions that are not zero on a cell.
    #[inline]
    pub fn gather(&self, u: &[f64], origin: [usize; 2]) -> [V3; LOCAL] {
        let mut gathered = [[0.0; 3]; LOCAL];
        for (local, slot) in gathered.iter_mut().enumerate() {
            let first = COMPONENTS * self.coefficient(origin, local);
            slot.copy_from_slice(&u[first..first + COMPONENTS]);
        }
        gathered
    }

    /// Returns the displacement of a place, mm.
    pub fn interpolate(&self, u: &[f64], place: &Place) -> V3 {
        weighted(&place.values, &self.gather(u, place.origin))
    }

    /// Returns the derivatives of the displacement by x and by y at a place.
    pub fn gradients(&self, u: &[f64], place: &Place) -> [V3; 2] {
        let local = self.gather(u, place.origin);
        [
            weighted(&place.slopes[0], &local),
            weighted(&place.slopes[1], &local),
        ]
    }
}

fn weighted(weights: &[f64; LOCAL], local: &[V3; LOCAL]) -> V3 {
    let mut sum = [0.0; 3];
    for (weight, vector) in weights.iter().zip(local) {
        for (total, part) in sum.iter_mut().zip(vector) {
            *total += weight * part;
        }
    }
    sum
}
