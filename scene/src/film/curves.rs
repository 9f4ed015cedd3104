//! The reduced film's curves: what a few numbers say of a press, and how they are evaluated.
//!
//! A press is a size s between 0 and 1, a tilt q and an offset o of the tip (each in parts of its largest; what they
//! are parts of is the matter of whoever asks). Each output is s · Σ c_m(s) · q_r^a q_t^b o_r^c o_t^d: polynomials in
//! tilt and offset whose coefficients are Chebyshev series in s. The film has the symmetry of a square, so one marker's
//! curves serve all four: r and t run along its diagonal, outward, and across it, x towards y. Mirroring at the diagonal
//! leaves terms of even b + d to what is even under it, and odd ones to the rest.
//!
//! A marker is a small disc. Its nine outputs are the affine map that is nearest to the film's displacement over the
//! disc: the disc's mean displacement and its slopes along r and t.

use super::products::{MOST_PRODUCTS, Products};
use super::table::{Lead, TIP, Table};
use crate::MARKERS;

pub use super::products::product;

/// Chebyshev polynomials at most.
pub const TERMS: usize = 24;
/// The highest degree of a term in tilt and offset together.
pub const DEGREE: u8 = 12;

/// What a curve contributes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The disc's mean displacement along r, t and z, mm.
    Moved(Part),
    /// The displacement's slope along r.
    AlongR(Part),
    /// The displacement's slope along t.
    AlongT(Part),
    /// A vector that belongs to no marker, seen in the marker's directions: where the tip goes (mm) or what pushes it
    /// (N).
    Tip(Part),
}

/// A component in a marker's own directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Along its diagonal, outward.
    R,
    /// Across it, x towards y.
    T,
    /// Away from the camera.
    Z,
}

impl Output {
    /// All twelve, in the order of [`Output::index`].
    pub const ALL: [Output; 12] = {
        use Output::{AlongR, AlongT, Moved, Tip};
        use Part::{R, T, Z};
        [
            Moved(R),
            Moved(T),
            Moved(Z),
            AlongR(R),
            AlongR(T),
            AlongR(Z),
            AlongT(R),
            AlongT(T),
            AlongT(Z),
            Tip(R),
            Tip(T),
            Tip(Z),
        ]
    };

    /// Its place among all.
    pub fn index(self) -> usize {
        let (row, part) = match self {
            Output::Moved(part) => (0, part),
            Output::AlongR(part) => (1, part),
            Output::AlongT(part) => (2, part),
            Output::Tip(part) => (3, part),
        };
        3 * row + part as usize
    }

    /// Whether mirroring at the marker's diagonal changes its sign.
    pub fn is_odd(self) -> bool {
        match self {
            Output::Moved(part) | Output::AlongR(part) | Output::Tip(part) => part == Part::T,
            Output::AlongT(part) => part != Part::T,
        }
    }

    /// Whether a half turn leaves a term of this degree to it: the tip's vector belongs to the whole film.
    pub fn allows_degree(self, degree: u8) -> bool {
        match self {
            Output::Tip(Part::Z) => degree.is_multiple_of(2),
            Output::Tip(_) => !degree.is_multiple_of(2),
            _ => true,
        }
    }
}

/// A press, in parts of the largest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// How hard, 0 to 1.
    pub size: f64,
    /// Which way, −1 to 1 each along x and y.
    pub tilt: [f64; 2],
    /// Where the tip meets the film, along x and y.
    pub offset: [f64; 2],
}

/// What the curves say of a press.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// The tip's vector, film frame.
    pub tip: [f64; 3],
    /// The markers, by identity.
    pub discs: [DiscMotion; 4],
}

/// How the film around a marker moves: by `moved_mm + along_x · x + along_y · y` at (x, y) mm from its centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiscMotion {
    /// Mean over the disc, mm, film frame. Where the film sticks to the tip its x and y put the centroid of the disc's image
    /// where the full solution has it: within 0.002 mm of the mean.
    pub moved_mm: [f64; 3],
    /// Slope along x, mm per mm.
    pub along_x: [f64; 3],
    /// Slope along y, mm per mm.
    pub along_y: [f64; 3],
}

impl DiscMotion {
    /// The displacement of the film at (x, y) mm from the marker's centre.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        std::array::from_fn(|k| self.moved_mm[k] + self.along_x[k] * x + self.along_y[k] * y)
    }
}

/// One curve: the coefficient of one term of one output.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What it contributes to.
    pub output: Output,
    /// The powers of (q_r, q_t, o_r, o_t); their sum is at most [`DEGREE`].
    pub powers: [u8; 4],
    /// The coefficient as a Chebyshev series in s, at most [`TERMS`] long.
    pub series: Vec<f64>,
}

