//! Compares a unit's numbers with its rest position and its loads: residuals and their rates.

use anyhow::Result;
use hivtac_shell::{Change, Design, Equilibrium, Film};
use hivtac_twin::Camera;

use super::COARSE;
use super::equations::{LoadEquations, LoadSlopes, Normal};
use super::linear::{Matrix, inverse};
use super::load::UNKNOWNS;
use super::numbers::{self, Family, Number, Prior};
use super::view::View;
use crate::loads::SeenLoad;
use crate::parallel;

/// Beyond this number, loads repeat each other: these cover places and directions all over the
/// film.
const APART: usize = 10;
/// Standard uncertainty of the rest position while it has little weight, px, times the blur.
const LITTLE_REST_PX: f64 = 0.05;
/// Standard uncertainty of a real film's motion around the family's nearest film, px at 320×240.
const FAMILY_PX: f64 = 0.006;
/// The same for loads whose places nobody noted: then only the family of films relates them.
const FAMILY_PX_NOWHERE: f64 = 0.02;

/// Camera and rest position, as known before any load.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The camera's nominal focal length, px.
    pub focal_px: f64,
    /// Where its axis nominally meets the picture, px.
    pub middle_px: [f64; 2],
    /// Where markers rest, px.
    pub rest_px: Vec<[f64; 2]>,
    /// Standard uncertainty of these coordinates, px.
    pub noise_px: f64,
    /// Where dots are nominally glued, mm.
    pub dots_mm: Vec<[f64; 2]>,
    /// The camera whose lens sees the film; images are in its focal lengths.
    pub camera: Camera,
    /// Direction of gravity in the film frame at rest and under all loads, parts of g, if known.
    pub down: Option<[f64; 3]>,
    /// Fineness of the film's mesh.
    pub fineness: f64,
}

/// A unit's numbers, their priors, and the loads to compare them with.
pub struct Problem<'a> {
    pub bench: &'a Bench,
    pub loads: &'a [SeenLoad],
    pub family: Family,
    pub priors: Vec<Prior>,
    pub trust: Trust,
}

/// How much a fit trusts the seen coordinates: with less trust it converges from farther away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// Factor on the standard uncertainty of the seen coordinates, ≥ 1.
    pub blur: f64,
    /// If true, dots under loads are compared by their shift from the rest position. If false, they
    /// are compared by their place in the picture, and the rest position has little weight. The
    /// rest position of a slack film jumps, and would shift all loads.
    pub from_rest: bool,
}

impl Trust {
    /// Full trust: the stated uncertainties hold.
    pub const WHOLE: Trust = Trust {
        blur: 1.0,
        from_rest: true,
    };
}

/// A unit with given values of its numbers.
#[derive(Clone, Debug)]
pub struct Made {
    pub design: Design,
    /// Where its dots are on the film, mm.
    pub dots_mm: Vec<[f64; 2]>,
    /// Rest position as a tare measures it, minus where the markers rest, px.
    pub rest_px: Vec<[f64; 2]>,
    pub roll_deg: f64,
    pub focal_px: f64,
    pub farther_mm: f64,
    pub middle_px: [f64; 2],
    /// The stage's zero on the film, mm.
    pub stage_mm: [f64; 2],
}

/// Values of all unknowns, in standard deviations from their means.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknowns {
    /// The unit's numbers.
    pub numbers: Vec<f64>,
    /// The unknowns of each load.
    pub loads: Vec<[f64; UNKNOWNS]>,
}

/// The film, its states and the residuals at given values of the unknowns.
pub struct At {
    pub unknowns: Unknowns,
    pub made: Made,
    pub film: Film,
    pub rest: Equilibrium,
    /// The dots' images at rest, focal lengths.
    images: Vec<[f64; 2]>,
    /// The film under each load.
    pub states: Vec<Equilibrium>,
    /// Residuals, seen minus predicted, in standard uncertainties: at rest, and under each load.
    rest_residual: Vec<f64>,
    pub residuals: Vec<Vec<f64>>,
}

/// Derivatives of the residuals by the unknowns.
struct Slopes {
    /// By number: of the rest position's residuals.
    rest: Vec<Vec<f64>>,
    loads: Vec<LoadSlopes>,
}

/// Images of the dots, focal lengths.
struct Images {
    rest: Vec<[f64; 2]>,
    pressed: Vec<Vec<[f64; 2]>>,
}

