//! Creep and hysteresis: the film remembers earlier loads, and its shape depends on them.
//!
//! The model is a linear viscoelastic solid with a Prony series of two terms, in Fung's
//! quasi-linear form. See *Biomechanics: Mechanical Properties of Living Tissues*, 2nd ed., 1993,
//! section 7.6, and for the series Park and Schapery, *Int. J. Solids Struct.* 36, 1999. At each
//! moment the film takes the shape that an elastic film takes under an effective load:
//!
//! ```text
//! F_eff = F + Σ part · q,    time · dq/dt = F − q,
//! ```
//!
//! A load that is put on first gets the elastic answer. While it is held, the film moves on as if
//! the load grew by the sum of the parts. After the load is taken off, the rest of it dies away
//! with the two times. Fung's form is about the stress at each point of a material. For a film,
//! whose shape depends on its loads, it is an approximation: all of the film lags alike.
//!
//! The load's moment lags as its components do. The rest of a load therefore acts where the load
//! was.

use crate::options::all_within;
use crate::{Load, SceneError};

/// The largest value of a part.
const MOST: f64 = 0.15;
/// Shortest and longest time, s.
const TIMES_S: [f64; 2] = [0.01, 1000.0];
/// The longest step, s, within which the load of a motion is taken as changing at a constant rate.
const STEP_S: f64 = 0.005;
/// Loads older than this many times the longer time are forgotten: e⁻²⁰ of them is left.
const TIMES_REMEMBERED: f64 = 20.0;

/// The share of its loads that a film remembers, and for how long. The default is an elastic film.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Creep {
    /// The parts of itself by which a held load grows, 0 to 0.15 each.
    pub parts: [f64; 2],
    /// The times in which it grows by them, s, 0.01 to 1000.
    pub times_s: [f64; 2],
}

impl Default for Creep {
    fn default() -> Creep {
        Creep {
            parts: [0.0; 2],
            times_s: [0.5, 20.0],
        }
    }
}

/// The quantities that lag: F_x, F_y, F_z, N, and F_z·x, F_z·y, N·mm.
type Resultant = [f64; 5];

/// A film's memory at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    creep: Creep,
    lagging: [Resultant; 2],
}

impl Creep {
    /// Splits `part` in two halves: one comes within half a second, the other within twenty
    /// seconds.
    pub fn of(part: f64) -> Creep {
        Creep {
            parts: [part / 2.0; 2],
            ..Creep::default()
        }
    }

    /// Returns the memory of a film that was never pressed.
    pub fn unpressed(self) -> Memory {
        Memory {
            creep: self,
            lagging: [[0.0; 5]; 2],
        }
    }

    /// # Errors
    /// If parts or times are outside their ranges.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        all_within("parts", self.parts, [0.0, MOST])?;
        all_within("times_s", self.times_s, TIMES_S)
    }

    pub(crate) fn is_elastic(&self) -> bool {
        self.parts == [0.0; 2]
    }

    /// Returns the factor by which a load has grown that was put on at once and held for `held_s`
    /// seconds.
    pub fn grown(&self, held_s: f64) -> f64 {
        let terms = self.parts.iter().zip(self.times_s);
        let grown = terms.map(|(part, time_s)| part * (1.0 - libm::exp(-held_s / time_s)));
        1.0 + grown.sum::<f64>()
    }

    /// Returns the load to which a held load grows in the end.
    pub(crate) fn at_last(&self, load: &Load) -> Load {
        if self.is_elastic() {
            return *load;
        }
        let grown = self.grown(f64::INFINITY);
        let force = Load::from_vector(load.vector_n().map(|part| grown * part));
        force.map_or(*load, |force| {
            force.or(load.contact(), load.offset_mm(), load.tip_radius_mm())
        })
    }

    /// Returns the memory at a time, s, of loads from time 0 on.
    pub(crate) fn memory(self, time_s: f64, load: impl Fn(f64) -> Load) -> Memory {
        let [one, other] = self.times_s;
        let forgotten_s = time_s - TIMES_REMEMBERED * one.max(other);
        self.unpressed().after(forgotten_s, time_s, load)
    }
}

impl Memory {
    /// Lets a time > 0, s, pass, in which the load changes at a constant rate from one to another.
    pub fn pass(&mut self, from: &Load, to: &Load, after_s: f64) {
        if after_s <= 0.0 {
            return;
        }
        let (from, to) = (resultant(from), resultant(to));
        for (lagging, time_s) in self.lagging.iter_mut().zip(self.creep.times_s) {
            let left = libm::exp(-after_s / time_s);
            for (part, (from, to)) in lagging.iter_mut().zip(from.iter().zip(to)) {
                // For a load that changes at a constant rate, the lag approaches this value.
                let behind = (to - from) * time_s / after_s;
                *part = to - behind + (*part - from + behind) * left;
            }
        }
    }

