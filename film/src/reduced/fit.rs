//! Makes the curves from the full solution and holds them against it.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

use hivtac_scene::Load;

use super::{Curve, MAX_FORCE_N, MAX_OFFSET_MM, MAX_TANGENT, MAX_TILT_DEG, Motion, Reduced, TERMS};
use super::{Ways, chebyshev, term, to_diagonal};
use crate::newton::solve_small;
use crate::view::{MARKERS_MM, paper_camera, seen};
use crate::{Contact, Design, Film, FilmError};

/// Poses (tilt and offset) at which every curve's nodes are solved. Each gives four markers' samples for at most 19
/// terms of a motion.
const POSES: usize = 20;
/// The highest degree in tilt and offset together.
const DEGREE: u8 = 3;
/// A curve whose part nowhere exceeds this is left out, mm (0.1 px is about 2 µm).
const NEGLIGIBLE_MM: f64 = 3e-4;
/// So is the end of a series that does not exceed this, mm.
const NEGLIGIBLE_TAIL_MM: f64 = 2e-6;

/// How far the curves are from the full solution, over poses that they were not made from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Check {
    /// Poses solved.
    pub poses: usize,
    /// The largest distance of a marker's image at 800×600 `paper`, px.
    pub worst_px: f64,
    /// Its root mean square, px.
    pub rms_px: f64,
    /// The largest error of the tip's depth, mm.
    pub worst_depth_mm: f64,
}

/// A pose: tangents of the direction, and offset in mm.
#[derive(Clone, Copy, Debug)]
struct Pose {
    tangents: [f64; 2],
    offset_mm: [f64; 2],
}

/// One pose's tip depth and markers' motions at each node of s.
type Run = Vec<(f64, [[f64; 3]; 4])>;

/// Makes the curves of a film on `threads` threads; `progress` is told (poses done, poses) now and then.
///
/// # Errors
/// When the film cannot be made or an equilibrium is not found.
pub fn fit(
    design: &Design,
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Reduced, FilmError> {
    let poses: Vec<Pose> = (0..POSES).map(training_pose).collect();
    let runs = in_parallel(design, &poses, threads, progress, |film, pose| {
        run(film, pose)
    })?;
    let mut curves = Vec::new();
    for motion in [
        Motion::Radial,
        Motion::Tangential,
        Motion::Normal,
        Motion::Depth,
    ] {
        curves.extend(motion_curves(motion, &poses, &runs)?);
    }
    Ok(Reduced { curves })
}

impl Reduced {
    /// Holds the curves against the full solution at `poses` random loads and offsets of their whole domain.
    ///
    /// # Errors
    /// When the film cannot be made or an equilibrium is not found.
    pub fn check(
        &self,
        design: &Design,
        poses: usize,
        threads: usize,
        progress: impl Fn(usize, usize) + Sync,
    ) -> Result<Check, FilmError> {
        let cases = (0..poses)
            .map(checking_case)
            .collect::<Result<Vec<_>, _>>()?;
        let errors = in_parallel(design, &cases, threads, progress, |film, (load, offset)| {
            self.errors(film, load, *offset)
        })?;
        let mut check = Check {
            poses,
            ..Check::default()
        };
        for (depth_mm, pixels) in &errors {
            check.worst_depth_mm = check.worst_depth_mm.max(*depth_mm);
            for px in pixels {
                check.worst_px = check.worst_px.max(*px);
                check.rms_px += px * px;
            }
        }
        check.rms_px = (check.rms_px / (4 * poses.max(1)) as f64).sqrt();
        Ok(check)
    }

    /// The tip's error in mm and the markers' in px.
    fn errors(
        &self,
        film: &mut Film,
        load: &Load,
        offset_mm: [f64; 2],
    ) -> Result<(f64, [f64; 4]), FilmError> {
        film.move_tip(offset_mm)?;
        let state = film.press(Contact::Force(load.vector_n()), &film.rest())?;
        let reduced = self.press(load, offset_mm)?;
        let camera = paper_camera()?;
        let distance = |k: usize| {
            let rest = MARKERS_MM[k];
            let [a, b] = [film.displacement(&state, rest), reduced.moved_mm[k]]
                .map(|moved| seen(rest, moved, &camera));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        let depth_mm = (reduced.tip_depth_mm + state.tip_mm[2]).abs();
        Ok((depth_mm, std::array::from_fn(distance)))
    }
}

/// Runs `work` on each item, every thread with its own film.
fn in_parallel<T: Sync, R: Send>(
    design: &Design,
    items: &[T],
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
    work: impl Fn(&mut Film, &T) -> Result<R, FilmError> + Sync,
) -> Result<Vec<R>, FilmError> {
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let worker = || -> Result<Vec<(usize, R)>, FilmError> {
        let mut film = Film::new(design)?;
        let mut results = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else {
                return Ok(results);
            };
            results.push((index, work(&mut film, item)?));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, items.len());
        }
    };
    let shares = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(worker)).collect();
        let stopped = || FilmError::Solver("a thread stopped".into());
        let joined = handles
            .into_iter()
            .map(|handle| handle.join().map_err(|_| stopped())?);
        joined.collect::<Result<Vec<_>, _>>()
    })?;
    let mut all: Vec<(usize, R)> = shares.into_iter().flatten().collect();
    all.sort_by_key(|(index, _)| *index);
    Ok(all.into_iter().map(|(_, result)| result).collect())
}

