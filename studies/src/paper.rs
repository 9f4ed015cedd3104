//! Compares the paper's pipeline, extended by the place as two more outputs, with the project's
//! own, on the same frames of 800×600.

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::data::dataset::{Dataset, Loads, Observation, Recipe, generate};
use hivtac_calibration::data::loads::norm;
use hivtac_calibration::data::range::Range;
use hivtac_calibration::evaluation::answer::Chip;
use hivtac_calibration::fit::fit;
use hivtac_calibration::network::{Arithmetic, Meaning};
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::Options as Training;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::status::Status;
use serde::Serialize;

use crate::page;
use crate::press::{self, Errors, FORCES_MN, REACH_MM};

/// Columns and rows.
const SIZE: [u16; 2] = [800, 600];
/// Gauss–Newton steps from the answer of the project's network.
const STEPS: u8 = 1;
/// The seed of the test frames.
const TEST_SEED: u64 = 77;
/// Largest relative difference from a force for which a frame counts.
const NEAR: f64 = 0.2;

/// Train the paper's network on the paper's centroids, force and place, and judge it beside ours on
/// the same frames.
#[derive(Args)]
pub struct Paper {
    /// Frames that networks are trained on.
    #[arg(long, default_value_t = 8000)]
    frames: usize,
    /// Passes of the paper's network over them; the paper's has 100.
    #[arg(long, default_value_t = 40)]
    epochs: usize,
    /// Frames that are judged.
    #[arg(long, default_value_t = 2000)]
    judged: usize,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// A force and the place of its tip, N and mm.
type Answer = ([f64; 3], [f64; 2]);

/// A frame's true answer and a pipeline's answer; `None` if it refuses the frame.
struct Judged {
    truth: Answer,
    found: Option<Answer>,
}

/// The errors of a pipeline near a force.
#[derive(Serialize)]
struct Row {
    pipeline: &'static str,
    #[serde(flatten)]
    of: press::Row,
}

impl Paper {
    /// Runs the study.
    pub fn run(&self) -> Result<()> {
        let theirs = self.theirs()?;
        let ours = self.ours()?;
        // Frames that one of the pipelines refuses count for neither.
        let both = || {
            let both = theirs.iter().zip(&ours);
            both.filter(|(theirs, ours)| theirs.found.is_some() && ours.found.is_some())
        };
        let near = |judged: &[&Judged]| FORCES_MN.map(|force_mn| row(force_mn, judged));
        let of_theirs = near(&both().map(|(theirs, _)| theirs).collect::<Vec<_>>());
        let of_ours = near(&both().map(|(_, ours)| ours).collect::<Vec<_>>());
        let named = |pipeline| move |of| Row { pipeline, of };
        let rows = of_theirs.into_iter().map(named("the paper's"));
        let rows: Vec<Row> = rows.chain(of_ours.map(named("ours"))).collect();
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = String::from(
            "| pipeline | force | direction, rms | \\|F\\|, rms | place, rms | frames \
             |\n|---|--:|--:|--:|--:|--:|\n",
        );
        for Row { pipeline, of } in &rows {
            text += &format!(
                "| {pipeline} | {} mN | {:.3}° | {:.3} mN | {:.1} µm | {} |\n",
                of.force_mn, of.direction_deg, of.magnitude_mn, of.place_um, of.frames
            );
        }
        let refused = |all: &[Judged]| all.iter().filter(|one| one.found.is_none()).count();
        text += &format!(
            "\nOf {} frames, the paper's pipeline refused {}, ours {}.\n",
            theirs.len(),
            refused(&theirs),
            refused(&ours)
        );
        print!("{text}");
        page::write("paper.md", include_str!("paper.md"), &text)
    }

    /// The paper's pipeline: plain means of masks, and a network of three layers of 512 in floats.
    fn theirs(&self) -> Result<Vec<Judged>> {
        let training = dataset(CentroidEstimator::BinaryMask, self.frames, 1)?;
        let options = Training {
            hidden: vec![512; 3],
            meaning: Meaning::ForceAndPlace,
            arithmetic: Arithmetic::Int16,
            epochs: self.epochs,
            rounded_epochs: 0,
            learning_rate: 1e-3,
            batch: 64,
            whitened: false,
            direction_weight: None,
            ..Training::default()
        };
        let weights = fit(&training, &options, |_| ())?.weights;
        let test = dataset(CentroidEstimator::BinaryMask, self.judged, TEST_SEED)?;
        Ok(judged(&test, |row| {
            let features = row.features_px();
            let network = weights.network.as_ref()?;
            Some((network.force_n(&features), network.place_mm(&features)?))
        }))
    }

    /// The project's pipeline: weighted centroids, a small network and steps, as the chip computes
    /// them.
    fn ours(&self) -> Result<Vec<Judged>> {
        let bytes = export(&small(self.frames)?)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let test = dataset(CentroidEstimator::RednessWeighted, self.judged, TEST_SEED)?;
        let mut chip = Chip::new(model, &test.rest()?)?;
        Ok(judged(&test, |row| {
            let (force, status) = chip.force(row).ok()?;
            let place = force.place?;
            let force_n = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
            let place_mm = [place.x, place.y].map(|part| f64::from(part.0) * 1e-3);
            (!status.contains(Status::UNEXPLAINED)).then_some((force_n, place_mm))
        }))
    }
}

/// A small network with the nominal film, trained on `frames` frames.
fn small(frames: usize) -> Result<Weights> {
    let dataset = dataset(CentroidEstimator::RednessWeighted, frames, 1)?;
    let options = Training {
        hidden: vec![32, 32],
        meaning: Meaning::ForceAndPlace,
        epochs: 150,
        rounded_epochs: 100,
        direction_weight: None,
        ..Training::default()
    };
    let network = fit(&dataset, &options, |_| ())?.weights;
    network.with_film(STEPS, &dataset)
}

/// A data set of presses anywhere, seen at 800×600.
fn dataset(centroid: CentroidEstimator, frames: usize, seed: u64) -> Result<Dataset> {
    let [width, height] = SIZE;
    let recipe = Recipe {
        width,
        height,
        centroid,
        loads: Loads::Random(frames),
        range: Range {
            force_n: 0.25,
            alpha_deg: 10.0,
            beta_deg: 10.0,
            place_mm: 1.05 * REACH_MM,
        },
        seed,
        ..Recipe::default()
    };
    generate(&recipe, || ())
}

/// The answers of a pipeline for the frames with a press.
fn judged(dataset: &Dataset, mut says: impl FnMut(&Observation) -> Option<Answer>) -> Vec<Judged> {
    let pressed = dataset
        .rows
        .iter()
        .filter_map(|row| Some((row, row.tip_mm?)));
    let judge = pressed.map(|(row, tip_mm)| Judged {
        truth: (row.force_n, tip_mm),
        found: row.seen.as_ref().ok().and_then(&mut says),
    });
    judge.collect()
}

/// Errors near a force.
fn row(force_mn: u32, judged: &[&Judged]) -> press::Row {
    let around_n = f64::from(force_mn) * 1e-3;
    let mut errors = Errors::default();
    for one in judged {
        let (force_n, place_mm) = one.truth;
        let is_inside = place_mm.iter().all(|part| part.abs() <= REACH_MM);
        let is_near = (norm(force_n) - around_n).abs() <= NEAR * around_n;
        if let (Some((found_n, found_mm)), true, true) = (one.found, is_inside, is_near) {
            errors.take((found_n, norm(found_n), found_mm), one.truth, [0.0; 3]);
        }
    }
    errors.row(force_mn)
}
