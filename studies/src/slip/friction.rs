//! Coulomb friction between a tip and the film: a sticking film is pulled with the tip, and slips
//! beyond a limit.

/// Sideways stiffness of the film under a tip, N/mm.
pub const STIFFNESS: f64 = 0.1;
/// Ratio of sliding friction to static friction.
const SLIDING: f64 = 0.8;
/// Time constant with which a slip relaxes the film's excess pull, s: its damping.
const RELAXES_S: f64 = 0.005;
/// Speed below which a sliding contact sticks again, mm/s.
const STICKS: f64 = 0.2;

/// The state of a contact at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Meeting {
    /// Force into the film, N, ≥ 0.
    pub normal_n: f64,
    /// Force along the film, in the direction of the pull, N.
    pub pull_n: f64,
    /// Distance that the contact has slipped over the film, mm.
    pub slipped_mm: f64,
    /// Whether it slips.
    pub slips: bool,
}

/// A contact whose tip moves along the film and pulls it, until friction fails.
#[derive(Clone, Copy, Debug)]
pub struct Friction {
    /// The static friction ratio.
    ratio: f64,
    now: Meeting,
}

impl Friction {
    /// A contact with a static friction ratio.
    pub fn new(ratio: f64) -> Self {
        Self {
            ratio,
            now: Meeting::default(),
        }
    }

    /// Its state after `step_s`, s, for the tip's force into the film, N, and place, mm.
    pub fn step(&mut self, normal_n: f64, tip_mm: f64, step_s: f64) -> Meeting {
        let pulled_n = STIFFNESS * (tip_mm - self.now.slipped_mm);
        let holds_n = self.ratio * normal_n;
        let slides_n = SLIDING * self.ratio * normal_n;
        let mut slips = self.now.slips || pulled_n.abs() > holds_n;
        let mut pull_n = pulled_n;
        if normal_n <= 0.0 {
            // The film returns to its rest position.
            self.now.slipped_mm = tip_mm;
            (slips, pull_n) = (false, 0.0);
        } else if slips {
            let beyond_n = (pulled_n.abs() - slides_n).max(0.0) * pulled_n.signum();
            let part = 1.0 - (-step_s / RELAXES_S).exp();
            let moved_mm = beyond_n / STIFFNESS * part;
            self.now.slipped_mm += moved_mm;
            pull_n = STIFFNESS * (tip_mm - self.now.slipped_mm);
            // Friction holds no larger force.
            pull_n = pull_n.clamp(-holds_n, holds_n);
            slips = moved_mm.abs() > STICKS * step_s;
        }
        self.now = Meeting {
            normal_n: normal_n.max(0.0),
            pull_n,
            slipped_mm: self.now.slipped_mm,
            slips,
        };
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_sticks_until_the_pull_is_too_large_follows_the_tip_and_sticks_when_that_stops() {
        let mut friction = Friction::new(0.5);
        // At 5 mm/s the film is pulled by 0.5 mm, which is 0.05 N, after 100 ms.
        let tip_mm = |k: u32| 5e-3 * f64::from(k.min(400));
        let meetings: Vec<Meeting> = (0..600)
            .map(|k| friction.step(0.1, tip_mm(k), 1e-3))
            .collect();
        let first = meetings.iter().position(|m| m.slips).unwrap();
        assert!((100..103).contains(&first), "{first}");
        assert!(meetings[..first].iter().all(|m| m.slipped_mm == 0.0));
        let (slips, speed) = (
            &meetings[399],
            meetings[399].slipped_mm - meetings[300].slipped_mm,
        );
        assert!(
            slips.slips && (slips.pull_n - 0.04).abs() < 0.003,
            "{slips:?}"
        );
        assert!((speed / 0.099 - 5.0).abs() < 0.1, "{speed} mm in 99 ms");
        assert!(!meetings[599].slips);
    }
}
