//! Takes steps to the two contacts that explain the markers best.

use super::film::{Both, PairPrediction};
use super::interaction::{INPUTS, Interaction};
use super::{Pair, PairEstimate};
use crate::force::forward::Forward;
use crate::force::forward::covariance::{Covariance, Unknown, Whitening};
use crate::force::forward::descent::{LIKELY, unlikely, within};
use crate::force::forward::estimate::{Estimate, Observed, Start};
use crate::force::forward::mounting::Mounting;
use crate::force::forward::pose::Pose;
use crate::force::forward::solve::{Column, PRIOR, Rows, Solved, norm, solve_here, square};
use hivtac_terms::contact_shape::ContactShape;

/// Most steps of a descent.
pub(super) const STEPS: usize = 16;
/// If a step does not lower the residual, shorter ones are tried (Marquardt 1963). Equations hold
/// each unknown at its value, with these parts of the markers' weight for it. Near contacts have
/// nearly the same slopes, so that without them a step may lead anywhere, or nowhere.
const HOLDS: [f32; 3] = [0.01, 0.05, 0.2];
/// The steps have converged if the next one would explain at most this.
const LEFT_TO_EXPLAIN: f32 = 0.05;
/// The longest step of a place along an axis, mm, and of a size, relative to the largest. A longer
/// step would leave the range of the slopes.
const LONGEST_MM: f32 = 1.5;
const LARGEST_CHANGE: f32 = 0.25;

/// The markers of a frame, and the properties of the unit.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The film.
    pub forward: &'a Forward<'a>,
    /// The correction of two contacts.
    pub interaction: &'a Interaction<'a>,
    /// The markers.
    pub observed: &'a Observed<'a>,
    /// How this unit's markers are glued and seen.
    pub mounting: &'a Mounting,
    /// The uncertainty about the unit.
    pub unknown: Unknown<'a>,
}

/// Changes of the unknowns.
type Step = [f32; INPUTS];

/// Two contacts, and the equations of the markers there.
struct Point {
    both: Both,
    prediction: PairPrediction,
    /// The part of the motion that they do not explain.
    left: Column,
}

/// Two contacts, and where one step leads from there.
pub(super) struct Stepped {
    /// The contacts where the step begins.
    pub here: PairEstimate,
    /// The contacts after it, with their squared residual relative to the covariance at its begin;
    /// `None` if no step explains more.
    pub next: Option<(Pair, f32)>,
}

