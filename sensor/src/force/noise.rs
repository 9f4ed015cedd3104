//! Measures the noise of frames, by the residuals of two successive frames.
//!
//! N markers have 2·N coordinates, and a load explains five of them. The others, three of four
//! markers, are residuals, whatever the load is. An object on the film or a model error gives
//! nearly the same residuals in two successive frames, 6 ms apart; noise gives independent ones. So
//! half the squared difference of two frames is the variance of noise alone. It shows little light,
//! a high gain or flickering specks, but not even a fast force.

use super::misfit::Misfit;
use crate::force::forward::{Column, Estimate, residual, square};
use crate::force::kernels::sqrt;
use hivtac_terms::marker::Marker;
use hivtac_terms::units::Px;

/// Time constants of the mean variances, in frames: 0.1 s and 1.6 s at 156 frames a second.
const FRAMES: f32 = 16.0;
const LASTING_FRAMES: f32 = 256.0;
/// Limit of a single frame's variance, relative to the mean: an object that falls onto the film
/// moves a marker once.
const MOST_AT_ONCE: f32 = 8.0;
/// The means' scatter nearly always stays below these: 3 of their standard deviations.
const SCATTER: f32 = 0.6;
const LASTING_SCATTER: f32 = 0.15;
/// A shift of a marker, px, that noise may seem to make (seen: 0.008). It is less than the noise of
/// a marker's place.
const EVEN_PX: f32 = 0.01;
/// The shift is uncertain by this factor: it depends on unknown colours and on the sharpness of the
/// marker's edge.
const UNKNOWN_COLOUR: f32 = 1.25;
/// A frame is disturbed if light through the film makes a marker this uncertain, 0.03 px.
const DISTURBED: Px = Px(1_966);
/// Largest variance that is accepted, relative to the modelled one. Beyond it the residual no
/// longer separates good frames from bad. A camera with 4 times the noise reaches 7.
const LARGEST: f32 = 10.0;

/// The variance, px², of a marker's coordinate by what shows through the film beside it and shifts
/// the marker by the root of this.
pub(super) fn beside_px2(shift_px2: f32) -> f32 {
    let more = shift_px2 - EVEN_PX * EVEN_PX;
    UNKNOWN_COLOUR * UNKNOWN_COLOUR * more.max(0.0)
}

/// How a frame's noise differs from the model's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameNoise {
    /// Factor on the modelled noise, > 0.
    pub times: f32,
    /// An additional standard uncertainty of each coordinate, 0 or more.
    pub blur: Px,
    /// Another one, of markers whose motion changes (`Motion::unsteadiness`).
    pub motion: Px,
    /// Another one, of markers next to which something shows through the film.
    pub beside: Px,
}

impl FrameNoise {
    /// No difference.
    pub const AS_MODELLED: FrameNoise = FrameNoise {
        times: 1.0,
        blur: Px(0),
        motion: Px(0),
        beside: Px(0),
    };

    /// Whether light through the film disturbs it.
    pub fn is_disturbed(&self) -> bool {
        self.beside >= DISTURBED
    }
}

/// The noise level of the frames up to now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLevel {
    /// Residual of the previous frame, in units of the modelled noise.
    before: Option<Column>,
    /// Residual of the current frame.
    now: Option<Column>,
    /// Mean variance of the residual, relative to the modelled one.
    variance: f32,
    /// The same over more frames, within the scatter of `variance`: it shows noise that is a little
    /// larger than modelled.
    lasting: f32,
    /// Uncertainty of the current frame's markers by their motion.
    motion: Px,
    /// And by light through the film next to them.
    beside: Px,
    /// Errors that last as long as the markers rest.
    misfit: Misfit,
}

impl NoiseLevel {
    /// The level that the model states.
    pub const AS_MODELLED: NoiseLevel = NoiseLevel {
        before: None,
        now: None,
        variance: 1.0,
        lasting: 1.0,
        motion: Px(0),
        beside: Px(0),
        misfit: Misfit::NONE,
    };

    /// Call before a frame that does not immediately follow the previous one.
    pub fn forget_frame(&mut self) {
        (self.before, self.now) = (None, None);
    }

    /// Call at the beginning of each frame.
    pub fn begin_frame(&mut self) {
        self.before = self.now.take();
        (self.motion, self.beside) = (Px(0), Px(0));
    }

    /// Sets the uncertainty of the current frame's markers by their motion.
    pub fn set_motion(&mut self, motion: Px) {
        self.motion = motion;
    }

    /// Sets the square of the largest shift of a marker of the current frame, px², by light through
    /// the film next to it. Not inlined, so that it stays out of the near memory.
    #[inline(never)]
    pub fn set_beside(&mut self, shift_px2: f32) {
        self.beside = Px::of_f32(sqrt(beside_px2(shift_px2)));
    }

    /// Returns the noise to expect of a frame, at least the model's, with this additional blur.
    pub fn of_frame(&self, blur: Px) -> FrameNoise {
        let variance = self.variance_of_frames().max(self.misfit.variance());
        FrameNoise {
            times: sqrt(variance),
            blur,
            motion: self.motion,
            beside: self.beside,
        }
    }

    /// The variance of frames that show the same, relative to the modelled one: 1 to [`LARGEST`].
    pub fn variance_of_frames(&self) -> f32 {
        let variance = (self.variance - SCATTER).max(self.lasting - LASTING_SCATTER);
        variance.clamp(1.0, LARGEST)
    }

    /// Call before the blobs of a frame are measured. Discards what was [seen](Self::saw) of the
    /// same frame before more blobs came.
    pub fn begin_measurement(&mut self) {
        self.now = None;
        self.misfit.begin();
    }

