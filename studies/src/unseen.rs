//! Measures what the residual cannot detect: one marker that is found away from its true place.

use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::forward::{Estimate, Forward, Markers, Mounting, Observed, Pose, Start};
use hivtac_sensor::force::model::Model;
use hivtac_sensor::markers::lost::Lost;
use hivtac_terms::list::List;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::REACH_MM;

/// Forces, mN.
const FORCES_MN: [u32; 2] = [50, 200];
/// Displacements of a marker, px, and number of directions.
const OFF_PX: [f64; 10] = [0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0];
const WAYS: u32 = 8;
/// Places of the tip along each axis, and the largest coordinate, mm.
const PLACES: usize = 41;
const FARTHEST_MM: f64 = 5.0;
/// Largest error that agrees with the sensor's statement, in stated standard uncertainties.
const SIGMAS: f64 = 3.0;

/// Find each marker in turn a little beside its place, and see how wrong a force gets before it is
/// refused.
#[derive(Args)]
pub struct Unseen {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// The results for all places at one force.
#[derive(Serialize)]
struct Row {
    force_mn: u32,
    /// Percentage refused among the displacements that change the force by more than three stated
    /// standard uncertainties.
    refused: f64,
    /// Median and maximum over all places of the largest displacement that is not refused, px.
    off_px: [f64; 2],
    /// Median and maximum of the largest error that is not refused: degrees, mN, mm.
    direction_deg: [f64; 2],
    magnitude_mn: [f64; 2],
    place_mm: [f64; 2],
    /// The place with the largest error of the direction, mm.
    at_mm: [f64; 2],
}

/// A place of the tip, with the number of displacements that matter, and of those that are refused.
#[derive(Default)]
struct Cell {
    place_mm: [f64; 2],
    /// The largest displacement of a marker that is not refused, px.
    off_px: f64,
    /// The largest errors that are not refused: direction, degrees; |F|, mN; place, mm.
    errors: [f64; 3],
    matter: u32,
    refused: u32,
}

impl Unseen {
    /// Runs the study.
    pub fn run(&self) -> Result<()> {
        let bytes = export(&Weights::load(&self.weights)?)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let film = Film::new(&model).context("the model has no film")?;
        let rows = FORCES_MN.map(|force_mn| {
            let cells = (0..PLACES * PLACES).into_par_iter();
            let cells = cells.map(|number| cell(&film, force_mn, number));
            Row::of(force_mn, &cells.collect::<Vec<_>>())
        });
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = String::from(
            "| force | refused, of displacements that matter | displaced unseen: median, most | \
             direction then: median, most | \\|F\\|: median, most | place: median, most | the most \
             at |\n|--:|--:|--:|--:|--:|--:|---|\n",
        );
        text.extend(rows.iter().map(Row::line));
        print!("{text}");
        page::write("unseen.md", include_str!("unseen.md"), &text)
    }
}

/// The film of a model.
struct Film<'m> {
    forward: Forward<'m>,
    mounting: Mounting,
}

