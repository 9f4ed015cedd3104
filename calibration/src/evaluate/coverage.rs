//! Whether the uncertainty of the direction that comes with every force is honest.

use super::Judged;
use crate::errors::norm;

/// The angle within which 95 of 100 errors lie, over their root mean square: √(−ln 0.05), for errors that are the same to
/// all sides.
const BOUND: f64 = 1.730_818_382_602_285_4;
const PARTS: usize = 10;

/// A tenth of the frames, by |F|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coverage {
    /// Smallest and largest |F|, N.
    pub force_n: [f64; 2],
    /// Part of the frames whose direction is no further off than the stated 95 % bound.
    pub within: f64,
    /// Median of the stated bounds, degrees.
    pub bound_deg: f64,
    /// Median of the errors, degrees.
    pub error_deg: f64,
}

/// The coverage of each tenth of the frames, from the weakest forces to the strongest; none when there are fewer than ten.
pub fn coverage(frames: &[Judged]) -> Vec<Coverage> {
    let mut sorted: Vec<&Judged> = frames.iter().collect();
    sorted.sort_by(|a, b| norm(a.truth).total_cmp(&norm(b.truth)));
    let part = |i: usize| &sorted[i * sorted.len() / PARTS..(i + 1) * sorted.len() / PARTS];
    (0..PARTS).map(part).filter_map(of_part).collect()
}

fn of_part(frames: &[&Judged]) -> Option<Coverage> {
    let (first, last) = (frames.first()?, frames.last()?);
    let bound = |frame: &Judged| (BOUND * frame.direction_sigma_deg).min(180.0);
    let within = frames
        .iter()
        .filter(|f| f.direction_deg <= bound(f))
        .count();
    Some(Coverage {
        force_n: [norm(first.truth), norm(last.truth)],
        within: within as f64 / frames.len() as f64,
        bound_deg: median(frames.iter().map(|f| bound(f))),
        error_deg: median(frames.iter().map(|f| f.direction_deg)),
    })
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

    /// Errors that are as large as stated, to all sides: 95 of 100 lie within.
    #[test]
    fn an_honest_bound_holds_for_95_of_100() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut frame = || {
            let size: f64 = random.random_range(0.01..0.2);
            let sigma = 0.02 / size;
            let error = sigma * (-random.random_range(1e-9..1.0_f64).ln()).sqrt();
            Judged {
                truth: [0.0, 0.0, -size],
                truth_polar: [0.0, 0.0, size],
                found_polar: [0.0, 0.0, size],
                direction_deg: error,
                direction_sigma_deg: sigma,
                pose: None,
            }
        };
        let frames: Vec<_> = (0..20_000).map(|_| frame()).collect();
        let parts = coverage(&frames);
        assert_eq!(parts.len(), 10);
        assert!(
            parts
                .windows(2)
                .all(|pair| pair[0].force_n[1] <= pair[1].force_n[0])
        );
        assert!(
            parts
                .iter()
                .all(|part| (0.935..0.965).contains(&part.within)),
            "{parts:?}"
        );
        // √(ln 20 / ln 2) for the medians.
        assert!(
            parts
                .iter()
                .all(|part| (1.8..2.4).contains(&(part.bound_deg / part.error_deg)))
        );
        assert!(coverage(&frames[..9]).is_empty() || coverage(&frames[..9]).len() < 10);
        assert!(coverage(&[]).is_empty());
    }
}
