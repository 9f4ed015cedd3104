//! What the reduced film is fitted to: full solutions with their slopes.

use std::f64::consts::PI;

use hivtac_scene::film::curves::{Answer, Pose};
use hivtac_scene::film::{Family, MAX_FORCE_N, SLIP_N};

use crate::film::Response;
use crate::point::V3;
use crate::view::disc_motions;
use crate::{Contact, Equilibrium, Film, FilmError};

/// Known states that a start is foretold from.
const FORETOLD_FROM: usize = 4;

/// The outputs at a pose, by [`Answer::outputs`].
pub struct Sample {
    pub pose: Pose,
    pub outputs: [[f64; 4]; 12],
    /// Their derivatives by the pose's tilt along x and y, and its offset along x and y.
    pub slopes: [[[f64; 4]; 12]; 4],
}

/// Presses the film at training pose `index`, harder and harder: a sample for each size.
pub fn samples(
    family: Family,
    film: &mut Film,
    index: usize,
    sizes: &[f64],
) -> Result<Vec<Sample>, FilmError> {
    let mut path = Path::from_rest(film);
    let mut samples = Vec::new();
    for &size in sizes {
        let pose = training_pose(family, index, size);
        film.move_tip(offset_mm(family, &pose))?;
        let state = path.go(film, Contact::Force(force_n(family, &pose)), size)?;
        samples.push(sample(family, film, pose, &state)?);
    }
    Ok(samples)
}

/// States found one after the other, each foretold by the latest.
pub struct Path(Vec<(f64, Equilibrium)>);

impl Path {
    pub fn from_rest(film: &Film) -> Path {
        Path(vec![(0.0, film.rest())])
    }

    /// The state of the next place.
    pub fn go(
        &mut self,
        film: &Film,
        contact: Contact,
        place: f64,
    ) -> Result<Equilibrium, FilmError> {
        let latest = &self.0[self.0.len().saturating_sub(FORETOLD_FROM)..];
        let known: Vec<_> = latest.iter().map(|(at, state)| (*at, state)).collect();
        let last = &self.0[self.0.len() - 1].1;
        let state = Equilibrium::foretold(&known, place)
            .and_then(|start| film.press(contact, &start).ok())
            .map_or_else(|| film.press(contact, last), Ok)?;
        self.0.push((place, state.clone()));
        Ok(state)
    }
}

/// Spread evenly over what is asked of a family, and denser towards its limits, where a polynomial would stray first.
fn training_pose(family: Family, index: usize, size: f64) -> Pose {
    let part = |base| halton(index + 1, base);
    let (radius, angle) = ((PI / 2.0 * part(2)).sin(), 2.0 * PI * part(3));
    let tilt = match family {
        Family::Force => [2, 3].map(|base| -(PI * part(base)).cos()),
        Family::Slip => [radius * angle.cos(), radius * angle.sin()],
    };
    let (wide, turned) = (part(7).sqrt(), 2.0 * PI * part(11));
    let aside = [wide * turned.cos(), wide * turned.sin()];
    let offset = match family {
        Family::Force => [5, 7].map(|base| -(PI * part(base)).cos()),
        Family::Slip => {
            // The steepest way less the film's own leaves so much for a slide, along the force.
            let slid_mm = (PI / 2.0 * part(5)).sin() * (2.0 - 0.95 * radius) * size;
            let reach = family.offset_mm(size);
            let along = [angle.cos(), angle.sin()];
            [0, 1].map(|c| (0.3 * aside[c] + slid_mm * along[c]) / reach)
        }
    };
    Pose { size, tilt, offset }
}

fn offset_mm(family: Family, pose: &Pose) -> [f64; 2] {
    pose.offset.map(|part| family.offset_mm(pose.size) * part)
}

