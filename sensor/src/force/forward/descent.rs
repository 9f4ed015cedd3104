//! Takes steps of falling residual to the load that explains the markers best, by the linearized
//! film.

use super::Forward;
use super::covariance::{Covariance, Unknown, Whitening};
use super::estimate::{Estimate, Observed};
use super::mounting::Mounting;
use super::pose::{Pose, limited};
use super::predict::Prediction;
use super::residual;
use super::solve::{Column, PRIOR, Rows, Solved, UNKNOWNS, Unknowns, solve, square};
use super::torsion::{Arm, Turning};
use super::widths::{self, Wide};
use crate::force::kernels::sqrt;

/// The steps have converged if the next one would explain at most this part of the residual,
/// relative to its variance. It would move no unknown by more than a fifth of its standard
/// uncertainty.
const LEFT_TO_EXPLAIN: f32 = 0.05;
/// If a step that would explain at most this does not lower the residual, the rest is rounding of
/// the tables.
const ROUNDING: f32 = 0.5;
/// Index of the tilt among the unknowns; the place follows it.
const TILT: usize = 1;
/// Prior: standard deviations of the tilt along x and y, rad, and the place along x and y, mm,
/// around 0. A load too weak for its direction and place stays near the prior; otherwise the steps
/// would not end.
pub(super) const LIKELY: [f32; PRIOR] = [0.3, 0.3, 2.5, 2.5];
/// Factor by which the next step is shortened if one did not lower the residual.
const SHORTER: f32 = 0.5;

/// The descent from a first guess to the load that explains the markers best.
pub struct Descent<'a> {
    forward: &'a Forward<'a>,
    markers: Markers<'a>,
    here: &'a mut Point,
    /// The load of the next step.
    there: &'a mut Point,
    /// By the covariance of noise and of the unit's uncertainty, at the load here.
    whitening: &'a mut Whitening,
    /// The equations in coordinates in which that covariance is the unit matrix; `None` if it is
    /// singular or not finite.
    white: Option<White>,
    /// The fraction of the next step that is tried.
    part: f32,
    /// How the path bends: added to the unknowns and the width, times the square of that fraction.
    bend: Bend,
    /// True if the last step changed no more than rounding.
    has_ended: bool,
    /// How often the film was run forwards.
    looks: u8,
}

/// The markers of a frame, their mounting, and the unit's uncertainty.
struct Markers<'a> {
    observed: &'a Observed<'a>,
    mounting: &'a Mounting,
    unknown: Unknown<'a>,
    /// The torque of what presses, if that counts.
    turning: Option<&'a Turning<'a>>,
}

/// The storage of a descent. It is large, and therefore changed in place.
pub struct Storage {
    points: [Point; 2],
    whitening: Whitening,
}

/// A load, and the linear equations of the markers there.
struct Point {
    pose: Pose,
    /// The motion under the load, and its slopes.
    prediction: Prediction,
    /// The part of the markers' motion that the load does not explain, focal lengths.
    left: Column,
    /// The motion by a torque, if that counts, where the equations were solved.
    by_arm: Column,
}

/// How a path bends.
#[derive(Clone, Copy, Default)]
struct Bend {
    unknowns: Unknowns,
    width: f32,
}

/// The solution of white equations.
#[derive(Clone, Copy)]
struct White {
    /// The square of the part of the motion that the load does not explain.
    unexplained: f32,
    /// That square, plus the square of the distance from the prior.
    square: f32,
    solved: Option<Solved>,
    /// The arm of the torque, if that counts.
    arm: Option<Arm>,
}

impl Storage {
    /// Storage before a descent.
    pub fn new() -> Storage {
        let point = || Point {
            pose: Pose::default(),
            prediction: Prediction::zeros(0),
            left: Column::default(),
            by_arm: Column::default(),
        };
        Storage {
            points: [point(), point()],
            whitening: Whitening::EMPTY,
        }
    }
}