impl<'m> Film<'m> {
    /// From a model; `None` if it has no film.
    fn new(model: &Model<'m>) -> Option<Film<'m>> {
        let forward = model.forward?;
        let mounting = Mounting {
            beside_mm: Markers::defaults(forward.tables.dots()),
            ..forward.rest_image.mounting(&model.rest)
        };
        Some(Film { forward, mounting })
    }

    /// A straight press, N, at a place, mm, and its markers without noise.
    fn contact(&self, force_n: f64, place_mm: [f64; 2]) -> (Pose, Observed<'static>) {
        let Film { forward, mounting } = self;
        let force_n = [0.0, 0.0, -force_n as f32];
        let place_mm = place_mm.map(|part| part as f32);
        let pose = Pose::of_force(force_n, place_mm, &forward.stiffness, &forward.limits);
        let tables = &forward.tables;
        let shown = tables.predict(&pose, &forward.limits, &mounting.beside_mm);
        let noise = forward.noise.at_rest_px.map(|part| mounting.scale() * part);
        let variances = noise.map(|noise| noise * noise);
        let observed = Observed {
            hanging: None,
            pressing: None,
            wide: None,
            lost: Lost::NONE,
            drift: None,
            moved: shown.moved,
            noise: List::from_fn(tables.dots(), |k| forward.rest_image.noise(k, variances)),
        };
        (pose, observed)
    }
}

/// The coordinates of a place, mm, by its number, which counts row by row.
fn place_mm(number: usize) -> [f64; 2] {
    let at = |k: usize| FARTHEST_MM * (2.0 * k as f64 / (PLACES - 1) as f64 - 1.0);
    [at(number % PLACES), at(number / PLACES)]
}

fn cell(film: &Film<'_>, force_mn: u32, number: usize) -> Cell {
    let Film { forward, mounting } = film;
    let place_mm = place_mm(number);
    let (pose, shown) = film.contact(f64::from(force_mn) * 1e-3, place_mm);
    let mut cell = Cell {
        place_mm,
        ..Cell::default()
    };
    for (marker, way) in (0..4).flat_map(|marker| (0..WAYS).map(move |way| (marker, way))) {
        let turn = std::f32::consts::TAU * way as f32 / WAYS as f32;
        for off_px in OFF_PX {
            let mut observed = shown;
            // In focal lengths.
            let focal = off_px as f32 * mounting.scale();
            observed.moved[2 * marker] += focal * turn.cos();
            observed.moved[2 * marker + 1] += focal * turn.sin();
            let found = forward.estimate(
                &observed,
                mounting,
                forward.unknown(true),
                Start::Near(pose),
            );
            cell.take(forward, &pose, off_px, &found);
        }
    }
    cell
}

impl Cell {
    fn take(&mut self, forward: &Forward<'_>, truth: &Pose, off_px: f64, found: &Estimate) {
        let errors = errors(forward, &found.pose, truth);
        let refused = !found.is_explained() || found.pose.size >= forward.limits.size;
        let matters = found.sigma(&forward.strength(true)).is_none_or(|sigma| {
            let stated = [
                f64::from(sigma.direction).to_degrees(),
                1e3 * f64::from(sigma.magnitude_n),
                f64::from(sigma.place_mm),
            ];
            errors
                .iter()
                .zip(stated)
                .any(|(error, sigma)| *error > SIGMAS * sigma)
        });
        self.matter += u32::from(matters);
        self.refused += u32::from(matters && refused);
        if !refused {
            self.off_px = self.off_px.max(off_px);
            for (worst, error) in self.errors.iter_mut().zip(errors) {
                *worst = worst.max(error);
            }
        }
    }
}

/// Errors of the direction, degrees, of |F|, mN, and of the place, mm.
fn errors(forward: &Forward<'_>, found: &Pose, truth: &Pose) -> [f64; 3] {
    let [a, b] = [found, truth].map(|pose| pose.direction().map(f64::from));
    let [found_n, truth_n] = [found, truth].map(|pose| forward.stiffness.magnitude_n(pose.size));
    let [x, y] = [0, 1].map(|i| f64::from(found.place_mm[i] - truth.place_mm[i]));
    [
        angle_deg(a, b).unwrap_or(180.0),
        1e3 * f64::from(found_n - truth_n).abs(),
        x.hypot(y),
    ]
}

impl Row {
    fn of(force_mn: u32, cells: &[Cell]) -> Row {
        let is_inside = |cell: &&Cell| cell.place_mm.iter().all(|part| part.abs() <= REACH_MM);
        let cells: Vec<&Cell> = cells.iter().filter(is_inside).collect();
        let both = |of: &dyn Fn(&Cell) -> f64| {
            let mut all: Vec<f64> = cells.iter().map(|cell| of(cell)).collect();
            all.sort_by(f64::total_cmp);
            [all[all.len() / 2], all[all.len() - 1]]
        };
        let direction_deg = both(&|cell| cell.errors[0]);
        let worst = cells.iter().find(|cell| cell.errors[0] >= direction_deg[1]);
        let sum = |of: fn(&Cell) -> u32| f64::from(cells.iter().map(|cell| of(cell)).sum::<u32>());
        Row {
            force_mn,
            refused: 100.0 * sum(|cell| cell.refused) / sum(|cell| cell.matter),
            off_px: both(&|cell| cell.off_px),
            direction_deg,
            magnitude_mn: both(&|cell| cell.errors[1]),
            place_mm: both(&|cell| cell.errors[2]),
            at_mm: worst.map_or([0.0; 2], |cell| cell.place_mm),
        }
    }

    fn line(&self) -> String {
        let Row {
            force_mn,
            refused,
            off_px: [off, most_off],
            direction_deg: [angle, most_angle],
            magnitude_mn: [size, most_size],
            place_mm: [far, farthest],
            at_mm: [x, y],
        } = self;
        format!(
            "| {force_mn} mN | {refused:.1} % | {off} px, {most_off} px | {angle:.2}°, \
             {most_angle:.1}° | {size:.2} mN, {most_size:.1} mN | {far:.3} mm, {farthest:.2} mm | \
             ({x}, {y}) mm |\n"
        )
    }
}