    /// Returns the memory at a later time, s, of loads as a function of time. Before time 0 there
    /// is no load.
    pub(crate) fn after(mut self, from_s: f64, to_s: f64, load: impl Fn(f64) -> Load) -> Memory {
        let from_s = from_s.max(0.0);
        if self.creep.is_elastic() || !to_s.is_finite() || to_s <= from_s {
            return self;
        }
        let steps = ((to_s - from_s) / STEP_S).ceil();
        let step_s = (to_s - from_s) / steps;
        let mut before = load(from_s);
        for step in 1..=steps as u64 {
            let after = load(from_s + step as f64 * step_s);
            self.pass(&before, &after, step_s);
            before = after;
        }
        self
    }

    /// Returns the effective load: under it an elastic film has the shape that this film has under
    /// `load`.
    pub fn effective(&self, load: &Load) -> Load {
        if self.creep.is_elastic() {
            return *load;
        }
        let mut sum = resultant(load);
        for (lagging, part) in self.lagging.iter().zip(self.creep.parts) {
            for (sum, lagging) in sum.iter_mut().zip(lagging) {
                *sum += part * lagging;
            }
        }
        let [x, y, z, right, down] = sum;
        // All loads press, and so do their remainders.
        let force = Load::from_vector([x, y, z]).unwrap_or(Load::REST);
        let placed = force.with_offset_mm([right / z, down / z]);
        let placed = placed.unwrap_or(force);
        placed.or(load.contact(), [0.0; 2], load.tip_radius_mm())
    }
}

fn resultant(load: &Load) -> Resultant {
    let [x, y, z] = load.vector_n();
    let [right, down] = load.offset_mm();
    [x, y, z, z * right, z * down]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(force_n: f64) -> Load {
        let load = Load::from_angles(force_n, 4.0, -3.0).unwrap();
        load.with_offset_mm([2.0, -1.0]).unwrap()
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
    }

    #[test]
    fn a_held_load_grows_by_the_parts_and_leaves_them_behind_at_its_place() {
        let creep = Creep {
            parts: [0.04, 0.1],
            times_s: [0.5, 20.0],
        };
        // Held for ten seconds.
        let load = |time_s: f64| {
            if time_s < 10.0 {
                press(0.1)
            } else {
                Load::REST
            }
        };
        let grown = |s: f64| 1.04 - 0.04 * libm::exp(-s / 0.5) + 0.1 * (1.0 - libm::exp(-s / 20.0));
        for time_s in [0.0, 0.1, 1.0, 9.9] {
            let effective = creep.memory(time_s, load).effective(&load(time_s));
            near(creep.grown(time_s), grown(time_s));
            near(effective.magnitude_n(), 0.1 * grown(time_s));
            near(effective.alpha_deg(), 4.0);
            near(effective.offset_mm()[0], 2.0);
        }
        for after_s in [0.1f64, 10.0, 100.0] {
            let left = creep.memory(10.0 + after_s, load).effective(&Load::REST);
            let [short, long] = [0.5f64, 20.0]
                .map(|time_s| libm::exp(-after_s / time_s) - libm::exp(-(10.0 + after_s) / time_s));
            let expected = 0.1 * (0.04 * short + 0.1 * long);
            // The load is taken off within one step, and falls in it.
            assert!((left.magnitude_n() / expected - 1.0).abs() < 0.01);
            near(left.offset_mm()[1], -1.0);
        }
        near(creep.at_last(&press(0.1)).magnitude_n(), 0.114);
    }

    /// Returns the loss factor of the series at a frequency.
    #[test]
    fn a_sine_lags_as_a_standard_solid_does() {
        let creep = Creep::of(0.1);
        let omega = std::f64::consts::TAU;
        let size = |time_s: f64| 0.1 + 0.05 * libm::sin(omega * time_s);
        let load = |time_s: f64| press(size(time_s));
        let mut expected = [0.1 * 0.1, 0.0, 0.0];
        for time_s in [0.5, 20.0] {
            let square = 1.0 + omega * time_s * omega * time_s;
            expected[1] += 0.05 * 0.05 / square;
            expected[2] -= 0.05 * 0.05 * omega * time_s / square;
        }
        for part in 0..8 {
            let time_s = 300.0 + f64::from(part) / 8.0;
            let found = creep.memory(time_s, load).effective(&load(time_s));
            let (sin, cos) = libm::sincos(omega * time_s);
            let sum = size(time_s) + expected[0] + expected[1] * sin + expected[2] * cos;
            assert!((found.magnitude_n() - sum).abs() < 2e-6);
        }
    }

    #[test]
    fn an_elastic_film_remembers_nothing() {
        let load = |_: f64| press(0.2);
        let memory = Creep::default().memory(50.0, load);
        assert_eq!(memory.effective(&Load::REST), Load::REST);
        for time_s in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            let memory = Creep::of(0.1).memory(time_s, load);
            assert_eq!(memory.effective(&Load::REST), Load::REST);
        }
    }
}
