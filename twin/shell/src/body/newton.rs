//! Finds the film's equilibrium with a body that a force presses on it, by Newton's method.
//!
//! Unknowns are the film's and the height of the body's foot. Along x and y the foot goes with the
//! film: it keeps its distance from the mean place of the points that bear it (`shares`). A force
//! on the body along x and y therefore acts on the film by these shares, less what the contact's
//! normal pressure already bears. Together these are one energy, U(u) + E(u, foot) − F · foot.

use crate::ShellError;
use crate::body::points::{Bearing, First, Points};
use crate::newton::{inner, largest, shifted_factors, solve_small};
use crate::point::V3;
use crate::shell::Shell;
use crate::sparse::{COMPONENTS, Solver};

/// At equilibrium no unknown has more unbalanced force than this, N.
pub const TOLERANCE_N: f64 = 1e-9;
/// The same of a state that is only a start for the next.
pub const LOOSE_N: f64 = 1e-5;
const MAX_STEPS: usize = 60;
/// The part of the predicted fall of energy that a step must reach (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// The fall of energy below which rounding hides it, N·mm.
const HIDDEN_N_MM: f64 = 1e-12;
const MOST_HALVINGS: usize = 30;
/// The first and the largest step, mm, by which a body is lowered until the film bears it.
const FIRST_STEP_MM: f64 = 1e-3;
const MOST_STEP_MM: f64 = 2.0;
/// Number of halvings by which its height is found between the last two.
const HEIGHT_STEPS: usize = 30;

/// A body that presses a film.
pub struct Pressing<'a> {
    pub shell: &'a Shell,
    pub solver: &'a Solver,
    pub points: Points<'a>,
    /// The place of the foot on the film, mm.
    pub place_mm: [f64; 2],
    /// The share of each coefficient in the film's motion that the foot follows.
    pub shares: Vec<f64>,
    /// The force on the body, N.
    pub force_n: V3,
}

/// A state: the film's unknowns, mm, and the foot's place, mm.
#[derive(Clone)]
pub struct State {
    pub unknowns: Vec<f64>,
    pub foot: V3,
}

/// The energy less the force's work, with the unbalanced forces.
struct Balance {
    energy: f64,
    /// On each unknown, N.
    film: Vec<f64>,
    /// On the body along z, N.
    body: f64,
    /// The force along x and y by which the film holds the body, N.
    held: [f64; 2],
}

/// A step of the unknowns and of the foot's height.
struct Step {
    film: Vec<f64>,
    height: f64,
}

