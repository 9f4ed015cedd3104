//! The effect of a film's own weight on its markers, at rest and under a load.
//!
//! Weight along the normal acts as a load of its own that is spread over the film. It raises the
//! size s of the tip's load to the root a of L·a + a³ = L·s + s³ − k·g_z. The displacement by
//! weight is nearly in proportion to Δ = a − s, from hanging freely to under a deep press. The rest
//! of it are powers of Δ and, under a load, sums of the [`Terms`]. Weight along the film moves the
//! film in proportion.

use super::LINEAR_N;
use super::axis::Axis;
use super::pose::{Pose, size_of};
use super::table::Table;
use super::terms::Terms;
use super::unit::Unit;
use crate::film::{DiscMotion, FilmError, MARKER_CENTRES_MM};

/// The straight press that sinks the film as its weight does, N. The posts carry the rest of the
/// film's 4.1 mN.
pub const AS_A_PRESS_N: f64 = 2.2e-3;
/// Nodes of the tip's place for the effect of weight, along x and along y, mm.
const NODES_MM: [f64; 9] = [-5.0, -3.8, -2.6, -1.3, 0.0, 1.3, 2.6, 3.8, 5.0];
/// The number of functions of gravity whose sum is the effect of weight at rest.
const AT_REST: usize = 7;
/// The number of functions of gravity whose sum is the change of that effect under a load.
const UNDER_LOAD: usize = 4;
/// Count of numbers in a [`DiscMotion`].
const DISC: usize = 9;

/// The effect of weight on marker 2 of the nominal film.
#[derive(Clone, Debug, PartialEq)]
pub struct Weight {
    /// Motion and slopes at rest per function of [`Pull::at_rest`].
    at_rest: [[f64; DISC]; AT_REST],
    /// The addition by a load to the motion along x and along z per function of
    /// [`Pull::under_load`].
    under_load: Table,
}

/// Gravity on a film under a load of a size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// Along x and y, in parts of g on the nominal film.
    along: [f64; 2],
    /// Difference of the load's size with and without the film's weight.
    larger: f64,
}

impl Pull {
    /// Returns the pull on a film whose tip presses with a load of this size; gravity in parts of
    /// g.
    pub fn new(size: f64, down: [f64; 3], unit: &Unit) -> Pull {
        let [bending, stretching] = unit.bending_and_stretching();
        let linear = LINEAR_N * bending / stretching;
        let [x, y, z] = down.map(|part| part / unit.stiffness);
        let press_n = linear * size + size * size * size;
        Pull {
            along: [x, y],
            larger: size_of(press_n - AS_A_PRESS_N * z, linear) - size,
        }
    }

    /// Returns the functions of gravity whose sum is the effect of weight at rest.
    pub fn at_rest(&self) -> [f64; AT_REST] {
        let Pull {
            along: [x, y],
            larger: d,
        } = *self;
        [d, d * d, d * d * d, x, y, x * d, y * d]
    }

    /// Returns the functions of gravity whose sum is added under a load.
    pub fn under_load(&self) -> [f64; UNDER_LOAD] {
        let [d, square, _, x, y, ..] = self.at_rest();
        [d, square, x, y]
    }

    fn swapped(self) -> Pull {
        let [x, y] = self.along;
        Pull {
            along: [y, x],
            ..self
        }
    }
}

impl Weight {
    /// Returns the nodes of the tip's place along x and along y.
    pub fn axis() -> Axis {
        Axis::new(&NODES_MM)
    }

    /// Returns the terms of the part that a load adds.
    pub fn terms() -> Terms {
        Terms::up_to(4, 2, 1)
    }

    /// Makes it from the motion and slopes of marker 2 per function of [`Pull::at_rest`], and from
    /// the coefficients of the part that a load adds. These are ordered by node along y, node along
    /// x, function of [`Pull::under_load`], motion along x and z, and term.
    pub fn new(at_rest: [DiscMotion; AT_REST], coefficients: &[f64]) -> Weight {
        let outputs = 2 * UNDER_LOAD;
        Weight {
            at_rest: at_rest.map(numbers),
            under_load: Table::new(Weight::axis(), Weight::terms(), outputs, coefficients),
        }
    }

    /// Returns the bytes that a file stores.
    pub fn to_bytes(&self) -> Vec<u8> {
        let at_rest = self.at_rest.as_flattened().iter();
        let mut bytes: Vec<u8> = at_rest
            .flat_map(|part| (*part as f32).to_le_bytes())
            .collect();
        bytes.extend(self.under_load.to_bytes());
        bytes
    }

