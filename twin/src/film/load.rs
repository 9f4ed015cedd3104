//! The force on the film.

use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

use crate::film::FilmError;
use crate::film::MAX_RATIO;
use crate::film::reduced::NOMINAL_RADIUS_MM;

/// How the label (α, β, |F|) of a load relates to the tip. It decides how well anything can be
/// measured: at 0.2 N and 800×600, a degree moves the markers by 0.2 px (`Force`) or 1.8 px
/// (`Stick`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(try_from = "String"))]
pub enum Contact {
    /// The label is the direction and size of the force on the film. The tip goes where the film
    /// lets it.
    #[default]
    Force,
    /// The tip moves in the label's direction and the film sticks to it, up to a friction ratio of
    /// 0.8. |F| is the force along that direction, as a gauge on the paper's stage reads it. The
    /// force on the film is tilted more than the travel.
    Stick,
    /// As `Stick`, until the sideways force is μ times the normal one (in the film's frame). Then
    /// the tip slides over the film in its direction of travel, and the sideways force stays at μ
    /// times the normal one.
    Slip {
        /// The friction ratio, 0.05 to 0.8.
        mu: f64,
    },
}

impl FromStr for Contact {
    type Err = FilmError;

    /// Reads `force`, `stick` or, with the friction ratio, `slip:0.6`.
    fn from_str(text: &str) -> Result<Contact, FilmError> {
        let contact = match (text, text.strip_prefix("slip:")) {
            ("force", _) => Some(Contact::Force),
            ("stick", _) => Some(Contact::Stick),
            (_, Some(mu)) => mu.parse().ok().map(|mu| Contact::Slip { mu }),
            _ => None,
        };
        let contact = contact.ok_or_else(|| {
            FilmError::Load(format!("contact `{text}`: use force, stick or slip:0.6"))
        })?;
        contact.check()?;
        Ok(contact)
    }
}

#[cfg(feature = "file")]
impl TryFrom<String> for Contact {
    type Error = FilmError;

    fn try_from(text: String) -> Result<Contact, FilmError> {
        text.parse()
    }
}

impl fmt::Display for Contact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Contact::Force => f.write_str("force"),
            Contact::Stick => f.write_str("stick"),
            Contact::Slip { mu } => write!(f, "slip:{mu}"),
        }
    }
}

impl Contact {
    /// # Errors
    /// If the friction ratio is outside its range.
    fn check(self) -> Result<(), FilmError> {
        match self {
            Contact::Slip { mu } if !(0.05..=MAX_RATIO).contains(&mu) => {
                Err(FilmError::Load(format!(
                    "the friction ratio is {mu}: use 0.05 to {MAX_RATIO}; what holds better sticks"
                )))
            }
            _ => Ok(()),
        }
    }
}

/// A load on the film: a labelled force in newtons, the meaning of its label, and its place.
///
/// Film frame, right-handed: x right and y down in the image, z away from the camera. A press has
/// F_z < 0. F = |F| · (sin α cos β, sin β, −cos α cos β): β's stage carries α's (the paper's
/// goniometer, Section 6). [`crate::film::Film::check`] decides whether the film can take the load.
/// [`crate::film::Pressed::force_n`] is the force that then acts on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    vector_n: [f64; 3],
    magnitude_n: f64,
    alpha_deg: f64,
    beta_deg: f64,
    contact: Contact,
    offset_mm: [f64; 2],
    tip_radius_mm: f64,
}

impl Load {
    /// No force. A force of size 0 has no direction: α and β are 0.
    pub const REST: Load = Load {
        vector_n: [0.0; 3],
        magnitude_n: 0.0,
        alpha_deg: 0.0,
        beta_deg: 0.0,
        contact: Contact::Force,
        offset_mm: [0.0; 2],
        tip_radius_mm: NOMINAL_RADIUS_MM,
    };