impl Problem<'_> {
    /// Returns the one contact that explains the markers best.
    pub fn one(&self, start: Start) -> Estimate {
        (self.forward).estimate(self.observed, self.mounting, self.unknown, start)
    }

    /// Returns the one contact of unknown width near another that explains the markers best; `None`
    /// if it is not known how a wide contact moves them.
    pub(super) fn one_wide(&self, near: Pose) -> Option<Estimate> {
        let wide = self.forward.widths?.pressing(ContactShape::Unknown);
        let observed = Observed {
            wide,
            ..*self.observed
        };
        let start = Start::At(near);
        Some((self.forward).estimate(&observed, self.mounting, self.unknown, start))
    }

    /// Returns known contacts with their residual for these markers, without a step.
    #[inline(never)]
    pub(super) fn held(&self, known: &PairEstimate) -> PairEstimate {
        let mut here = Point {
            both: Both::new(known.pair, self.forward),
            prediction: PairPrediction::default(),
            left: Column::default(),
        };
        here.prediction.moved = self.moved(&known.pair);
        let pairs = self.observed.moved.iter().zip(here.prediction.moved.iter());
        here.left = Column::of(pairs.map(|(seen, predicted)| seen - predicted));
        let mut whitening = Whitening::EMPTY;
        let whole = whitening.set(|sum| here.put_covariance(self, sum));
        whitening.whiten(&mut here.left);
        PairEstimate {
            unexplained: whole.map_or(f32::INFINITY, |()| square(&here.left)),
            ..*known
        }
    }

    /// Takes a step from two contacts.
    #[inline(never)]
    pub(super) fn step(&self, pair: Pair) -> Stepped {
        let here = Point::new(self, pair);
        let mut whitening = Whitening::EMPTY;
        let found = self.solved(&here, &mut whitening);
        let is_over = |own: &Solved<INPUTS>| own.explained <= LEFT_TO_EXPLAIN;
        let next = match &found.solved {
            _ if !found.unexplained.is_finite() => None,
            Some(own) if is_over(own) => None,
            own => self.lower(&here, own.as_ref().map(|own| own.unknowns), &whitening),
        };
        Stepped { here: found, next }
    }

    /// Returns the contacts after a step, or a shorter one, that explains more; `None` without one.
    fn lower(
        &self,
        here: &Point,
        step: Option<Step>,
        whitening: &Whitening,
    ) -> Option<(Pair, f32)> {
        let squares = |pair: &Pair, left: &Column| {
            let mut left = *left;
            whitening.whiten(&mut left);
            let unlikely = pair.iter().map(|pose| square(&unlikely(pose)));
            (square(&left), unlikely.sum::<f32>())
        };
        let (explained, likely) = squares(&here.both.poses, &here.left);
        let shorter = HOLDS.iter().map(|hold| here.held(whitening, *hold));
        for step in core::iter::once(step).chain(shorter).flatten() {
            let pair = self.after(&here.both, &step);
            let mut left = self.moved(&pair);
            for (left, seen) in left.iter_mut().zip(self.observed.moved.iter()) {
                *left = seen - *left;
            }
            let (there, unlikely) = squares(&pair, &left);
            if there + unlikely < explained + likely {
                return Some((pair, there));
            }
        }
        None
    }

    /// The square of the motion, focal lengths, that two contacts do not explain.
    pub(super) fn left(&self, pair: &Pair) -> f32 {
        let moved = self.moved(pair);
        let pairs = moved.iter().zip(self.observed.moved.iter());
        pairs.fold(0.0, |sum, (predicted, seen)| {
            sum + (seen - predicted) * (seen - predicted)
        })
    }

    /// The motion of the images under two contacts, focal lengths.
    fn moved(&self, pair: &Pair) -> Column {
        let both = Both::new(*pair, self.forward);
        let mut moved = self.interaction.moved(&both);
        for (part, pose) in both.alone() {
            let beside_mm = &self.mounting.beside_mm;
            let limits = &self.forward.limits;
            let alone = self.forward.tables.predict(&pose, limits, beside_mm);
            for (sum, alone) in moved.iter_mut().zip(alone.moved.iter()) {
                *sum += part * alone;
            }
        }
        moved
    }

    fn solved(&self, here: &Point, whitening: &mut Whitening) -> PairEstimate {
        let mut estimate = PairEstimate {
            pair: here.both.poses,
            size: here.both.size,
            unexplained: f32::INFINITY,
            is_only: true,
            solved: None,
        };
        if whitening
            .set(|sum| here.put_covariance(self, sum))
            .is_none()
        {
            return estimate;
        }
        let (mut columns, mut side) = here.equations(whitening, 0.0);
        let markers = side.get(..here.left.len());
        estimate.unexplained = square(markers.unwrap_or_default());
        estimate.solved = solve_here(&mut columns, &mut side);
        estimate
    }

    /// The part of a step that is not too long.
    fn longest(&self, step: &Step) -> f32 {
        let [first, second, _, _, _, _, places @ ..] = step;
        let change = first.abs().max(second.abs()) / self.forward.limits.size;
        let far = places
            .iter()
            .fold(0.0f32, |most, part| most.max(part.abs()));
        (LARGEST_CHANGE / change.max(LARGEST_CHANGE)).min(LONGEST_MM / far.max(LONGEST_MM))
    }

    /// The contacts after a step, or after the part of it that is not too long.
    fn after(&self, both: &Both, step: &Step) -> Pair {
        let part = self.longest(step);
        let [s, t, a, b, c, d, x, y, z, w] = step.map(|own| part * own);
        let [first, second] = both.poses;
        let moved = |pose: Pose, size: f32, tilt: [f32; 2], place: [f32; 2]| {
            let moved = Pose {
                size: pose.size + size,
                tilt: [pose.tilt[0] + tilt[0], pose.tilt[1] + tilt[1]],
                place_mm: [pose.place_mm[0] + place[0], pose.place_mm[1] + place[1]],
                width: 0.0,
            };
            within(self.forward, moved)
        };
        [
            moved(first, s, [a, b], [x, y]),
            moved(second, t, [c, d], [z, w]),
        ]
    }
}

