//! Computes the effect of gravity on a unit's film when it is turned, by finite elements.

use anyhow::{Context, Result, ensure};
use hivtac_sensor::force::forward::Stiffness;
use hivtac_sensor::force::forward::weight::{AT_REST, SIZES, TERMS, UNDER_LOAD};
use hivtac_sensor::force::model::WeightSpec;
use hivtac_shell::{Design, Equilibrium, Film};
use hivtac_twin::film::reduced::{AS_A_PRESS_N, LARGEST_TILT, Pose};
use serde::{Deserialize, Serialize};

use super::descent::Found;
use super::field::force_n;
use super::problem::{At, Problem};
use crate::forward::{Moved, Pressed, Weighed, weight};

/// Places of the tip along each axis, mm, and tilts in its middle, in parts of the largest.
const PLACES_MM: [f64; 3] = [-3.8, 0.0, 3.8];
const TILTS: [[f64; 2]; 4] = [[0.6, 0.0], [-0.6, 0.0], [0.0, 0.6], [0.0, -0.6]];

/// The contents of [`WeightSpec`], as a unit's file keeps them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnWeight {
    /// Gravity while the unit's loads were applied, parts of g.
    down: [f64; 3],
    press_n: f32,
    unsure: [f32; 2],
    /// By function of gravity.
    at_rest: Vec<Vec<f64>>,
    /// Coefficients by size, function of gravity, coordinate and term, flattened.
    under_load: Vec<f32>,
}

impl OwnWeight {
    /// Of a unit whose loads were applied with gravity known.
    ///
    /// # Errors
    /// When its film, turned, finds no equilibrium.
    pub fn new(problem: &Problem<'_>, found: &Found, stiffness_n: [f64; 2]) -> Result<Self> {
        let at = problem.coarse(&found.at)?;
        let weightless = turned(&at, [0.0; 3])?;
        let film = Hung {
            images: images(problem, &at, &weightless, &weightless.rest()),
            problem,
            at: &at,
            stiffness_n,
        };
        let [linear_n, cubic_n] = stiffness_n.map(|part| part as f32);
        let stiffness = Stiffness { linear_n, cubic_n };
        let down = at.made.design.down;
        let spec = weight(&film, stiffness, down).context("the film, turned any way")?;
        let under_load = spec.under_load.as_flattened().iter().flatten().flatten();
        Ok(Self {
            down,
            press_n: spec.press_n,
            unsure: spec.unsure,
            at_rest: spec.at_rest.to_vec(),
            under_load: under_load.map(|part| *part as f32).collect(),
        })
    }

    /// Checks that every value is valid, for this many coordinates of markers.
    ///
    /// # Errors
    /// Names the first that is not.
    pub fn check(&self, coordinates: usize) -> Result<()> {
        self.spec(coordinates).map(|_| ())
    }

    /// As a model file holds it, of this many coordinates of markers.
    ///
    /// # Errors
    /// When numbers are missing, too many or not finite.
    pub fn spec(&self, coordinates: usize) -> Result<WeightSpec> {
        let all = self.at_rest.iter().flatten();
        ensure!(
            all.chain(&self.down).all(|part| part.is_finite())
                && self.under_load.iter().all(|part| part.is_finite()),
            "film.own.weight has numbers that are not finite"
        );
        let at_rest = <[Vec<f64>; AT_REST]>::try_from(self.at_rest.clone());
        let counts = "film.own.weight: numbers are missing, or too many";
        ensure!(
            self.under_load.len() == SIZES * UNDER_LOAD * coordinates * TERMS
                && self
                    .at_rest
                    .iter()
                    .all(|column| column.len() == coordinates),
            counts
        );
        let (terms, _) = self.under_load.as_chunks::<TERMS>();
        let mut blocks = terms.chunks(coordinates).map(|coordinates| {
            let terms = coordinates.iter().map(|terms| terms.map(f64::from));
            terms.collect::<Vec<_>>()
        });
        let under_load =
            [(); SIZES].map(|()| [(); UNDER_LOAD].map(|()| blocks.next().unwrap_or_default()));
        Ok(WeightSpec {
            down: self.down.map(|part| part as f32),
            press_n: self.press_n,
            unsure: self.unsure,
            at_rest: at_rest.ok().context(counts)?,
            under_load,
        })
    }
}

/// A unit's film that can be turned.
struct Hung<'a> {
    problem: &'a Problem<'a>,
    /// With gravity as when its loads were applied.
    at: &'a At,
    stiffness_n: [f64; 2],
    /// Images of its dots when it weighs nothing, focal lengths.
    images: Moved,
}

impl Weighed for Hung<'_> {
    type Turned = Film;

    fn press_n(&self) -> f64 {
        let thickness = |design: &Design| design.material.thickness_mm;
        AS_A_PRESS_N * thickness(&self.at.made.design) / thickness(&Design::default())
    }

    fn pressed(&self) -> Vec<Pressed> {
        let places = PLACES_MM
            .into_iter()
            .flat_map(|y| PLACES_MM.map(|x| ([x, y], [0.0; 2])));
        let tilted = TILTS.map(|tilt| ([0.0; 2], tilt.map(|part| LARGEST_TILT * part)));
        places.chain(tilted).collect()
    }

    fn turned(&self, down: [f64; 3]) -> Result<Film> {
        turned(self.at, down)
    }

    fn moved(&self, film: &Film, pressed: &Pressed, sizes: &[f64]) -> Result<Vec<Moved>> {
        let (place_mm, tilt) = *pressed;
        let at_mm = self.at.film.material_point(&self.at.rest, place_mm);
        let mut state = film.rest();
        let of_size = |size: &f64| -> Result<Moved> {
            let pose = Pose {
                size: *size,
                tilt,
                place_mm,
            };
            state = film.press_force(at_mm, force_n(self.stiffness_n, &pose), &state)?;
            Ok(self.beside_weightless(film, &state))
        };
        sizes.iter().map(of_size).collect()
    }

    fn hangs(&self, film: &Film) -> Result<Moved> {
        Ok(self.beside_weightless(film, &film.rest()))
    }
}

impl Hung<'_> {
    fn beside_weightless(&self, film: &Film, state: &Equilibrium) -> Moved {
        let there = images(self.problem, self.at, film, state);
        Moved::from_fn(there.len(), |k| there[k] - self.images[k])
    }
}

/// The unit's film with gravity along another direction.
fn turned(at: &At, down: [f64; 3]) -> Result<Film> {
    let mut design = at.made.design.clone();
    design.down = down;
    Ok(at.film.changed(&design)?)
}

/// Images of the unit's dots, focal lengths.
fn images(problem: &Problem<'_>, at: &At, film: &Film, state: &Equilibrium) -> Moved {
    let view = problem.view(&at.made, film);
    let images = view.images(state, &at.made.dots_mm);
    Moved::of(images.as_flattened().iter().copied())
}