    /// Takes the residual of a frame, in units of the expected `noise`.
    pub fn saw(&mut self, noise: FrameNoise, left: &Column) {
        let left = left.map(|part| part * noise.times);
        // A residual beyond the largest noise is not noise.
        self.now = (square(&left) <= LARGEST * residual::unexplained(left.len())).then_some(left);
    }

    /// Takes a press of a frame with this expected `noise`, which explains the markers. While their
    /// motion changes, the press does not show lasting errors.
    pub fn saw_press(&mut self, noise: FrameNoise, estimate: &Estimate, markers: &[Marker]) {
        if noise.motion == Px(0) && noise.beside == Px(0) {
            self.misfit.saw(noise.times, estimate, markers);
        }
    }

    /// Call at the end of each frame: what was seen of it counts. Not inlined, so that it stays out
    /// of the near memory.
    #[inline(never)]
    pub fn end_frame(&mut self) {
        self.misfit.end();
        let Some((before, left)) = self.before.as_ref().zip(self.now.as_ref()) else {
            return;
        };
        let pairs = left.iter().zip(before.iter());
        let apart = Column::of(pairs.map(|(left, before)| left - before));
        let variance = square(&apart) / (2.0 * residual::left_over(apart.len()) as f32);
        let seen = variance.min(MOST_AT_ONCE * self.variance);
        let mean = self.variance + (seen - self.variance) / FRAMES;
        self.variance = mean.clamp(1.0 / LARGEST, 2.0 * LARGEST);
        let lasting = self.lasting + (seen - self.lasting) / LASTING_FRAMES;
        self.lasting = lasting
            .max(self.variance - SCATTER)
            .min(self.variance + SCATTER);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FOLLOWING: usize = 4_000;

    /// A normal deviate: the sum of twelve uniform ones.
    fn normal(state: &mut u64) -> f32 {
        let mut sum = -6.0;
        for _ in 0..12 {
            *state = state
                .wrapping_mul(0x5851_f42d_4c95_7f2d)
                .wrapping_add(0x1405_7b7e_f767_814f);
            sum += (*state >> 40) as f32 / (1u32 << 24) as f32;
        }
        sum
    }

    /// Three coordinates with noise of this size; all of them with a constant or slow part.
    fn left(state: &mut u64, times: f32, drift: f32) -> Column {
        let mut left = Column::filled(8, drift);
        for part in &mut left[..3] {
            *part += times * normal(state);
        }
        left
    }

    fn pushed(level: &mut NoiseLevel, left: &Column) -> f32 {
        level.begin_frame();
        let noise = level.of_frame(Px(0));
        let parts = left.map(|part| part / noise.times);
        level.saw(noise, &parts);
        level.end_frame();
        level.of_frame(Px(0)).times
    }

    /// With noise as modelled, the factor is 1 but for 1 of 100 frames, whatever constant residual
    /// there is.
    #[test]
    fn usual_noise_is_as_modelled() {
        for stays in [0.0, 4.0] {
            let (mut level, mut state) = (NoiseLevel::AS_MODELLED, 1);
            let larger = (0..FOLLOWING)
                .filter(|k| {
                    let drift = stays + 0.001 * *k as f32;
                    pushed(&mut level, &left(&mut state, 1.0, drift)) > 1.0
                })
                .count();
            assert!(larger < FOLLOWING / 100, "{larger}");
        }
    }

    /// After 0.2 s the factor fits larger noise; it falls again as fast.
    #[test]
    fn larger_noise_is_followed() {
        for times in [1.8f32, 3.0] {
            let (mut level, mut state) = (NoiseLevel::AS_MODELLED, 2);
            for k in 0..FOLLOWING {
                let reported = pushed(&mut level, &left(&mut state, times, 3.0));
                let is_near = (0.6 * times..1.5 * times).contains(&reported);
                assert!(k < 32 || is_near, "{k}: {reported} for {times}");
            }
            for _ in 0..64 {
                pushed(&mut level, &left(&mut state, 1.0, 3.0));
            }
            assert!(level.of_frame(Px(0)).times < 1.3);
        }
    }

    /// Noise of 1.4 times the modelled one, as a camera with smaller pixels has, is known to 10 %
    /// after some seconds.
    #[test]
    fn noise_a_little_larger_is_known_after_a_while() {
        let (mut level, mut state) = (NoiseLevel::AS_MODELLED, 4);
        for k in 0..FOLLOWING {
            let reported = pushed(&mut level, &left(&mut state, 1.4, 3.0));
            assert!(k < 512 || reported > 1.25, "{k}: {reported}");
        }
    }

    /// One frame in which something moves is one large value, not a level.
    #[test]
    fn a_single_jump_is_no_noise() {
        let (mut level, mut state) = (NoiseLevel::AS_MODELLED, 3);
        for _ in 0..64 {
            pushed(&mut level, &left(&mut state, 1.0, 0.0));
        }
        for jump in [8.0, 500.0] {
            let reported = pushed(&mut level, &left(&mut state, 1.0, jump));
            assert!(reported < 1.3, "{reported}");
        }
        // The frame after a pause has no predecessor to compare with.
        level.forget_frame();
        let before = level.of_frame(Px(0));
        pushed(&mut level, &left(&mut state, 1.0, 0.0));
        assert_eq!(level.of_frame(Px(0)), before);
    }

    proptest! {
        /// For any residual, the factor is at least 1 and at most the largest.
        #[test]
        fn it_stays_within_its_limits(
            frames in proptest::collection::vec([any::<f32>(); 8], 1..20),
        ) {
            let mut level = NoiseLevel::AS_MODELLED;
            for left in frames {
                let reported = pushed(&mut level, &Column::of(left));
                prop_assert!((1.0..=LARGEST.sqrt()).contains(&reported), "{reported}");
            }
        }
    }
}
