//! The polynomials in size and tilt whose sum is the film's answer at one place.

use super::pose::{LARGEST_SIZE, LARGEST_TILT, Pose};

/// Terms are stored in groups of this many, which a processor adds in parallel.
pub const LANES: usize = 8;
/// The largest number of terms of a set.
pub const MOST_TERMS: usize = 88;
const MOST_SIZES: usize = 8;
const MOST_TILTS: usize = 5;

/// A set of terms s·T_i(2s/s_max − 1)·a^j·b^k. T_i are Chebyshev polynomials of the size s; a and b
/// are the tilt in parts of the largest.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms {
    powers: Vec<[u8; 3]>,
}

/// The values of a set's terms, padded with zeros to whole [`LANES`].
pub type Values = [f32; MOST_TERMS];

impl Terms {
    /// Returns the terms of tilts up to a degree, with `sizes` sizes without tilt and fewer with
    /// it: one less for each `per_size` degrees of tilt, or part of them.
    pub fn up_to(sizes: u8, degree: u8, per_size: u8) -> Terms {
        let left = |tilt: u8| sizes.saturating_sub(tilt.div_ceil(per_size));
        Terms::with_sizes((0..=degree).map(left))
    }

    /// Returns the terms with the first number of sizes without tilt, the second with its first
    /// degree, and further on.
    pub fn with_sizes(sizes: impl IntoIterator<Item = u8>) -> Terms {
        let mut powers = Vec::new();
        for (tilt, left) in (0..).zip(sizes) {
            for b in 0..=tilt {
                powers.extend((0..left).map(|size| [size, tilt - b, b]));
            }
        }
        powers.truncate(MOST_TERMS);
        Terms { powers }
    }

    /// Returns the number of terms.
    pub fn count(&self) -> usize {
        self.powers.len()
    }

    /// Returns the number of terms including the padding of the last group.
    pub fn padded(&self) -> usize {
        self.powers.len().next_multiple_of(LANES)
    }

    /// Returns the terms' values at a pose.
    pub fn values(&self, pose: &Pose) -> Values {
        let factors = Factors::at(pose);
        let mut values = [0.0; MOST_TERMS];
        for (value, [i, j, k]) in values.iter_mut().zip(&self.powers) {
            let [i, j, k] = [i, j, k].map(|&power| usize::from(power));
            *value = (factors.sizes[i] * (factors.x[j] * factors.y[k])) as f32;
        }
        values
    }

    /// Returns the terms' values at a pose in double precision.
    pub fn exact(&self, pose: &Pose) -> Vec<f64> {
        let at = Factors::at(pose);
        let value = |[i, j, k]: [usize; 3]| at.sizes[i] * (at.x[j] * at.y[k]);
        let powers = self.powers.iter();
        powers.map(|p| value(p.map(usize::from))).collect()
    }

    /// Returns each term's powers: of the size, and of the tilt along x and along y.
    pub fn powers(&self) -> &[[u8; 3]] {
        &self.powers
    }

    /// Returns the terms' values and their derivatives by size and tilt (1/rad), row by row.
    pub fn rows(&self, pose: &Pose) -> [Vec<f64>; 4] {
        let at = Factors::at(pose);
        let row = |what: &dyn Fn([usize; 3]) -> f64| {
            let powers = self.powers.iter();
            powers.map(|p| what(p.map(usize::from))).collect()
        };
        let slope = |powers: &[f64], j: usize| match j {
            0 => 0.0,
            _ => j as f64 * powers[j - 1] / LARGEST_TILT,
        };
        [
            row(&|[i, j, k]| at.sizes[i] * at.x[j] * at.y[k]),
            row(&|[i, j, k]| at.size_slopes[i] * at.x[j] * at.y[k]),
            row(&|[i, j, k]| at.sizes[i] * slope(&at.x, j) * at.y[k]),
            row(&|[i, j, k]| at.sizes[i] * at.x[j] * slope(&at.y, k)),
        ]
    }
}

/// The factors of the terms.
struct Factors {
    sizes: [f64; MOST_SIZES],
    size_slopes: [f64; MOST_SIZES],
    x: [f64; MOST_TILTS],
    y: [f64; MOST_TILTS],
}

impl Factors {
    fn at(pose: &Pose) -> Factors {
        let x = 2.0 * pose.size / LARGEST_SIZE - 1.0;
        let (mut t, mut slopes) = ([1.0; MOST_SIZES], [0.0; MOST_SIZES]);
        (t[1], slopes[1]) = (x, 1.0);
        for i in 2..MOST_SIZES {
            t[i] = 2.0 * x * t[i - 1] - t[i - 2];
            slopes[i] = 2.0 * t[i - 1] + 2.0 * x * slopes[i - 1] - slopes[i - 2];
        }
        let rate = 2.0 / LARGEST_SIZE;
        let [along_x, along_y] = pose.tilt.map(|part| powers(part / LARGEST_TILT));
        Factors {
            sizes: t.map(|t| pose.size * t),
            size_slopes: std::array::from_fn(|i| t[i] + pose.size * rate * slopes[i]),
            x: along_x,
            y: along_y,
        }
    }
}

fn powers(base: f64) -> [f64; MOST_TILTS] {
    let mut powers = [1.0; MOST_TILTS];
    for j in 1..MOST_TILTS {
        powers[j] = powers[j - 1] * base;
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_sizes_are_left_to_higher_tilts() {
        assert_eq!(Terms::up_to(7, 4, 1).count(), 65);
        assert_eq!(Terms::up_to(7, 4, 2).count(), 82);
        assert_eq!(Terms::up_to(7, 4, 1).padded(), 72);
    }

    #[test]
    fn rows_are_values_and_their_differences() {
        let terms = Terms::up_to(7, 4, 1);
        let pose = |[size, x, y]: [f64; 3]| Pose {
            size,
            tilt: [x, y],
            place_mm: [0.0; 2],
        };
        let at = [0.4, 0.3, -0.5];
        let rows = terms.rows(&pose(at));
        let values = terms.values(&pose(at));
        for (value, reported) in rows[0].iter().zip(values) {
            assert!((value - f64::from(reported)).abs() < 1e-7);
        }
        for (axis, slopes) in rows[1..].iter().enumerate() {
            let step = 1e-6;
            let [mut back, mut forth] = [at; 2];
            back[axis] -= step;
            forth[axis] += step;
            let [back, forth] = [back, forth].map(|at| terms.rows(&pose(at))[0].clone());
            for ((a, b), slope) in back.iter().zip(&forth).zip(slopes) {
                assert!(((b - a) / (2.0 * step) - slope).abs() < 1e-6);
            }
        }
    }
}
