//! The reduced film: a few curves of the force instead of the solver.
//!
//! With s = (|F| / 0.25 N)^⅓, the tangents q = (F_x, F_y)/−F_z of the direction and the tip's offset o, both in parts
//! of their largest, a marker's displacement is s · Σ c_m(s) · q_r^a q_t^b o_r^c o_t^d: polynomials in the tilt and the
//! offset whose coefficients are Chebyshev series in s. The film has the symmetry of a square, so one marker's curves
//! serve all four: r and t run along its diagonal and across it, and mirroring at the diagonal leaves terms of even
//! b + d to the motions along r and z, and odd ones to t.
//!
//! The curves hold for the `force` reading. A tip that sticks pulls the film sideways as hard as it presses; one side
//! goes slack, and polynomials of the tilt no longer follow (cubic ones stray by 3 px): that is the full solver's.

mod fit;
mod format;

pub use fit::{Check, fit};

use hivtac_scene::Load;

use crate::FilmError;
use crate::view::MARKERS_MM;

/// The largest force that the curves hold for, N.
pub const MAX_FORCE_N: f64 = 0.25;
/// The largest |α| and |β| that the curves hold for, degrees.
pub const MAX_TILT_DEG: [f64; 2] = [12.0, 10.0];
/// The largest offset of the tip that the curves hold for, mm.
pub const MAX_OFFSET_MM: f64 = 0.25;
/// The largest tangent: tan 12°.
const MAX_TANGENT: f64 = 0.212_556_561_670_022_13;
/// Chebyshev polynomials at most.
const TERMS: usize = 20;

/// What a curve contributes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// A marker's motion along its diagonal, outward.
    Radial,
    /// A marker's motion across its diagonal, x towards y.
    Tangential,
    /// A marker's motion away from the camera.
    Normal,
    /// The tip's motion towards the camera.
    Depth,
}

/// One term: the powers of (q_r, q_t, o_r, o_t), and its coefficient as a Chebyshev series in s.
#[derive(Clone, Debug, PartialEq)]
struct Curve {
    motion: Motion,
    powers: [u8; 4],
    series: Vec<f64>,
}

/// The reduced film.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduced {
    curves: Vec<Curve>,
}

/// What the reduced film says of a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// How deep the tip is, mm.
    pub tip_depth_mm: f64,
    /// How the markers moved, mm, film frame, by identity.
    pub moved_mm: [[f64; 3]; 4],
}

impl Reduced {
    /// Number of curves.
    pub fn curves(&self) -> usize {
        self.curves.len()
    }

    /// Tip and markers under a load at an offset of the tip, mm.
    ///
    /// # Errors
    /// When the load or the offset is beyond what the curves hold for.
    pub fn press(&self, load: &Load, offset_mm: [f64; 2]) -> Result<Pressed, FilmError> {
        check(load, offset_mm)?;
        if load.magnitude_n() == 0.0 {
            return Ok(Pressed {
                tip_depth_mm: 0.0,
                moved_mm: [[0.0; 3]; 4],
            });
        }
        let sizes = self.sizes((load.magnitude_n() / MAX_FORCE_N).cbrt());
        let ways = Ways::new(load.vector_n(), offset_mm);
        let motions = MARKERS_MM.map(|rest| self.motions(&sizes, &ways.powers(rest)));
        let moved = |k: usize| {
            let [r, t, z, _] = motions[k];
            let [x, y] = from_diagonal([r, t], MARKERS_MM[k]);
            [x, y, z]
        };
        Ok(Pressed {
            // The tip belongs to no marker: the mean of what the four diagonals say.
            tip_depth_mm: motions.iter().map(|[.., depth]| depth).sum::<f64>() / 4.0,
            moved_mm: std::array::from_fn(moved),
        })
    }

    /// s times each curve's value at s.
    fn sizes(&self, s: f64) -> Vec<f64> {
        let polynomials = chebyshev(s);
        self.curves
            .iter()
            .map(|curve| s * curve.at(&polynomials))
            .collect()
    }

    /// One marker's motions, in the order of [`Motion`].
    fn motions(&self, sizes: &[f64], powers: &[[f64; 4]; 4]) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for (curve, size) in self.curves.iter().zip(sizes) {
            sums[curve.motion as usize] += size * term(&curve.powers, powers);
        }
        sums
    }
}

impl Curve {
    /// The coefficient where Chebyshev's polynomials have these values.
    fn at(&self, polynomials: &[f64; TERMS]) -> f64 {
        self.series
            .iter()
            .zip(polynomials)
            .map(|(c, t)| c * t)
            .sum()
    }
}

