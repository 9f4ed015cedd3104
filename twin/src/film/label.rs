//! The force that a label of the paper's stage means. The tip moves in the label's direction, the
//! film sticks to it or the tip slides, and a gauge reads the force along the direction.

use crate::film::reduced::{LARGEST_TILT, Pose};

/// The film's answer to a tip on a stage.
pub trait Felt {
    /// Returns the tip's displacement under a load, mm.
    fn tip_mm(&self, pose: &Pose) -> [f64; 3];
    /// Returns the size, as in [`Pose`], of a force in N on this film.
    fn size_of(&self, force_n: f64) -> f64;
}

/// The motion and the gauge reading of a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// The tip's travel along x and y per travel along −z.
    pub tangents: [f64; 2],
    /// The force along that direction, N, > 0.
    pub force_n: f64,
    /// Place where the tip first touches the film, mm.
    pub offset_mm: [f64; 2],
    /// The largest ratio of tangential to normal force, up to 0.8. Beyond it the tip slides.
    pub friction: f64,
}

/// The tip of a stage at rest on the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// The load on the film; its place is the tip's present one.
    pub pose: Pose,
    /// |F|, N.
    pub magnitude_n: f64,
}

/// The largest number of Newton's steps, and the step by which unknowns are differentiated.
const MOST_STEPS: usize = 40;
const STEP: f64 = 1e-3;
/// The tip's largest allowed distance from its path, in parts of its depth.
const TOLERANCE: f64 = 1e-6;

impl Stage {
    /// Returns the load under which the tip is on its path.
    pub fn reach(&self, film: &impl Felt) -> Reached {
        let steepest = libm::atan(self.friction).min(LARGEST_TILT);
        let held = solve([0.0; 2], |tilt| self.off_its_way(film, tilt, [0.0; 2]));
        let tilt = held.unwrap_or([f64::INFINITY; 2]);
        let steep = libm::hypot(tilt[0], tilt[1]);
        if steep <= steepest {
            return self.reached(film, tilt, [0.0; 2]);
        }
        // The tip slides along the tangential force. The unknowns are the direction of the slide
        // and its length in parts of the depth.
        let [x, y] = self.tangents;
        let along = |turn: f64| {
            let (sin, cos) = libm::sincos(turn);
            [cos, sin]
        };
        let start = [libm::atan2(y, x), 0.3 * libm::hypot(x, y)];
        let state = |[turn, part]: [f64; 2]| {
            let along = along(turn);
            (along.map(|c| steepest * c), along.map(|c| part * c))
        };
        let slid = solve(start, |unknown| {
            let (tilt, part) = state(unknown);
            self.off_its_way(film, tilt, part)
        });
        let (tilt, part) = state(slid.unwrap_or(start));
        self.reached(film, tilt, part)
    }

    /// Returns the load with this tilt; the tip has slid by `slid`, in parts of its depth.
    fn reached(&self, film: &impl Felt, tilt: [f64; 2], slid: [f64; 2]) -> Reached {
        let mut pose = Pose {
            size: 0.0,
            tilt,
            place_mm: self.offset_mm,
        };
        let [x, y] = self.tangents;
        let way = libm::sqrt(x * x + y * y + 1.0);
        let [dx, dy, dz] = pose.direction();
        let along = (dx * x + dy * y - dz) / way;
        let magnitude_n = self.force_n / along;
        pose.size = film.size_of(magnitude_n);
        // The depth hardly depends on the place.
        for _ in 0..if slid == [0.0; 2] { 0 } else { 3 } {
            let depth = -film.tip_mm(&pose)[2];
            pose.place_mm = [0, 1].map(|c| self.offset_mm[c] + slid[c] * depth);
        }
        Reached { pose, magnitude_n }
    }

    /// Returns the tip's distance from its path, in parts of its depth.
    fn off_its_way(&self, film: &impl Felt, tilt: [f64; 2], slid: [f64; 2]) -> [f64; 2] {
        let Reached { pose, .. } = self.reached(film, tilt, slid);
        let [x, y, z] = film.tip_mm(&pose);
        let moved = [x, y];
        [0, 1].map(|c| moved[c] / -z + slid[c] - self.tangents[c])
    }
}

/// Newton's method for two unknowns. Returns `None` if it finds no root.
fn solve(start: [f64; 2], off: impl Fn([f64; 2]) -> [f64; 2]) -> Option<[f64; 2]> {
    let mut at = start;
    for _ in 0..MOST_STEPS {
        let here = off(at);
        if here.iter().all(|part| part.abs() < TOLERANCE) {
            return Some(at);
        }
        let slope = |k: usize| {
            let [mut back, mut forth] = [at; 2];
            back[k] -= STEP;
            forth[k] += STEP;
            let (back, forth) = (off(back), off(forth));
            [0, 1].map(|c| (forth[c] - back[c]) / (2.0 * STEP))
        };
        let ([a, c], [b, d]) = (slope(0), slope(1));
        let whole = a * d - b * c;
        let step = [
            (b * here[1] - d * here[0]) / whole,
            (c * here[0] - a * here[1]) / whole,
        ];
        let length = libm::hypot(step[0], step[1]);
        if !length.is_finite() {
            return None;
        }
        let part = (0.2 / length).min(1.0);
        at = [at[0] + part * step[0], at[1] + part * step[1]];
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A film of springs, four times softer sideways.
    struct Springs;

    impl Felt for Springs {
        fn tip_mm(&self, pose: &Pose) -> [f64; 3] {
            let [x, y, z] = pose.force_n();
            [10.0 * x, 10.0 * y, 40.0 * z]
        }

        fn size_of(&self, force_n: f64) -> f64 {
            Pose::of_force([0.0, 0.0, -force_n], [0.0; 2], [1.0; 2]).size
        }
    }

    fn stage(tangents: [f64; 2], friction: f64) -> Stage {
        Stage {
            tangents,
            force_n: 0.1,
            offset_mm: [0.1, 0.0],
            friction,
        }
    }

    #[test]
    fn a_tip_that_sticks_pulls_the_film_its_way() {
        let stage = stage([0.1, -0.05], 0.8);
        let reached = stage.reach(&Springs);
        let [x, y, z] = reached.pose.force_n();
        assert!((x / -z - 0.4).abs() < 1e-5 && (y / -z + 0.2).abs() < 1e-5);
        assert_eq!(reached.pose.place_mm, [0.1, 0.0]);
        let along = (0.1 * x - 0.05 * y - z) / (1.0_f64 + 0.0125).sqrt();
        assert!((along - 0.1).abs() < 1e-9);
    }

    #[test]
    fn what_friction_does_not_hold_slides() {
        let stage = stage([0.2, 0.0], 0.5);
        let reached = stage.reach(&Springs);
        let [x, y, z] = reached.pose.force_n();
        assert!((x / -z - 0.5).abs() < 1e-9 && y.abs() < 1e-9);
        // The stage moved by 0.2 of the depth, and the film gave way by 0.125 of it.
        let slid = reached.pose.place_mm[0] - 0.1;
        assert!((slid - 0.075 * 40.0 * -z).abs() < 1e-5, "{slid}");
    }
}