/// Chebyshev's nodes in s, from the smallest.
fn nodes() -> [f64; TERMS] {
    std::array::from_fn(|k| (1.0 - ((k as f64 + 0.5) * PI / TERMS as f64).cos()) / 2.0)
}

/// Presses the film at one pose, harder and harder.
fn run(film: &mut Film, pose: &Pose) -> Result<Run, FilmError> {
    film.move_tip(pose.offset_mm)?;
    let mut state = film.rest();
    let mut run = Vec::new();
    for s in nodes() {
        state = film.press(pose.contact(s), &state)?;
        run.push((
            -state.tip_mm[2],
            MARKERS_MM.map(|rest| film.displacement(&state, rest)),
        ));
    }
    Ok(run)
}

impl Pose {
    fn contact(&self, s: f64) -> Contact {
        let [x, y] = self.tangents;
        let size = MAX_FORCE_N * s.powi(3) / (1.0 + x * x + y * y).sqrt();
        Contact::Force([size * x, size * y, -size])
    }

    fn ways(&self) -> Ways {
        Ways::new([self.tangents[0], self.tangents[1], -1.0], self.offset_mm)
    }
}

/// Spread evenly in four dimensions and denser towards the limits, where a polynomial would stray first.
fn training_pose(index: usize) -> Pose {
    let spread = |base| -(PI * halton(index + 1, base)).cos();
    Pose {
        tangents: [2, 3].map(|base| MAX_TANGENT * spread(base)),
        offset_mm: [5, 7].map(|base| MAX_OFFSET_MM * spread(base)),
    }
}

/// A load and an offset of the stated domain; from another part of the same sequence, with other bases.
fn checking_case(index: usize) -> Result<(Load, [f64; 2]), FilmError> {
    let part = |base| halton(index + 1000, base);
    let [alpha, beta] =
        [(3, 0), (5, 1)].map(|(base, k)| MAX_TILT_DEG[k] * (2.0 * part(base) - 1.0));
    let load = Load::from_angles(MAX_FORCE_N * part(2), alpha, beta);
    let (size, angle) = (MAX_OFFSET_MM * part(7).sqrt(), 2.0 * PI * part(11));
    let load = load.map_err(|error| FilmError::Scene(error.to_string()))?;
    Ok((load, [size * angle.cos(), size * angle.sin()]))
}

/// Halton's sequence: the digits of `index` in `base` behind the point, reversed.
fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= base as f64;
        value += place * (index % base) as f64;
        index /= base;
    }
    value
}

/// The terms that the symmetry leaves to a motion.
fn terms(motion: Motion) -> Vec<[u8; 4]> {
    let odd = u8::from(motion == Motion::Tangential);
    let mut terms = Vec::new();
    for code in 0..=255u8 {
        let powers = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6];
        let degree: u8 = powers.iter().sum();
        // The tip sees all four diagonals alike: a half turn leaves it no odd degree.
        let allowed = motion != Motion::Depth || degree.is_multiple_of(2);
        if degree <= DEGREE && (powers[1] + powers[3]) % 2 == odd && allowed {
            terms.push(powers);
        }
    }
    terms
}