impl<'a> Descent<'a> {
    /// Begins at a guess; outside the tables, at the nearest load inside.
    pub fn new(
        forward: &'a Forward<'a>,
        observed: &'a Observed<'a>,
        mounting: &'a Mounting,
        (unknown, turning): (Unknown<'a>, Option<&'a Turning<'a>>),
        guess: Pose,
        storage: &'a mut Storage,
    ) -> Self {
        let Storage { points, whitening } = storage;
        let [here, there] = points;
        let markers = Markers {
            observed,
            mounting,
            unknown,
            turning,
        };
        here.put(forward, &markers, within(forward, guess));
        let mut descent = Self {
            forward,
            markers,
            here,
            there,
            whitening,
            white: None,
            part: 1.0,
            bend: Bend::default(),
            has_ended: false,
            looks: 1,
        };
        descent.solve();
        descent
    }

    /// Tries a step. A step that does not lower the residual, weighted by the covariance where it
    /// begins, is not taken, and the next one is shorter. It then follows a path that bends as the
    /// whole step's residual says (geodesic acceleration: Transtrum and Sethna 2012). Returns false
    /// if the markers do not determine a step.
    pub fn step(&mut self) -> bool {
        let Some((white, solved)) = self.solved() else {
            return false;
        };
        let pose = after(self.forward, &self.here.pose, solved, self.part, &self.bend);
        let (square, explained) = (white.square, solved.explained);
        self.there.put(self.forward, &self.markers, pose);
        self.looks += 1;
        let wide = self.markers.observed.wide.as_ref();
        if self.there.square(self.whitening, wide) < square {
            core::mem::swap(&mut self.here, &mut self.there);
            (self.part, self.bend) = (1.0, Bend::default());
            self.solve();
        } else {
            self.has_ended = explained <= ROUNDING;
            if self.part == 1.0 {
                self.bend = self.bend();
            }
            self.part *= SHORTER;
        }
        true
    }

    /// Solves the equations here.
    fn solve(&mut self) {
        let Self {
            forward,
            markers,
            here,
            ..
        } = self;
        if let Some(turning) = markers.turning {
            turning.put(&here.pose, &forward.limits, &mut here.by_arm);
        }
        let put = |covariance: &mut Covariance| here.put_covariance(forward, markers, covariance);
        let wide = markers.observed.wide.as_ref();
        let turning = markers.turning;
        self.white = (self.whitening.set(put)).map(|()| here.white(self.whitening, wide, turning));
    }

    /// The solution, if the markers determine one.
    fn solved(&self) -> Option<(&White, &Solved)> {
        let white = self.white.as_ref()?;
        Some((white, white.solved.as_ref()?))
    }

    /// Returns whether more steps would not help, whether or not the load explains the markers.
    pub fn is_over(&self) -> bool {
        self.has_converged() || self.is_done()
    }

    /// Whether another step would explain hardly more.
    fn has_converged(&self) -> bool {
        let solved = self.solved();
        solved.is_some_and(|(_, solved)| solved.explained <= LEFT_TO_EXPLAIN)
    }

    /// Returns whether the load explains the markers and the steps came to an end.
    pub fn is_done(&self) -> bool {
        let stuck = residual::stuck(self.markers.observed.coordinates());
        let is_explained = self.white.is_some_and(|white| white.unexplained <= stuck);
        is_explained && (self.has_ended || self.has_converged())
    }

    /// Returns how the path bends if the whole first step leads to `there`: the slopes here, solved
    /// for the residual there. Not inlined, so that its stack is released on return.
    #[inline(never)]
    fn bend(&self) -> Bend {
        let (prediction, there) = (&self.here.prediction, &self.there);
        let wide = self.markers.observed.wide.as_ref();
        let at = (&there.left, &there.pose);
        let mut equations = Equations::new(self.whitening, prediction, at, wide);
        let solved = equations.solve();
        solved.map_or(Bend::default(), |solved| Bend {
            unknowns: solved.unknowns,
            width: solved.width.step,
        })
    }

    /// The load that it has reached.
    pub fn estimate(self) -> Estimate {
        let white = self.white;
        Estimate {
            pose: self.here.pose,
            // A load without a covariance explains nothing: infinite residual.
            unexplained: white.map_or(f32::INFINITY, |white| white.unexplained),
            left: self.here.by_noise(self.markers.observed, self.whitening),
            solved: white.and_then(|white| white.solved),
            arm: white.and_then(|white| white.arm),
            coordinates: self.markers.observed.coordinates(),
            looks: self.looks,
        }
    }
}

/// The markers' equations and those of the prior, in units of their standard uncertainties.
struct Equations {
    columns: [Rows; UNKNOWNS],
    side: Rows,
    /// The column of the contact's width, if that is unknown.
    width: Option<Rows>,
}

impl Equations {
    fn new(
        whitening: &Whitening,
        prediction: &Prediction,
        (left, pose): (&Column, &Pose),
        wide: Option<&Wide<'_>>,
    ) -> Self {
        let (markers, rows) = (left.len(), left.len() + prior(wide));
        let mut all = Equations {
            columns: [Rows::defaults(rows); UNKNOWNS],
            side: Rows::defaults(rows),
            width: None,
        };
        for (column, slope) in all.columns.iter_mut().zip(&prediction.slopes) {
            put_white(whitening, slope, column);
        }
        put_white(whitening, left, &mut all.side);
        for (k, (likely, own)) in LIKELY.into_iter().zip(unlikely(pose)).enumerate() {
            let column = all.columns.get_mut(TILT + k);
            let one = column.and_then(|column| column.get_mut(markers + k));
            if let Some((one, side)) = one.zip(all.side.get_mut(markers + k)) {
                (*one, *side) = (1.0 / likely, own);
            }
        }
        if let Some(wide) = wide {
            let [off, per_width] = wide.unlikely(pose.width);
            let mut column = Rows::defaults(rows);
            put_white(whitening, &prediction.by_width, &mut column);
            let last = column.last_mut().zip(all.side.last_mut());
            if let Some((one, side)) = last {
                (*one, *side) = (per_width, off);
            }
            all.width = Some(column);
        }
        all
    }

