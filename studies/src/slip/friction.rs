//! Coulomb friction between a tip and the film: what sticks is pulled, what is pulled too far
//! slips.

/// Sideways stiffness of the film under a tip, N/mm.
pub const STIFFNESS: f64 = 0.1;
/// Sliding over static friction.
const SLIDING: f64 = 0.8;
/// In this time a slip takes back what the film was pulled too far, s: its damping.
const RELAXES_S: f64 = 0.005;
/// What slides no faster than this, mm/s, sticks again.
const STICKS: f64 = 0.2;

/// How a tip meets the film at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Meeting {
    /// Force into the film, N, ≥ 0.
    pub normal_n: f64,
    /// Force along the film, in the direction of the pull, N.
    pub pull_n: f64,
    /// How far the contact has slipped over the film, mm.
    pub slipped_mm: f64,
    /// Whether it slips.
    pub slips: bool,
}

/// A contact whose tip is moved along the film: it takes the film with it until friction gives way.
#[derive(Clone, Copy, Debug)]
pub struct Friction {
    /// The static friction ratio.
    ratio: f64,
    now: Meeting,
}

impl Friction {
    /// Of a static friction ratio.
    pub fn new(ratio: f64) -> Self {
        Self {
            ratio,
            now: Meeting::default(),
        }
    }

    /// The sliding friction ratio.
    pub fn sliding(&self) -> f64 {
        SLIDING * self.ratio
    }

    /// A short time later, when the tip presses with a force and stands so far along its way, mm.
    pub fn step(&mut self, normal_n: f64, tip_mm: f64, step_s: f64) -> Meeting {
        let pulled_n = STIFFNESS * (tip_mm - self.now.slipped_mm);
        let holds_n = self.ratio * normal_n;
        let slides_n = self.sliding() * normal_n;
        let mut slips = self.now.slips || pulled_n.abs() > holds_n;
        let mut pull_n = pulled_n;
        if normal_n <= 0.0 {
            // The film goes back to where it rests.
            self.now.slipped_mm = tip_mm;
            (slips, pull_n) = (false, 0.0);
        } else if slips {
            let beyond_n = (pulled_n.abs() - slides_n).max(0.0) * pulled_n.signum();
            let part = 1.0 - (-step_s / RELAXES_S).exp();
            let moved_mm = beyond_n / STIFFNESS * part;
            self.now.slipped_mm += moved_mm;
            pull_n = STIFFNESS * (tip_mm - self.now.slipped_mm);
            // Friction holds no more than that.
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

    const STEP_S: f64 = 1e-3;

    /// Moved at a speed, mm/s, under a constant force.
    fn dragged(ratio: f64, normal_n: f64, speed: f64, steps: u32) -> Vec<Meeting> {
        let mut friction = Friction::new(ratio);
        (0..steps)
            .map(|k| friction.step(normal_n, speed * f64::from(k) * STEP_S, STEP_S))
            .collect()
    }

    #[test]
    fn it_sticks_until_the_pull_is_too_large_and_then_follows_the_tip() {
        let meetings = dragged(0.5, 0.1, 5.0, 400);
        // 0.05 N is 0.5 mm, after 100 ms.
        let first = meetings.iter().position(|m| m.slips).unwrap();
        assert!((100..103).contains(&first), "{first}");
        assert!(meetings[..first].iter().all(|m| m.slipped_mm == 0.0));
        let last = meetings.last().unwrap();
        assert!(last.slips && (last.pull_n - 0.04).abs() < 0.003, "{last:?}");
        let speed = (last.slipped_mm - meetings[300].slipped_mm) / 0.099;
        assert!((speed - 5.0).abs() < 0.1, "{speed} mm/s");
    }

    #[test]
    fn the_pull_never_exceeds_friction_and_what_stops_sticks() {
        let mut friction = Friction::new(0.3);
        for k in 0..600 {
            let normal_n = 0.1 - 1e-4 * f64::from(k).min(900.0);
            let meeting = friction.step(normal_n, 0.01 * f64::from(k.min(200)), STEP_S);
            assert!(
                meeting.pull_n.abs() <= 0.3 * normal_n + 1e-12,
                "{meeting:?}"
            );
        }
        let mut friction = Friction::new(0.3);
        let stopped = (0..600).map(|k| friction.step(0.1, 0.005 * f64::from(k.min(200)), STEP_S));
        assert!(!stopped.last().unwrap().slips);
    }
}