    /// Returns a force of a size (N, ≥ 0) and a direction (degrees, between −90 and 90).
    ///
    /// # Errors
    /// If a number is not finite, `magnitude_n` is negative or an angle is not between −90° and
    /// 90°.
    pub fn from_angles(magnitude_n: f64, alpha_deg: f64, beta_deg: f64) -> Result<Load, FilmError> {
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
            ..Load::REST
        })
    }

    /// Returns a force from its vector (N) in the film frame, with F_z < 0, or the zero vector.
    ///
    /// # Errors
    /// If a component is not finite, or the force does not press (F_z ≥ 0).
    pub fn from_vector(vector_n: [f64; 3]) -> Result<Load, FilmError> {
        let [x, y, z] = vector_n;
        let magnitude_n = (x * x + y * y + z * z).sqrt();
        check_magnitude(magnitude_n)?;
        if magnitude_n == 0.0 {
            return Ok(Load::REST);
        }
        if z >= 0.0 {
            return Err(FilmError::Load(format!(
                "F_z is {z} N: a tip can only press, which is F_z < 0"
            )));
        }
        Ok(Load {
            vector_n,
            magnitude_n,
            alpha_deg: degrees(libm::atan2(x, -z)),
            beta_deg: degrees(libm::asin(y / magnitude_n)),
            ..Load::REST
        })
    }

    /// Returns the same label with another meaning.
    ///
    /// # Errors
    /// If the friction ratio is outside its range.
    pub fn with_contact(self, contact: Contact) -> Result<Load, FilmError> {
        contact.check()?;
        Ok(Load { contact, ..self })
    }

    /// Returns the same load; its tip first touches the film (x, y) mm from the middle.
    ///
    /// # Errors
    /// If a number is not finite.
    pub fn with_offset_mm(self, offset_mm: [f64; 2]) -> Result<Load, FilmError> {
        if !offset_mm.iter().all(|part| part.is_finite()) {
            return Err(FilmError::Load(format!(
                "the tip's offset is {offset_mm:?} mm: use finite numbers"
            )));
        }
        Ok(Load { offset_mm, ..self })
    }

    /// Returns the same load by a tip that spreads it over a disc of this radius, mm.
    ///
    /// # Errors
    /// If the radius is not finite.
    pub fn with_tip_radius_mm(self, tip_radius_mm: f64) -> Result<Load, FilmError> {
        if !tip_radius_mm.is_finite() {
            return Err(FilmError::Load(format!(
                "the tip's radius is {tip_radius_mm} mm: use a finite number"
            )));
        }
        Ok(Load {
            tip_radius_mm,
            ..self
        })
    }

    /// Returns the load with these values in place of those that it leaves open. A new load leaves
    /// them all open. The values must be possible.
    pub fn or(self, contact: Contact, offset_mm: [f64; 2], tip_radius_mm: f64) -> Load {
        let plain = self.contact == Contact::Force;
        let central = self.offset_mm == [0.0; 2];
        let nominal = self.tip_radius_mm == NOMINAL_RADIUS_MM;
        Load {
            contact: if plain { contact } else { self.contact },
            offset_mm: if central { offset_mm } else { self.offset_mm },
            tip_radius_mm: if nominal {
                tip_radius_mm
            } else {
                self.tip_radius_mm
            },
            ..self
        }
    }

    /// Returns the meaning of the label.
    pub fn contact(&self) -> Contact {
        self.contact
    }

    /// Returns the place where the tip first touches the film, mm from the middle along x and y.
    pub fn offset_mm(&self) -> [f64; 2] {
        self.offset_mm
    }

    /// Returns the radius of the disc over which the tip spreads its force, by (1 − r²/R²)², mm.
    pub fn tip_radius_mm(&self) -> f64 {
        self.tip_radius_mm
    }

    /// Returns the label's vector (F_x, F_y, F_z) in N. In the reading [`Contact::Force`] it is the
    /// force on the film, otherwise |F| along the tip's direction of travel.
    pub fn vector_n(&self) -> [f64; 3] {
        self.vector_n
    }

    /// Returns |F| in N, ≥ 0.
    pub fn magnitude_n(&self) -> f64 {
        self.magnitude_n
    }

    /// Returns α in degrees, −90 to 90; 0 at rest.
    pub fn alpha_deg(&self) -> f64 {
        self.alpha_deg
    }

    /// Returns β in degrees, −90 to 90; 0 at rest.
    pub fn beta_deg(&self) -> f64 {
        self.beta_deg
    }
}

fn check_magnitude(magnitude_n: f64) -> Result<(), FilmError> {
    if magnitude_n.is_finite() && magnitude_n >= 0.0 {
        return Ok(());
    }
    Err(FilmError::Load(format!(
        "|F| is {magnitude_n} N: use a finite number of newtons, 0 or more"
    )))
}

fn check_angle(name: &str, degrees: f64) -> Result<(), FilmError> {
    if degrees > -90.0 && degrees < 90.0 {
        return Ok(());
    }
    Err(FilmError::Load(format!(
        "{name} is {degrees}°: use an angle between −90° and 90°"
    )))
}

fn radians(degrees: f64) -> f64 {
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

    #[test]
    fn contact_and_offset_are_kept_or_refused() {
        let load = Load::from_angles(0.1, 5.0, 0.0).unwrap();
        assert_eq!(
            (load.contact(), load.offset_mm()),
            (Contact::Force, [0.0; 2])
        );
        let slip = load.with_contact(Contact::Slip { mu: 0.6 }).unwrap();
        let slip = slip.with_offset_mm([0.1, -0.2]).unwrap();
        assert_eq!(slip.contact(), Contact::Slip { mu: 0.6 });
        assert_eq!(slip.offset_mm(), [0.1, -0.2]);
        assert_eq!(slip.vector_n(), load.vector_n());
        for mu in [0.0, 0.9, -0.6, f64::NAN] {
            assert!(load.with_contact(Contact::Slip { mu }).is_err(), "μ = {mu}");
        }
        assert!(load.with_offset_mm([0.0, f64::NAN]).is_err());
        for name in ["force", "stick", "slip:0.6"] {
            assert_eq!(name.parse::<Contact>().unwrap().to_string(), name);
        }
        for name in ["slip", "slip:", "slip:2", "glue"] {
            assert!(name.parse::<Contact>().is_err(), "{name}");
        }
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
