//! The force on the film.

use std::f64::consts::PI;

use crate::SceneError;

/// A force on the film's centre, in newtons.
///
/// Film frame, right-handed: x right and y down in the image, z away from the camera, so that a press has F_z < 0.
/// F = |F| · (sin α cos β, sin β, −cos α cos β): β's stage carries α's (the paper's goniometer, Section 6).
/// Whether the film can take it is the film's to say ([`crate::Film::check`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    vector_n: [f64; 3],
    magnitude_n: f64,
    alpha_deg: f64,
    beta_deg: f64,
}

impl Load {
    /// No force. A force without size has no direction: α and β are 0.
    pub const REST: Load = Load {
        vector_n: [0.0; 3],
        magnitude_n: 0.0,
        alpha_deg: 0.0,
        beta_deg: 0.0,
    };

    /// A force by size (N, ≥ 0) and direction (degrees, between −90 and 90).
    ///
    /// # Errors
    /// When a number is not finite, `magnitude_n` is negative or an angle is not between −90° and 90°.
    pub fn from_angles(
        magnitude_n: f64,
        alpha_deg: f64,
        beta_deg: f64,
    ) -> Result<Load, SceneError> {
        check_magnitude(magnitude_n)?;
        check_angle("α", alpha_deg)?;
        check_angle("β", beta_deg)?;
        if magnitude_n == 0.0 {
            return Ok(Load::REST);
        }
        let (sin_a, cos_a) = libm::sincos(radians(alpha_deg));
        let (sin_b, cos_b) = libm::sincos(radians(beta_deg));
        let direction = [sin_a * cos_b, sin_b, -(cos_a * cos_b)];
        Ok(Load {
            vector_n: direction.map(|part| magnitude_n * part),
            magnitude_n,
            alpha_deg,
            beta_deg,
        })
    }

    /// A force by its vector (N) in the film frame, F_z < 0 (or no force at all).
    ///
    /// # Errors
    /// When a component is not finite, or the force does not press (F_z ≥ 0).
    pub fn from_vector(vector_n: [f64; 3]) -> Result<Load, SceneError> {
        let [x, y, z] = vector_n;
        let magnitude_n = (x * x + y * y + z * z).sqrt();
        check_magnitude(magnitude_n)?;
        if magnitude_n == 0.0 {
            return Ok(Load::REST);
        }
        if z >= 0.0 {
            return Err(SceneError::Load(format!(
                "F_z is {z} N: a tip can only press, which is F_z < 0"
            )));
        }
        Ok(Load {
            vector_n,
            magnitude_n,
            alpha_deg: degrees(libm::atan2(x, -z)),
            beta_deg: degrees(libm::asin(y / magnitude_n)),
        })
    }

    /// (F_x, F_y, F_z) in N.
    pub fn vector_n(&self) -> [f64; 3] {
        self.vector_n
    }

    /// |F| in N, ≥ 0.
    pub fn magnitude_n(&self) -> f64 {
        self.magnitude_n
    }

    /// α in degrees, −90 to 90; 0 at rest.
    pub fn alpha_deg(&self) -> f64 {
        self.alpha_deg
    }

    /// β in degrees, −90 to 90; 0 at rest.
    pub fn beta_deg(&self) -> f64 {
        self.beta_deg
    }
}

fn check_magnitude(magnitude_n: f64) -> Result<(), SceneError> {
    if magnitude_n.is_finite() && magnitude_n >= 0.0 {
        return Ok(());
    }
    Err(SceneError::Load(format!(
        "|F| is {magnitude_n} N: use a finite number of newtons, 0 or more"
    )))
}

fn check_angle(name: &str, degrees: f64) -> Result<(), SceneError> {
    if degrees > -90.0 && degrees < 90.0 {
        return Ok(());
    }
    Err(SceneError::Load(format!(
        "{name} is {degrees}°: use an angle between −90° and 90°"
    )))
}

/// Degrees to radians.
pub(crate) fn radians(degrees: f64) -> f64 {
    degrees * (PI / 180.0)
}

fn degrees(radians: f64) -> f64 {
    radians * (180.0 / PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn axes_point_as_the_convention_says() {
        let press = Load::from_angles(0.1, 0.0, 0.0).unwrap();
        assert_eq!(press.vector_n(), [0.0, 0.0, -0.1]);
        assert!(Load::from_angles(0.1, 5.0, 0.0).unwrap().vector_n()[0] > 0.0);
        assert!(Load::from_angles(0.1, 0.0, 5.0).unwrap().vector_n()[1] > 0.0);
    }

    #[test]
    fn what_is_no_load_is_refused() {
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(Load::from_angles(bad, 0.0, 0.0).is_err(), "|F| = {bad}");
        }
        for bad in [-90.0, 90.0, f64::NAN, f64::INFINITY] {
            assert!(Load::from_angles(0.1, bad, 0.0).is_err(), "α = {bad}");
            assert!(Load::from_angles(0.1, 0.0, bad).is_err(), "β = {bad}");
        }
        assert!(Load::from_vector([0.0, 0.0, 0.1]).is_err());
        assert!(Load::from_vector([0.1, 0.0, 0.0]).is_err());
        assert!(Load::from_vector([f64::NAN, 0.0, -0.1]).is_err());
        assert!(Load::from_vector([1e200, 0.0, -1e200]).is_err());
    }

    #[test]
    fn no_force_has_no_direction() {
        assert_eq!(Load::from_angles(0.0, 5.0, 5.0).unwrap(), Load::REST);
        assert_eq!(Load::from_vector([0.0; 3]).unwrap(), Load::REST);
    }

    proptest! {
        #[test]
        fn angles_and_vector_say_the_same(f in 1e-6..1.0, a in -89.0..89.0, b in -89.0..89.0) {
            let by_angles = Load::from_angles(f, a, b).unwrap();
            let by_vector = Load::from_vector(by_angles.vector_n()).unwrap();
            prop_assert!((by_vector.magnitude_n() - f).abs() <= 1e-12 * f);
            prop_assert!((by_vector.alpha_deg() - a).abs() < 1e-9);
            prop_assert!((by_vector.beta_deg() - b).abs() < 1e-9);
        }
    }
}
