//! The sensing's answers to two contacts at once on a layout of more dots, and to other presses.

mod presses;
mod row;

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::forward::pairs::PairFilm;
use hivtac_sensor::force::forward::pair::{
    Found, Interaction, PairEstimate, Problem, Search, Work, find, follow,
};
use hivtac_sensor::force::forward::{
    Column, Estimate, Forward, Markers, Mounting, Observed, Pose, Start, Unknown,
};
use hivtac_sensor::force::model::Model;
use hivtac_sensor::markers::lost::Lost;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::list::List;
use hivtac_twin::film::Layout;
use rayon::prelude::*;

use crate::page;
use crate::press::{normal, seeded};
use presses::{Kind, Press};
use row::{OtherRow, Outcome, PairRow};

/// Noise of each coordinate of a centroid, px, as in the simulated camera's frames.
const NOISE_PX: f64 = 0.011;
/// Fineness of the mesh: dots are within 0.002 px of a mesh of half the cells' size.
const FINENESS: f64 = 1.0;

/// The network of two contacts, and the number of bytes at its end that hold its errors.
const NETWORK: &[u8] = include_bytes!("../../../sensor/data/pairs-8v.bin");
const LEFT_BYTES: usize = 4 * 16 * 17 / 2;
/// Frames of each press of one needle or ball.
const SINGLE_FRAMES: u32 = 10;

/// Press with two needles at once
#[derive(Args)]
pub struct Touches {
    /// The layout.
    #[arg(long, default_value = "8v")]
    layout: Layout,
    /// The layout's model file.
    #[arg(long, default_value = "calibration/models/8v/default.hvtm")]
    model: PathBuf,
    /// Presses of each row.
    #[arg(long, default_value_t = 24)]
    presses: u32,
    /// Frames of each press: as many draws of noise.
    #[arg(long, default_value_t = 4)]
    frames: u32,
    /// Presses of each row of one needle or ball, with ten frames each.
    #[arg(long, default_value_t = 100)]
    singles: u32,
    /// Selects the presses.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// The sensor's forward model, with centroids in place of frames.
struct Bench<'a> {
    forward: Forward<'a>,
    mounting: Mounting,
}

impl Touches {
    /// Runs the study.
    ///
    /// # Errors
    /// If the model cannot be read, the film finds no equilibrium, or the page cannot be written.
    pub fn run(&self) -> Result<()> {
        let (pairs, others) = self.rows()?;
        if self.json {
            println!("{}", serde_json::json!({ "rows": pairs, "others": others }));
            return Ok(());
        }
        let mut text = String::from(PairRow::HEAD);
        text.extend(pairs.iter().map(PairRow::line));
        text += "\n";
        text += PairRow::BOUNDS;
        text.extend(pairs.iter().map(PairRow::bounds));
        text += "\n";
        text += OtherRow::HEAD;
        text.extend(others.iter().map(OtherRow::line));
        print!("{text}");
        page::write("touches.md", &text)
    }

    fn rows(&self) -> Result<(Vec<PairRow>, Vec<OtherRow>)> {
        let file = fs::read(&self.model).with_context(|| format!("{}", self.model.display()))?;
        let model = Model::parse(&file).map_err(|error| anyhow!("{error}"))?;
        let forward = model.forward.context("the model has no film")?;
        let dots = forward.tables.dots();
        let per_px = forward.per_px.context("the model has no camera")?;
        let bench = Bench {
            forward,
            mounting: Mounting {
                per_px,
                beside_mm: Markers::defaults(dots),
            },
        };
        let film = PairFilm::new(&self.layout.centres_mm(), FINENESS)?;
        let (mut pairs, mut others) = (Vec::new(), Vec::new());
        for kind in Kind::all() {
            let presses = match kind.is_single() {
                true => self.singles,
                false => self.presses,
            };
            let numbers = (0..presses).into_par_iter();
            let solved = numbers.map(|number| self.outcomes(&bench, &film, kind, number));
            let solved: Vec<Vec<Outcome>> = solved.collect::<Result<_>>()?;
            let outcomes: Vec<Outcome> = solved.into_iter().flatten().collect();
            match kind {
                Kind::Pair { .. } => pairs.push(PairRow::of(kind, &outcomes)),
                _ => others.push(OtherRow::of(kind, &outcomes)),
            }
            eprintln!("{kind}");
        }
        Ok((pairs, others))
    }

