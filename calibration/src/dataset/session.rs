//! What differs between one day's calibration and another's.

use hivtac_scene::{Lens, Mechanics, Mounting, Options};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// How far apart sessions lie in what has no tare: every force is then a little wrong in its own way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// Each marker is glued up to this far from its place, along x and along y, mm.
    pub glue_mm: f64,
    /// The tip touches the film up to this far from its middle, along x and along y, mm.
    pub offset_mm: f64,
}

impl Default for Spread {
    /// Markers and tip in their places.
    fn default() -> Self {
        Self {
            glue_mm: 0.0,
            offset_mm: 0.0,
        }
    }
}

/// How a sensor was built, mounted, lit, focused and pressed in one session.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Session {
    /// Shift of the picture in parts of its width.
    shift: [f64; 2],
    roll_deg: f64,
    /// Change of brightness, in parts.
    brighter: f64,
    gradient: [f64; 2],
    /// Blur in parts of the frame's width.
    blur: f64,
    /// How far from their places the markers are glued, mm.
    glued_mm: [[f64; 2]; 4],
    /// Where the tip touches the film, mm from the middle.
    offset_mm: [f64; 2],
}

impl Session {
    /// Session 0 is the nominal one. The others: the picture up to 1 % of its width off and turned by up to 1°, the
    /// light up to 20 % off and up to 20 % uneven, the focus up to 1/500 of the width wrong (0.64 px at QVGA); each marker
    /// and the tip as far off, along x and y, as `spread` says.
    pub fn numbered(session: usize, seed: u64, spread: &Spread) -> Self {
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
            glued_mm: [0; 4].map(|_: u8| [0; 2].map(|_: u8| within(spread.glue_mm))),
            offset_mm: [0; 2].map(|_: u8| within(spread.offset_mm)),
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
            glued_mm: self.glued_mm,
            film: Mechanics {
                offset_mm: self.offset_mm,
                ..Mechanics::default()
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
        let spread = Spread {
            glue_mm: 0.05,
            offset_mm: 0.1,
        };
        let session = |number, seed| Session::numbered(number, seed, &spread);
        assert_eq!(session(0, 7).options(320), Options::default());
        assert_eq!(session(1, 7), session(1, 7));
        assert_ne!(session(1, 7), session(2, 7));
        assert_ne!(session(1, 7), session(1, 8));
    }

    #[test]
    fn markers_and_tip_are_as_far_off_as_the_spread_says() {
        let spread = Spread {
            glue_mm: 0.04,
            offset_mm: 0.2,
        };
        let largest = |of: fn(&Options) -> Vec<f64>| {
            (1..200)
                .flat_map(|number| of(&Session::numbered(number, 7, &spread).options(320)))
                .fold(0.0, |most: f64, mm| most.max(mm.abs()))
        };
        let glued = largest(|options| options.glued_mm.as_flattened().to_vec());
        let offset = largest(|options| options.film.offset_mm.to_vec());
        assert!((0.039..=0.04).contains(&glued), "{glued}");
        assert!((0.195..=0.2).contains(&offset), "{offset}");
        let none = Spread {
            glue_mm: 0.0,
            offset_mm: 0.0,
        };
        let plain = Session::numbered(1, 7, &none).options(320);
        assert_eq!(plain.film, Mechanics::default());
        assert_eq!(plain.glued_mm, [[0.0; 2]; 4]);
        assert_eq!(
            plain.mounting,
            Session::numbered(1, 7, &spread).options(320).mounting,
            "the rest stays"
        );
    }
}
