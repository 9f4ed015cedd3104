//! The room behind a film that lets light through.

use crate::options::within;
use crate::{Patch, SceneError};

/// The room behind the film.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Room {
    /// The part of the light that passes the film, 0 to 1: 0 for an opaque film, 0.9 for clear
    /// silicone. The rest is scattered, as the opaque film scatters all of it.
    pub transmission: f64,
    /// The room's light on things behind the film, in parts of the lamp's on the film, 0 to 10. A
    /// wall of the film's colour fills the view.
    pub brightness: f64,
    /// Radius of a fingertip that presses, where it touches the film, mm, 0 to 10; 0 for a tip that
    /// is not seen. The lamp lights it through the film.
    pub finger_mm: f64,
    /// Things in the room, where they are seen on the film at rest. They do not move with it.
    #[cfg_attr(feature = "file", serde(rename = "thing"))]
    pub things: Vec<Patch>,
}

impl Default for Room {
    /// An opaque film in front of a room that is as bright.
    fn default() -> Room {
        Room {
            transmission: 0.0,
            brightness: 1.0,
            finger_mm: 0.0,
            things: Vec::new(),
        }
    }
}

impl Room {
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        within("transmission", self.transmission, [0.0, 1.0])?;
        within("brightness", self.brightness, [0.0, 10.0])?;
        within("finger_mm", self.finger_mm, [0.0, 10.0])?;
        self.things.iter().try_for_each(Patch::check)
    }

    /// Returns the colour of a film that has `film` where it is opaque, in front of a thing of the
    /// room.
    pub(crate) fn through(&self, film: [f64; 3], behind: [f64; 3]) -> [f64; 3] {
        self.over(film, behind, self.brightness)
    }

    /// Returns the same in front of a thing that touches the film: the lamp's light passes the film
    /// twice.
    pub(crate) fn through_to_touching(&self, film: [f64; 3], behind: [f64; 3]) -> [f64; 3] {
        self.over(film, behind, self.transmission)
    }

    fn over(&self, film: [f64; 3], behind: [f64; 3], light: f64) -> [f64; 3] {
        let passes = self.transmission;
        std::array::from_fn(|c| film[c] * (1.0 - passes) + behind[c] * (passes * light))
    }
}