/// The observations of a unit with given images, x and y of each dot, px.
struct Seen {
    rest: Vec<f64>,
    pressed: Vec<Vec<f64>>,
}

/// Derivatives of the observations by the unknowns: x and y of each dot, px.
pub struct UnitRates {
    /// By number, per standard deviation: of where the dots rest.
    pub rest: Vec<Vec<f64>>,
    /// Of the dots' shift from there, in each state.
    pub pressed: Vec<Rates>,
}

/// Derivatives of the shift of dots under a load.
pub struct Rates {
    /// By number, per standard deviation.
    pub numbers: Vec<Vec<f64>>,
    /// By the force along x, y and z, per N.
    pub force: Vec<Vec<f64>>,
    /// By the place along x and y, per mm.
    pub place: Vec<Vec<f64>>,
}

/// The normal equations of the unknowns, and the covariance that follows from them.
pub struct Solved {
    /// Of the numbers, in parts of their prior standard deviations.
    pub covariance: Matrix,
    /// The equations of the numbers, from the rest position and all loads.
    pub whole: Normal,
    /// Those of each load.
    pub loads: Vec<LoadEquations>,
}

impl Made {
    /// Converts a point of the picture from focal lengths to px.
    pub fn to_px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.roll_deg.to_radians());
        [
            self.focal_px * (cos * x - sin * y),
            self.focal_px * (sin * x + cos * y),
        ]
    }
}

impl At {
    /// χ²: the squares of all residuals and of all unknowns' distances from their priors.
    pub fn square(&self) -> f64 {
        let seen = self.residuals.iter().flatten().chain(&self.rest_residual);
        let own = self.unknowns.loads.iter().flatten();
        let all = seen.chain(&self.unknowns.numbers).chain(own);
        all.map(|part| part * part).sum()
    }
}

