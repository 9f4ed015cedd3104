//! The differences between sessions: how a sensor is mounted, lit and focused anew each time.

use hivtac_twin::{Lens, Mounting, Options};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How a sensor was mounted, lit and focused in one session.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Session {
    /// Shift of the picture in parts of its width.
    shift: [f64; 2],
    roll_deg: f64,
    /// Change of brightness, in parts of it.
    brighter: f64,
    gradient: [f64; 2],
    /// Blur in parts of the frame's width.
    blur: f64,
}

impl Session {
    /// Session 0 is the nominal one. In the others the picture is shifted by up to 1 % of its width
    /// and turned by up to 1°. The light differs by up to 20 % and is uneven by up to 20 %. The
    /// focus is off by up to 1/500 of the width (0.64 px at QVGA).
    pub fn numbered(session: usize, seed: u64) -> Self {
        if session == 0 {
            return Self::default();
        }
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5E55_1011);
        random.set_stream(session as u64);
        let mut within = |limit: f64| limit * random.random_range(-1.0..=1.0);
        Self {
            shift: [within(0.01), within(0.01)],
            roll_deg: within(1.0),
            brighter: within(0.2),
            gradient: [within(0.2), within(0.2)],
            blur: within(0.002).abs(),
        }
    }

    pub fn options(&self, width: u16) -> Options {
        let px = |part: f64| part * f64::from(width);
        Options {
            gain: 1.0 + self.brighter,
            gradient: self.gradient,
            mounting: Mounting {
                shift_px: self.shift.map(px),
                roll_deg: self.roll_deg,
            },
            lens: Lens {
                blur_px: px(self.blur),
                ..Lens::default()
            },
            ..Options::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_differ_and_the_first_is_nominal() {
        let session = Session::numbered;
        assert_eq!(session(0, 7).options(320), Options::default());
        assert_eq!(session(1, 7), session(1, 7));
        assert_ne!(session(1, 7), session(2, 7));
        assert_ne!(session(1, 7), session(1, 8));
    }
}
