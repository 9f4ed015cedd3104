//! Computes the numbers of an evaluation, with confidence intervals.

use std::collections::BTreeMap;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Judged;

/// Resamples of the bootstrap.
const RESAMPLES: usize = 1000;

/// A number with the interval that contains 95 % of its resamples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The number.
    pub value: f64,
    /// The interval's ends.
    pub range: [f64; 2],
}

/// Numbers of a selection of the frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers {
    /// Number of frames.
    pub frames: usize,
    /// Mean angle between found and true force, degrees.
    pub direction_deg: Interval,
    /// Mean of |error| of α, degrees.
    pub alpha_deg: Interval,
    /// Mean of |error| of β, degrees.
    pub beta_deg: Interval,
    /// Root mean square error of |F|, N.
    pub force_rmse_n: Interval,
    /// Part of the frames whose α is within 0.5°.
    pub alpha_within: Interval,
    /// Part of the frames whose β is within 0.5°.
    pub beta_within: Interval,
    /// Part of the frames whose |F| is within 10 mN.
    pub force_within: Interval,
    /// Largest angle between found and true force, degrees.
    pub direction_worst_deg: f64,
    /// Largest |error| of |F|, N.
    pub force_worst_n: f64,
}

/// The number of sums over a group of frames that is resampled together.
const SUMS: usize = 8;

fn sums_of(frame: &Judged) -> [f64; SUMS] {
    let [alpha, beta, force] = errors(frame);
    let within = |error: f64, limit: f64| f64::from(u8::from(error.abs() <= limit));
    [
        1.0,
        frame.direction_deg,
        alpha.abs(),
        beta.abs(),
        force * force,
        within(alpha, 0.5),
        within(beta, 0.5),
        within(force, 0.010),
    ]
}

/// Found minus true: α, β (degrees), |F| (N).
pub(super) fn errors(frame: &Judged) -> [f64; 3] {
    std::array::from_fn(|i| frame.found_polar[i] - frame.truth_polar[i])
}

impl Numbers {
    /// Of frames; `None` without frames. Frames of a pose are resampled together, because they
    /// share that pose's error; without poses, each frame alone.
    pub fn of<'a>(frames: impl Iterator<Item = &'a Judged>, seed: u64) -> Option<Self> {
        let mut groups: BTreeMap<usize, [f64; SUMS]> = BTreeMap::new();
        let (mut count, mut direction_worst_deg, mut force_worst_n) = (0, 0.0_f64, 0.0_f64);
        for frame in frames {
            let group = groups
                .entry(frame.pose.unwrap_or(usize::MAX - count))
                .or_default();
            group
                .iter_mut()
                .zip(sums_of(frame))
                .for_each(|(sum, value)| *sum += value);
            direction_worst_deg = direction_worst_deg.max(frame.direction_deg);
            force_worst_n = force_worst_n.max(errors(frame)[2].abs());
            count += 1;
        }
        let groups: Vec<_> = groups.into_values().collect();
        let intervals = intervals(&groups, seed)?;
        let [
            direction_deg,
            alpha_deg,
            beta_deg,
            force_rmse_n,
            alpha_within,
            beta_within,
            force_within,
        ] = intervals;
        Some(Self {
            frames: count,
            direction_deg,
            alpha_deg,
            beta_deg,
            force_rmse_n,
            alpha_within,
            beta_within,
            force_within,
            direction_worst_deg,
            force_worst_n,
        })
    }
}

fn intervals(groups: &[[f64; SUMS]], seed: u64) -> Option<[Interval; SUMS - 1]> {
    if groups.is_empty() {
        return None;
    }
    let all = means(groups.iter());
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut resample =
        || means((0..groups.len()).map(|_| &groups[random.random_range(0..groups.len())]));
    let resampled: Vec<_> = (0..RESAMPLES).map(|_| resample()).collect();
    Some(std::array::from_fn(|i| {
        let mut values: Vec<f64> = resampled.iter().map(|means| means[i]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |part: f64| values[(part * (RESAMPLES - 1) as f64).round() as usize];
        Interval {
            value: all[i],
            range: [at(0.025), at(0.975)],
        }
    }))
}

fn means<'a>(groups: impl Iterator<Item = &'a [f64; SUMS]>) -> [f64; SUMS - 1] {
    let mut sums = [0.0; SUMS];
    for group in groups {
        sums.iter_mut()
            .zip(group)
            .for_each(|(sum, value)| *sum += value);
    }
    let mut means = std::array::from_fn(|i| sums[i + 1] / sums[0]);
    means[3] = f64::sqrt(means[3]);
    means
}

