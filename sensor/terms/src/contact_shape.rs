//! Defines the shape of what presses the film, as far as known.

use crate::units::Micrometres;

/// The contact's shape. Displacements and their uncertainty depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub enum ContactShape {
    /// A tip like the model's: of 0.5 mm radius on a simulated unit, the gauge's on a calibrated
    /// one.
    Needle,
    /// A soft or rounded tip: the radius of its contact, [`ContactShape::RADII`].
    Round(Micrometres),
    /// A rigid flat face: its radius, [`ContactShape::RADII`].
    Flat(Micrometres),
    /// Any of these, up to 4 mm, and pads, edges and tilted faces of that size.
    #[default]
    Unknown,
}

impl ContactShape {
    /// Allowed radii.
    pub const RADII: core::ops::RangeInclusive<Micrometres> = Micrometres(250)..=Micrometres(4000);

    /// Returns the radius, if the shape has one.
    pub fn radius(self) -> Option<Micrometres> {
        match self {
            ContactShape::Round(radius) | ContactShape::Flat(radius) => Some(radius),
            ContactShape::Needle | ContactShape::Unknown => None,
        }
    }

    /// Returns whether the radius, if there is one, is allowed.
    pub fn is_sound(self) -> bool {
        self.radius()
            .is_none_or(|radius| ContactShape::RADII.contains(&radius))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_have_a_range() {
        assert!(ContactShape::Needle.is_sound() && ContactShape::default().is_sound());
        for (um, is_sound) in [(249, false), (250, true), (4000, true), (4001, false)] {
            let radius = Micrometres(um);
            assert_eq!(ContactShape::Round(radius).is_sound(), is_sound);
            assert_eq!(ContactShape::Flat(radius).is_sound(), is_sound);
        }
    }
}
