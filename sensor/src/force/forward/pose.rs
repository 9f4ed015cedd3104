//! Describes a load in the variables in which the film's answer is nearly a polynomial.

use super::terms::Limits;
use crate::force::kernels::sqrt;

/// A force and the place where it presses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// The strength: |F| = `linear_n`·size + `cubic_n`·size³ ([`Stiffness`]).
    pub size: f32,
    /// The force's polar angle, split along x and y, rad.
    pub tilt: [f32; 2],
    /// Where the tip touches the film, mm.
    pub place_mm: [f32; 2],
    /// How wide the contact is: 0 as the tables' tip, 1 as a soft disc of 4.4 mm. It is known if a
    /// table has [widths](super::Widths), and 0 otherwise.
    pub width: f32,
}

/// The force of a size: first the film's bending resists, then its stretching.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// The linear coefficient, N.
    pub linear_n: f32,
    /// The cubic coefficient, N.
    pub cubic_n: f32,
}

/// Newton's steps to a size. From above, where the cubic is convex, six reach 10⁻⁶ relative.
const SIZE_STEPS: usize = 8;

impl Stiffness {
    /// |F| of a size, N.
    pub fn magnitude_n(&self, size: f32) -> f32 {
        size * self.linear_n + size * size * size * self.cubic_n
    }

    /// The slope of |F| by size, N.
    pub fn per_size_n(&self, size: f32) -> f32 {
        self.linear_n + 3.0 * size * size * self.cubic_n
    }

    /// The size of |F|, N, at most `largest`.
    pub fn size_of(&self, magnitude_n: f32, largest: f32) -> f32 {
        let mut size = (magnitude_n / self.linear_n).min(largest);
        for _ in 0..SIZE_STEPS {
            size -= (self.magnitude_n(size) - magnitude_n) / self.per_size_n(size);
        }
        limited(size, 0.0, largest)
    }
}

/// As `f32::clamp`, which panics if its limits are not in order; here they come from a model file.
pub fn limited(value: f32, least: f32, most: f32) -> f32 {
    if value < least {
        least
    } else if value > most {
        most
    } else {
        value
    }
}

impl Pose {
    /// Returns the pose of a force, N, that presses (F_z < 0) at a place, mm. A force that pulls
    /// gives size 0.
    pub fn of_force(
        [x, y, z]: [f32; 3],
        place_mm: [f32; 2],
        stiffness: &Stiffness,
        limits: &Limits,
    ) -> Pose {
        if z >= 0.0 {
            return Pose {
                place_mm,
                ..Pose::default()
            };
        }
        let magnitude_n = sqrt(x * x + y * y + z * z);
        let tangents = [x, y].map(|part| (part / -z).clamp(-2.0, 2.0));
        let part = angle_over_tangent(tangents);
        Pose {
            size: stiffness.size_of(magnitude_n, limits.size),
            tilt: tangents.map(|tangent| part * tangent),
            place_mm,
            width: 0.0,
        }
    }

    /// The force's direction, a unit vector, exact to 10⁻⁷ for tilts of at most 1 rad.
    pub fn direction(&self) -> [f32; 3] {
        let [x, y] = self.tilt;
        let (sine, cosine) = sine_over_angle_and_cosine(x * x + y * y);
        [sine * x, sine * y, -cosine]
    }

    /// The size of the tilt, rad.
    pub fn angle(&self) -> f32 {
        let [x, y] = self.tilt;
        sqrt(x * x + y * y)
    }
}

/// sin θ / θ and cos θ from θ² ≤ 1: series to θ¹⁰ and θ¹².
pub fn sine_over_angle_and_cosine(t: f32) -> (f32, f32) {
    const SINE: [f32; 6] = [
        -1.0 / 39_916_800.0,
        1.0 / 362_880.0,
        -1.0 / 5_040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
        1.0,
    ];
    const COSINE: [f32; 7] = [
        1.0 / 479_001_600.0,
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -0.5,
        1.0,
    ];
    let horner = |parts: &[f32]| parts.iter().fold(0.0, |sum, part| sum * t + part);
    (horner(&SINE), horner(&COSINE))
}

/// θ / tan θ, for tangents up to 2 exact to 0.005: good enough for a first guess.
fn angle_over_tangent([x, y]: [f32; 2]) -> f32 {
    // Shafer's formula: arctan t / t ≈ 3 / (1 + 2 √(1 + t²)).
    3.0 / (1.0 + 2.0 * sqrt(1.0 + x * x + y * y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const STIFFNESS: Stiffness = Stiffness {
        linear_n: 0.01,
        cubic_n: 1.0,
    };
    const LIMITS: Limits = Limits {
        size: 0.6288,
        tilt: 0.674_741,
    };

    proptest! {
        #[test]
        fn forces_come_back(f in 1e-6f32..0.254, tilt in 0.0f32..0.67, turn in 0.0f32..6.2) {
            let force = [
                f * tilt.sin() * turn.cos(),
                f * tilt.sin() * turn.sin(),
                -f * tilt.cos(),
            ];
            let pose = Pose::of_force(force, [1.0, 2.0], &STIFFNESS, &LIMITS);
            let magnitude = STIFFNESS.magnitude_n(pose.size);
            prop_assert!((magnitude - f).abs() < 2e-6 * f + 1e-9, "{} {}", magnitude, f);
            for (a, b) in pose.direction().into_iter().zip(force) {
                prop_assert!((a - b / f).abs() < 0.01);
            }
        }

        #[test]
        fn directions_are_exact(x in -0.7f32..0.7, y in -0.7f32..0.7) {
            let pose = Pose { tilt: [x, y], ..Pose::default() };
            let angle = f64::from(x).hypot(f64::from(y));
            let [dx, dy, dz] = pose.direction().map(f64::from);
            let part = if angle > 0.0 { angle.sin() / angle } else { 1.0 };
            prop_assert!((dx - part * f64::from(x)).abs() < 2e-7);
            prop_assert!((dy - part * f64::from(y)).abs() < 2e-7);
            prop_assert!((dz + angle.cos()).abs() < 2e-7);
        }
    }

    #[test]
    fn what_does_not_press_is_nothing() {
        for z in [0.0, 0.1] {
            let pose = Pose::of_force([0.1, 0.0, z], [1.0, 2.0], &STIFFNESS, &LIMITS);
            assert_eq!((pose.size, pose.tilt), (0.0, [0.0; 2]));
        }
        let far = Pose::of_force([0.0, 0.0, -1e9], [0.0; 2], &STIFFNESS, &LIMITS);
        assert_eq!(far.size, LIMITS.size);
    }
}
