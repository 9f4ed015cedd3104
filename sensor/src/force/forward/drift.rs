//! Describes how far the film may rest from its rest position. Camera and film drift with
//! temperature, and move when the sensor is touched.

use super::covariance::{Covariance, add_square};
use super::mounting::{Mounting, about_middle, radius};
use super::predict::Markers;

/// The possible change of a rest position since it was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Standard uncertainties of drift that no frame has shown, relative to the pattern's radius:
    /// shift along x and along y each, turn, change of scale.
    pub unseen: [f32; 3],
    /// Distance of the untouched film's markers from the rest position when they were last seen,
    /// px; `None` if it is 0 or unknown.
    pub seen_px: Option<Markers>,
}

impl Drift {
    /// A rest position that was taken just now.
    pub const NONE: Drift = Drift {
        unseen: [0.0; 3],
        seen_px: None,
    };

    /// A rest position that no frame of the untouched film has confirmed: 0.08 px at 320×240, and
    /// 1.5 times that by a change of scale, which looks like a press.
    pub const UNSEEN: Drift = Drift {
        unseen: [1e-3, 1e-3, 1.5e-3],
        ..Drift::NONE
    };

    /// A camera that may have been mounted anew: any shift and turn. The change of scale is small,
    /// because a press looks like a larger one.
    pub const MOUNTED_ANEW: Drift = Drift {
        unseen: [0.1, 0.1, 1e-3],
        ..Drift::NONE
    };

    /// The largest distance of a marker's coordinate from the rest position, px.
    pub fn farthest_px(&self) -> f32 {
        let seen = self.seen_px.iter().flat_map(|seen| seen.as_flattened());
        seen.fold(0.0, |farthest, part| part.abs().max(farthest))
    }

    /// Adds the covariance of the images of markers that rest at these px. Compiled once, because
    /// the near memory is scarce.
    #[inline(never)]
    pub fn add_to(&self, mounting: &Mounting, rest_px: &Markers, covariance: &mut Covariance) {
        let mut add = |px: Markers| {
            let moved = px.map(|px| mounting.moved(px));
            add_square(covariance, moved.as_flattened(), 1.0);
        };
        if self.unseen != Drift::NONE.unseen {
            let about = about_middle(rest_px);
            let [shift, turn, scale] = self.unseen;
            let shift_px = shift * radius(&about);
            add(about.map(|_| [shift_px, 0.0]));
            add(about.map(|_| [0.0, shift_px]));
            add(about.map(|[x, y]| [-turn * y, turn * x]));
            add(about.map(|place| place.map(|part| scale * part)));
        }
        if let Some(seen_px) = self.seen_px {
            add(seen_px);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST_PX: [[f32; 2]; 4] = [[60.0, 20.0], [160.0, 20.0], [160.0, 120.0], [60.0, 120.0]];

    fn covariance(drift: &Drift) -> Covariance {
        let mounting = Mounting {
            per_px: [0.01, 0.0],
            beside_mm: Markers::defaults(4),
        };
        let mut covariance = Covariance::zeros(8);
        drift.add_to(&mounting, &Markers::of(REST_PX), &mut covariance);
        covariance
    }

    fn variance(covariance: &Covariance, along: &[[f32; 2]]) -> f32 {
        let along = along.as_flattened();
        let mut sum = 0.0;
        for i in 0..along.len() {
            for j in 0..along.len() {
                sum += along[i] * along[j] * covariance.entry(i, j);
            }
        }
        sum
    }

    /// The pattern's radius is 70.7 px, a pixel 0.01 focal lengths.
    #[test]
    fn shift_turn_and_scale_are_as_uncertain_as_stated() {
        let drift = Drift {
            unseen: [1e-3, 2e-3, 3e-3],
            ..Drift::NONE
        };
        let covariance = covariance(&drift);
        let about = about_middle(&Markers::of(REST_PX));
        let modes = [
            (
                Markers::filled(4, [0.5, 0.0]),
                1e-3 * 50.0 * 2f32.sqrt() * 2.0,
            ),
            (about.map(|[x, y]| [-y / 141.42, x / 141.42]), 2e-3 * 141.42),
            (about.map(|[x, y]| [x / 141.42, y / 141.42]), 3e-3 * 141.42),
            (Markers::from_fn(4, |k| [0.5 - (k % 2) as f32, 0.0]), 0.0),
        ];
        for (mode, sigma_px) in modes {
            let found = variance(&covariance, &mode).sqrt();
            assert!((found - 0.01 * sigma_px).abs() < 1e-5, "{found} {sigma_px}");
        }
    }

    #[test]
    fn what_was_seen_is_as_uncertain_as_it_is_far() {
        let seen_px = [[0.1, 0.0], [0.1, -0.3], [0.1, 0.0], [0.1, 0.0]];
        let drift = Drift {
            seen_px: Some(Markers::of(seen_px)),
            ..Drift::NONE
        };
        assert_eq!(drift.farthest_px(), 0.3);
        let found = covariance(&drift);
        assert!((found.entry(3, 3) - 9e-6).abs() < 1e-9);
        assert!((found.entry(3, 0) + 3e-6).abs() < 1e-9);
        assert_eq!(covariance(&Drift::NONE), Covariance::zeros(8));
    }
}
