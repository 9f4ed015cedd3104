//! Selects loads from minutes of pressing anywhere: frames in which the force was steadiest, spread
//! over places and sizes.

use std::collections::BTreeMap;

use crate::data::dataset::{Observation, Sample};
use crate::data::loads::norm;
use hivtac_twin::film::Dots;

/// The largest number of frames in a load.
const MOST_FRAMES: usize = 8;
/// Limits within which |F|, in parts of it, and markers, px root mean square, stay near a load's
/// mean.
const STRAY: f64 = 0.02;
const STRAY_PX: f64 = 0.05;
/// The least force of a load, N.
const LEAST_N: f64 = 0.01;
/// Standard uncertainty of a force if the gauge's rate is unknown, in parts of it.
const UNKNOWN_RATE: f64 = 0.05;
/// Number of bins along x and along y, their reach, ± mm, and the limits between sizes, N.
const SIDE: usize = 5;
const REACH_MM: f64 = 4.0;
const SIZES_N: [f64; 4] = [0.04, 0.08, 0.13, 0.19];
/// The uncertainty of |F| that counts as much as [`STRAY_PX`]: in parts of |F|, and N.
const USUAL: f64 = 0.01;
const USUAL_N: f64 = 0.000_5;
/// Two loads of a bin are at least this many rows apart; nearer ones belong to the same press.
const APART: usize = 24;

/// A load from a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadFrames {
    /// The mean force along the rows' direction, N.
    pub force_n: [f64; 3],
    /// Standard uncertainty of |F|, N: the gauge's rate times the clocks' uncertainty, and the
    /// scatter of the frames.
    pub clock_n: f64,
    /// Estimated place, mm.
    pub place_mm: [f64; 2],
    /// Mean seen positions of the markers, px.
    pub seen_px: Dots<[f64; 2]>,
    /// Number of frames.
    pub frames: usize,
}

/// A candidate load.
#[derive(Clone, Copy, Debug)]
struct Group {
    load: LoadFrames,
    /// Number of its first row.
    at: usize,
    /// Smaller for steadier loads.
    cost: f64,
}

/// Index of the place along x and y, and of the size.
type Bin = (usize, usize, usize);

/// At most `most` loads from presses in their recorded order, spread over places and sizes.
/// `rough_place_mm` estimates each place.
pub fn representative(
    rows: &[Sample<'_>],
    most: usize,
    rough_place_mm: impl Fn(&Observation) -> [f64; 2],
) -> Vec<LoadFrames> {
    let mut bins: BTreeMap<Bin, Vec<Group>> = BTreeMap::new();
    let mut rest = rows;
    while !rest.is_empty() {
        let (frames, others) = rest.split_at(steady(rest));
        let group = Group::of(frames, rows.len() - rest.len(), &rough_place_mm);
        rest = others;
        if norm(group.load.force_n) >= LEAST_N {
            bins.entry(group.bin()).or_default().push(group);
        }
    }
    for groups in bins.values_mut() {
        groups.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    }
    let mut chosen = spread(bins, most);
    chosen.sort_by_key(|group| group.at);
    chosen.into_iter().map(|group| group.load).collect()
}

/// Number of rows at the start that are one steady load.
fn steady(rows: &[Sample<'_>]) -> usize {
    let first = &rows[0];
    let direction = |sample: &Sample<'_>| {
        let size = norm(sample.force_n);
        sample.force_n.map(|part| part / size)
    };
    let (mut size_n, mut mean_px) = (norm(first.force_n), first.seen.places_px());
    for (count, row) in rows.iter().enumerate().take(MOST_FRAMES).skip(1) {
        let (now_n, now_px) = (norm(row.force_n), row.seen.places_px());
        let [a, b] = [direction(first), direction(row)];
        let is_same = row.session == first.session && (0..3).all(|i| (a[i] - b[i]).abs() < 1e-6);
        let strays =
            (now_n - size_n).abs() > STRAY * size_n || apart_px(&now_px, &mean_px) > STRAY_PX;
        if !is_same || strays {
            return count;
        }
        let part = 1.0 / (count + 1) as f64;
        size_n += (now_n - size_n) * part;
        let now = now_px.as_flattened();
        for (mean, now) in mean_px.as_flattened_mut().iter_mut().zip(now) {
            *mean += (now - *mean) * part;
        }
    }
    rows.len().min(MOST_FRAMES)
}

/// Root mean square of the coordinates' differences, px.
fn apart_px(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

impl Group {
    fn of(
        frames: &[Sample<'_>],
        at: usize,
        rough_place_mm: impl Fn(&Observation) -> [f64; 2],
    ) -> Self {
        let count = frames.len() as f64;
        let mean = |of: &dyn Fn(&Sample<'_>) -> f64| frames.iter().map(of).sum::<f64>() / count;
        let seen: Vec<Dots<[f64; 2]>> = frames.iter().map(|row| row.seen.places_px()).collect();
        let places: Vec<[f64; 2]> = frames.iter().map(|row| rough_place_mm(row.seen)).collect();
        let size_n = mean(&|row| norm(row.force_n));
        let scatter_n = mean(&|row| (norm(row.force_n) - size_n).powi(2)).sqrt();
        let rate_n = mean(&|row| row.clock_n.unwrap_or(UNKNOWN_RATE * size_n));
        let clock_n = rate_n.hypot(scatter_n / count.sqrt());
        let seen_px = Dots::from_fn(seen[0].len(), |k| {
            [0, 1].map(|axis| seen.iter().map(|at| at[k][axis]).sum::<f64>() / count)
        });
        let moved_px = match frames.len() {
            1 => STRAY_PX,
            _ => seen.iter().map(|at| apart_px(at, &seen_px)).sum::<f64>() / count,
        };
        let usual_n = USUAL * size_n + USUAL_N;
        let cost = (clock_n / usual_n).powi(2) + (moved_px / STRAY_PX).powi(2) + 1.0 / count;
        let load = LoadFrames {
            force_n: std::array::from_fn(|i| mean(&|row| row.force_n[i])),
            clock_n,
            place_mm: [0, 1].map(|axis| places.iter().map(|at| at[axis]).sum::<f64>() / count),
            seen_px,
            frames: frames.len(),
        };
        Group { load, at, cost }
    }

    fn bin(&self) -> Bin {
        let index = |part: f64| {
            let steps = (part + REACH_MM) / (2.0 * REACH_MM) * SIDE as f64;
            (steps.max(0.0) as usize).min(SIDE - 1)
        };
        let size_n = norm(self.load.force_n);
        let size = SIZES_N.iter().filter(|least| size_n >= **least).count();
        let [x, y] = self.load.place_mm;
        (index(x), index(y), size)
    }
}

/// Takes from every bin, round by round, the steadiest candidate that is not near an earlier
/// choice.
fn spread(mut bins: BTreeMap<Bin, Vec<Group>>, most: usize) -> Vec<Group> {
    let mut chosen: Vec<Group> = Vec::new();
    let mut taken: BTreeMap<Bin, Vec<usize>> = BTreeMap::new();
    while chosen.len() < most {
        let mut round = Vec::new();
        for (bin, groups) in &mut bins {
            let taken = taken.entry(*bin).or_default();
            groups.retain(|group| taken.iter().all(|at| group.at.abs_diff(*at) >= APART));
            if !groups.is_empty() {
                let group = groups.remove(0);
                taken.push(group.at);
                round.push(group);
            }
        }
        if round.is_empty() {
            break;
        }
        round.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        round.truncate(most - chosen.len());
        chosen.extend(round);
    }
    chosen
}
