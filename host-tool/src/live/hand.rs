//! A press of a person: where, how hard and in which direction, changed at any time from another
//! thread.

pub use crate::page::{Fingers, Press};
use hivtac_twin::Load;
use std::sync::{Arc, Mutex, PoisonError};

/// Largest force, N: the end of the calibrated range.
pub const MOST_N: f64 = 0.25;
/// Largest distance from the film's middle along an axis, mm: the calibrated range.
pub const FARTHEST_MM: f64 = 4.0;
/// Largest α and β, degrees: the calibrated range.
pub const STEEPEST_DEG: f64 = 12.0;

/// Time within which a press follows the hand, s: a screen reports a pointer's place some sixty
/// times a second, and a finger does not jump.
const FOLLOWS_S: f64 = 0.02;
/// Force below which a released film is untouched, N.
const UNTOUCHED_N: f64 = 1e-4;

impl Press {
    /// Returns the nearest press that is in range; `None` if a value is not a number.
    pub fn in_range(self) -> Option<Press> {
        let [x, y] = self.place_mm;
        let [alpha, beta] = self.angles_deg;
        let values = [x, y, self.force_n, alpha, beta];
        values.iter().all(|value| value.is_finite()).then(|| Press {
            place_mm: self.place_mm.map(|at| at.clamp(-FARTHEST_MM, FARTHEST_MM)),
            force_n: self.force_n.clamp(0.0, MOST_N),
            angles_deg: (self.angles_deg).map(|angle| angle.clamp(-STEEPEST_DEG, STEEPEST_DEG)),
        })
    }
}

/// A hand that another thread moves.
#[derive(Clone, Debug, Default)]
pub struct Hand {
    wanted: Arc<Mutex<Fingers>>,
    is_at_once: bool,
}

impl Hand {
    /// A hand whose press is complete in the next frame, as for a simulation.
    pub fn at_once() -> Hand {
        Hand {
            is_at_once: true,
            ..Hand::default()
        }
    }

    /// Presses in this way from now on.
    pub fn set(&self, fingers: Fingers) {
        *self.wanted.lock().unwrap_or_else(PoisonError::into_inner) = fingers;
    }

    fn wants(&self, finger: usize) -> Option<Press> {
        self.wanted.lock().unwrap_or_else(PoisonError::into_inner)[finger]
    }

    /// The part of the way to the wanted press that it goes in this time.
    fn part(&self, step_s: f64) -> f64 {
        match self.is_at_once {
            true => 1.0,
            false => 1.0 - libm::exp(-step_s / FOLLOWS_S),
        }
    }
}

/// The press that follows a finger of a hand.
#[derive(Clone, Debug)]
pub struct Following {
    hand: Hand,
    finger: usize,
    at_s: f64,
    /// The press at that time and at the time before it.
    now: Option<Press>,
    before: Option<Press>,
    step_s: f64,
}

impl Following {
    /// Follows a finger, 0 or 1, which touches nothing at time 0.
    pub fn new(hand: Hand, finger: usize) -> Self {
        Self {
            hand,
            finger,
            at_s: 0.0,
            now: None,
            before: None,
            step_s: 0.0,
        }
    }

    /// Moves on to a time, s; returns whether something presses.
    pub fn advance(&mut self, at_s: f64) -> bool {
        self.step_s = (at_s - self.at_s).max(0.0);
        self.at_s = at_s;
        self.before = self.now;
        let part = self.hand.part(self.step_s);
        let toward = |from: f64, to: f64| from + (to - from) * part;
        self.now = match (self.now, self.hand.wants(self.finger)) {
            // A new touch begins where the hand is, from no force.
            (None, Some(wanted)) => Some(Press {
                force_n: toward(0.0, wanted.force_n),
                ..wanted
            }),
            (Some(now), Some(wanted)) => Some(Press {
                place_mm: [0, 1].map(|i| toward(now.place_mm[i], wanted.place_mm[i])),
                force_n: toward(now.force_n, wanted.force_n),
                angles_deg: [0, 1].map(|i| toward(now.angles_deg[i], wanted.angles_deg[i])),
            }),
            (Some(now), None) => Some(Press {
                force_n: toward(now.force_n, 0.0),
                ..now
            })
            .filter(|touch| touch.force_n > UNTOUCHED_N),
            (None, None) => None,
        };
        self.now.is_some()
    }