/// Numbers as the paper gives them: errors averaged over each pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseNumbers {
    /// Number of poses.
    pub poses: usize,
    /// Largest |average error| of α, β (degrees), |F| (N).
    pub worst: [f64; 3],
    /// Part of the poses whose average error of α is within 0.5°, of β within 0.5°, of |F| within
    /// 10 and 30 mN.
    pub within: [f64; 4],
}

/// Average errors of each pose: α, β (degrees), |F| (N).
pub(super) fn by_pose(frames: &[Judged]) -> BTreeMap<usize, [f64; 3]> {
    let mut sums: BTreeMap<usize, ([f64; 3], f64)> = BTreeMap::new();
    for frame in frames {
        if let Some(pose) = frame.pose {
            let (sum, count) = sums.entry(pose).or_default();
            sum.iter_mut()
                .zip(errors(frame))
                .for_each(|(sum, error)| *sum += error);
            *count += 1.0;
        }
    }
    sums.into_iter()
        .map(|(pose, (sum, count))| (pose, sum.map(|s| s / count)))
        .collect()
}

impl PoseNumbers {
    pub(super) fn of(averages: &BTreeMap<usize, [f64; 3]>) -> Option<Self> {
        if averages.is_empty() {
            return None;
        }
        let worst = |i: usize| averages.values().map(|a| a[i].abs()).fold(0.0, f64::max);
        let part = |i: usize, limit: f64| {
            let inside = averages.values().filter(|a| a[i].abs() <= limit).count();
            inside as f64 / averages.len() as f64
        };
        Some(Self {
            poses: averages.len(),
            worst: [worst(0), worst(1), worst(2)],
            within: [part(0, 0.5), part(1, 0.5), part(2, 0.010), part(2, 0.030)],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(pose: usize, alpha: f64, force: f64) -> Judged {
        Judged {
            truth: [0.0, 0.0, -0.1],
            truth_polar: [1.0, 0.0, 0.1],
            found_polar: [1.0 + alpha, 0.0, 0.1 + force],
            direction_deg: alpha.abs(),
            direction_sigma_deg: 0.2,
            magnitude_sigma_n: 1e-3,
            tip_mm: None,
            found_place: None,
            session: 0,
            pose: Some(pose),
        }
    }

    #[test]
    fn numbers_are_what_they_say() {
        let frames = [
            frame(0, 0.2, 0.003),
            frame(0, -0.6, -0.004),
            frame(1, 0.1, 0.02),
        ];
        let numbers = Numbers::of(frames.iter(), 1).unwrap();
        assert_eq!(numbers.frames, 3);
        assert!((numbers.direction_deg.value - 0.3).abs() < 1e-12);
        let rmse = ((9e-6 + 16e-6 + 400e-6) / 3.0_f64).sqrt();
        assert!((numbers.force_rmse_n.value - rmse).abs() < 1e-12);
        assert!((numbers.alpha_within.value - 2.0 / 3.0).abs() < 1e-12);
        assert!((numbers.force_worst_n - 0.02).abs() < 1e-12);
        let averages = by_pose(&frames);
        assert!((averages[&0][0] + 0.2).abs() < 1e-12);
        let poses = PoseNumbers::of(&averages).unwrap();
        assert_eq!((poses.poses, poses.within), (2, [1.0, 1.0, 0.5, 1.0]));
        assert!(Numbers::of([].iter(), 1).is_none() && PoseNumbers::of(&BTreeMap::new()).is_none());
    }

    /// The mean of 400 uniform numbers has a standard deviation of 0.0144: the interval must be
    /// about 2 · 1.96 times as wide.
    #[test]
    fn intervals_are_as_wide_as_theory_says() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let frames: Vec<_> = (0..400)
            .map(|i| frame(i, random.random_range(0.0..1.0), 0.0))
            .collect();
        let Interval { value, range } = Numbers::of(frames.iter(), 1).unwrap().direction_deg;
        let width = (range[1] - range[0]) / (2.0 * 1.96 * 0.01443);
        assert!((0.85..1.15).contains(&width), "{width}");
        assert!(range[0] < value && value < range[1]);
    }
}