impl Problem<'_> {
    /// The film's numbers: index and change of each.
    fn changes(&self) -> impl Iterator<Item = (usize, Change)> {
        let all = self.priors.iter().enumerate();
        all.filter_map(|(k, prior)| match prior.number {
            Number::Film(change) => Some((k, change)),
            _ => None,
        })
    }

    /// The unit with these values of the numbers.
    pub fn made(&self, parts: &[f64]) -> Made {
        let bench = self.bench;
        let mut made = Made {
            design: Design {
                fineness: bench.fineness,
                gauss_points: 2,
                dots_mm: bench.dots_mm.clone(),
                ..Design::default()
            },
            dots_mm: bench.dots_mm.clone(),
            rest_px: vec![[0.0; 2]; bench.dots_mm.len()],
            roll_deg: 0.0,
            focal_px: bench.focal_px,
            farther_mm: 0.0,
            middle_px: bench.middle_px,
            stage_mm: [0.0; 2],
        };
        for (prior, part) in self.priors.iter().zip(parts) {
            let value = prior.value(*part);
            match prior.number {
                Number::Film(change) => numbers::set(&mut made.design, change, value),
                Number::Marker(k, axis) => made.dots_mm[k][axis] += value,
                Number::Rest(k, axis) => made.rest_px[k][axis] = value,
                Number::Roll => made.roll_deg = value,
                Number::Focal => made.focal_px *= libm::exp(value),
                Number::Distance => made.farther_mm = value,
                Number::Middle(axis) => made.middle_px[axis] += value,
                Number::Stage(axis) => made.stage_mm[axis] = value,
            }
        }
        made
    }

    /// The unit without loads, on a mesh that is fine enough for rates by the numbers.
    ///
    /// # Errors
    /// When the film finds no rest.
    pub fn coarse(&self, at: &At) -> Result<At> {
        let mut made = at.made.clone();
        made.design.fineness = COARSE;
        let film = Film::new(&made.design)?;
        Ok(self.unloaded(at.unknowns.clone(), made, film))
    }

    /// The unit and its film, without loads.
    fn unloaded(&self, unknowns: Unknowns, made: Made, film: Film) -> At {
        let rest = film.rest();
        let images = self.view(&made, &film).images(&rest, &made.dots_mm);
        At {
            rest_residual: self.rest_residual(&made, &images),
            images,
            unknowns,
            made,
            film,
            rest,
            states: Vec::new(),
            residuals: Vec::new(),
        }
    }

    /// The unit's film in front of its camera.
    pub fn view<'a>(&'a self, made: &Made, film: &'a Film) -> View<'a> {
        View {
            film,
            camera: &self.bench.camera,
            farther_mm: made.farther_mm,
        }
    }

    /// The film, its states and the residuals at these unknowns. Starts from a film nearby and its
    /// states under the loads, as far as there are any.
    ///
    /// # Errors
    /// When the film finds no equilibrium.
    pub fn at(&self, unknowns: Unknowns, near: Option<(&Film, &[Equilibrium])>) -> Result<At> {
        let made = self.made(&unknowns.numbers);
        let film = match near {
            Some((near, _)) => near.changed(&made.design)?,
            None => Film::new(&made.design)?,
        };
        let mut at = self.unloaded(unknowns, made, film);
        let press = |k: usize| -> Result<(Equilibrium, Vec<f64>)> {
            let start = near.and_then(|(_, states)| states.get(k));
            self.press(&at, k, &at.unknowns.loads[k], start.unwrap_or(&at.rest))
        };
        let pressed = parallel::try_map(self.loads.len(), press)?;
        (at.states, at.residuals) = pressed.into_iter().unzip();
        Ok(at)
    }

    /// The unit's film under a load whose unknowns are these, in standard uncertainties. Also the
    /// load's residual, in parts of its uncertainty.
    ///
    /// # Errors
    /// When the film finds no equilibrium.
    pub fn press(
        &self,
        at: &At,
        number: usize,
        parts: &[f64; UNKNOWNS],
        start: &Equilibrium,
    ) -> Result<(Equilibrium, Vec<f64>)> {
        let load = &self.loads[number];
        let pressed = load.at(parts);
        let place_mm = [0, 1].map(|i| pressed.place_mm[i] + at.made.stage_mm[i]);
        let at_mm = at.film.material_point(&at.rest, place_mm);
        let state = at.film.press_force(at_mm, pressed.force_n, start)?;
        let should = self.moved_px(at, &state);
        let (seen, rest) = (
            load.seen_px.as_flattened(),
            self.bench.rest_px.as_flattened(),
        );
        let noise_px = self.noise_px(load, &at.made);
        let residual = (0..should.len()).map(|i| (seen[i] - rest[i] - should[i]) / noise_px[i]);
        Ok((state, residual.collect()))
    }

    /// Images of the dots at rest and in some states, focal lengths.
    fn images(&self, at: &At, made: &Made, states: &[Equilibrium]) -> Images {
        let view = self.view(made, &at.film);
        let of = |state: &Equilibrium| view.images(state, &made.dots_mm);
        Images {
            rest: of(&at.rest),
            pressed: parallel::map(states.len(), |k| of(&states[k])),
        }
    }

    /// The observations of a unit with these images, px: its dots' rest places, and their shift in
    /// each state from the rest position as a tare measures it.
    fn seen(&self, made: &Made, images: &Images) -> Seen {
        let pressed = images.pressed.iter();
        Seen {
            rest: rest_px(made, &images.rest),
            pressed: pressed
                .map(|there| self.pressed_px(made, there, &images.rest))
                .collect(),
        }
    }

    /// Standard uncertainty of each coordinate under a load, px: of the seen coordinates, and of
    /// the mesh near the tip. The family's own error is the same in similar loads. More loads than
    /// [`APART`] do not average it out, so each then counts less.
    fn noise_px(&self, load: &SeenLoad, made: &Made) -> Vec<f64> {
        let more = self.loads.len().saturating_sub(APART) as f64 / APART as f64;
        let family_px = match load.each_place_mm.is_finite() {
            true => FAMILY_PX,
            false => FAMILY_PX_NOWHERE,
        };
        let shared_px = load.noise_px.hypot(family_px * more.sqrt());
        let seen = load.seen_px.iter().zip(&self.bench.rest_px);
        let of_dot = |(dot, (seen, rest)): (&[f64; 2], (&[f64; 2], &[f64; 2]))| {
            let moved_px = libm::hypot(seen[0] - rest[0], seen[1] - rest[1]);
            let mesh_px = moved_px * mesh_part(*dot, load.place_mm);
            [self.trust.blur * shared_px.hypot(mesh_px); 2]
        };
        made.dots_mm.iter().zip(seen).flat_map(of_dot).collect()
    }

    /// Shift of a unit's dots from their rest position in a state, x and y of each, px.
    pub fn moved_px(&self, at: &At, state: &Equilibrium) -> Vec<f64> {
        let view = self.view(&at.made, &at.film);
        let images = view.images(state, &at.made.dots_mm);
        self.pressed_px(&at.made, &images, &at.images)
    }

    /// Predicted shift of dots with these images from the rest position of a tare, x and y of each,
    /// px.
    fn pressed_px(&self, made: &Made, there: &[[f64; 2]], rest: &[[f64; 2]]) -> Vec<f64> {
        if self.trust.from_rest {
            return moved_px(made, there, rest);
        }
        let of_dot = |(image, seen_rest): (&[f64; 2], &[f64; 2])| {
            let at = made.to_px(*image);
            [0, 1].map(|i| made.middle_px[i] + at[i] - seen_rest[i])
        };
        there
            .iter()
            .zip(&self.bench.rest_px)
            .flat_map(of_dot)
            .collect()
    }

    /// Standard uncertainty of each coordinate at rest, px.
    fn rest_sigma_px(&self) -> f64 {
        match self.trust.from_rest {
            true => self.trust.blur * self.bench.noise_px,
            false => self.trust.blur * LITTLE_REST_PX,
        }
    }

    /// Residuals of the rest position, in parts of its uncertainty.
    fn rest_residual(&self, made: &Made, images: &[[f64; 2]]) -> Vec<f64> {
        let sigma_px = self.rest_sigma_px();
        let seen = self.bench.rest_px.as_flattened().iter();
        let pairs = seen.zip(rest_px(made, images));
        pairs
            .map(|(seen, should)| (seen - should) / sigma_px)
            .collect()
    }

    /// Derivatives of the residuals by the unknowns.
    fn slopes(&self, at: &At) -> Result<Slopes> {
        let rates = self.rates(at, &at.states)?;
        let of_load = |(load, rates): (&SeenLoad, &Rates)| {
            let noise_px = self.noise_px(load, &at.made);
            let numbers = rates.numbers.iter();
            LoadSlopes {
                numbers: numbers.map(|column| scaled(column, &noise_px)).collect(),
                own: own_slopes(load, &noise_px, &rates.force, &rates.place),
            }
        };
        let of_rest = vec![self.rest_sigma_px(); 2 * at.made.dots_mm.len()];
        let at_rest = rates.rest.iter();
        Ok(Slopes {
            rest: at_rest.map(|column| scaled(column, &of_rest)).collect(),
            loads: self.loads.iter().zip(&rates.pressed).map(of_load).collect(),
        })
    }

    /// Derivatives of the observations by the unknowns, at rest and in some states of the unit's
    /// film.
    ///
    /// # Errors
    /// When a state is not stable.
    pub fn rates(&self, at: &At, states: &[Equilibrium]) -> Result<UnitRates> {
        let (numbers, changes): (Vec<usize>, Vec<Change>) = self.changes().unzip();
        let units: Vec<f64> = numbers
            .iter()
            .zip(&changes)
            .map(|(k, change)| {
                self.priors[*k].sigma * numbers::per_number(&at.made.design, *change)
            })
            .collect();
        let at_rest = self.image_rates(at, &at.rest, &changes)?;
        let all: Vec<Change> = changes.iter().copied().chain(load_changes()).collect();
        let of_state = |state: &Equilibrium| -> Result<Rates> {
            let moved = self.image_rates(at, state, &all)?;
            let (of_film, of_load) = moved.split_at(changes.len());
            let (force, place) = of_load.split_at(3);
            let mut rates = Rates {
                numbers: vec![Vec::new(); self.priors.len()],
                force: force.to_vec(),
                place: place.to_vec(),
            };
            for (j, k) in numbers.iter().enumerate() {
                let pairs = of_film[j].iter().zip(&at_rest[j]);
                let with_rest = if self.trust.from_rest { 1.0 } else { 0.0 };
                rates.numbers[*k] = pairs.map(|(a, b)| units[j] * (a - with_rest * b)).collect();
            }
            for (k, prior) in self.priors.iter().enumerate() {
                if let Number::Stage(axis) = prior.number {
                    let column = place[axis].iter();
                    rates.numbers[k] = column.map(|part| prior.sigma * part).collect();
                }
            }
            Ok(rates)
        };
        let mut rates = UnitRates {
            rest: vec![vec![0.0; 2 * at.made.dots_mm.len()]; self.priors.len()],
            pressed: parallel::try_map(states.len(), |k| of_state(&states[k]))?,
        };
        for (j, k) in numbers.iter().enumerate() {
            rates.rest[*k] = at_rest[j].iter().map(|part| units[j] * part).collect();
        }
        self.add_camera(at, states, &mut rates);
        Ok(rates)
    }

    /// Adds the rates by numbers that do not change the film, by finite differences.
    fn add_camera(&self, at: &At, states: &[Equilibrium], rates: &mut UnitRates) {
        const STEP: f64 = 0.01;
        let here = self.images(at, &at.made, states);
        let seen_here = self.seen(&at.made, &here);
        for (k, prior) in self.priors.iter().enumerate() {
            let moves_images = match prior.number {
                Number::Film(_) | Number::Stage(_) => continue,
                Number::Marker(..) | Number::Distance => true,
                _ => false,
            };
            let mut there = at.unknowns.numbers.clone();
            there[k] += STEP;
            let made = self.made(&there);
            let seen = match moves_images {
                true => self.seen(&made, &self.images(at, &made, states)),
                false => self.seen(&made, &here),
            };
            let rate = |there: &[f64], here: &[f64]| -> Vec<f64> {
                let pairs = there.iter().zip(here);
                pairs.map(|(a, b)| (a - b) / STEP).collect()
            };
            rates.rest[k] = rate(&seen.rest, &seen_here.rest);
            for (k_state, rates) in rates.pressed.iter_mut().enumerate() {
                rates.numbers[k] = rate(&seen.pressed[k_state], &seen_here.pressed[k_state]);
            }
        }
    }

    /// By change: rates of the dots' images, x and y of each, px per unit of the change.
    fn image_rates(
        &self,
        at: &At,
        state: &Equilibrium,
        changes: &[Change],
    ) -> Result<Vec<Vec<f64>>> {
        let responses = at.film.linearize(state, changes)?;
        let view = self.view(&at.made, &at.film);
        let mut rates = vec![Vec::new(); changes.len()];
        for dot in &at.made.dots_mm {
            for (column, rate) in rates.iter_mut().zip(view.rates(state, &responses, *dot)) {
                column.extend(at.made.to_px(rate));
            }
        }
        Ok(rates)
    }

    /// The Gauss–Newton step of a load's own unknowns, the unit held as it is.
    ///
    /// # Errors
    /// When the state is not stable.
    pub fn own_step(
        &self,
        at: &At,
        number: usize,
        parts: &[f64; UNKNOWNS],
        (state, residual): &(Equilibrium, Vec<f64>),
    ) -> Result<[f64; UNKNOWNS]> {
        let load = &self.loads[number];
        let changes: Vec<Change> = load_changes().collect();
        let rates = self.image_rates(at, state, &changes)?;
        let (force, place) = rates.split_at(3);
        let slopes = LoadSlopes {
            numbers: Vec::new(),
            own: own_slopes(load, &self.noise_px(load, &at.made), force, place),
        };
        Ok(LoadEquations::new(slopes, residual, parts)?.step(&[]))
    }

    /// The linearized equations, and the covariance of the numbers.
    ///
    /// # Errors
    /// When a state is not stable.
    pub fn solve(&self, at: &At) -> Result<Solved> {
        let slopes = self.slopes(at)?;
        let mut whole = Normal::before(&at.unknowns.numbers);
        whole.add(&slopes.rest, &at.rest_residual);
        let own = at.unknowns.loads.iter();
        let loads = slopes.loads.into_iter().zip(&at.residuals).zip(own);
        let loads: Vec<LoadEquations> = loads
            .map(|((slopes, residual), own)| LoadEquations::new(slopes, residual, own))
            .collect::<Result<_>>()?;
        for load in &loads {
            whole.take(load, 1.0);
        }
        Ok(Solved {
            covariance: inverse(whole.matrix.clone())?,
            whole,
            loads,
        })
    }
}

