//! How a pressed film answers to small changes: of its load, and of what it is made of.

use crate::film::Response;
use crate::shell::Shell;
use crate::{Design, Equilibrium, Film, ShellError};

/// Steps by which forces are differentiated: tip's place and radius, mm; thickness and posts'
/// places, mm.
const TIP_STEP_MM: f64 = 1e-3;
const THICKNESS_STEP_MM: f64 = 1e-4;
const POST_STEP_MM: f64 = 2e-2;
/// Films beside the one that is asked about: thinner and thicker.
const BESIDE: [f64; 2] = [-1.0, 1.0];

/// Something that a film's state answers to, with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The force along x, y or z, N.
    Force(usize),
    /// The place of the tip along x or y with the force kept, mm.
    Place(usize),
    /// The tip's radius, mm.
    TipRadius,
    /// The film's thickness with its grip kept, mm.
    Thickness,
    /// The posts' grip, in parts of itself.
    Grip,
    /// A post's place along x or y, mm.
    Post(usize, usize),
}

impl Change {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Change> {
        let posts = (0..4).flat_map(|post| (0..2).map(move |way| Change::Post(post, way)));
        (0..3)
            .map(Change::Force)
            .chain((0..2).map(Change::Place))
            .chain([Change::TipRadius, Change::Thickness, Change::Grip])
            .chain(posts)
    }
}

/// A film, and the films beside it that tell what a change of its own does.
pub struct Neighbours {
    thinner_and_thicker: [Shell; 2],
    step_mm: f64,
}

impl Neighbours {
    /// Of films of this design, wherever the tip is.
    pub fn of(design: &Design) -> Neighbours {
        let shell = |way: f64| {
            let mut beside = design.clone();
            beside.material.thickness_mm += way * THICKNESS_STEP_MM;
            beside.shell()
        };
        Neighbours {
            thinner_and_thicker: BESIDE.map(shell),
            step_mm: THICKNESS_STEP_MM,
        }
    }
}

impl Film {
    /// How a state answers to each change, per unit of it.
    ///
    /// # Errors
    /// When the stiffness is not positive definite: a force would not hold the film there.
    pub fn answers(
        &self,
        beside: &Neighbours,
        state: &Equilibrium,
        changes: &[Change],
    ) -> Result<Vec<Response>, ShellError> {
        let factors = self.factors_at(state)?;
        let mut sides = Vec::new();
        for &change in changes {
            sides.extend(self.force_of(beside, state, change));
        }
        factors.solve(&mut sides, changes.len());
        let columns = sides.chunks(self.unknowns()).zip(changes);
        let answer = |(unknowns, change): (&[f64], &Change)| {
            let mut response = self.response(unknowns.to_vec());
            // A tip that moved sees another part of the film.
            if let Change::Place(_) | Change::TipRadius = change {
                let shares = self.shares_by(*change);
                let seen = self.mean(&shares, state);
                for (sum, part) in response.tip_mm.iter_mut().zip(seen) {
                    *sum += part;
                }
            }
            response
        };
        Ok(columns.map(answer).collect())
    }

    /// The force on each unknown that one unit of a change leaves unbalanced, N.
    fn force_of(&self, beside: &Neighbours, state: &Equilibrium, change: Change) -> Vec<f64> {
        let u = state.unknowns();
        match change {
            Change::Force(axis) => {
                let mut force = [0.0; 3];
                force[axis] = 1.0;
                self.load(&force)
            }
            Change::Place(_) | Change::TipRadius => {
                Film::spread(&self.shares_by(change), &state.force_n)
            }
            Change::Thickness => {
                let [thinner, thicker] = &beside.thinner_and_thicker;
                let pair = thinner.gradient(u).into_iter().zip(thicker.gradient(u));
                pair.map(|(a, b)| (a - b) / (2.0 * beside.step_mm))
                    .collect()
            }
            Change::Grip => {
                let springs = self.design().springs(self.shell().grid());
                let pull = self.shell().pull(u, &springs);
                pull.into_iter().map(|part| -part).collect()
            }
            Change::Post(post, way) => self.force_of_post(u, post, way),
        }
    }

