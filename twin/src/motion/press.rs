//! Presses in one direction.

use std::f64::consts::PI;

use super::{load, ramp};
use crate::options::within;
use crate::{Load, SceneError};

/// Range of the time of one part of a motion, s.
pub(super) const LONGEST_S: [f64; 2] = [0.0, 1000.0];
/// Range of forces in a motion, N; the film's own limit is lower.
pub(super) const FORCES_N: [f64; 2] = [0.0, 1.0];
/// Range of a press's angles, degrees.
pub(super) const ANGLES_DEG: [f64; 2] = [-45.0, 45.0];

/// Press, hold, release: |F| rises and falls with half a cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Press {
    /// |F| during the hold, N.
    pub force_n: f64,
    /// Its direction, degrees.
    pub alpha_deg: f64,
    /// Its direction, degrees.
    pub beta_deg: f64,
    /// Time at which it begins, s.
    pub start_s: f64,
    /// Time of the rise, s.
    pub rise_s: f64,
    /// Time of the hold, s.
    pub hold_s: f64,
    /// Time of the fall, s.
    pub fall_s: f64,
}

impl Default for Press {
    /// 0.15 N at α = 4°, β = −3°, within 0.3 s, for 1 s.
    fn default() -> Press {
        Press {
            force_n: 0.15,
            alpha_deg: 4.0,
            beta_deg: -3.0,
            start_s: 0.1,
            rise_s: 0.3,
            hold_s: 1.0,
            fall_s: 0.3,
        }
    }
}

impl Press {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        within("force_n", self.force_n, FORCES_N)?;
        within("alpha_deg", self.alpha_deg, ANGLES_DEG)?;
        within("beta_deg", self.beta_deg, ANGLES_DEG)?;
        within("start_s", self.start_s, LONGEST_S)?;
        within("rise_s", self.rise_s, LONGEST_S)?;
        within("hold_s", self.hold_s, LONGEST_S)?;
        within("fall_s", self.fall_s, LONGEST_S)
    }

    pub(super) fn load(&self, time_s: f64) -> Load {
        let pressed_s = time_s - self.start_s;
        let rising = ramp(pressed_s, self.rise_s);
        let falling = ramp(pressed_s - self.rise_s - self.hold_s, self.fall_s);
        let force_n = self.force_n * (rising - falling);
        load(force_n, self.alpha_deg, self.beta_deg)
    }
}

/// A press with a sinusoid on it, from its start on without end: once it has risen, |F| = force +
/// amplitude · sin.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Vibration {
    /// Mean |F|, N.
    pub force_n: f64,
    /// Its direction, degrees.
    pub alpha_deg: f64,
    /// Its direction, degrees.
    pub beta_deg: f64,
    /// Amplitude of the sinusoid, N, at most the force.
    pub amplitude_n: f64,
    /// Its frequency, 0–1000 Hz.
    pub frequency_hz: f64,
    /// Time at which the press begins, s.
    pub start_s: f64,
    /// Time of the rise, s; the sinusoid rises with it.
    pub rise_s: f64,
}

impl Default for Vibration {
    /// 0.1 ± 0.02 N at 20 Hz, straight.
    fn default() -> Vibration {
        Vibration {
            force_n: 0.1,
            alpha_deg: 0.0,
            beta_deg: 0.0,
            amplitude_n: 0.02,
            frequency_hz: 20.0,
            start_s: 0.1,
            rise_s: 0.3,
        }
    }
}

impl Vibration {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        within("force_n", self.force_n, FORCES_N)?;
        within("alpha_deg", self.alpha_deg, ANGLES_DEG)?;
        within("beta_deg", self.beta_deg, ANGLES_DEG)?;
        within("amplitude_n", self.amplitude_n, [0.0, self.force_n])?;
        within("frequency_hz", self.frequency_hz, [0.0, 1000.0])?;
        within("start_s", self.start_s, LONGEST_S)?;
        within("rise_s", self.rise_s, LONGEST_S)
    }

    pub(super) fn load(&self, time_s: f64) -> Load {
        let pressed_s = time_s - self.start_s;
        let wave = libm::sin(2.0 * PI * self.frequency_hz * pressed_s);
        let force_n = (self.force_n + self.amplitude_n * wave) * ramp(pressed_s, self.rise_s);
        load(force_n, self.alpha_deg, self.beta_deg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_press_rises_holds_and_falls() {
        let press = Press::default();
        let force = |time_s| press.load(time_s).magnitude_n();
        assert_eq!((force(0.05), force(1.75)), (0.0, 0.0));
        assert!((force(0.25) - 0.075).abs() < 1e-12, "half way up");
        assert_eq!((force(0.4), force(1.4)), (0.15, 0.15));
        assert!((force(1.55) - 0.075).abs() < 1e-12, "half way down");
        assert_eq!(press.load(1.0).alpha_deg(), 4.0);
    }

    #[test]
    fn a_step_is_a_press_without_rise() {
        let step = Press {
            rise_s: 0.0,
            ..Press::default()
        };
        assert_eq!(step.load(0.1), Load::REST);
        assert_eq!(step.load(0.100_001).magnitude_n(), 0.15);
    }

    #[test]
    fn a_vibration_swings_about_its_mean() {
        let vibration = Vibration::default();
        let force = |time_s| vibration.load(time_s).magnitude_n();
        // A quarter and three quarters into a period of 50 ms.
        assert!((force(1.1 + 0.0125) - 0.12).abs() < 1e-9);
        assert!((force(1.1 + 0.0375) - 0.08).abs() < 1e-9);
        let too_much = Vibration {
            amplitude_n: 0.11,
            ..vibration
        };
        assert!(too_much.check().is_err());
    }
}
