//! Measures errors of the markers' centres that change from place to place, by the residuals of
//! presses.
//!
//! Some errors of a marker's centre last as long as the marker rests. They come from a camera whose
//! pixels see one colour each, a film that shows the room, or differences of model and unit. Two
//! successive frames do not show them ([noise](super::NoiseLevel)). But they change once the
//! markers have moved by some pixels, and a contact explains only five of the coordinates. So the
//! mean squared residual of presses at many places is their variance.

use crate::force::forward::{Estimate, Markers, residual};
use hivtac_terms::marker::Marker;

/// A press counts once a coordinate of a marker has moved by this much since the last that counted,
/// px: half the distance of the pixels of a colour.
const APART_PX: f32 = 1.0;
/// Presses of the mean, and of how many the model's word counts at first.
const PRESSES: u8 = 32;
const FIRST_PRESSES: u8 = 4;
/// A contact explains a part of the error, so the residual of presses is too small: the expected
/// variance is this factor times the mean. For the model's own unit the mean is 0.7, and nearly
/// always below 1 over this.
const MARGIN: f32 = 1.25;
/// Largest variance that is accepted, relative to the modelled one, and of a single press relative
/// to the mean. Beyond it the residual no longer separates a needle from something else.
const LARGEST: f32 = 4.0;

/// Residuals of the presses until now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Misfit {
    /// Mean variance of the residual, relative to the modelled one.
    variance: f32,
    /// Number of presses in it, at most [`PRESSES`].
    presses: u8,
    /// Where the markers were in the last press that counted, px.
    at_px: Option<Markers>,
    /// The same of this frame, with its variance; `None` if nothing presses.
    now: Option<(Markers, f32)>,
}

impl Misfit {
    /// As the model states, without a press.
    pub const NONE: Misfit = Misfit {
        variance: 1.0 / MARGIN,
        presses: FIRST_PRESSES,
        at_px: None,
        now: None,
    };

    /// The variance to expect of a press, relative to the modelled one: 1 to [`LARGEST`].
    pub fn variance(&self) -> f32 {
        (MARGIN * self.variance).clamp(1.0, LARGEST)
    }

    /// Call before a frame is measured. Discards an earlier measurement of the same frame.
    pub fn begin(&mut self) {
        self.now = None;
    }

    /// Takes a press that explains these markers, in a frame of `times` the modelled noise. Not
    /// inlined, as [`Self::end`], so that it stays out of the near memory.
    #[inline(never)]
    pub fn saw(&mut self, times: f32, estimate: &Estimate, markers: &[Marker]) {
        let left_over = residual::left_over(estimate.coordinates).max(1);
        let variance = times * times * estimate.unexplained / left_over as f32;
        let px = markers
            .iter()
            .map(|marker| [marker.x.to_f32(), marker.y.to_f32()]);
        self.now = Some((Markers::of(px), variance));
    }

    /// Call once a frame was measured.
    #[inline(never)]
    pub fn end(&mut self) {
        let Some((px, variance)) = self.now.take() else {
            return;
        };
        if self.at_px.is_some_and(|before| !are_apart(&before, &px)) {
            return;
        }
        self.at_px = Some(px);
        let seen = variance.min(LARGEST * self.variance);
        self.presses = self.presses.saturating_add(1).min(PRESSES);
        let mean = self.variance + (seen - self.variance) / f32::from(self.presses);
        self.variance = mean.clamp(1.0 / LARGEST, LARGEST);
    }
}

fn are_apart(before: &Markers, now: &Markers) -> bool {
    let pairs = before.as_flattened().iter().zip(now.as_flattened());
    pairs
        .map(|(before, now)| (before - now).abs())
        .any(|apart| apart >= APART_PX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After `presses` at places this far apart, px, each with this variance.
    fn after(presses: usize, apart_px: f32, variance: f32) -> f32 {
        let mut misfit = Misfit::NONE;
        for press in 0..presses {
            misfit.begin();
            let at = apart_px * press as f32;
            misfit.now = Some((Markers::filled(4, [at, 100.0]), variance));
            misfit.end();
        }
        misfit.variance()
    }

    #[test]
    fn undisturbed_presses_leave_the_variance_as_modelled() {
        assert_eq!(after(0, 2.0, 1.0), 1.0);
        assert_eq!(after(100, 2.0, 0.7), 1.0);
    }

    #[test]
    fn what_presses_leave_is_known_after_a_few_and_limited() {
        let reported = after(8, 2.0, 2.4);
        assert!((2.0..3.0).contains(&reported), "{reported}");
        assert_eq!(after(1_000, 2.0, f32::MAX), LARGEST);
    }

    #[test]
    fn a_press_that_stays_counts_once() {
        assert_eq!(after(100, 0.001, 2.4), after(1, 0.001, 2.4));
    }

    /// A press measured ahead counts only if it is the frame's last measurement.
    #[test]
    fn a_press_that_is_measured_anew_is_forgotten() {
        let mut misfit = Misfit::NONE;
        misfit.now = Some((Markers::filled(4, [0.0; 2]), 4.0));
        misfit.begin();
        misfit.end();
        assert_eq!(misfit, Misfit::NONE);
    }
}
