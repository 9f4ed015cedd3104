//! A contact that is dragged until it slips.

use super::press::{FORCES_N, LONGEST_S};
use super::{pressed_and_pulled, ramp};
use crate::options::within;
use crate::{Load, SceneError};

/// Press, then pull sideways at a constant rate until friction gives way; slide with less friction;
/// release.
///
/// Coulomb friction: the pull grows to `friction_static` · N, then falls to `friction_sliding` · N
/// within 20 ms. The film's tables reach to a ratio of 0.8; a contact with more friction is out of
/// their range.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Drag {
    /// The normal force N during the drag, N.
    pub force_n: f64,
    /// Direction of the drag, degrees from x towards y, ±360.
    pub direction_deg: f64,
    /// Growth of the pull, 0.001–100 N/s.
    pub rate_n_per_s: f64,
    /// Ratio of pull to normal force at which the contact slips, 0–2.
    pub friction_static: f64,
    /// Ratio during the slide, at most the static one.
    pub friction_sliding: f64,
    /// Time at which the press begins, s.
    pub start_s: f64,
    /// Time of the rise, and of the fall at the end, s.
    pub rise_s: f64,
    /// Time of the slide, s.
    pub slide_s: f64,
    /// Distance by which the contact moves over the film during the slide, from the middle on, 0–4
    /// mm.
    pub slide_mm: f64,
}

/// Time that the pull takes to fall after the contact gives way, s.
const SLIP_S: f64 = 0.02;

impl Default for Drag {
    /// 0.12 N, pulled to the right at 0.05 N/s. It slips at a ratio of 0.2 and slides for 0.5 s at
    /// 0.15, without moving over the film.
    fn default() -> Drag {
        Drag {
            force_n: 0.12,
            direction_deg: 0.0,
            rate_n_per_s: 0.05,
            friction_static: 0.2,
            friction_sliding: 0.15,
            start_s: 0.1,
            rise_s: 0.3,
            slide_s: 0.5,
            slide_mm: 0.0,
        }
    }
}

impl Drag {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        within("force_n", self.force_n, FORCES_N)?;
        within("direction_deg", self.direction_deg, [-360.0, 360.0])?;
        within("rate_n_per_s", self.rate_n_per_s, [0.001, 100.0])?;
        within("friction_static", self.friction_static, [0.0, 2.0])?;
        let sliding = [0.0, self.friction_static];
        within("friction_sliding", self.friction_sliding, sliding)?;
        within("start_s", self.start_s, LONGEST_S)?;
        within("rise_s", self.rise_s, LONGEST_S)?;
        within("slide_s", self.slide_s, LONGEST_S)?;
        within("slide_mm", self.slide_mm, [0.0, 4.0])
    }

    /// Returns the time at which the contact gives way, s.
    fn slip_s(&self) -> f64 {
        let most_n = self.friction_static * self.force_n;
        self.start_s + self.rise_s + most_n / self.rate_n_per_s
    }

    pub(super) fn load(&self, time_s: f64) -> Load {
        let dragged_s = time_s - self.start_s - self.rise_s;
        let slipped = ramp(time_s - self.slip_s(), SLIP_S);
        let friction =
            self.friction_static + (self.friction_sliding - self.friction_static) * slipped;
        let lateral_n = (self.rate_n_per_s * dragged_s.max(0.0)).min(friction * self.force_n);
        let rising = ramp(time_s - self.start_s, self.rise_s);
        let falling = ramp(time_s - self.slip_s() - self.slide_s, self.rise_s);
        let left = rising - falling;
        // The pull fades with the press: there is no friction without pressure.
        let load = pressed_and_pulled(self.force_n * left, lateral_n * left, self.direction_deg);
        load.with_offset_mm(self.place_mm(time_s)).unwrap_or(load)
    }

    /// Returns the place where the tip touches the film.
    fn place_mm(&self, time_s: f64) -> [f64; 2] {
        let sliding_s = time_s - self.slip_s();
        if sliding_s <= 0.0 || self.slide_mm == 0.0 {
            return [0.0; 2];
        }
        let (sin, cos) = libm::sincos(crate::camera::radians(self.direction_deg));
        let slid_mm = self.slide_mm * (sliding_s / self.slide_s).min(1.0);
        [cos, sin].map(|part| slid_mm * part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pull_grows_gives_way_and_slides() {
        let drag = Drag {
            direction_deg: 90.0,
            ..Drag::default()
        };
        let at = |time_s| drag.load(time_s).vector_n();
        // It slips at 0.024 N, 0.48 s after the press is complete at 0.4 s.
        assert!((drag.slip_s() - 0.88).abs() < 1e-12);
        let [x, y, z] = at(0.6);
        assert!(x.abs() < 1e-12 && (y - 0.01).abs() < 1e-12 && (z + 0.12).abs() < 1e-12);
        assert!((at(0.88)[1] - 0.024).abs() < 1e-9);
        assert!((at(1.2)[1] - 0.018).abs() < 1e-12, "slides");
        assert_eq!(drag.load(2.0), Load::REST);
    }

    #[test]
    fn its_contact_moves_while_it_slides() {
        let drag = Drag {
            direction_deg: 90.0,
            slide_mm: 2.0,
            ..Drag::default()
        };
        let down = |time_s| drag.load(time_s).offset_mm()[1];
        assert_eq!([0.5, 0.87].map(down), [0.0; 2]);
        assert!((down(1.13) - 1.0).abs() < 1e-9, "half of the way");
        assert!((down(1.5) - 2.0).abs() < 1e-9);
        assert!(drag.load(1.13).offset_mm()[0].abs() < 1e-9);
    }

    #[test]
    fn the_pull_never_exceeds_friction() {
        let drag = Drag::default();
        for step in 0..2000 {
            let [x, _, z] = drag.load(f64::from(step) * 0.001).vector_n();
            assert!(x <= -0.2 * z + 1e-12, "at {step} ms");
        }
    }
}