    fn solve(&mut self) -> Option<Solved> {
        let Equations {
            columns,
            side,
            width,
        } = self;
        let taken = (width.as_mut()).map(|width| widths::take_out(width, columns, side));
        let solved = solve(columns, side)?;
        Some(taken.map_or(solved, |taken| taken.put_into(solved)))
    }
}

/// Number of equations of the prior.
fn prior(wide: Option<&Wide<'_>>) -> usize {
    PRIOR + usize::from(wide.is_some())
}

/// Puts a column, in white coordinates, into the first rows.
fn put_white(whitening: &Whitening, column: &Column, rows: &mut Rows) {
    if let Some(rows) = rows.get_mut(..column.len()) {
        rows.copy_from_slice(column);
        whitening.whiten(rows);
    }
}

/// The distance of a load from the prior, in standard deviations.
pub(super) fn unlikely(pose: &Pose) -> [f32; LIKELY.len()] {
    let ([a, b], [x, y]) = (pose.tilt, pose.place_mm);
    let parts = [a, b, x, y];
    core::array::from_fn(|k| -parts[k] / LIKELY[k])
}

impl Point {
    /// Makes this the point of a load. Not inlined, so that its stack is released on return.
    #[inline(never)]
    fn put(&mut self, forward: &Forward<'_>, markers: &Markers<'_>, pose: Pose) {
        let Markers {
            observed, mounting, ..
        } = markers;
        let limits = &forward.limits;
        let Point {
            prediction, left, ..
        } = self;
        (forward.tables).put(&pose, limits, &mounting.beside_mm, prediction);
        if let Some(hanging) = observed.hanging {
            hanging.add_to(&pose, forward, prediction);
        }
        if let Some(pressing) = &observed.pressing {
            pressing.add_to(&pose, limits, prediction);
        }
        if let Some(wide) = &observed.wide {
            wide.add_to(&pose, limits, prediction);
        }
        left.reset(observed.moved.len(), 0.0);
        let pairs = observed.moved.iter().zip(prediction.moved.iter());
        for (left, (seen, predicted)) in left.iter_mut().zip(pairs) {
            *left = seen - predicted;
        }
        self.pose = pose;
    }

    /// Puts the covariance of noise and of the unit's uncertainty at this load into `covariance`.
    fn put_covariance(
        &self,
        forward: &Forward<'_>,
        markers: &Markers<'_>,
        covariance: &mut Covariance,
    ) {
        let Markers {
            observed,
            mounting,
            unknown,
            turning,
        } = markers;
        let (pose, limits) = (&self.pose, &forward.limits);
        unknown.put(pose, limits, &self.prediction.moved, covariance);
        observed.add_to(mounting, covariance);
        if let Some(hanging) = observed.hanging {
            hanging.add_uncertainty(pose, forward, covariance);
        }
        if let Some(pressing) = &observed.pressing {
            pressing.add_uncertainty(pose, limits, covariance);
        }
        if let Some(wide) = &observed.wide {
            wide.add_uncertainty(pose, limits, &self.prediction.moved, covariance);
        }
        if let Some(turning) = turning {
            turning.add_to(&self.by_arm, covariance);
        }
    }

