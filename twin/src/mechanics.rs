//! The film's answer to a load, complete or simplified, to measure the effect of each part.

use crate::film::DiscMotion;
use crate::film::reduced::{NOMINAL_RADIUS_MM, Unit};
use crate::film::{Dots, Film, FilmError, Layout, Pressed};
use crate::{Contact, Creep, Disc, Load, SceneError};

/// The parts of the film's answer to a load that a scene uses.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Mechanics {
    /// The film's surface that carries the markers.
    pub surface: crate::Surface,
    /// The relation of the film's depth to the force.
    pub stiffness: Stiffness,
    /// Whether a tilted force moves the film sideways. If false, |F| presses straight for every
    /// direction.
    pub lateral: bool,
    /// Direction of gravity, a unit vector in the film's frame; `None` means that the film weighs
    /// nothing.
    pub down: Option<[f64; 3]>,
    /// Its differences from the nominal film.
    pub unit: Unit,
    /// The meaning of labels, for loads that leave it open.
    pub contact: Contact,
    /// The place where the tip first touches, for loads that leave it open: mm from the middle,
    /// within ±5 (±8 with another layout, ±0.25 if it sticks or slides).
    pub offset_mm: [f64; 2],
    /// Radius of the disc over which the tip spreads its force, for loads that leave it open, mm,
    /// 0.25 to 2.
    pub tip_radius_mm: f64,
    /// The film's creep by a scene's motion.
    pub creep: Creep,
}

/// The relation of the film's depth to the force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(rename_all = "lowercase"))]
pub enum Stiffness {
    /// As its finite elements give it: soft at first, five times stiffer at 0.2 N.
    #[default]
    Computed,
    /// Depth in proportion to force, as computed at 0.2 N; constant beyond that.
    Linear,
}

/// The force at which a linear film agrees with the computed one, N.
const LINEAR_UP_TO_N: f64 = 0.2;

impl Default for Mechanics {
    /// The complete answer.
    fn default() -> Mechanics {
        Mechanics {
            surface: crate::Surface::CameraSide,
            stiffness: Stiffness::Computed,
            lateral: true,
            down: None,
            unit: Unit::default(),
            contact: Contact::Force,
            offset_mm: [0.0; 2],
            tip_radius_mm: NOMINAL_RADIUS_MM,
            creep: Creep::default(),
        }
    }
}

impl Mechanics {
    /// Returns the film for these settings, with the dots of a layout, each shifted by `markers_mm`
    /// from its place, by identity, mm.
    ///
    /// # Errors
    /// If a film differs too much from the nominal one, or a contact is impossible.
    pub(crate) fn film(
        &self,
        layout: Layout,
        markers_mm: Dots<[f64; 2]>,
    ) -> Result<Film, SceneError> {
        if self.down.is_some() && self.stiffness == Stiffness::Linear {
            let why = "a linear film weighs nothing: leave down out, or use computed".to_owned();
            return Err(FilmError::Load(why).into());
        }
        if self.stiffness == Stiffness::Linear && layout != Layout::default() {
            let why = "a linear film has the layout 4 alone: use computed".to_owned();
            return Err(FilmError::Layout(why).into());
        }
        let film = Film::of(Unit {
            markers_mm,
            ..self.unit
        })?;
        let film = film.with_down(self.down)?.with_layout(layout)?;
        film.check(&self.completed(&Load::REST.with_contact(self.contact)?))?;
        Ok(film)
    }

    /// Checks that a film can take a load, held for ever.
    ///
    /// # Errors If the load is outside the range of the film's tables.
    pub(crate) fn check(&self, film: &Film, load: &Load) -> Result<(), SceneError> {
        let load = self.completed(load);
        film.check(&load)?;
        Ok(film.check(&self.creep.at_last(&load))?)
    }

