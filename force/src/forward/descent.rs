//! Steps downhill: each to the load that the linearized film says explains the markers best.

use super::Forward;
use super::estimate::{Estimate, Observed, UNEXPLAINED};
use super::mounting::Mounting;
use super::pose::{Pose, limited};
use super::predict::{CORNERS, Prediction};
use super::solve::{Column, EQUATIONS, Solved, UNKNOWNS, solve, square};
use crate::kernels::sqrt;

/// A step that would explain no more than this of the residual, in parts of the noise's variance,
/// is not needed: it would move no unknown by more than a half of its standard uncertainty.
const LEFT_TO_EXPLAIN: f32 = 0.25;
/// The first of the unknowns that are the tilt, which the place follows.
const TILT: usize = 1;
/// What is likely before there is a frame: tilt along x and y, rad, and place along x and y, mm,
/// are nothing to within this. A load too weak for its direction and place keeps what is likely,
/// instead of being sought where steps do not end.
const LIKELY: [f32; 4] = [0.3, 0.3, 2.5, 2.5];
/// The markers' equations, and those of what is likely.
const ROWS: usize = EQUATIONS + LIKELY.len();
/// What is left of a step that did not lower the residual.
const SHORTER: f32 = 0.25;

/// A way from a first guess to the load that explains the markers best.
pub struct Descent<'a> {
    forward: &'a Forward<'a>,
    markers: Markers<'a>,
    here: Linearization,
    /// How much of the next step is tried.
    part: f32,
    /// How often the film was run forwards.
    looks: u8,
}

/// What the markers of a frame show.
struct Markers<'a> {
    observed: &'a Observed,
    mounting: &'a Mounting,
    /// What each coordinate weighs, away from the pattern's middle and across that.
    weights: Column,
}

/// A load, and what the markers say there.
struct Linearization {
    pose: Pose,
    /// What the load does not explain of the markers: the sum of squares in parts of their
    /// variances.
    unexplained: f32,
    /// By coordinate.
    left: Column,
    /// That square, and how unlikely the load is.
    square: f32,
    solved: Option<Solved>,
}

impl<'a> Descent<'a> {
    /// At a guess; at the nearest load that the tables hold where it is beyond.
    pub fn new(
        forward: &'a Forward<'a>,
        observed: &'a Observed,
        mounting: &'a Mounting,
        guess: Pose,
    ) -> Self {
        let half = core::f32::consts::FRAC_1_SQRT_2;
        let markers = Markers {
            observed,
            mounting,
            weights: observed.sigma.map(|sigma| half / sigma),
        };
        let here = Linearization::at(forward, &markers, within(forward, guess));
        Self {
            forward,
            markers,
            here,
            part: 1.0,
            looks: 1,
        }
    }

    /// Tries a step; one that does not lower the residual is not taken, and the next is shorter
    /// then. False when the markers do not tell where to go.
    pub fn step(&mut self) -> bool {
        let Some(solved) = &self.here.solved else {
            return false;
        };
        let pose = after(self.forward, &self.here.pose, solved, self.part);
        let there = Linearization::at(self.forward, &self.markers, pose);
        self.looks += 1;
        if there.square < self.here.square {
            (self.here, self.part) = (there, 1.0);
        } else {
            self.part *= SHORTER;
        }
        true
    }

    /// Whether the load explains the markers, and another step would hardly explain more.
    pub fn is_done(&self) -> bool {
        self.here.is_done()
    }

    /// What it has come to.
    pub fn estimate(self) -> Estimate {
        Estimate {
            pose: self.here.pose,
            unexplained: self.here.unexplained,
            left: self.here.left,
            solved: self.here.solved,
            looks: self.looks,
        }
    }
}

/// The markers' equations, and those of what is likely, in parts of their standard uncertainties.
struct Equations {
    columns: [[f32; ROWS]; UNKNOWNS],
    side: [f32; ROWS],
}

impl Equations {
    fn new(columns: &[Column; UNKNOWNS], side: &Column, pose: &Pose) -> Equations {
        let mut all = Equations {
            columns: [[0.0; ROWS]; UNKNOWNS],
            side: [0.0; ROWS],
        };
        for (column, markers) in all.columns.iter_mut().zip(columns) {
            column[..EQUATIONS].copy_from_slice(markers);
        }
        all.side[..EQUATIONS].copy_from_slice(side);
        let ([a, b], [x, y]) = (pose.tilt, pose.place_mm);
        for (k, (unknown, likely)) in [a, b, x, y].into_iter().zip(LIKELY).enumerate() {
            all.columns[TILT + k][EQUATIONS + k] = 1.0 / likely;
            all.side[EQUATIONS + k] = -unknown / likely;
        }
        all
    }
}

impl Linearization {
    fn at(forward: &Forward<'_>, markers: &Markers<'_>, pose: Pose) -> Linearization {
        let Markers {
            observed,
            mounting,
            weights,
        } = markers;
        let tables = &forward.tables;
        let Prediction { moved, slopes } =
            tables.predict(&pose, &forward.limits, &mounting.beside_mm);
        let left = core::array::from_fn(|i| observed.moved[i] - moved[i]);
        let left = from_middle(&left, weights);
        let slopes = slopes.each_ref().map(|slope| from_middle(slope, weights));
        let equations = Equations::new(&slopes, &left, &pose);
        Linearization {
            pose,
            unexplained: square(&left),
            left,
            square: square(&equations.side),
            solved: solve(equations.columns, equations.side),
        }
    }

    fn is_done(&self) -> bool {
        is_done(self.unexplained, self.solved.as_ref())
    }
}

/// Whether a load explains the markers, and another step would hardly explain more.
pub fn is_done(unexplained: f32, solved: Option<&Solved>) -> bool {
    let explained = solved.map_or(0.0, |solved| solved.explained);
    unexplained <= UNEXPLAINED && explained <= LEFT_TO_EXPLAIN
}

/// The load after a part of a step. Where that is too steep for the tables, the other unknowns
/// follow the tilt back: without that, steps along the tables' border would not lower the residual.
fn after(forward: &Forward<'_>, pose: &Pose, solved: &Solved, part: f32) -> Pose {
    let most = forward.limits.tilt;
    let mut step = solved.unknowns.map(|unknown| part * unknown);
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

/// The nearest load that the tables hold.
fn within(forward: &Forward<'_>, pose: Pose) -> Pose {
    let too_steep = (pose.angle() / forward.limits.tilt).max(1.0);
    let [from, to] = forward.tables.moved.axis().ends_mm();
    Pose {
        size: limited(pose.size, 0.0, forward.limits.size),
        tilt: pose.tilt.map(|part| part / too_steep),
        place_mm: pose.place_mm.map(|part| limited(part, from, to)),
    }
}

/// x and y of markers 0–3, as seen from the pattern's middle: away from it, and across that, as
/// often as each weighs.
fn from_middle(column: &Column, weights: &Column) -> Column {
    let mut turned = *weights;
    let markers = column.as_chunks::<2>().0.iter().zip(CORNERS);
    for (([x, y], [cx, cy]), turned) in markers.zip(turned.as_chunks_mut::<2>().0) {
        turned[0] *= x * cx + y * cy;
        turned[1] *= y * cx - x * cy;
    }
    turned
}