/// Tilt and offset, in parts of their largest.
struct Ways {
    tilt: [f64; 2],
    offset: [f64; 2],
}

impl Ways {
    fn new([x, y, z]: [f64; 3], offset_mm: [f64; 2]) -> Ways {
        Ways {
            tilt: [x, y].map(|part| part / -z / MAX_TANGENT),
            offset: offset_mm.map(|part| part / MAX_OFFSET_MM),
        }
    }

    /// Powers 0 to 3 of (q_r, q_t, o_r, o_t) as a marker sees them.
    fn powers(&self, rest: [f64; 2]) -> [[f64; 4]; 4] {
        let [qr, qt] = to_diagonal(self.tilt, rest);
        let [or, ot] = to_diagonal(self.offset, rest);
        [qr, qt, or, ot].map(|x| [1.0, x, x * x, x * x * x])
    }
}

fn term(exponents: &[u8; 4], powers: &[[f64; 4]; 4]) -> f64 {
    let factors = exponents.iter().zip(powers);
    factors
        .map(|(exponent, powers)| powers[usize::from(*exponent)])
        .product()
}

/// Mirrors a vector into the (+, +) corner and turns it: along the diagonal and across it.
fn to_diagonal([x, y]: [f64; 2], [corner_x, corner_y]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (x * corner_x.signum(), y * corner_y.signum());
    [
        (x + y) / std::f64::consts::SQRT_2,
        (y - x) / std::f64::consts::SQRT_2,
    ]
}

/// The way back.
fn from_diagonal([r, t]: [f64; 2], [corner_x, corner_y]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (
        (r - t) / std::f64::consts::SQRT_2,
        (r + t) / std::f64::consts::SQRT_2,
    );
    [x * corner_x.signum(), y * corner_y.signum()]
}

/// T_0 … of 2s − 1, for s in 0 to 1.
fn chebyshev(s: f64) -> [f64; TERMS] {
    let x = 2.0 * s - 1.0;
    let mut values = [1.0; TERMS];
    values[1] = x;
    for k in 2..TERMS {
        values[k] = 2.0 * x * values[k - 1] - values[k - 2];
    }
    values
}

fn check(load: &Load, [x, y]: [f64; 2]) -> Result<(), FilmError> {
    let offset = (x * x + y * y).sqrt();
    let bounds = [
        ("|F|", load.magnitude_n(), MAX_FORCE_N, "N"),
        ("|α|", load.alpha_deg().abs(), MAX_TILT_DEG[0], "°"),
        ("|β|", load.beta_deg().abs(), MAX_TILT_DEG[1], "°"),
        ("the tip's offset", offset, MAX_OFFSET_MM, "mm"),
    ];
    for (what, value, most, unit) in bounds {
        // Angles come back from a vector with a rounding.
        if value.is_nan() || value > most * (1.0 + 1e-9) {
            return Err(FilmError::Contact(format!(
                "{what} is {value} {unit} and the reduced film holds up to {most}: use less, or the full solver"
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chebyshev_polynomials_are_cosines() {
        for s in [0.0, 0.1, 0.5, 0.93, 1.0] {
            let angle = f64::acos(2.0 * s - 1.0);
            for (k, value) in chebyshev(s).iter().enumerate() {
                assert!((value - (k as f64 * angle).cos()).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn diagonals_point_outward_and_come_back() {
        for rest in MARKERS_MM {
            let [r, t] = to_diagonal(rest, rest);
            assert!(r > 5.0 && t.abs() < 1e-12);
            let [x, y] = from_diagonal(to_diagonal([0.3, -0.7], rest), rest);
            assert!((x - 0.3).abs() < 1e-12 && (y + 0.7).abs() < 1e-12);
        }
    }

    #[test]
    fn beyond_the_curves_is_refused() {
        let reduced = Reduced { curves: Vec::new() };
        let refused = |f, a, b, o| {
            let load = Load::from_angles(f, a, b).unwrap();
            reduced.press(&load, o).unwrap_err().to_string()
        };
        assert!(refused(0.26, 0.0, 0.0, [0.0; 2]).contains("|F|"));
        assert!(refused(0.2, -12.5, 0.0, [0.0; 2]).contains("|α|"));
        assert!(refused(0.2, 0.0, 10.5, [0.0; 2]).contains("|β|"));
        assert!(refused(0.2, 0.0, 0.0, [0.2, 0.2]).contains("offset"));
        assert!(refused(0.2, 0.0, 0.0, [f64::NAN, 0.2]).contains("offset"));
        let limit = Load::from_angles(0.25, 12.0, -10.0).unwrap();
        assert!(reduced.press(&limit, [0.0, 0.25]).is_ok());
    }
}
