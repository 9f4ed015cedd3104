//! The force of objects in a gripper. The sensor is one of its two fingers and carries half of an
//! object's weight.

use std::f64::consts::PI;

use super::press::{ANGLES_DEG, FORCES_N, LONGEST_S};
use super::{load, pressed_and_pulled, ramp};
use crate::options::within;
use crate::{Load, SceneError};

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;

/// Grasp an object from a table, lift it, hold it, put it down, let go (the paper's Section 7.3 and
/// Figure 15).
///
/// The grip rises. Lifting takes the weight off the table, accelerates and slows down again; the
/// end is the same backwards. The paper's objects weigh 30 and 36 g. They pull more steeply than
/// the 12° of the paper's calibration and of the film's default range: the default object is
/// lighter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Grasp {
    /// Normal force of the grip, N.
    pub grip_n: f64,
    /// Mass of the object, 0–1000 g; two fingers share it.
    pub mass_g: f64,
    /// Direction of down, degrees from x towards y, ±360.
    pub down_deg: f64,
    /// Largest acceleration during the lift, 0–10 m/s².
    pub acceleration: f64,
    /// Time at which the gripper closes, s.
    pub start_s: f64,
    /// Time that it takes to close, and to open at the end, s.
    pub close_s: f64,
    /// Time that it takes to lift, and to put down at the end, s.
    pub lift_s: f64,
    /// Time for which it holds, s.
    pub hold_s: f64,
}

impl Default for Grasp {
    /// 5 g in a grip of 0.15 N, with down towards +y; lifted within 0.4 s at up to 1 m/s².
    fn default() -> Grasp {
        Grasp {
            grip_n: 0.15,
            mass_g: 5.0,
            down_deg: 90.0,
            acceleration: 1.0,
            start_s: 0.1,
            close_s: 0.4,
            lift_s: 0.4,
            hold_s: 1.0,
        }
    }
}

impl Grasp {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        within("grip_n", self.grip_n, FORCES_N)?;
        within("mass_g", self.mass_g, [0.0, 1000.0])?;
        within("down_deg", self.down_deg, [-360.0, 360.0])?;
        within("acceleration", self.acceleration, [0.0, 10.0])?;
        within("start_s", self.start_s, LONGEST_S)?;
        within("close_s", self.close_s, LONGEST_S)?;
        within("lift_s", self.lift_s, LONGEST_S)?;
        within("hold_s", self.hold_s, LONGEST_S)
    }

    pub(super) fn load(&self, time_s: f64) -> Load {
        let closed_s = self.start_s + self.close_s;
        let lowered_s = closed_s + self.lift_s + self.hold_s;
        let gripped = ramp(time_s - self.start_s, self.close_s)
            - ramp(time_s - lowered_s - self.lift_s, self.close_s);
        // The table carries no weight from a tenth of the lift on, until a tenth before the end of
        // the descent.
        let tenth_s = self.lift_s / 10.0;
        let hanging = ramp(time_s - closed_s, tenth_s)
            - ramp(time_s - lowered_s - self.lift_s + tenth_s, tenth_s);
        let upwards = self.speeding(time_s - closed_s) - self.speeding(time_s - lowered_s);
        let each_kg = self.mass_g / 2000.0;
        let weight_n = each_kg * (GRAVITY + upwards) * hanging;
        pressed_and_pulled(self.grip_n * gripped, weight_n, self.down_deg)
    }

    /// Returns the acceleration of a lift that begins at time 0, first up, then down; m/s².
    fn speeding(&self, time_s: f64) -> f64 {
        if time_s <= 0.0 || time_s >= self.lift_s {
            return 0.0;
        }
        self.acceleration * libm::sin(2.0 * PI * time_s / self.lift_s)
    }
}

