//! Things on the film other than its markers: patches and specks.

use crate::options::{all_within, within};
use crate::{Disc, HALF_SIDE_MM, SceneError, noise};

/// A round patch that moves with the film.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(deny_unknown_fields))]
pub struct Patch {
    /// Place of its centre on the film at rest, mm, within ±14.
    pub centre_mm: [f64; 2],
    /// Radius, 0.01 to 10 mm; a marker has 0.5 mm.
    pub radius_mm: f64,
    /// Its colour.
    pub paint: Paint,
}

/// The colour of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(rename_all = "lowercase"))]
pub enum Paint {
    /// The markers' red: a distraction, or a bridge that merges two markers.
    Red,
    /// The film's own colour: it cuts what lies beneath.
    Film,
    /// The reflection of a lamp: white, and as bright as the camera can show.
    Glare,
    /// Matte black: a sixth of the film's light.
    Black,
    /// Blue: a fifth of the film's red, half of its green, nearly all of its blue.
    Blue,
    /// Skin: a hue near red, and less saturated than the markers.
    Skin,
}

impl Paint {
    /// Every paint.
    pub const ALL: [Paint; 6] = [
        Paint::Red,
        Paint::Film,
        Paint::Glare,
        Paint::Black,
        Paint::Blue,
        Paint::Skin,
    ];

    /// Returns the name in files: `red`, `film`, `glare`, `black`, `blue` or `skin`.
    pub fn name(self) -> &'static str {
        match self {
            Paint::Red => "red",
            Paint::Film => "film",
            Paint::Glare => "glare",
            Paint::Black => "black",
            Paint::Blue => "blue",
            Paint::Skin => "skin",
        }
    }
}

/// Red specks all over the film; they move with it. The scene's seed decides their places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specks {
    /// Their number, 0 to 100,000.
    pub count: u32,
    /// Radius of each, 0.01 to 1 mm; a pixel of QVGA sees about 0.06 mm.
    pub radius_mm: f64,
}

impl Default for Specks {
    /// No specks; their radius would be 0.05 mm.
    fn default() -> Specks {
        Specks {
            count: 0,
            radius_mm: 0.05,
        }
    }
}

impl Patch {
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        all_within("centre_mm", self.centre_mm, [-14.0, 14.0])?;
        within("radius_mm", self.radius_mm, [0.01, 10.0])
    }

    pub(crate) fn disc(&self) -> Disc {
        Disc {
            centre_mm: self.centre_mm,
            radius_mm: self.radius_mm,
        }
    }
}

impl Specks {
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        within("specks", f64::from(self.count), [0.0, 100_000.0])?;
        within("speck_radius_mm", self.radius_mm, [0.01, 1.0])
    }

    /// Returns the specks as discs.
    pub(crate) fn discs(&self, seed: u64) -> Vec<Disc> {
        let mut place = noise::uniform(seed).map(|part| HALF_SIDE_MM * (2.0 * part - 1.0));
        let mut next = || place.next().unwrap_or_default();
        (0..self.count)
            .map(|_| Disc {
                centre_mm: [next(), next()],
                radius_mm: self.radius_mm,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specks_lie_all_over_the_film_where_the_seed_says() {
        let specks = Specks {
            count: 2000,
            ..Specks::default()
        };
        let discs = specks.discs(1);
        assert_eq!(discs, specks.discs(1));
        assert_ne!(discs, specks.discs(2));
        let quarter = discs
            .iter()
            .filter(|disc| disc.centre_mm[0] > 0.0 && disc.centre_mm[1] > 0.0);
        assert!((430..570).contains(&quarter.count()));
    }
}
