//! Motions: loads as functions of time.

mod grip;
mod press;
mod slide;
mod wander;

use std::f64::consts::PI;

pub use grip::{Catch, Grasp};
pub use press::{Press, Vibration};
pub use slide::Drag;

use crate::{Load, SceneError};

/// The load on the film as a function of time. Before time 0, and at a time that is not finite, it
/// is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// No load.
    Rest,
    /// One load, from time 0 on.
    Static(Load),
    /// A tenth of a second of rest, then a tip whose force wanders smoothly: |F| 0.02–0.2 N, |α| ≤
    /// 8°, |β| ≤ 6°.
    Demo {
        /// Decides the start of α and β.
        seed: u64,
    },
    /// |F| goes 0 → 0.2 N → 0 in 4 s, again and again: straight, then tilted by α = ±8° and by
    /// β = ±6°.
    Sweep,
    /// Press, hold, release.
    Press(Press),
    /// Press, then drag until the contact slips.
    Drag(Drag),
    /// Grasp an object, lift it, hold it, put it down.
    Grasp(Grasp),
    /// Catch an object.
    Catch(Catch),
    /// Press with something that vibrates.
    Vibration(Vibration),
}

/// Length of the part of a motion that is tried on the film before the motion is accepted, and its
/// step.
const TRIED_S: f64 = 10.0;
const TRIED_STEP_S: f64 = 0.001;

impl Motion {
    /// The names of all motions.
    pub const NAMES: [&str; 9] = [
        "rest",
        "static",
        "demo",
        "sweep",
        "press",
        "drag",
        "grasp",
        "catch",
        "vibration",
    ];

    /// Returns a motion by its name, with default parameters: one of [`Motion::NAMES`]. `static` is
    /// 0.1 N at α = 4°, β = −3°. The seed decides where `demo` starts.
    ///
    /// # Errors
    /// If no motion has that name.
    pub fn named(name: &str, seed: u64) -> Result<Motion, SceneError> {
        match name {
            "rest" => Ok(Motion::Rest),
            "static" => Ok(Motion::Static(load(0.1, 4.0, -3.0))),
            "demo" => Ok(Motion::Demo { seed }),
            "sweep" => Ok(Motion::Sweep),
            "press" => Ok(Motion::Press(Press::default())),
            "drag" => Ok(Motion::Drag(Drag::default())),
            "grasp" => Ok(Motion::Grasp(Grasp::default())),
            "catch" => Ok(Motion::Catch(Catch::default())),
            "vibration" => Ok(Motion::Vibration(Vibration::default())),
            _ => Err(SceneError::UnknownScene(name.to_owned())),
        }
    }

    /// Returns the load at a time in seconds.
    pub fn load(&self, time_s: f64) -> Load {
        if !time_s.is_finite() || time_s < 0.0 {
            return Load::REST;
        }
        match self {
            Motion::Rest => Load::REST,
            Motion::Static(load) => *load,
            Motion::Demo { seed } => wander::demo(time_s, *seed),
            Motion::Sweep => wander::sweep(time_s),
            Motion::Press(press) => press.load(time_s),
            Motion::Drag(drag) => drag.load(time_s),
            Motion::Grasp(grasp) => grasp.load(time_s),
            Motion::Catch(catch) => catch.load(time_s),
            Motion::Vibration(vibration) => vibration.load(time_s),
        }
    }

    /// Checks that the parameters are possible, and by `film` that the film can take the loads of
    /// the motion's first ten seconds.
    ///
    /// # Errors
    /// If a parameter is outside its range, or the film cannot take a load of the motion.
    pub(crate) fn check(
        &self,
        film: impl Fn(&Load) -> Result<(), SceneError>,
    ) -> Result<(), SceneError> {
        match self {
            Motion::Static(load) => return film(load),
            Motion::Rest | Motion::Demo { .. } | Motion::Sweep => {}
            Motion::Press(press) => press.check()?,
            Motion::Drag(drag) => drag.check()?,
            Motion::Grasp(grasp) => grasp.check()?,
            Motion::Catch(catch) => catch.check()?,
            Motion::Vibration(vibration) => vibration.check()?,
        }
        (0..(TRIED_S / TRIED_STEP_S) as u32)
            .try_for_each(|step| film(&self.load(f64::from(step) * TRIED_STEP_S)))
    }
}

/// Returns a load of a size ≥ 0 and the angles of a press; [`Load::REST`] if they are impossible.
fn load(magnitude_n: f64, alpha_deg: f64, beta_deg: f64) -> Load {
    Load::from_angles(magnitude_n, alpha_deg, beta_deg).unwrap_or(Load::REST)
}

/// Returns a load from its pressure on the film (N, ≥ 0) and its pull along a direction in the
/// film's plane (degrees from x towards y). Without pressure there is no pull.
fn pressed_and_pulled(normal_n: f64, lateral_n: f64, direction_deg: f64) -> Load {
    let (sin, cos) = libm::sincos(crate::camera::radians(direction_deg));
    Load::from_vector([lateral_n * cos, lateral_n * sin, -normal_n]).unwrap_or(Load::REST)
}

/// Rises smoothly (half a cosine) from 0 at time 0 to 1 after `rise_s`; at once if that is 0.
fn ramp(time_s: f64, rise_s: f64) -> f64 {
    if time_s <= 0.0 {
        return 0.0;
    }
    if time_s >= rise_s {
        return 1.0;
    }
    0.5 - 0.5 * libm::cos(PI * time_s / rise_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Film;

    #[test]
    fn every_named_motion_begins_at_rest_moves_smoothly_and_suits_the_film() {
        for name in Motion::NAMES {
            let motion = Motion::named(name, 3).unwrap();
            assert_eq!(
                motion.check(|load| Ok(Film::default().check(load)?)),
                Ok(()),
                "{name}"
            );
            if name == "static" {
                continue;
            }
            assert_eq!(motion.load(0.0), Load::REST, "{name}");
            let loads: Vec<Load> = (0..6000)
                .map(|n| motion.load(f64::from(n) * 0.001))
                .collect();
            for (n, pair) in loads.windows(2).enumerate() {
                let step = pair[1].magnitude_n() - pair[0].magnitude_n();
                // `demo` starts with a step of 0.02 N.
                assert!(step.abs() < 0.021, "{name}: {step} N at {n} ms");
            }
            let largest = loads.iter().map(Load::magnitude_n).fold(0.0, f64::max);
            assert_eq!(largest > 0.05, name != "rest", "{name}: {largest} N");
        }
    }

    #[test]
    fn outside_time_nothing_presses() {
        for name in Motion::NAMES {
            let motion = Motion::named(name, 0).unwrap();
            for time_s in [-1.0, f64::NAN, f64::INFINITY] {
                assert_eq!(motion.load(time_s), Load::REST);
            }
        }
        let error = Motion::named("dance", 0).unwrap_err().to_string();
        assert!(
            Motion::NAMES.iter().all(|name| error.contains(name)),
            "{error}"
        );
    }

    #[test]
    fn what_the_film_cannot_take_is_refused() {
        let press = Press {
            force_n: 0.9,
            ..Press::default()
        };
        let error = Motion::Press(press)
            .check(|load| Ok(Film::default().check(load)?))
            .unwrap_err();
        assert!(matches!(error, SceneError::Film(_)), "{error}");
        let press = Press {
            rise_s: f64::NAN,
            ..Press::default()
        };
        let error = Motion::Press(press)
            .check(|load| Ok(Film::default().check(load)?))
            .unwrap_err()
            .to_string();
        assert!(error.contains("rise_s"), "{error}");
    }
}
