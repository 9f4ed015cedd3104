//! The differences of one film from the nominal one.

use crate::film::{Dots, FilmError};

/// A film as it was made, relative to the nominal film.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Unit {
    /// Young's modulus in parts of the nominal 1 MPa, 0.5 to 2.
    pub stiffness: f64,
    /// Thickness in parts of the nominal 0.5 mm, 0.7 to 1.3.
    pub thickness: f64,
    /// Stiffness of the posts' grip in parts of the nominal 20 N/mm³, 0.2 to 5.
    pub grip: f64,
    /// Each post's shift from its nominal place, by the identity of the marker next to it, mm,
    /// within ±1.
    pub posts_mm: [[f64; 2]; 4],
    /// Shift of each marker's centre from its place, mm, within ±1; 0 where none is given.
    #[cfg_attr(feature = "file", serde(skip))]
    pub markers_mm: Dots<[f64; 2]>,
}

impl Default for Unit {
    /// The nominal film.
    fn default() -> Unit {
        Unit {
            stiffness: 1.0,
            thickness: 1.0,
            grip: 1.0,
            posts_mm: [[0.0; 2]; 4],
            markers_mm: [[0.0; 2]; 4].into(),
        }
    }
}

impl Unit {
    /// Returns the factors of bending and stretching stiffness over the nominal film's.
    pub fn bending_and_stretching(&self) -> [f64; 2] {
        let Unit {
            stiffness: e,
            thickness: t,
            ..
        } = *self;
        [e * t * t * t, e * t]
    }

    /// # Errors
    /// If a part is outside its range.
    pub fn check(&self) -> Result<(), FilmError> {
        let parts = [
            ("the film's stiffness", self.stiffness, [0.5, 2.0]),
            ("the film's thickness", self.thickness, [0.7, 1.3]),
            ("the posts' grip", self.grip, [0.2, 5.0]),
        ];
        let posts = self.posts_mm.map(|place| ("a post's", place));
        let markers = self
            .markers_mm
            .into_iter()
            .map(|place| ("a marker's", place));
        let places = posts
            .into_iter()
            .chain(markers)
            .flat_map(|(what, place)| place.map(|part| (what, part, [-1.0, 1.0])));
        for (what, value, [from, to]) in parts.into_iter().chain(places) {
            if !(from..=to).contains(&value) {
                return Err(FilmError::Load(format!(
                    "{what} difference from the nominal film is {value}: use {from} to {to}"
                )));
            }
        }
        Ok(())
    }

    /// Returns the factors of the film's tables: the logarithms of thickness and of grip over
    /// stiffness, then the posts' shifts.
    pub(crate) fn parts(&self) -> [f64; 10] {
        let grip = libm::log(self.grip / self.stiffness);
        let thickness = libm::log(self.thickness);
        let [a, b, c, d] = self.posts_mm;
        [
            thickness, grip, a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nominal_film_differs_in_nothing() {
        assert_eq!(Unit::default().parts(), [0.0; 10]);
        assert_eq!(Unit::default().check(), Ok(()));
    }

    #[test]
    fn what_no_one_builds_is_refused() {
        let thick = Unit {
            thickness: 1.5,
            ..Unit::default()
        };
        let text = thick.check().unwrap_err().to_string();
        assert!(
            text.contains("thickness") && text.contains("0.7 to 1.3"),
            "{text}"
        );
        let mut far = Unit::default();
        far.markers_mm[2][1] = f64::NAN;
        assert!(far.check().is_err());
    }
}
