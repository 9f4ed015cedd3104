//! Films as people mount them, by finite elements: stretched, cut otherwise, of other rubber.

use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use hivtac_shell::{Design, Equilibrium, Film, Law, Material, pressed};
use hivtac_twin::film::Pressed;
use hivtac_twin::{Disc, Load, Options};
use rand::Rng;

use super::seeded;

/// Number of states that are kept as starts for others.
const MOST_STATES: usize = 40;
/// Fineness of the films' meshes, which differs from that of fits.
const FINENESS: f64 = 0.7;

/// A film on its posts.
pub struct RealFilm {
    film: Film,
    /// How far it is lifted off its place, mm in the middle, and mm per mm along x and y.
    lift: [f64; 3],
    rest: Equilibrium,
    /// The newest states, with the film's shape for a scene.
    states: Mutex<Vec<(Load, Equilibrium, Pressed)>>,
}

impl RealFilm {
    /// The film with this number, with the posts and dots of these options, under a tip with a
    /// radius in mm.
    pub fn random(number: u64, options: &Options, tip_radius_mm: f64) -> Result<Self> {
        Self::lifted(&random_design(number, options, tip_radius_mm), [0.0; 3])
    }

    /// The film of a design, farther from the camera than it should be: in mm in its middle, and in
    /// mm per mm along x and y.
    pub fn lifted(design: &Design, lift: [f64; 3]) -> Result<Self> {
        let film = Film::new(design)?;
        Ok(Self {
            rest: film.rest(),
            film,
            lift,
            states: Mutex::default(),
        })
    }

    /// The film under a load.
    pub fn press(&self, load: &Load) -> Result<Pressed> {
        let mut states = self.states.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((.., pressed)) = states.iter().find(|(other, ..)| other == load) {
            return Ok(*pressed);
        }
        let state = match load.magnitude_n() {
            0.0 => self.rest.clone(),
            _ => {
                let at_mm = self.film.material_point(&self.rest, load.offset_mm());
                // Starts from the state under the load nearest to this one.
                let far = |(other, ..): &&(Load, _, _)| far(load, other);
                let nearest = states.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
                let start = nearest.map_or(&self.rest, |(_, state, _)| state);
                self.film.press_force(at_mm, load.vector_n(), start)?
            }
        };
        let discs = self.film.design().dots_mm.iter().copied().map(Disc::marker);
        let mut pressed = Pressed {
            tip_mm: state.tip_mm,
            force_n: load.vector_n(),
            touches_mm: load.offset_mm(),
            ..pressed(&self.film, &state, discs)?
        };
        let [middle, along_x, along_y] = self.lift;
        for (disc, [x, y]) in pressed.discs.iter_mut().zip(pressed.centres_mm) {
            disc.moved_mm[2] += middle + along_x * x + along_y * y;
            disc.along_x[2] += along_x;
            disc.along_y[2] += along_y;
        }
        if states.len() >= MOST_STATES {
            states.remove(0);
        }
        states.push((*load, state, pressed));
        Ok(pressed)
    }
}

/// Square distance of two loads: a millimetre of place counts as much as 20 mN.
fn far(load: &Load, other: &Load) -> f64 {
    let apart =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum() };
    apart(&load.vector_n(), &other.vector_n()) + 4e-4 * apart(&load.offset_mm(), &other.offset_mm())
}

/// The design of the film with this number.
fn random_design(number: u64, options: &Options, tip_radius_mm: f64) -> Design {
    let mut random = seeded(77_000 + number);
    let mut between = |from: f64, to: f64| random.random_range(from..to);
    let unit = &options.film.unit;
    let nominal = Design::default();
    let across = [between(-0.05, 0.05), between(-0.05, 0.05)];
    let curve = [(); 3].map(|()| between(-0.03, 0.03));
    let law = match number % 3 {
        0 => Law::default(),
        1 => Law {
            neo_hooke: 1.0,
            stiffening: 0.0,
        },
        _ => Law {
            neo_hooke: 1.0,
            stiffening: between(0.02, 0.2),
        },
    };
    // Every third film is cut at its holes.
    let overhang_mm = match number / 3 % 3 {
        0 => 0.0,
        _ => between(0.0, 8.0),
    };
    let down = loop {
        let vector = [(); 3].map(|()| between(-1.0, 1.0));
        let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
        if (0.1..1.0).contains(&length) {
            break vector.map(|part| part / length);
        }
    };
    let centres_mm = options.layout.centres_mm();
    let dots_mm = (centres_mm.iter().zip(options.glued_mm.iter()))
        .map(|([x, y], [right, down])| [x + right, y + down])
        .collect();
    Design {
        material: Material {
            youngs_mpa: unit.stiffness * nominal.material.youngs_mpa,
            thickness_mm: unit.thickness * nominal.material.thickness_mm,
            ..nominal.material
        },
        law,
        stretch: [between(-0.003, 0.03), between(-0.003, 0.03)],
        overhang_mm,
        post_radius_mm: between(1.0, 3.0),
        post_shift_mm: unit.posts_mm,
        thickness_slope: across,
        thickness_curve: curve,
        dot_stiffening: between(0.0, 1.0),
        dots_mm,
        down,
        tip_radius_mm,
        fineness: FINENESS,
        ..nominal
    }
}
