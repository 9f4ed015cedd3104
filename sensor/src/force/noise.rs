//! How noisy frames are: what the film leaves unexplained of one frame beside the frame before.
//!
//! Four markers tell eight coordinates, a load explains five of them, and three are left over
//! whatever the load is. What a thing on the film or an error of the model leaves there hardly
//! changes from a frame to the next, 6 ms later; what noise leaves there is another draw. So half
//! the square of the difference of two frames is the variance of noise alone: little light, a high
//! gain or flickering specks show in it, and a force, a fast one too, does not.

use crate::force::forward::{Column, UNEXPLAINED, square};
use crate::force::kernels::sqrt;
use hivtac_terms::units::Px;

/// Coordinates that are left over.
const LEFT_OVER: f32 = 3.0;
/// The mean variance follows one in this many frames: 0.1 s at 156 frames a second.
const FRAMES: f32 = 16.0;
/// A single frame counts as at most so many times the mean variance: a thing that falls onto the
/// film moves a marker once.
const MOST_AT_ONCE: f32 = 8.0;
/// The mean of so few frames is off by less than this nearly always: 3 of its standard deviations.
const SCATTER: f32 = 0.6;
/// Noise that is more times as large as modelled makes the judgement of what is left over too dull:
/// a variance of 10 times (seen of a camera with 4 times the noise: 7).
const LARGEST: f32 = 10.0;

/// How a frame's noise differs from what a model says of its frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameNoise {
    /// How many times as large it is, > 0.
    pub times: f32,
    /// A standard uncertainty of each coordinate beside it, 0 or more.
    pub blur: Px,
}

impl FrameNoise {
    /// It does not.
    pub const AS_MODELLED: FrameNoise = FrameNoise {
        times: 1.0,
        blur: Px(0),
    };
}

/// Noise of the frames up to now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLevel {
    /// What the frame before left over, in parts of the modelled noise.
    before: Option<Column>,
    /// What the frame under way does.
    now: Option<Column>,
    /// Mean variance of what is left over, in parts of the modelled one.
    variance: f32,
}

impl NoiseLevel {
    /// As large as the model says.
    pub const AS_MODELLED: NoiseLevel = NoiseLevel {
        before: None,
        now: None,
        variance: 1.0,
    };

    /// The next frame does not follow the one before at once.
    pub fn forget_frame(&mut self) {
        (self.before, self.now) = (None, None);
    }

    /// The next frame begins.
    pub fn begin_frame(&mut self) {
        self.before = self.now.take();
    }

    /// What to expect of a frame, at least what the model says; with a blur beside it.
    pub fn of_frame(&self, blur: Px) -> FrameNoise {
        let variance = (self.variance - SCATTER).clamp(1.0, LARGEST);
        FrameNoise {
            times: sqrt(variance),
            blur,
        }
    }

    /// Takes what a frame left over when `noise` was expected of it.
    pub fn saw(&mut self, noise: FrameNoise, left: &Column) {
        let left = left.map(|part| part * noise.times);
        // What the largest noise does not explain is no noise.
        self.now = (square(&left) <= LARGEST * UNEXPLAINED).then_some(left);
        let Some((before, left)) = self.before.as_ref().zip(self.now.as_ref()) else {
            return;
        };
        let apart: Column = core::array::from_fn(|i| left[i] - before[i]);
        let variance = square(&apart) / (2.0 * LEFT_OVER);
        let seen = variance.min(MOST_AT_ONCE * self.variance);
        let mean = self.variance + (seen - self.variance) / FRAMES;
        self.variance = mean.clamp(1.0 / LARGEST, 2.0 * LARGEST);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FOLLOWING: usize = 4_000;

    /// A normal deviate, by the sum of twelve even ones.
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

    /// Three coordinates of noise of a size, and what stays or moves slowly in the others.
    fn left(state: &mut u64, times: f32, drift: f32) -> Column {
        let mut left = [drift; 8];
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
        level.of_frame(Px(0)).times
    }

    /// Noise as modelled is told as it is, but for 1 of 100 frames, whatever stays left over beside
    /// it.
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

    /// Larger noise is told within a quarter after 0.2 s, and forgotten as soon.
    #[test]
    fn larger_noise_is_followed() {
        for times in [1.8f32, 3.0] {
            let (mut level, mut state) = (NoiseLevel::AS_MODELLED, 2);
            for k in 0..FOLLOWING {
                let told = pushed(&mut level, &left(&mut state, times, 3.0));
                let is_near = (0.6 * times..1.5 * times).contains(&told);
                assert!(k < 32 || is_near, "{k}: {told} for {times}");
            }
            for _ in 0..64 {
                pushed(&mut level, &left(&mut state, 1.0, 3.0));
            }
            assert!(level.of_frame(Px(0)).times < 1.3);
        }
    }

    /// One frame that something moves is one draw too large, not a level.
    #[test]
    fn a_single_jump_is_no_noise() {
        let (mut level, mut state) = (NoiseLevel::AS_MODELLED, 3);
        for _ in 0..64 {
            pushed(&mut level, &left(&mut state, 1.0, 0.0));
        }
        for jump in [8.0, 500.0] {
            let told = pushed(&mut level, &left(&mut state, 1.0, jump));
            assert!(told < 1.3, "{told}");
        }
        // The frame after a pause is compared with none.
        level.forget_frame();
        let before = level.of_frame(Px(0));
        pushed(&mut level, &left(&mut state, 1.0, 0.0));
        assert_eq!(level.of_frame(Px(0)), before);
    }

    proptest! {
        /// Whatever is left over: never surer than the model, never beyond the largest.
        #[test]
        fn it_stays_within_its_limits(
            frames in proptest::collection::vec([any::<f32>(); 8], 1..20),
        ) {
            let mut level = NoiseLevel::AS_MODELLED;
            for left in frames {
                let told = pushed(&mut level, &left);
                prop_assert!((1.0..=LARGEST.sqrt()).contains(&told), "{told}");
            }
        }
    }
}
