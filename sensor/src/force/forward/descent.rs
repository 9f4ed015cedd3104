//! Steps downhill to the load that explains the markers best, each by the linearized film.

use super::Forward;
use super::covariance::{Covariance, Unknown, Whitening};
use super::estimate::{Estimate, Observed};
use super::mounting::Mounting;
use super::pose::{Pose, limited};
use super::predict::Prediction;
use super::solve::{Column, EQUATIONS, Solved, UNKNOWNS, Unknowns, solve, square};
use crate::force::kernels::sqrt;

/// The steps have converged if the next one would explain at most this part of the residual,
/// relative to its variance. It would move no unknown by more than a fifth of its standard
/// uncertainty.
const LEFT_TO_EXPLAIN: f32 = 0.05;
/// If a step that would explain at most this does not lower the residual, the rest is rounding of
/// the tables.
const ROUNDING: f32 = 0.5;
/// If more than this is left where the steps end, they may be stuck where the tables bend. χ² of
/// three degrees of freedom exceeds it in 1 of 100 honest frames.
const STUCK: f32 = 11.3;
/// Index of the tilt among the unknowns; the place follows it.
const TILT: usize = 1;
/// Prior: standard deviations of the tilt along x and y, rad, and the place along x and y, mm,
/// around 0. A load too weak for its direction and place stays near the prior; otherwise the steps
/// would not end.
const LIKELY: [f32; 4] = [0.3, 0.3, 2.5, 2.5];
/// The markers' equations, and those of the prior.
const ROWS: usize = EQUATIONS + LIKELY.len();
/// Factor by which the next step is shortened if one did not lower the residual.
const SHORTER: f32 = 0.5;

/// The descent from a first guess to the load that explains the markers best.
pub struct Descent<'a> {
    forward: &'a Forward<'a>,
    markers: Markers<'a>,
    here: Linearization,
    /// The fraction of the next step that is tried.
    part: f32,
    /// How the path bends: added to the unknowns, times the square of that fraction.
    bend: Unknowns,
    /// True if the last step changed no more than rounding.
    has_ended: bool,
    /// How often the film was run forwards.
    looks: u8,
}

/// What the markers of a frame show, how they are mounted, and what is unknown of the unit.
struct Markers<'a> {
    observed: &'a Observed<'a>,
    mounting: &'a Mounting,
    unknown: Unknown<'a>,
}

/// A load, and the linear equations of the markers there.
struct Linearization {
    pose: Pose,
    /// The part of the markers' motion that the load does not explain, and the slopes of the part
    /// that it does, focal lengths.
    left: Column,
    slopes: [Column; UNKNOWNS],
    /// Weighted by the covariance, at this load, of noise and of what is unknown of the unit;
    /// `None` if that covariance is singular or not finite.
    white: Option<White>,
}

/// A linearization in coordinates in which the covariance is the unit matrix.
struct White {
    whitening: Whitening,
    /// The square of the part of the motion that the load does not explain.
    unexplained: f32,
    /// That square, plus the square of the distance from the prior.
    square: f32,
    solved: Option<Solved>,
}

impl<'a> Descent<'a> {
    /// Begins at a guess; outside the tables, at the nearest load inside.
    pub fn new(
        forward: &'a Forward<'a>,
        observed: &'a Observed<'a>,
        mounting: &'a Mounting,
        unknown: Unknown<'a>,
        guess: Pose,
    ) -> Self {
        let markers = Markers {
            observed,
            mounting,
            unknown,
        };
        let here = Linearization::at(forward, &markers, within(forward, guess));
        Self {
            forward,
            markers,
            here,
            part: 1.0,
            bend: Unknowns::default(),
            has_ended: false,
            looks: 1,
        }
    }