/// A set of curves, ready to be evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    pub(super) curves: Vec<Curve>,
    products: Products,
    table: Table,
}

impl Curves {
    /// Curves of at most [`TERMS`] numbers, of at most 95 different terms whose powers sum up to at most [`DEGREE`];
    /// others are left out.
    pub fn new(curves: impl IntoIterator<Item = Curve>) -> Curves {
        let fits = |curve: &Curve| {
            let degree: u32 = curve.powers.iter().map(|power| u32::from(*power)).sum();
            degree <= u32::from(DEGREE) && curve.series.len() <= TERMS
        };
        let mut curves: Vec<Curve> = curves.into_iter().filter(fits).collect();
        let mut products = Products::default();
        // The tip's first, so that it can be told without the others.
        let of_tip = |curve: &Curve| matches!(curve.output, Output::Tip(_));
        for curve in curves.iter().filter(|curve| of_tip(curve)) {
            products.place(curve.powers);
        }
        products.mark_tip();
        curves.retain(|curve| products.place(curve.powers).is_some());
        let table = Table::new(&curves, &products);
        Curves {
            curves,
            products,
            table,
        }
    }

    /// Number of curves.
    pub fn count(&self) -> usize {
        self.curves.len()
    }

    /// Tip and markers under a press.
    pub fn at(&self, pose: &Pose) -> Answer {
        let mut products = [[0.0; MOST_PRODUCTS]; 2];
        self.products.values(pose, &mut products);
        Answer {
            tip: tip(self.table.tip_sums(pose.size, &products[0])),
            discs: discs(self.table.sums(pose.size, &products)),
        }
    }

    /// The markers alone.
    pub fn discs(&self, pose: &Pose) -> [DiscMotion; 4] {
        let mut products = [[0.0; MOST_PRODUCTS]; 2];
        self.products.values(pose, &mut products);
        discs(self.table.sums(pose.size, &products))
    }

    /// The tip's vector alone.
    pub fn tip(&self, pose: &Pose) -> [f64; 3] {
        let mut products = [[0.0; MOST_PRODUCTS]];
        self.products.tip_values(pose, &mut products);
        tip(self.table.tip_sums(pose.size, &products[0]))
    }

    /// The first terms of the tip's vector.
    pub(super) fn lead(&self, size: f64) -> Lead {
        self.table.lead(size)
    }
}

impl Answer {
    /// The outputs as each marker sees them, by [`Output::index`] and identity.
    pub fn outputs(&self) -> [[f64; 4]; 12] {
        let mut outputs = [[0.0; 4]; 12];
        for (k, disc) in self.discs.iter().enumerate() {
            let corner = MARKERS[k].centre_mm;
            let half = std::f64::consts::FRAC_1_SQRT_2;
            let [x, y] = corner.map(|part| half * part.signum());
            let slope = |by_x: f64, by_y: f64| {
                std::array::from_fn(|c| by_x * disc.along_x[c] + by_y * disc.along_y[c])
            };
            let rows: [[f64; 3]; 4] = [disc.moved_mm, slope(x, y), slope(-x, y), self.tip];
            for (row, [vx, vy, vz]) in rows.into_iter().enumerate() {
                let [r, t] = to_diagonal([vx, vy], corner);
                for (part, value) in [r, t, vz].into_iter().enumerate() {
                    outputs[3 * row + part][k] = value;
                }
            }
        }
        outputs
    }
}

/// A row of three outputs as marker `k` sees it, in the film frame.
fn vector(sums: &[[f64; 4]; TIP], row: usize, k: usize) -> [f64; 3] {
    let [r, t, z] = [0, 1, 2].map(|part| sums[3 * row + part][k]);
    let [x, y] = from_diagonal([r, t], MARKERS[k].centre_mm);
    [x, y, z]
}

/// The tip's vector as the first marker sees it, in the film frame; the symmetry of the curves gives all four the same.
fn tip([r, t, z]: [f64; 3]) -> [f64; 3] {
    let [x, y] = from_diagonal([r, t], MARKERS[0].centre_mm);
    [x, y, z]
}

/// From the markers' own directions to the film frame.
fn discs(sums: [[f64; 4]; TIP]) -> [DiscMotion; 4] {
    std::array::from_fn(|k| {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let [x, y] = MARKERS[k].centre_mm.map(|part| half * part.signum());
        let (along_r, along_t) = (vector(&sums, 1, k), vector(&sums, 2, k));
        DiscMotion {
            moved_mm: vector(&sums, 0, k),
            along_x: std::array::from_fn(|c| x * (along_r[c] - along_t[c])),
            along_y: std::array::from_fn(|c| y * (along_r[c] + along_t[c])),
        }
    })
}