    fn force_of_post(&self, u: &[f64], post: usize, way: usize) -> Vec<f64> {
        let [back, forth] = BESIDE.map(|sign| {
            let mut design = self.design().clone();
            design.post_shift_mm[post][way] += sign * POST_STEP_MM;
            self.shell().pull(u, &design.springs(self.shell().grid()))
        });
        let pairs = back.iter().zip(&forth);
        pairs.map(|(a, b)| (a - b) / (2.0 * POST_STEP_MM)).collect()
    }

    /// How the tip's shares change with its place or radius, per mm.
    fn shares_by(&self, change: Change) -> Vec<f64> {
        let [back, forth] = BESIDE.map(|sign| {
            let mut design = self.design().clone();
            match change {
                Change::Place(way) => design.tip_offset_mm[way] += sign * TIP_STEP_MM,
                _ => design.tip_radius_mm += sign * TIP_STEP_MM,
            }
            self.shares(&design)
        });
        let pairs = forth.iter().zip(&back);
        pairs.map(|(b, a)| (b - a) / (2.0 * TIP_STEP_MM)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Contact;

    /// Every answer is the difference of full solutions.
    #[test]
    fn answers_are_differences() {
        let design = Design {
            fineness: 0.5,
            tip_offset_mm: [2.0, 1.0],
            ..Design::default()
        };
        let force = [0.02, -0.01, -0.1];
        let pressed = |design: &Design, force: [f64; 3]| {
            let film = Film::new(design).unwrap();
            let state = film.press(Contact::Force(force), &film.rest()).unwrap();
            (film.displacement(&state, [3.7, -3.7]), state.tip_mm)
        };
        let film = Film::new(&design).unwrap();
        let state = film.press(Contact::Force(force), &film.rest()).unwrap();
        let changes: Vec<Change> = Change::all().collect();
        let beside = Neighbours::of(&design);
        let answers = film.answers(&beside, &state, &changes).unwrap();
        for (change, answer) in changes.into_iter().zip(&answers) {
            let step = 1e-3;
            let [back, forth] = BESIDE.map(|sign| {
                let (mut there, mut pull) = (design.clone(), force);
                let by = sign * step;
                match change {
                    Change::Force(axis) => pull[axis] += by,
                    Change::Place(way) => there.tip_offset_mm[way] += by,
                    Change::TipRadius => there.tip_radius_mm += by,
                    Change::Thickness => there.material.thickness_mm += by,
                    Change::Grip => there.post_grip_n_per_mm3 *= 1.0 + by,
                    Change::Post(post, way) => there.post_shift_mm[post][way] += 20.0 * by,
                }
                pressed(&there, pull)
            });
            let unit = match change {
                Change::Post(..) => 20.0 * step,
                _ => step,
            };
            let half = |sign: f64| {
                let by = match change {
                    Change::Thickness => sign * 1e-6,
                    _ => 0.0,
                };
                let there = film.beside(&state, answer, sign * 1e-6);
                film.surface(&there, [3.7, -3.7], (0.5 + by) / 2.0)
            };
            let [before, after] = BESIDE.map(half);
            for c in 0..3 {
                let full = (forth.0[c] - back.0[c]) / (2.0 * unit);
                let told = (after[c] - before[c]) / 2e-6;
                assert!(
                    (told - full).abs() < 2e-3 * full.abs() + 2e-4,
                    "{change:?} {c}: {told} {full}"
                );
                let full = (forth.1[c] - back.1[c]) / (2.0 * unit);
                let told = answer.tip_mm[c];
                assert!(
                    (told - full).abs() < 2e-3 * full.abs() + 2e-4,
                    "{change:?} tip {c}: {told} {full}"
                );
            }
        }
    }
}
