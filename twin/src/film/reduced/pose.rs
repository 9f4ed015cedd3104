//! A load in variables in which the film's answer is nearly a polynomial.

/// A load of size s is a force of `LINEAR_N`·s + s³ newton. Thus s grows like the depth, both where
/// bending holds the film and where stretching does.
pub const LINEAR_N: f64 = 0.01;
/// The size of the largest load, 0.255 N.
pub const LARGEST_SIZE: f64 = 0.628_8;
/// The largest tilt, rad: the tangential force is 0.8 of the normal one.
pub const LARGEST_TILT: f64 = 0.674_740_942_223_553_1;

/// A force and its place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// The size, see [`LINEAR_N`]; 0 to [`LARGEST_SIZE`].
    pub size: f64,
    /// The force's polar angle, split along x and y, rad; at most [`LARGEST_TILT`] long.
    pub tilt: [f64; 2],
    /// The place where the tip touches the film, mm.
    pub place_mm: [f64; 2],
}

impl Pose {
    /// Returns the pose of a force (N, F_z < 0 or the zero vector) at a place (mm). `stiffness` are
    /// the factors of the film's bending and stretching stiffness over the nominal film's.
    pub fn of_force(force_n: [f64; 3], place_mm: [f64; 2], stiffness: [f64; 2]) -> Pose {
        let [x, y, z] = force_n;
        let sideways = libm::hypot(x, y);
        let angle = libm::atan2(sideways, -z);
        let part = if sideways > 0.0 {
            angle / sideways
        } else {
            0.0
        };
        let [bending, stretching] = stiffness;
        let linear = LINEAR_N * bending / stretching;
        Pose {
            size: size_of(libm::hypot(sideways, z) / stretching, linear),
            tilt: [x * part, y * part],
            place_mm,
        }
    }

    /// Returns the force on the nominal film, N.
    pub fn force_n(&self) -> [f64; 3] {
        let size_n = LINEAR_N * self.size + self.size * self.size * self.size;
        self.direction().map(|part| size_n * part)
    }

    /// Returns the force's direction, a unit vector.
    pub fn direction(&self) -> [f64; 3] {
        let [x, y] = self.tilt;
        let angle = libm::hypot(x, y);
        let part = if angle > 0.0 {
            libm::sin(angle) / angle
        } else {
            1.0
        };
        [part * x, part * y, -libm::cos(angle)]
    }

    /// Returns the load mirrored: x and y take these signs.
    pub fn mirrored(&self, [sx, sy]: [f64; 2]) -> Pose {
        let mirror = |[x, y]: [f64; 2]| [sx * x, sy * y];
        Pose {
            size: self.size,
            tilt: mirror(self.tilt),
            place_mm: mirror(self.place_mm),
        }
    }

    /// Returns the load mirrored at the diagonal x = y.
    pub fn swapped(&self) -> Pose {
        let swap = |[x, y]: [f64; 2]| [y, x];
        Pose {
            size: self.size,
            tilt: swap(self.tilt),
            place_mm: swap(self.place_mm),
        }
    }
}

/// Returns the root s of linear·s + s³ = f, for linear > 0.
pub(super) fn size_of(f: f64, linear: f64) -> f64 {
    // Cardano's formula without cancellation: s = 2 √(linear / 3) sinh(asinh(…) / 3).
    let scale = 2.0 * libm::sqrt(linear / 3.0);
    let argument = 3.0 * f / (linear * scale);
    scale * libm::sinh(libm::asinh(argument) / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn forces_come_back(f in 0.0..0.2549f64, tilt in 0.0..LARGEST_TILT, turn in 0.0..6.3) {
            let (sin, cos) = libm::sincos(turn);
            let sideways = f * libm::sin(tilt);
            let force = [sideways * cos, sideways * sin, -f * libm::cos(tilt)];
            let pose = Pose::of_force(force, [1.0, 2.0], [1.0; 2]);
            prop_assert!((0.0..=LARGEST_SIZE).contains(&pose.size));
            for (a, b) in pose.force_n().into_iter().zip(force) {
                prop_assert!((a - b).abs() < 1e-14, "{} {}", a, b);
            }
        }

        #[test]
        fn a_stiffer_film_is_as_one_that_is_pressed_less(f in 1e-5..0.2f64, by in 1.0..1.2f64) {
            let nominal = Pose::of_force([0.0, 0.0, -f], [0.0; 2], [1.0; 2]);
            let stiffer = Pose::of_force([0.0, 0.0, -f * by], [0.0; 2], [by; 2]);
            prop_assert!((nominal.size - stiffer.size).abs() < 1e-12);
        }
    }
}