/// The force of a pose, N.
fn force_n(family: Family, pose: &Pose) -> V3 {
    let [x, y] = family.tangents(pose.tilt);
    let most = match family {
        Family::Slip => SLIP_N,
        _ => MAX_FORCE_N / (1.0 + x * x + y * y).sqrt(),
    };
    [x, y, -1.0].map(|part| most * pose.size.powi(3) * part)
}

fn sample(
    family: Family,
    film: &Film,
    pose: Pose,
    state: &Equilibrium,
) -> Result<Sample, FilmError> {
    let responses = film.responses(state)?;
    let slopes = changes_by_force(family, &pose).map(|change| {
        let response = Response::to_all(&responses, change);
        let step = 1e-4 / response.size();
        let [back, forth] = [-step, step].map(|step| {
            let there = film.beside(state, &response, step);
            outputs(film, &there, [0.0; 3])
        });
        let of_tip = Answer {
            tip: response.tip_mm,
            ..Answer::default()
        }
        .outputs();
        std::array::from_fn(|output| {
            std::array::from_fn(|k| {
                (forth[output][k] - back[output][k]) / (2.0 * step) + of_tip[output][k]
            })
        })
    });
    Ok(Sample {
        pose,
        outputs: outputs(film, state, state.tip_mm),
        slopes,
    })
}

fn outputs(film: &Film, state: &Equilibrium, tip: V3) -> [[f64; 4]; 12] {
    let discs = disc_motions(film, state);
    Answer { tip, discs }.outputs()
}

/// What one unit of tilt along x and y and of offset along x and y is: of force along x, y and z (N) and of the tip's
/// place along x and y (mm).
fn changes_by_force(family: Family, pose: &Pose) -> [[f64; 5]; 4] {
    const STEP: f64 = 1e-4;
    let tilted = |k: usize| {
        let [back, forth] = [-STEP, STEP].map(|step| {
            let mut there = *pose;
            there.tilt[k] += step;
            force_n(family, &there)
        });
        let [x, y, z] = [0, 1, 2].map(|c| (forth[c] - back[c]) / (2.0 * STEP));
        [x, y, z, 0.0, 0.0]
    };
    let reach = family.offset_mm(pose.size);
    [
        tilted(0),
        tilted(1),
        [0.0, 0.0, 0.0, reach, 0.0],
        [0.0, 0.0, 0.0, 0.0, reach],
    ]
}

/// Halton's sequence: the digits of `index` in `base` behind the point, reversed.
pub fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= base as f64;
        value += place * (index % base) as f64;
        index /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Design;

    /// Slopes are what neighbours say.
    #[test]
    fn slopes_are_differences() {
        let design = Design {
            fineness: 0.5,
            ..Design::default()
        };
        let mut film = Film::new(&design).unwrap();
        for family in Family::ALL {
            let pose = Pose {
                size: 0.7,
                tilt: [0.3, -0.2],
                offset: [0.1, 0.4],
            };
            let mut at = |pose: Pose| {
                film.move_tip(offset_mm(family, &pose)).unwrap();
                let state = film
                    .press(Contact::Force(force_n(family, &pose)), &film.rest())
                    .unwrap();
                sample(family, &film, pose, &state).unwrap()
            };
            let here = at(pose);
            for k in 0..4 {
                const STEP: f64 = 1e-3;
                let mut beside = |step: f64| {
                    let mut pose = pose;
                    match k {
                        0 | 1 => pose.tilt[k] += step,
                        _ => pose.offset[k - 2] += step,
                    }
                    at(pose).outputs
                };
                let (back, forth) = (beside(-STEP), beside(STEP));
                for output in 0..12 {
                    for marker in 0..4 {
                        let slope = (forth[output][marker] - back[output][marker]) / (2.0 * STEP);
                        let found = here.slopes[k][output][marker];
                        assert!(
                            (slope - found).abs() < 1e-4,
                            "{family:?} {k} {output} {marker}: {slope} {found}"
                        );
                    }
                }
            }
        }
    }
}
