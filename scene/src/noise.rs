//! Sensor noise, the same on every machine.
//!
//! Counter-based: the noise of a pixel depends on seed, frame number and pixel index alone. A 64-bit hash
//! (SplitMix64's output function over a Weyl sequence) gives 12 bits per channel, and each picks a quantile of the
//! normal distribution from a table: |z| ≤ 3.7, standard deviation within 0.1 % of the one asked for.

/// Quantiles in the table.
const QUANTILES: usize = 4096;
/// SplitMix64's increment, the odd number nearest to 2⁶⁴ / golden ratio.
const WEYL: u64 = 0x9e37_79b9_7f4a_7c15;

/// A table of noise, in steps of 1/64 level.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Noise {
    table: Vec<i16>,
    seed: u64,
}

impl Noise {
    /// Noise of a standard deviation in steps, at most 4096.
    pub(crate) fn new(deviation: f64, seed: u64) -> Noise {
        let quantile = |i: usize| normal_quantile((i as f64 + 0.5) / QUANTILES as f64);
        Noise {
            table: (0..QUANTILES)
                .map(|i| (deviation * quantile(i)).round() as i16)
                .collect(),
            seed,
        }
    }

    /// The noise of one frame, pixel by pixel: three channels each, in steps.
    pub(crate) fn of_frame(&self, number: u64) -> impl Iterator<Item = [i32; 3]> {
        let mut state = mix(mix(self.seed).wrapping_add(number.wrapping_mul(WEYL)));
        let table: &[i16; QUANTILES] = self.table[..].try_into().expect("built with this length");
        std::iter::repeat_with(move || {
            state = state.wrapping_add(WEYL);
            let bits = mix(state);
            [bits >> 52, bits >> 40, bits >> 28].map(|b| i32::from(table[b as usize % QUANTILES]))
        })
    }
}

/// A well-mixed 64-bit hash (SplitMix64, variant 13 of Stafford's mixers).
pub(crate) fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// The standard normal quantile of p, 0 < p < 1, by bisection of the distribution function.
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