/// Mirrors a vector into the (+, +) corner and turns it: along the diagonal of a corner and across it.
pub fn to_diagonal([x, y]: [f64; 2], [corner_x, corner_y]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (x * corner_x.signum(), y * corner_y.signum());
    let half = std::f64::consts::FRAC_1_SQRT_2;
    [half * (x + y), half * (y - x)]
}

/// The way back.
pub(super) fn from_diagonal([r, t]: [f64; 2], [corner_x, corner_y]: [f64; 2]) -> [f64; 2] {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    [
        half * (r - t) * corner_x.signum(),
        half * (r + t) * corner_y.signum(),
    ]
}

/// T_0 … of 2s − 1, for s in 0 to 1.
pub fn chebyshev(s: f64) -> [f64; TERMS] {
    let x = 2.0 * s - 1.0;
    let mut values = [1.0; TERMS];
    values[1] = x;
    for k in 2..TERMS {
        values[k] = 2.0 * x * values[k - 1] - values[k - 2];
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chebyshev_polynomials_are_cosines() {
        for s in [0.0, 0.1, 0.5, 0.93, 1.0] {
            let angle = libm::acos(2.0 * s - 1.0);
            for (k, value) in chebyshev(s).iter().enumerate() {
                assert!((value - libm::cos(k as f64 * angle)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn diagonals_point_outward_and_come_back() {
        for marker in MARKERS {
            let rest = marker.centre_mm;
            let [r, t] = to_diagonal(rest, rest);
            assert!(r > 5.0 && t.abs() < 1e-12);
            let [x, y] = from_diagonal(to_diagonal([0.3, -0.7], rest), rest);
            assert!((x - 0.3).abs() < 1e-12 && (y + 0.7).abs() < 1e-12);
        }
    }

    #[test]
    fn an_affine_field_comes_back_in_the_film_frame() {
        // Displacement (a + b x) along x and c y along z, as marker 2 sees it.
        let (a, b, c) = (0.2, 0.03, -0.5);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let outputs = [
            (Output::Moved(Part::R), a * half),
            (Output::Moved(Part::T), -a * half),
            (Output::AlongR(Part::R), b / 2.0),
            (Output::AlongR(Part::T), -b / 2.0),
            (Output::AlongR(Part::Z), c * half),
            (Output::AlongT(Part::R), -b / 2.0),
            (Output::AlongT(Part::T), b / 2.0),
            (Output::AlongT(Part::Z), c * half),
        ];
        let curves = Curves::new(outputs.map(|(output, value)| Curve {
            output,
            powers: [0; 4],
            series: vec![value],
        }));
        let pose = Pose {
            size: 1.0,
            tilt: [0.0; 2],
            offset: [0.0; 2],
        };
        let disc = curves.at(&pose).discs[2];
        let close = |found: [f64; 3], expected: [f64; 3]| {
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-15, "{found} {expected}");
            }
        };
        close(disc.moved_mm, [a, 0.0, 0.0]);
        close(disc.along_x, [b, 0.0, 0.0]);
        close(disc.along_y, [0.0, 0.0, c]);
        close(disc.at([2.0, 3.0]), [a + 2.0 * b, 0.0, 3.0 * c]);
    }

    #[test]
    fn outputs_are_the_way_back() {
        let vector = |seed: f64| [0.1, 0.7, -0.3].map(|x| libm::sin(x + seed));
        let disc = |k: usize| DiscMotion {
            moved_mm: vector(k as f64),
            along_x: vector(10.0 + k as f64),
            along_y: vector(20.0 + k as f64),
        };
        let told = Answer {
            tip: vector(30.0),
            discs: std::array::from_fn(disc),
        };
        let outputs = told.outputs();
        let back = discs(std::array::from_fn(|output| outputs[output]));
        for (k, (there, again)) in told.discs.iter().zip(back).enumerate() {
            for at in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] {
                for (there, again) in there.at(at).iter().zip(again.at(at)) {
                    assert!((there - again).abs() < 1e-15, "{there} {again}");
                }
            }
            let [r, t, z] = [9, 10, 11].map(|output| outputs[output][k]);
            let [x, y] = from_diagonal([r, t], MARKERS[k].centre_mm);
            for (there, again) in told.tip.iter().zip([x, y, z]) {
                assert!((there - again).abs() < 1e-15, "{there} {again}");
            }
        }
    }
}