    /// The finger's press now; `None` without one.
    pub fn touch(&self) -> Option<Press> {
        self.now
    }

    /// Returns the load at a time in seconds from the one that it was moved on to.
    pub fn load(&self, after_s: f64) -> Load {
        let Some(now) = self.now else {
            return Load::REST;
        };
        let before = self.before.unwrap_or(Press {
            force_n: 0.0,
            ..now
        });
        let part = match self.step_s > 0.0 {
            true => (1.0 + after_s / self.step_s).clamp(0.0, 1.5),
            false => 1.0,
        };
        let between = |from: f64, to: f64| from + (to - from) * part;
        let force_n = between(before.force_n, now.force_n).clamp(0.0, MOST_N);
        let [alpha, beta] = [0, 1].map(|i| between(before.angles_deg[i], now.angles_deg[i]));
        let place_mm = [0, 1].map(|i| between(before.place_mm[i], now.place_mm[i]));
        Load::from_angles(force_n, alpha, beta)
            .and_then(|load| load.with_offset_mm(place_mm))
            .unwrap_or(Load::REST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOUCH: Press = Press {
        place_mm: [1.0, -2.0],
        force_n: 0.1,
        angles_deg: [4.0, 0.0],
    };

    #[test]
    fn a_press_follows_the_hand_and_ends_with_it() {
        let hand = Hand::default();
        let mut following = Following::new(hand.clone(), 0);
        assert!(!following.advance(0.01));
        hand.set([Some(TOUCH), None]);
        let mut last_n = 0.0;
        for step in 2..60 {
            assert!(following.advance(0.01 * f64::from(step)));
            let now_n = following.load(0.0).magnitude_n();
            assert!(now_n >= last_n && now_n <= 0.1, "{now_n}");
            last_n = now_n;
        }
        assert!((last_n - 0.1).abs() < 1e-6, "{last_n}");
        assert_eq!(following.load(0.0).offset_mm(), [1.0, -2.0]);
        hand.set([None; 2]);
        let steps = 60..400;
        let pressed = steps.filter(|step| following.advance(0.01 * f64::from(*step)));
        assert!((5..30).contains(&pressed.count()));
        assert_eq!(following.load(0.0), Load::REST);
    }

    #[test]
    fn a_press_at_once_is_there_with_the_next_frame_and_gone_with_it() {
        let hand = Hand::at_once();
        let mut following = Following::new(hand.clone(), 0);
        hand.set([Some(TOUCH), None]);
        assert!(following.advance(0.01));
        assert!((following.load(0.0).magnitude_n() - 0.1).abs() < 1e-9);
        // Half a frame earlier it was half there.
        assert!((following.load(-0.005).magnitude_n() - 0.05).abs() < 1e-9);
        hand.set([None; 2]);
        assert!(!following.advance(0.02));
    }

    #[test]
    fn what_is_out_of_range_is_brought_into_it() {
        let far = Press {
            place_mm: [9.0, -9.0],
            force_n: 3.0,
            angles_deg: [80.0, -80.0],
        };
        let near = far.in_range().unwrap();
        assert_eq!(near.place_mm, [FARTHEST_MM, -FARTHEST_MM]);
        assert_eq!((near.force_n, near.angles_deg), (MOST_N, [12.0, -12.0]));
        let none = Press {
            force_n: f64::NAN,
            ..TOUCH
        };
        assert_eq!(none.in_range(), None);
    }
}