/// The curves of one motion: least squares over the poses at each node, then Chebyshev series through the nodes.
fn motion_curves(motion: Motion, poses: &[Pose], runs: &[Run]) -> Result<Vec<Curve>, FilmError> {
    let terms = terms(motion);
    let rows: Vec<Vec<f64>> = poses.iter().flat_map(|pose| rows(&terms, pose)).collect();
    let nodes = nodes();
    let mut at_nodes = Vec::new();
    for (node, s) in nodes.iter().enumerate() {
        let values: Vec<f64> = runs
            .iter()
            .flat_map(|run| values(motion, &run[node]))
            .map(|x| x / s)
            .collect();
        let solved = least_squares(&rows, &values);
        at_nodes
            .push(solved.ok_or_else(|| FilmError::Solver("too few poses for the terms".into()))?);
    }
    let curves = terms.iter().enumerate().map(|(k, powers)| {
        let values: Vec<f64> = at_nodes.iter().map(|solved| solved[k]).collect();
        let largest = values
            .iter()
            .zip(&nodes)
            .map(|(value, s)| (value * s).abs())
            .fold(0.0, f64::max);
        let series = series(&values);
        (
            largest,
            Curve {
                motion,
                powers: *powers,
                series,
            },
        )
    });
    let worth = curves.filter(|(largest, _)| *largest > NEGLIGIBLE_MM);
    Ok(worth.map(|(_, curve)| curve).collect())
}

/// The terms' values at a pose, for each marker.
fn rows(terms: &[[u8; 4]], pose: &Pose) -> Vec<Vec<f64>> {
    let ways = pose.ways();
    let row = |rest| {
        let powers = ways.powers(rest);
        terms
            .iter()
            .map(|exponents| term(exponents, &powers))
            .collect()
    };
    MARKERS_MM.map(row).to_vec()
}

/// A motion's values, for each marker.
fn values(motion: Motion, (depth, moved): &(f64, [[f64; 3]; 4])) -> [f64; 4] {
    std::array::from_fn(|k| {
        let [x, y, z] = moved[k];
        let [r, t] = to_diagonal([x, y], MARKERS_MM[k]);
        match motion {
            Motion::Radial => r,
            Motion::Tangential => t,
            Motion::Normal => z,
            Motion::Depth => *depth,
        }
    })
}

/// Solves the normal equations; the terms are of size 1, and few.
fn least_squares(rows: &[Vec<f64>], values: &[f64]) -> Option<Vec<f64>> {
    let count = rows.first()?.len();
    let mut matrix = vec![vec![0.0; count]; count];
    let mut side = vec![0.0; count];
    for (row, value) in rows.iter().zip(values) {
        for i in 0..count {
            side[i] += row[i] * value;
            for j in 0..count {
                matrix[i][j] += row[i] * row[j];
            }
        }
    }
    solve_small(matrix, side)
}

/// The Chebyshev series through values at the nodes, without a negligible end.
fn series(values: &[f64]) -> Vec<f64> {
    let mut series = vec![0.0; TERMS];
    for (s, value) in nodes().iter().zip(values) {
        for (k, (part, t)) in series.iter_mut().zip(chebyshev(*s)).enumerate() {
            let weight = if k == 0 { 1.0 } else { 2.0 };
            *part += weight / TERMS as f64 * value * t;
        }
    }
    while series.len() > 1
        && series
            .last()
            .is_some_and(|part| part.abs() < NEGLIGIBLE_TAIL_MM)
    {
        series.pop();
    }
    series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetry_leaves_these_terms() {
        let count = |motion| terms(motion).len();
        assert_eq!(count(Motion::Radial), 19);
        assert_eq!(count(Motion::Tangential), 16);
        assert_eq!(count(Motion::Normal), 19);
        assert_eq!(count(Motion::Depth), 7);
    }

    #[test]
    fn series_go_through_their_nodes() {
        let values = nodes().map(|s| (3.0 * s).sin());
        let series = series(&values);
        for s in [0.0, 0.03, 0.4, 1.0] {
            let sum: f64 = series.iter().zip(chebyshev(s)).map(|(c, t)| c * t).sum();
            assert!((sum - (3.0 * s).sin()).abs() < 1e-5);
        }
        assert!(series.len() < TERMS);
    }
}