    /// Reads it from a file's bytes.
    ///
    /// # Errors
    /// If there are too few or too many bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Weight, FilmError> {
        let wrong = |why: &str| FilmError::Tables(format!("what weight does {why}: make it anew"));
        let (own, mut left) = bytes
            .split_at_checked(4 * AT_REST * DISC)
            .ok_or_else(|| wrong("is cut off"))?;
        let mut at_rest = [[0.0; DISC]; AT_REST];
        let parts = own.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
        for (slot, part) in at_rest.as_flattened_mut().iter_mut().zip(parts) {
            *slot = f64::from(part);
        }
        let (axis, terms) = (Weight::axis(), Weight::terms());
        let under_load = Table::take(axis, terms, 2 * UNDER_LOAD, &mut left)?;
        match left {
            [] => Ok(Weight {
                at_rest,
                under_load,
            }),
            _ => Err(wrong("is followed by something")),
        }
    }

    /// Returns the motion that gravity, in parts of g in the film's frame, adds to the film around
    /// marker `k`, which sits `unit.markers_mm` off its place. Of a unit's own differences only
    /// stiffness and thickness count.
    pub fn disc(&self, pose: &Pose, down: [f64; 3], unit: &Unit, k: usize) -> DiscMotion {
        let signs = MARKER_CENTRES_MM[k].map(f64::signum);
        let [x, y, z] = down;
        let pull = Pull::new(pose.size, [signs[0] * x, signs[1] * y, z], unit);
        let here = pose.mirrored(signs);
        let mut own = [0.0; DISC];
        for (part, row) in pull.at_rest().into_iter().zip(&self.at_rest) {
            for (sum, value) in own.iter_mut().zip(row) {
                *sum += part * value;
            }
        }
        if pose.size > 0.0 {
            let [along, away] = self.more(&here, &pull);
            let [across, _] = self.more(&here.swapped(), &pull.swapped());
            for (sum, more) in own.iter_mut().zip([along, across, away]) {
                *sum += more;
            }
        }
        let disc = disc(&own);
        let [bx, by] = unit.markers_mm.at(k);
        let moved_mm = disc.at([signs[0] * bx, signs[1] * by]);
        super::tables::mirrored_disc(DiscMotion { moved_mm, ..disc }, signs)
    }

    /// Returns the part that a load adds to the motion along x and along z.
    fn more(&self, pose: &Pose, pull: &Pull) -> [f64; 2] {
        let sums: [f64; 2 * UNDER_LOAD] = self.under_load.sums(&self.under_load.at(pose), 0);
        let pairs = sums.as_chunks::<2>().0.iter().zip(pull.under_load());
        pairs.fold([0.0; 2], |[x, z], ([along, away], part)| {
            [x + part * along, z + part * away]
        })
    }
}

fn numbers(disc: DiscMotion) -> [f64; DISC] {
    let DiscMotion {
        moved_mm: [a, b, c],
        along_x: [d, e, f],
        along_y: [g, h, i],
    } = disc;
    [a, b, c, d, e, f, g, h, i]
}

fn disc([a, b, c, d, e, f, g, h, i]: &[f64; DISC]) -> DiscMotion {
    DiscMotion {
        moved_mm: [*a, *b, *c],
        along_x: [*d, *e, *f],
        along_y: [*g, *h, *i],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_towards_the_camera_is_as_a_press_and_the_other_way_lifts() {
        let unit = Unit::default();
        let larger = |size, z| Pull::new(size, [0.0, 0.0, z], &unit).larger;
        assert!(larger(0.0, -1.0) > 0.1 && larger(0.0, 1.0) == -larger(0.0, -1.0));
        assert!(larger(0.3, -1.0) > 0.0 && larger(0.3, -1.0) < 0.1 * larger(0.0, -1.0));
        assert_eq!(larger(0.3, 0.0).abs(), 0.0);
    }

    #[test]
    fn files_keep_it() {
        let disc = |k: usize| DiscMotion {
            moved_mm: [k as f64, 2.0, 0.5],
            along_x: [0.25, 0.0, 1.0],
            along_y: [0.0, -1.0, 3.0],
        };
        let count = 81 * 2 * UNDER_LOAD * Weight::terms().count();
        let values: Vec<f64> = (0..count).map(|k| libm::sin(k as f64)).collect();
        let weight = Weight::new(std::array::from_fn(disc), &values);
        let bytes = weight.to_bytes();
        let read = Weight::from_bytes(&bytes).unwrap();
        let pose = Pose {
            size: 0.3,
            tilt: [0.2, -0.1],
            place_mm: [1.0, -2.0],
        };
        let unit = Unit::default();
        let at = |weight: &Weight| weight.disc(&pose, [0.6, 0.0, -0.8], &unit, 1).moved_mm;
        for (a, b) in at(&weight).into_iter().zip(at(&read)) {
            assert!((a - b).abs() < 1e-4 && a != 0.0, "{a} {b}");
        }
        assert!(Weight::from_bytes(&bytes[1..]).is_err());
        assert!(Weight::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
    }
}
