//! Sensor noise, the same on every machine.
//!
//! Counter-based: the noise of a pixel depends on seed, frame number and pixel index alone. A
//! 64-bit hash (SplitMix64's output function over a Weyl sequence) gives 12 bits per channel. Each
//! channel's bits select a quantile of the normal distribution from a table: |z| ≤ 3.7, standard
//! deviation within 0.1 % of the requested one.

use std::sync::LazyLock;

use crate::light::Channel;

/// Quantiles in the table.
const QUANTILES: usize = 4096;
/// SplitMix64's increment, the odd number nearest to 2⁶⁴ / golden ratio.
const WEYL: u64 = 0x9e37_79b9_7f4a_7c15;

/// Number of values of the extra number that comes with a pixel's noise.
pub(crate) const LOTS: u32 = 1 << 28;

/// The middle quantiles of [`QUANTILES`] equal parts of the standard normal distribution. Computed
/// once, because that takes a while.
static UNIT: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let middle = |i: usize| (i as f64 + 0.5) / QUANTILES as f64;
    (0..QUANTILES).map(|i| normal_quantile(middle(i))).collect()
});

/// A table of noise.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Noise {
    table: Vec<Channel<i16>>,
    seed: u64,
}

impl Noise {
    /// Returns noise of a standard deviation in steps, at most 4096.
    pub(crate) fn new(deviation: f64, seed: u64) -> Noise {
        let scaled = |quantile: &f64| Channel::from_bits((deviation * quantile).round() as i16);
        Noise {
            table: UNIT.iter().map(scaled).collect(),
            seed,
        }
    }

    /// Iterates over the noise of one frame, pixel by pixel: three channels each, and a number
    /// below [`LOTS`] that is independent of them.
    pub(crate) fn of_frame(&self, number: u64) -> impl Iterator<Item = ([Channel; 3], u32)> {
        let mut state = mix(mix(self.seed).wrapping_add(number.wrapping_mul(WEYL)));
        let table: &[Channel<i16>; QUANTILES] =
            self.table[..].try_into().expect("built with this length");
        std::iter::repeat_with(move || {
            state = state.wrapping_add(WEYL);
            let bits = mix(state);
            let channels = [bits >> 52, bits >> 40, bits >> 28];
            let noise = channels.map(|b| table[b as usize % QUANTILES].into());
            (noise, bits as u32 % LOTS)
        })
    }
}

/// Iterates over a pattern that is the same in all frames: a number of the standard normal
/// distribution per pixel.
pub(crate) fn pattern(seed: u64) -> impl Iterator<Item = f64> {
    let mut state = mix(seed ^ 0x7465_7874_7572_6500);
    std::iter::repeat_with(move || {
        state = state.wrapping_add(WEYL);
        UNIT[mix(state) as usize % QUANTILES]
    })
}

/// Iterates over numbers ≥ 0 and < 1.
pub(crate) fn uniform(seed: u64) -> impl Iterator<Item = f64> {
    let mut state = mix(seed ^ 0x7370_6563_6b73_0000);
    std::iter::repeat_with(move || {
        state = state.wrapping_add(WEYL);
        (mix(state) >> 11) as f64 / (1_u64 << 53) as f64
    })
}

/// Returns a well-mixed 64-bit hash (SplitMix64, variant 13 of Stafford's mixers).
pub(crate) fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// Returns the standard normal quantile of p, 0 < p < 1, by bisection of the distribution function.
fn normal_quantile(p: f64) -> f64 {
    let below = |z: f64| 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
    let (mut low, mut high) = (-8.0, 8.0);
    // 16 / 2²⁴ is a millionth: far finer than the table's steps.
    for _ in 0..24 {
        let middle = (low + high) / 2.0;
        if below(middle) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low + high) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: usize = 200_000;

    fn samples(noise: &Noise, number: u64) -> Vec<[f64; 3]> {
        let frame = noise.of_frame(number).take(PIXELS);
        let steps = |channel: Channel| f64::from(channel.bits());
        frame.map(|(pixel, _)| pixel.map(steps)).collect()
    }

    /// Returns the mean product of two series of deviation 160, as a correlation.
    fn correlation(a: impl Iterator<Item = f64>, b: impl Iterator<Item = f64>) -> f64 {
        let sum: f64 = a.zip(b).map(|(a, b)| a * b).sum();
        sum / PIXELS as f64 / (160.0 * 160.0)
    }

    #[test]
    fn quantiles_are_those_of_the_normal_distribution() {
        for (p, z) in [(0.5, 0.0), (0.975, 1.959_964), (0.001, -3.090_232)] {
            assert!((normal_quantile(p) - z).abs() < 2e-6, "{p}");
        }
    }

    #[test]
    fn mean_and_deviation_are_those_asked_for() {
        let noise = Noise::new(160.0, 1);
        let steps = noise.table.iter().map(|z| f64::from(z.bits()));
        let (mean, square) = steps.fold((0.0, 0.0), |(mean, square), z| {
            (mean + z / 4096.0, square + z * z / 4096.0)
        });
        assert_eq!(mean, 0.0);
        assert!(
            (square.sqrt() / 160.0 - 1.0).abs() < 1e-3,
            "{}",
            square.sqrt()
        );
    }

    #[test]
    fn channels_neighbours_frames_and_seeds_are_independent() {
        let a = samples(&Noise::new(160.0, 1), 0);
        let next = samples(&Noise::new(160.0, 1), 1);
        let other = samples(&Noise::new(160.0, 2), 0);
        let one = |series: &[[f64; 3]], channel: usize| -> Vec<f64> {
            series.iter().map(|pixel| pixel[channel]).collect()
        };
        let pairs = [
            ("itself", one(&a, 0), one(&a, 0), 1.0),
            ("red, green", one(&a, 0), one(&a, 1), 0.0),
            ("green, blue", one(&a, 1), one(&a, 2), 0.0),
            ("neighbour", one(&a, 0), one(&a[1..], 0), 0.0),
            ("row", one(&a, 0), one(&a[320..], 0), 0.0),
            ("frame", one(&a, 0), one(&next, 0), 0.0),
            ("seed", one(&a, 0), one(&other, 0), 0.0),
        ];
        for (name, x, y, expected) in pairs {
            let found = correlation(x.into_iter(), y.into_iter());
            // Four standard errors of the mean of 200,000.
            assert!(
                (found - expected).abs() < 0.009 + 0.004 * expected,
                "{name}: {found}"
            );
        }
    }

    #[test]
    fn lots_are_uniform_and_independent_of_the_noise() {
        let noise = Noise::new(160.0, 1);
        let drawn: Vec<_> = noise.of_frame(3).take(PIXELS).collect();
        let low = drawn.iter().filter(|(_, lot)| *lot < LOTS / 10);
        let low_and_bright = low.clone().filter(|(noise, _)| noise[2].bits() > 0);
        let share = |count: usize| count as f64 / PIXELS as f64;
        assert!((share(low.count()) - 0.1).abs() < 0.003);
        assert!((share(low_and_bright.count()) - 0.05).abs() < 0.002);
    }

    #[test]
    fn without_deviation_there_is_none() {
        let noise = Noise::new(0.0, 1);
        assert!(
            noise
                .of_frame(0)
                .take(100)
                .all(|(pixel, _)| pixel == [Channel::default(); 3])
        );
    }
}