    /// Tries a step. A step that does not lower the residual, weighted by the covariance where it
    /// begins, is not taken, and the next one is shorter. It then follows a path that bends as the
    /// whole step's residual says (geodesic acceleration: Transtrum and Sethna 2012). Returns false
    /// if the markers do not determine a step.
    pub fn step(&mut self) -> bool {
        let Some((white, solved)) = self.here.solved() else {
            return false;
        };
        let pose = after(self.forward, &self.here.pose, solved, self.part, &self.bend);
        let there = Linearization::at(self.forward, &self.markers, pose);
        self.looks += 1;
        let left = square(&white.whitening.of(&there.left));
        if left + square(&unlikely(&there.pose)) < white.square {
            (self.here, self.part, self.bend) = (there, 1.0, Unknowns::default());
        } else {
            self.has_ended = solved.explained <= ROUNDING;
            if self.part == 1.0 {
                self.bend = self.here.bend(&white.whitening, &there);
            }
            self.part *= SHORTER;
        }
        true
    }

    /// Returns whether more steps would not help, whether or not the load explains the markers.
    pub fn is_over(&self) -> bool {
        self.has_converged() || self.is_done()
    }

    /// Whether another step would explain hardly more.
    fn has_converged(&self) -> bool {
        let solved = self.here.solved();
        solved.is_some_and(|(_, solved)| solved.explained <= LEFT_TO_EXPLAIN)
    }

    /// Returns whether the load explains the markers and the steps came to an end.
    pub fn is_done(&self) -> bool {
        let white = self.here.white.as_ref();
        let is_explained = white.is_some_and(|white| white.unexplained <= STUCK);
        is_explained && (self.has_ended || self.has_converged())
    }

    /// The load that it has reached.
    pub fn estimate(self) -> Estimate {
        let left = self.here.by_noise(&self.markers.observed.by_noise());
        let white = self.here.white;
        Estimate {
            pose: self.here.pose,
            // A load without a covariance explains nothing: infinite residual.
            unexplained: white
                .as_ref()
                .map_or(f32::INFINITY, |white| white.unexplained),
            left,
            solved: white.and_then(|white| white.solved),
            looks: self.looks,
        }
    }
}

/// The markers' equations and those of the prior, in units of their standard uncertainties.
struct Equations {
    columns: [[f32; ROWS]; UNKNOWNS],
    side: [f32; ROWS],
}

impl Equations {
    fn new(whitening: &Whitening, slopes: &[Column; UNKNOWNS], left: &Column, pose: &Pose) -> Self {
        let mut all = Equations {
            columns: [[0.0; ROWS]; UNKNOWNS],
            side: [0.0; ROWS],
        };
        for (column, slope) in all.columns.iter_mut().zip(slopes) {
            column[..EQUATIONS].copy_from_slice(&whitening.of(slope));
        }
        all.side[..EQUATIONS].copy_from_slice(&whitening.of(left));
        all.side[EQUATIONS..].copy_from_slice(&unlikely(pose));
        for (k, likely) in LIKELY.into_iter().enumerate() {
            all.columns[TILT + k][EQUATIONS + k] = 1.0 / likely;
        }
        all
    }
}

/// The distance of a load from the prior, in standard deviations.
fn unlikely(pose: &Pose) -> [f32; LIKELY.len()] {
    let ([a, b], [x, y]) = (pose.tilt, pose.place_mm);
    let parts = [a, b, x, y];
    core::array::from_fn(|k| -parts[k] / LIKELY[k])
}

impl Linearization {
    fn at(forward: &Forward<'_>, markers: &Markers<'_>, pose: Pose) -> Linearization {
        let Markers {
            observed,
            mounting,
            unknown,
        } = markers;
        let (tables, limits) = (&forward.tables, &forward.limits);
        let mut prediction = tables.predict(&pose, limits, &mounting.beside_mm);
        let mut covariance = unknown.covariance(&pose, limits, &prediction.moved);
        observed.add_to(&mut covariance);
        if let Some(hanging) = observed.hanging {
            let stiffness = &forward.stiffness;
            hanging.add_to(&pose, stiffness, limits, &mut prediction, &mut covariance);
        }
        if let Some(pressing) = &observed.pressing {
            pressing.add_to(&pose, limits, &mut prediction, &mut covariance);
        }
        let Prediction { moved, slopes } = prediction;
        let left = core::array::from_fn(|i| observed.moved[i] - moved[i]);
        let white = White::new(&covariance, &slopes, &left, &pose);
        Linearization {
            pose,
            left,
            slopes,
            white,
        }
    }