/// Catch an object: it hits, bounces on the film with decaying force, and is held (the paper's
/// Figure 1).
///
/// From the impact on, |F| = hold · (1 − d·cos ωt) + peak · d·sin ωt with d = exp(−t / decay). If
/// that is negative, the object has left the film and the force is 0. The direction of the impact
/// dies away as d does.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Catch {
    /// Amplitude of the impact, N; the largest force is a little more or less.
    pub peak_n: f64,
    /// Force while the object is held, N.
    pub hold_n: f64,
    /// Direction of the impact, degrees.
    pub alpha_deg: f64,
    /// Direction of the impact, degrees.
    pub beta_deg: f64,
    /// Frequency of the object on the film, 0.1–1000 Hz.
    pub frequency_hz: f64,
    /// Time in which the oscillation falls to 1/e, 0.001–1000 s.
    pub decay_s: f64,
    /// Time of the impact, s.
    pub start_s: f64,
}

impl Default for Catch {
    /// An impact of 0.2 N at α = 8°, β = −5° that ends in 0.06 N; 10 Hz, gone in 0.1 s. That is an
    /// object of about 30 g on a film of 0.1 N/mm.
    fn default() -> Catch {
        Catch {
            peak_n: 0.2,
            hold_n: 0.06,
            alpha_deg: 8.0,
            beta_deg: -5.0,
            frequency_hz: 10.0,
            decay_s: 0.1,
            start_s: 0.1,
        }
    }
}

impl Catch {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        within("peak_n", self.peak_n, FORCES_N)?;
        within("hold_n", self.hold_n, FORCES_N)?;
        within("alpha_deg", self.alpha_deg, ANGLES_DEG)?;
        within("beta_deg", self.beta_deg, ANGLES_DEG)?;
        within("frequency_hz", self.frequency_hz, [0.1, 1000.0])?;
        within("decay_s", self.decay_s, [0.001, 1000.0])?;
        within("start_s", self.start_s, LONGEST_S)
    }

    pub(super) fn load(&self, time_s: f64) -> Load {
        let after_s = time_s - self.start_s;
        if after_s <= 0.0 {
            return Load::REST;
        }
        let decayed = libm::exp(-after_s / self.decay_s);
        let (sin, cos) = libm::sincos(2.0 * PI * self.frequency_hz * after_s);
        let force_n = self.hold_n * (1.0 - decayed * cos) + self.peak_n * decayed * sin;
        load(
            force_n.max(0.0),
            self.alpha_deg * decayed,
            self.beta_deg * decayed,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grasp_carries_half_the_weight_while_it_holds() {
        let grasp = Grasp::default();
        assert!((grasp.load(0.5).vector_n()[1]).abs() < 1e-9, "on the table");
        let [x, y, z] = grasp.load(1.5).vector_n();
        assert!(x.abs() < 1e-12 && (z + 0.15).abs() < 1e-12);
        assert!((y - 0.0025 * GRAVITY).abs() < 1e-12);
        assert_eq!(grasp.load(3.0), Load::REST, "let go");
    }

    #[test]
    fn lifting_speeds_up_and_slows_down() {
        let grasp = Grasp::default();
        let weight = |time_s| grasp.load(time_s).vector_n()[1] / 0.0025;
        assert!((weight(0.6) - GRAVITY - 1.0).abs() < 1e-9, "speeds up");
        assert!((weight(0.8) - GRAVITY + 1.0).abs() < 1e-9, "slows down");
        assert!((weight(2.0) - GRAVITY + 1.0).abs() < 1e-9, "is lowered");
    }

    #[test]
    fn a_caught_object_hits_bounces_and_is_held() {
        let catch = Catch::default();
        let force = |time_s| catch.load(time_s).magnitude_n();
        assert_eq!(force(0.1), 0.0);
        let largest = (100..200)
            .map(|ms| force(f64::from(ms) * 1e-3))
            .fold(0.0, f64::max);
        assert!((0.17..0.25).contains(&largest), "{largest}");
        let leaves = (150..200).any(|ms| force(f64::from(ms) * 1e-3) == 0.0);
        assert!(leaves, "bounces off once");
        assert!((force(1.5) - 0.06).abs() < 1e-6);
        assert!(catch.load(1.5).alpha_deg() < 1e-4);
    }
}