    /// Not inlined, so that its stack is released on return.
    #[inline(never)]
    fn white(
        &self,
        whitening: &Whitening,
        wide: Option<&Wide<'_>>,
        turning: Option<&Turning<'_>>,
    ) -> White {
        let at = (&self.left, &self.pose);
        let mut equations = Equations::new(whitening, &self.prediction, at, wide);
        let markers = equations.side.get(..self.left.len());
        let (unexplained, whole) = (square(markers.unwrap_or_default()), square(&equations.side));
        let solved = equations.solve();
        let known = turning.filter(|_| solved.is_some());
        White {
            unexplained,
            square: whole,
            solved,
            arm: known.map(|turning| {
                let units = (&equations.columns, equations.width.as_ref());
                turning.arm((&self.by_arm, whitening), units, &equations.side)
            }),
        }
    }

    /// The square that a step must lower, weighted by the covariance of another load.
    fn square(&self, whitening: &Whitening, wide: Option<&Wide<'_>>) -> f32 {
        let mut left = self.left;
        whitening.whiten(&mut left);
        let sum = square(&left) + square(&unlikely(&self.pose));
        let of_width = wide.map(|wide| wide.unlikely(self.pose.width));
        of_width.map_or(sum, |[off, _]| sum + off * off)
    }

    /// The part of the motion that no load near this one explains, in units of its noise alone. It
    /// overwrites the whitening.
    fn by_noise(&self, observed: &Observed<'_>, whitening: &mut Whitening) -> Column {
        let markers = self.left.len();
        if whitening.set(|noise| observed.put_noise(noise)).is_none() {
            return Column::filled(markers, f32::INFINITY);
        }
        let at = (&self.left, &self.pose);
        let wide = observed.wide.as_ref();
        let mut equations = Equations::new(whitening, &self.prediction, at, wide);
        // If the markers do not determine the load, the whole residual.
        let whole = equations.side;
        let side = match equations.solve() {
            Some(_) => equations.side,
            None => whole,
        };
        Column::of(side.iter().copied().take(markers))
    }
}

/// The load after `part` of a step and `part`² of a bend. If its tilt exceeds the tables, the tilt
/// is held back and the other unknowns follow it. Otherwise steps along the tables' border would
/// not lower the residual.
fn after(forward: &Forward<'_>, pose: &Pose, solved: &Solved, part: f32, bend: &Bend) -> Pose {
    let most = forward.limits.tilt;
    let mut step = solved.unknowns;
    for (step, bend) in step.iter_mut().zip(bend.unknowns) {
        *step = part * (*step + part * bend);
    }
    let tilt = [pose.tilt[0] + step[TILT], pose.tilt[1] + step[TILT + 1]];
    let steep = sqrt(tilt[0] * tilt[0] + tilt[1] * tilt[1]);
    if steep > most {
        let along = tilt.map(|part| part / steep);
        step = solved.held_back(step, TILT, along, steep - most);
    }
    let width = match solved.width.is_unknown() {
        true => {
            let wanted = part * (solved.width.step + part * bend.width);
            solved.step_of_width(pose.width, wanted, &mut step)
        }
        false => pose.width,
    };
    let [size, a, b, x, y] = step;
    within(
        forward,
        Pose {
            width,
            size: pose.size + size,
            tilt: [pose.tilt[0] + a, pose.tilt[1] + b],
            place_mm: [pose.place_mm[0] + x, pose.place_mm[1] + y],
        },
    )
}

/// The nearest load inside the tables.
pub(super) fn within(forward: &Forward<'_>, pose: Pose) -> Pose {
    let too_steep = (pose.angle() / forward.limits.tilt).max(1.0);
    let [from, to] = forward.tables.ends_mm();
    Pose {
        size: limited(pose.size, 0.0, forward.limits.size),
        tilt: pose.tilt.map(|part| part / too_steep),
        place_mm: pose.place_mm.map(|part| limited(part, from, to)),
        width: pose.width,
    }
}