    fn solved(&self) -> Option<(&White, &Solved)> {
        let white = self.white.as_ref()?;
        Some((white, white.solved.as_ref()?))
    }

    /// Returns how the path from here bends if its whole first step leads to `there`: the slopes
    /// here, solved for the residual there. Not inlined, as [`White::new`].
    #[inline(never)]
    fn bend(&self, whitening: &Whitening, there: &Linearization) -> Unknowns {
        let mut equations = Equations::new(whitening, &self.slopes, &there.left, &there.pose);
        let solved = solve(equations.columns, &mut equations.side);
        solved.map_or(Unknowns::default(), |solved| solved.unknowns)
    }

    /// The part of the motion that no load near this one explains, in units of its noise alone.
    fn by_noise(&self, noise: &Covariance) -> Column {
        let Some(whitening) = Whitening::new(noise) else {
            return [f32::INFINITY; EQUATIONS];
        };
        let mut equations = Equations::new(&whitening, &self.slopes, &self.left, &self.pose);
        // If the markers do not determine the load, the whole residual.
        let left = equations.side;
        let side = match solve(equations.columns, &mut equations.side) {
            Some(_) => equations.side,
            None => left,
        };
        core::array::from_fn(|i| side[i])
    }
}

impl White {
    /// Returns `None` if the covariance is singular or not finite. Not inlined, so that its stack
    /// is released on return.
    #[inline(never)]
    fn new(
        covariance: &Covariance,
        slopes: &[Column; UNKNOWNS],
        left: &Column,
        pose: &Pose,
    ) -> Option<White> {
        let whitening = Whitening::new(covariance)?;
        let mut equations = Equations::new(&whitening, slopes, left, pose);
        Some(White {
            whitening,
            unexplained: square(&equations.side[..EQUATIONS]),
            square: square(&equations.side),
            solved: solve(equations.columns, &mut equations.side),
        })
    }
}

/// The load after `part` of a step and `part`² of a bend. If its tilt exceeds the tables, the tilt
/// is held back and the other unknowns follow it. Otherwise steps along the tables' border would
/// not lower the residual.
fn after(forward: &Forward<'_>, pose: &Pose, solved: &Solved, part: f32, bend: &Unknowns) -> Pose {
    let most = forward.limits.tilt;
    let mut step = solved.unknowns;
    for (step, bend) in step.iter_mut().zip(bend) {
        *step = part * (*step + part * bend);
    }
    let tilt = [pose.tilt[0] + step[TILT], pose.tilt[1] + step[TILT + 1]];
    let steep = sqrt(tilt[0] * tilt[0] + tilt[1] * tilt[1]);
    if steep > most {
        let along = tilt.map(|part| part / steep);
        step = solved.held_back(step, TILT, along, steep - most);
    }
    let [size, a, b, x, y] = step;
    within(
        forward,
        Pose {
            size: pose.size + size,
            tilt: [pose.tilt[0] + a, pose.tilt[1] + b],
            place_mm: [pose.place_mm[0] + x, pose.place_mm[1] + y],
        },
    )
}

/// The nearest load inside the tables.
fn within(forward: &Forward<'_>, pose: Pose) -> Pose {
    let too_steep = (pose.angle() / forward.limits.tilt).max(1.0);
    let [from, to] = forward.tables.ends_mm();
    Pose {
        size: limited(pose.size, 0.0, forward.limits.size),
        tilt: pose.tilt.map(|part| part / too_steep),
        place_mm: pose.place_mm.map(|part| limited(part, from, to)),
    }
}