impl Solved {
    /// The Gauss–Newton step of the unknowns from some values. Damping shortens it most for numbers
    /// about which the loads say little.
    ///
    /// # Errors
    /// When the equations have no solution.
    pub fn step(&self, priors: &[Prior], at: &Unknowns, damping: f64) -> Result<Unknowns> {
        let numbers = self.whole.step_within(priors, &at.numbers, damping)?;
        Ok(Unknowns {
            loads: self.loads.iter().map(|load| load.step(&numbers)).collect(),
            numbers,
        })
    }
}

/// The changes of a load: three of its force, two of its place.
fn load_changes() -> impl Iterator<Item = Change> {
    (0..3).map(Change::Force).chain((0..2).map(Change::Place))
}

/// Where a unit's dots rest, x and y of each, px.
fn rest_px(made: &Made, images: &[[f64; 2]]) -> Vec<f64> {
    let of_dot = |(image, off): (&[f64; 2], &[f64; 2])| {
        let at = made.to_px(*image);
        [0, 1].map(|i| made.middle_px[i] + at[i] + off[i])
    };
    images.iter().zip(&made.rest_px).flat_map(of_dot).collect()
}

/// Shift of a unit's dots from the rest position as a tare measures it, x and y of each, px.
fn moved_px(made: &Made, there: &[[f64; 2]], rest: &[[f64; 2]]) -> Vec<f64> {
    let dots = there.iter().zip(rest).zip(&made.rest_px);
    let moved = dots.flat_map(|((there, here), off)| {
        let moved = made.to_px([0, 1].map(|i| there[i] - here[i]));
        [0, 1].map(|i| moved[i] - off[i])
    });
    moved.collect()
}