    /// Returns a load with the values that it leaves open.
    pub(crate) fn completed(&self, load: &Load) -> Load {
        load.or(self.contact, self.offset_mm, self.tip_radius_mm)
    }

    /// Returns the film under a load that it accepts.
    pub(crate) fn press(&self, film: &Film, load: &Load) -> Pressed {
        self.press_by(load, |load| film.press(load))
    }

    /// Returns the film as `press` has it, under a load that it accepts.
    fn press_by(&self, load: &Load, press: impl Fn(&Load) -> Pressed) -> Pressed {
        let load = &self.completed(load);
        match self.stiffness {
            Stiffness::Computed => press(&self.taken(load, load.magnitude_n())),
            Stiffness::Linear => {
                let full = press(&self.taken(load, LINEAR_UP_TO_N));
                let part = (load.magnitude_n() / LINEAR_UP_TO_N).min(1.0);
                scaled(full, part)
            }
        }
    }

    /// Returns the motion of the surface that carries the markers, under a load that the film
    /// accepts.
    pub(crate) fn seen(&self, film: &Film, load: &Load) -> Pressed {
        self.surface.of(self.press(film, load))
    }

    /// As [`Mechanics::seen`], for a look at this disc alone.
    pub(crate) fn seen_around(&self, film: &Film, load: &Load, disc: &Disc) -> Pressed {
        let press = |load: &Load| film.press_around(load, disc);
        self.surface.of(self.press_by(load, press))
    }

    /// Returns a load of another size, straight if `lateral` is false.
    fn taken(&self, load: &Load, magnitude_n: f64) -> Load {
        if self.lateral && magnitude_n == load.magnitude_n() {
            return *load;
        }
        let (alpha, beta) = match self.lateral {
            true => (load.alpha_deg(), load.beta_deg()),
            false => (0.0, 0.0),
        };
        // A load's angles together with a size are always a valid load.
        let other = Load::from_angles(magnitude_n, alpha, beta).unwrap_or(*load);
        other.or(load.contact(), load.offset_mm(), load.tip_radius_mm())
    }
}

fn scaled(pressed: Pressed, part: f64) -> Pressed {
    let times = |vector: [f64; 3]| vector.map(|component| part * component);
    Pressed {
        tip_mm: times(pressed.tip_mm),
        force_n: times(pressed.force_n),
        discs: pressed.discs.map(|disc| DiscMotion {
            moved_mm: times(disc.moved_mm),
            along_x: times(disc.along_x),
            along_y: times(disc.along_y),
        }),
        ..pressed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(mechanics: Mechanics, force_n: f64, alpha_deg: f64) -> [f64; 3] {
        let load = Load::from_angles(force_n, alpha_deg, 0.0).unwrap();
        mechanics.press(&Film::default(), &load).discs[1].moved_mm
    }

    #[test]
    fn the_default_is_the_film_itself() {
        let load = Load::from_angles(0.13, 4.0, -3.0).unwrap();
        let film = Film::default();
        assert_eq!(Mechanics::default().press(&film, &load), film.press(&load));
    }

    #[test]
    fn a_linear_film_gives_in_proportion() {
        let linear = Mechanics {
            stiffness: Stiffness::Linear,
            ..Mechanics::default()
        };
        let full = depth(Mechanics::default(), 0.2, 5.0);
        for (force_n, part) in [(0.05, 0.25), (0.2, 1.0), (0.25, 1.0)] {
            for (a, b) in depth(linear, force_n, 5.0).iter().zip(full) {
                assert!((a - part * b).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn without_the_lateral_mode_a_force_has_no_direction() {
        let straight = Mechanics {
            lateral: false,
            ..Mechanics::default()
        };
        assert_eq!(depth(straight, 0.1, 8.0), depth(straight, 0.1, 0.0));
        let [x, ..] = depth(Mechanics::default(), 0.1, 8.0);
        assert!((x - depth(straight, 0.1, 8.0)[0]).abs() > 0.005);
    }
}