impl Pressing<'_> {
    /// Returns the foot's place with the film at `u` and the body at a height, mm.
    pub fn foot(&self, u: &[f64], height: f64) -> V3 {
        let mut foot = [self.place_mm[0], self.place_mm[1], height];
        for (share, moved) in self.shares.iter().zip(u.chunks(COMPONENTS)) {
            foot[0] += share * moved[0];
            foot[1] += share * moved[1];
        }
        foot
    }

    /// Sets the body on a film that holds still, at the height at which it bears the force along
    /// z.
    pub fn seated(&self, unknowns: Vec<f64>) -> State {
        let mut foot = self.foot(&unknowns, 0.0);
        // Touching from above: the film's highest point under the body.
        let mut high = foot[2];
        for _ in 0..8 {
            foot[2] = high;
            high -= self.points.least_mm(&unknowns, &foot);
        }
        let mut bears = |height: f64| {
            foot[2] = height;
            self.points.first(&unknowns, &foot).by_body[2] <= self.force_n[2]
        };
        let (mut step, mut low) = (FIRST_STEP_MM, high - FIRST_STEP_MM);
        while !bears(low) && step < MOST_STEP_MM {
            (high, step) = (low, 2.0 * step);
            low -= step;
        }
        for _ in 0..HEIGHT_STEPS {
            let middle = (low + high) / 2.0;
            match bears(middle) {
                true => low = middle,
                false => high = middle,
            }
        }
        State { unknowns, foot }
    }

    /// Finds the equilibrium from a state, but for this much unbalanced force, N. Returns it with
    /// the number of steps.
    ///
    /// # Errors If no equilibrium is within reach.
    pub fn solve(&self, mut state: State, tolerance_n: f64) -> Result<(State, usize), ShellError> {
        state.foot = self.foot(&state.unknowns, state.foot[2]);
        let mut at = self.balance(&state);
        for steps in 0..=MAX_STEPS {
            let left_over_n = at.left_over();
            if left_over_n < tolerance_n {
                return Ok((state, steps));
            }
            if left_over_n.is_nan() || steps == MAX_STEPS {
                return Err(ShellError::NoEquilibrium { steps, left_over_n });
            }
            match self.step(&state, &at)? {
                Some(step) => (state, at) = self.shortened(&state, &at, &step),
                None => {
                    state = self.seated(state.unknowns);
                    at = self.balance(&state);
                }
            }
        }
        Err(ShellError::Solver("the steps have an end".into()))
    }

    /// Returns the points that touch.
    pub fn bearing(&self, state: &State) -> Vec<Bearing> {
        self.points.bearing(&state.unknowns, &state.foot)
    }

    /// Returns the force by which the film holds the body along x and y, apart from the contact's
    /// normal pressure, N.
    pub fn held(&self, state: &State) -> [f64; 2] {
        self.balance(state).held
    }

    fn balance(&self, state: &State) -> Balance {
        let (energy, gradient) = self.shell.first(&state.unknowns);
        let First {
            energy: pressed,
            by_film,
            by_body,
        } = self.points.first(&state.unknowns, &state.foot);
        let held = [0, 1].map(|c| self.force_n[c] - by_body[c]);
        let parts = gradient.iter().zip(&by_film);
        let mut film: Vec<f64> = parts.map(|(own, contact)| -own - contact).collect();
        for (forces, share) in film.chunks_mut(COMPONENTS).zip(&self.shares) {
            forces[0] += share * held[0];
            forces[1] += share * held[1];
        }
        Balance {
            energy: energy + pressed - inner(&self.force_n, &state.foot),
            film,
            body: self.force_n[2] - by_body[2],
            held,
        }
    }

    /// Returns Newton's step; `None` if no point bears the body.
    fn step(&self, state: &State, at: &Balance) -> Result<Option<Step>, ShellError> {
        let (u, pattern) = (&state.unknowns, self.shell.pattern());
        let mut stiffness = self.shell.stiffness(u);
        let second = self
            .points
            .second((u, &state.foot), (pattern, &mut stiffness));
        if second.by_body[2][2] == 0.0 {
            return Ok(None);
        }
        let factors = shifted_factors(self.solver, pattern, &stiffness)?;
        // Right sides: the unbalanced force, the foot's three ways, and the two shares.
        let n = u.len();
        let mut columns = Vec::with_capacity(5 * n);
        for mixed in &second.mixed {
            columns.extend(mixed);
        }
        for way in 0..2 {
            columns.extend(self.share_column(way));
        }
        let mut sides = at.film.clone();
        sides.extend(&columns);
        factors.solve(&mut sides, 6);
        let (free, answers) = sides.split_at(n);
        let foot = solve_small(
            bordered(&second.by_body, &columns, answers, n),
            (0..5)
                .map(|k| {
                    let unbalanced = if k == 2 { at.body } else { 0.0 };
                    unbalanced - inner(&columns[k * n..(k + 1) * n], free)
                })
                .collect(),
        );
        Ok(foot.map(|foot| {
            let mut film = free.to_vec();
            for (answer, part) in answers.chunks(n).zip(&foot) {
                for (slot, answer) in film.iter_mut().zip(answer) {
                    *slot -= part * answer;
                }
            }
            Step {
                film,
                height: foot[2],
            }
        }))
    }

    /// Returns minus the shares, for one component.
    fn share_column(&self, way: usize) -> impl Iterator<Item = f64> {
        let part = move |share: &f64| {
            let mut parts = [0.0; COMPONENTS];
            parts[way] = -share;
            parts
        };
        self.shares.iter().flat_map(part)
    }

    /// Takes all of a step, or the half, quarter … at which the energy falls most.
    fn shortened(&self, state: &State, at: &Balance, step: &Step) -> (State, Balance) {
        let slope = -inner(&at.film, &step.film) - at.body * step.height;
        let look = |length: f64| {
            let parts = state.unknowns.iter().zip(&step.film);
            let unknowns: Vec<f64> = parts.map(|(u, part)| u + length * part).collect();
            let foot = self.foot(&unknowns, state.foot[2] + length * step.height);
            let there = State { unknowns, foot };
            let balance = self.balance(&there);
            (there, balance)
        };
        let mut length = 1.0;
        let mut best = look(length);
        let falls = |energy: f64, length: f64| energy <= at.energy + SUFFICIENT * length * slope;
        if slope <= -HIDDEN_N_MM && !falls(best.1.energy, length) {
            for _ in 0..MOST_HALVINGS {
                let half = look(length / 2.0);
                if falls(best.1.energy, length) && best.1.energy <= half.1.energy {
                    break;
                }
                length /= 2.0;
                best = half;
            }
        }
        best
    }
}

impl Balance {
    fn left_over(&self) -> f64 {
        largest(&self.film).max(self.body.abs())
    }
}

/// Returns the matrix of the foot's three ways and of the two forces that tie it to the film,
/// after the unknowns are eliminated. `columns` couple them with the unknowns, `answers` are the
/// inverse stiffness times these.
fn bordered(by_body: &[V3; 3], columns: &[f64], answers: &[f64], n: usize) -> Vec<Vec<f64>> {
    let entry = |i: usize, j: usize| {
        let own = match (i, j) {
            (0..=2, 0..=2) => by_body[i][j],
            (0, 3) | (3, 0) | (1, 4) | (4, 1) => 1.0,
            _ => 0.0,
        };
        own - inner(&columns[i * n..(i + 1) * n], &answers[j * n..(j + 1) * n])
    };
    (0..5)
        .map(|i| (0..5).map(|j| entry(i, j)).collect())
        .collect()
}