impl Point {
    /// The point of two contacts.
    fn new(problem: &Problem<'_>, pair: Pair) -> Point {
        let Problem {
            forward,
            interaction,
            observed,
            mounting,
            ..
        } = problem;
        let mut point = Point {
            both: Both::new(pair, forward),
            prediction: PairPrediction::default(),
            left: Column::defaults(observed.moved.len()),
        };
        let Point {
            both,
            prediction,
            left,
        } = &mut point;
        prediction.put(both, forward, interaction, &mounting.beside_mm);
        let pairs = observed.moved.iter().zip(prediction.moved.iter());
        for (left, (seen, predicted)) in left.iter_mut().zip(pairs) {
            *left = seen - predicted;
        }
        point
    }

    /// Puts the covariance of noise, of the tables' errors, and of the network's errors.
    fn put_covariance(&self, problem: &Problem<'_>, covariance: &mut Covariance) {
        let Problem {
            forward,
            interaction,
            observed,
            mounting,
            unknown,
        } = problem;
        covariance.reset(self.left.len());
        observed.add_to(mounting, covariance);
        let mut own = Covariance::EMPTY;
        for (part, pose) in self.both.alone() {
            unknown.put(&pose, &forward.limits, &self.prediction.moved, &mut own);
            for (sums, row) in covariance.rows_mut().zip(own.rows()) {
                for (sum, entry) in sums.iter_mut().zip(row) {
                    *sum += part * part * entry;
                }
            }
        }
        interaction.add_uncertainty(&self.both, covariance);
    }

    /// The step if equations hold each unknown with this part of the markers' strength; `None` if
    /// they do not determine all unknowns.
    #[inline(never)]
    fn held(&self, whitening: &Whitening, hold: f32) -> Option<Step> {
        let (mut columns, mut side) = self.equations(whitening, hold);
        solve_here(&mut columns, &mut side).map(|solved| solved.unknowns)
    }

    /// The equations of the markers and of the prior, in units of their standard uncertainties.
    /// Then, if `hold` is not 0, those that hold the unknowns with this part of the strength of the
    /// equations before.
    fn equations(&self, whitening: &Whitening, hold: f32) -> ([Rows; INPUTS], Rows) {
        let markers = self.left.len();
        let all = markers + 2 * PRIOR;
        let rows = if hold > 0.0 { all + INPUTS } else { all };
        let mut columns = [Rows::defaults(rows); INPUTS];
        let mut side = Rows::defaults(rows);
        let slopes = columns.iter_mut().zip(&self.prediction.slopes);
        for (rows, column) in slopes.chain([(&mut side, &self.left)]) {
            if let Some(rows) = rows.get_mut(..markers) {
                for (row, own) in rows.iter_mut().zip(column.iter()) {
                    *row = *own;
                }
                whitening.whiten(rows);
            }
        }
        for (number, pose) in self.both.poses.iter().enumerate() {
            for (k, (likely, own)) in LIKELY.into_iter().zip(unlikely(pose)).enumerate() {
                // The tilts of both come before the places of both.
                let unknown = 2 + 2 * number + k + if k < 2 { 0 } else { 2 };
                let row = markers + PRIOR * number + k;
                let one = columns.get_mut(unknown).and_then(|rows| rows.get_mut(row));
                if let Some((one, side)) = one.zip(side.get_mut(row)) {
                    (*one, *side) = (1.0 / likely, own);
                }
            }
        }
        for (unknown, column) in columns.iter_mut().enumerate() {
            let own = hold * norm(column);
            if let Some(row) = column.get_mut(all + unknown) {
                *row = own;
            }
        }
        (columns, side)
    }
}
