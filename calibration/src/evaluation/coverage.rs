//! Checks whether the stated uncertainties of forces hold.

use super::Judged;
use crate::data::loads::norm;
use crate::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND};

const PARTS: usize = 10;

/// A tenth of the frames, by |F|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coverage {
    /// Smallest and largest |F|, N.
    pub force_n: [f64; 2],
    /// The direction, in degrees.
    pub direction: Covered,
    /// |F|, in N.
    pub magnitude: Covered,
}

/// Comparison of stated bounds and errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covered {
    /// Part of the frames whose error does not exceed its stated 95 % bound.
    pub within: f64,
    /// Median of the stated bounds.
    pub bound: f64,
    /// Median of the errors.
    pub error: f64,
}

/// The coverage of each tenth of the frames, from the weakest forces to the strongest; empty for
/// fewer than ten frames.
pub fn coverage(frames: &[Judged]) -> Vec<Coverage> {
    let mut sorted: Vec<&Judged> = frames.iter().collect();
    sorted.sort_by(|a, b| norm(a.truth).total_cmp(&norm(b.truth)));
    let part = |i: usize| &sorted[i * sorted.len() / PARTS..(i + 1) * sorted.len() / PARTS];
    (0..PARTS).map(part).filter_map(of_part).collect()
}

fn of_part(frames: &[&Judged]) -> Option<Coverage> {
    let (first, last) = (frames.first()?, frames.last()?);
    let direction = |f: &Judged| {
        let bound = (DIRECTION_BOUND * f.direction_sigma_deg).min(180.0);
        (f.direction_deg, bound)
    };
    let magnitude = |f: &Judged| {
        let error = (f.found_polar[2] - f.truth_polar[2]).abs();
        (error, MAGNITUDE_BOUND * f.magnitude_sigma_n)
    };
    Some(Coverage {
        force_n: [norm(first.truth), norm(last.truth)],
        direction: covered(frames.iter().map(|f| direction(f))),
        magnitude: covered(frames.iter().map(|f| magnitude(f))),
    })
}

/// From pairs of error and bound.
fn covered(errors: impl ExactSizeIterator<Item = (f64, f64)> + Clone) -> Covered {
    let count = errors.len() as f64;
    let within = errors
        .clone()
        .filter(|(error, bound)| error <= bound)
        .count();
    Covered {
        within: within as f64 / count,
        bound: median(errors.clone().map(|(_, bound)| bound)),
        error: median(errors.map(|(error, _)| error)),
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Errors as large as stated, in all directions: 95 of 100 lie within their bounds.
    #[test]
    fn a_correct_bound_holds_for_95_of_100() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut frame = || {
            let size: f64 = random.random_range(0.01..0.2);
            let mut rayleigh = || (-random.random_range(1e-9..1.0_f64).ln()).sqrt();
            let (sigma, magnitude_sigma_n) = (0.02 / size, 1e-4 + 0.01 * size);
            let direction_deg = sigma * rayleigh();
            let off = magnitude_sigma_n * std::f64::consts::SQRT_2 * rayleigh();
            let turn: f64 = random.random_range(0.0..std::f64::consts::TAU);
            Judged {
                truth: [0.0, 0.0, -size],
                truth_polar: [0.0, 0.0, size],
                found_polar: [0.0, 0.0, size + off * turn.cos()],
                direction_deg,
                direction_sigma_deg: sigma,
                magnitude_sigma_n,
                tip_mm: None,
                found_place: None,
                session: 0,
                pose: None,
            }
        };
        let frames: Vec<_> = (0..20_000).map(|_| frame()).collect();
        let parts = coverage(&frames);
        assert_eq!(parts.len(), 10);
        let apart = |pair: &[Coverage]| pair[0].force_n[1] <= pair[1].force_n[0];
        assert!(parts.windows(2).all(apart));
        for part in &parts {
            for covered in [part.direction, part.magnitude] {
                assert!((0.935..0.965).contains(&covered.within), "{part:?}");
            }
            // Expected ratio of the medians: √(ln 20 / ln 2), and 1.960 / 0.674.
            let ratio = |covered: Covered| covered.bound / covered.error;
            assert!((1.8..2.4).contains(&ratio(part.direction)), "{part:?}");
            assert!((2.6..3.3).contains(&ratio(part.magnitude)), "{part:?}");
        }
        assert!(coverage(&frames[..9]).len() < 10);
        assert!(coverage(&[]).is_empty());
    }
}