/// Derivatives of a load's residual by its own unknowns. `force` is the rate of the observations by
/// a force along x, y and z, px/N; `place` that by a place along x and y, px/mm.
fn own_slopes(
    load: &SeenLoad,
    noise_px: &[f64],
    force: &[Vec<f64>],
    place: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let of_force = |parts: &[f64; 3]| {
        let sum = |i: usize| (0..3).map(|axis| parts[axis] * force[axis][i]).sum::<f64>();
        scaled(&(0..noise_px.len()).map(sum).collect::<Vec<_>>(), noise_px)
    };
    let of_place = |column: &Vec<f64>| {
        let parts = scaled(column, noise_px).into_iter();
        parts.map(|part| load.place_sigma_mm() * part).collect()
    };
    let forces = load.directions();
    let forces = forces.iter().map(of_force);
    forces.chain(place.iter().map(of_place)).collect()
}

/// The slope of a residual, from the slope of the predicted coordinates and their uncertainties.
fn scaled(column: &[f64], sigmas: &[f64]) -> Vec<f64> {
    let pairs = column.iter().zip(sigmas);
    pairs.map(|(rate, sigma)| -rate / sigma).collect()
}

/// Standard uncertainty of each coordinate of a dot due to the mesh, in parts of the dot's motion.
/// A finer mesh moves dots near the tip differently.
pub fn mesh_part(dot_mm: [f64; 2], place_mm: [f64; 2]) -> f64 {
    0.004 * near_tip(dot_mm, place_mm, 1.3)
}

/// 1 for a dot at the tip; falls to 0 at distances far beyond `reach_mm`.
pub fn near_tip(dot_mm: [f64; 2], place_mm: [f64; 2], reach_mm: f64) -> f64 {
    let apart = apart_mm(dot_mm, place_mm) / reach_mm;
    libm::exp(-apart * apart)
}

/// How far a dot is from the tip, mm.
pub fn apart_mm(dot_mm: [f64; 2], place_mm: [f64; 2]) -> f64 {
    libm::hypot(dot_mm[0] - place_mm[0], dot_mm[1] - place_mm[1])
}

impl Unknowns {
    /// These unknowns plus a step, each number within its range.
    pub fn after(&self, step: &Unknowns, priors: &[Prior]) -> Unknowns {
        let numbers = self.numbers.iter().zip(&step.numbers).zip(priors);
        let within = |((at, step), prior): ((&f64, &f64), &Prior)| prior.within(at + step);
        let loads = self.loads.iter().zip(&step.loads);
        Unknowns {
            numbers: numbers.map(within).collect(),
            loads: loads
                .map(|(at, step)| std::array::from_fn(|i| at[i] + step[i]))
                .collect(),
        }
    }
}