    fn outcomes(
        &self,
        bench: &Bench<'_>,
        film: &PairFilm,
        kind: Kind,
        number: u32,
    ) -> Result<Vec<Outcome>> {
        let press = kind.press(self.seed, number)?;
        let moved = press.moved(film)?;
        let mut random = seeded(u64::from(number) + 7);
        let frames = match kind.is_single() {
            true => 0..SINGLE_FRAMES,
            false => 0..self.frames,
        };
        Ok(frames
            .map(|_| {
                let noisy = moved.iter().map(|image| {
                    let noise = f64::from(bench.mounting.scale()) * NOISE_PX;
                    image.map(|part| (part + noise * normal(&mut random)) as f32)
                });
                bench.outcome(&press, &noisy.collect::<Vec<_>>())
            })
            .collect())
    }
}

impl Bench<'_> {
    fn outcome(&self, press: &Press, images: &[[f32; 2]]) -> Outcome {
        let variance = (self.mounting.scale() * NOISE_PX as f32).powi(2);
        let observed = Observed {
            moved: Column::of(images.as_flattened().iter().copied()),
            noise: List::from_fn(images.len(), |_| [variance, 0.0, variance]),
            lost: Lost::NONE,
            drift: None,
            hanging: None,
            pressing: None,
            wide: None,
            turning: (self.forward.torques).map(|torques| torques.of(ContactShape::Needle)),
        };
        let one = self.one(&observed, Start::Anywhere);
        let unknown = self.forward.unknown(true);
        let searched = |problem: &Problem<'_>| {
            let mut search = Search::new(one.pose);
            search.go_on(problem, &mut { Work::ALL });
            search.best(problem)
        };
        let both = || find(&self.forward, &observed, &self.mounting, unknown, searched);
        let both = (!one.is_explained()).then(both).flatten().flatten();
        let is_one_without_a_dot = !one.is_explained()
            && (0..images.len()).any(|dot| {
                let mut others = observed;
                others.lost = Lost::only(dot);
                others.lost.clear(&mut others.moved);
                self.one(&others, Start::At(one.pose)).is_explained()
            });
        let strength = self.forward.strength(true);
        let is_one = [one.is_explained(), is_one_without_a_dot];
        let bound = self.bound(press, &observed);
        Outcome::new(press, &strength, is_one, (both, bound))
    }

    /// Two needles where they are, as well as noise alone lets them be known: the bound of Cramér
    /// and Rao, with the prior of the steps.
    fn bound(&self, press: &Press, observed: &Observed<'_>) -> Option<PairEstimate> {
        let [first, second] = press.needles[..] else {
            return None;
        };
        let Forward {
            stiffness, limits, ..
        } = &self.forward;
        let pair = [first, second].map(|(place_mm, force_n)| {
            let place_mm = place_mm.map(|part| part as f32);
            Pose::of_force(force_n.map(|part| part as f32), place_mm, stiffness, limits)
        });
        let mut exact = NETWORK.to_vec();
        let end = exact.len();
        exact[end - LEFT_BYTES..].fill(0);
        let problem = Problem {
            forward: &self.forward,
            interaction: &Interaction::new(&exact)?,
            observed,
            mounting: &self.mounting,
            unknown: Unknown::Nothing,
        };
        let truth = PairEstimate::from(Found {
            pair,
            unexplained: 0.0,
            is_only: true,
        });
        Some(PairEstimate {
            pair,
            unexplained: 0.0,
            ..follow(&truth, &problem, &mut Work(1))
        })
    }

    fn one(&self, observed: &Observed<'_>, start: Start) -> Estimate {
        let unknown = self.forward.unknown(true);
        (self.forward).estimate(observed, &self.mounting, unknown, start)
    }
}
