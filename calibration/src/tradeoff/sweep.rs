//! Training and judging: every task of a plan that is not finished yet.

use std::path::Path;
use std::sync::Mutex;

use anyhow::{Result, anyhow, ensure};
use rayon::prelude::*;

use super::frames::{Frames, frames};
use super::plan::{CENTROIDS, Numbers, Plan, Task};
use super::results::{Figures, Finished, Results};
use crate::dataset::{Dataset, Row, Split};
use crate::errors::{WEAK_N, angle_deg, norm};
use crate::evaluate::Evaluation;
use crate::fit::{Kind, fit, fit_closed_form};
use crate::quantize::export;
use crate::train::Options;
use crate::weights::{Range, Weights};

/// Adam's first step and rows that share one, for the paper's network: the paper's.
const PAPER_RATE: f64 = 1e-3;
const PAPER_BATCH: usize = 64;

/// What a sweep tells of its progress.
pub enum Step {
    /// One of so many frames of a size is rendered.
    Frame,
    /// One of so many trainings is finished.
    Training,
}

/// Does what is missing in `results`; frames go into `folder`.
///
/// # Errors
/// When frames or results are of something else, cannot be written, or a training fails.
pub fn sweep(results: &mut Results, folder: &Path, progress: impl Fn(Step) + Sync) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    for size in results.plan.sizes.clone() {
        let tasks = results.missing(size);
        if tasks.is_empty() {
            continue;
        }
        let plan = results.plan.clone();
        let frames = frames(&plan, size, folder, || progress(Step::Frame))?;
        results.saw(size, frames.seen)?;
        let shared = Mutex::new(&mut *results);
        tasks.into_par_iter().try_for_each(|task| {
            let finished = run(&plan, &frames, task)?;
            progress(Step::Training);
            let mut results = shared
                .lock()
                .map_err(|_| anyhow!("another training failed"))?;
            results.add(finished)
        })?;
    }
    results.write()
}

/// One training, and what each arithmetic makes of it.
fn run(plan: &Plan, frames: &Frames, task: Task) -> Result<Finished> {
    let which = CENTROIDS.iter().position(|c| *c == task.centroid);
    let dataset = &frames.datasets[which.unwrap_or(0)];
    ensure!(
        (1..=plan.parts).contains(&task.seed),
        "there are {} parts, and seed {} is to be judged on one of its own",
        plan.parts,
        task.seed
    );
    let [training, judged] = parted(dataset, plan.parts, task.seed);
    let models = models(plan, &training, &task)?;
    let figures = models.iter().map(|(numbers, weights)| {
        let figures = match numbers {
            Numbers::F32 => floats(weights, &judged)?,
            _ => integers(weights, &judged)?,
        };
        Ok((*numbers, figures))
    });
    Ok(Finished {
        figures: figures.collect::<Result<_>>()?,
        task,
    })
}

/// The rows to train on, and those of a seed's own part; both begin with the untouched film.
fn parted(dataset: &Dataset, parts: usize, seed: usize) -> [Dataset; 2] {
    let rest = dataset.about.rest;
    let chosen = |own: bool| {
        let belongs =
            |(number, _): &(usize, &Row)| *number < rest || (number % parts == seed - 1) == own;
        let rows = dataset.rows.iter().enumerate().filter(belongs);
        Dataset {
            about: dataset.about.clone(),
            rows: rows.map(|(_, row)| row.clone()).collect(),
        }
    };
    [chosen(false), chosen(true)]
}

fn models(plan: &Plan, training: &Dataset, task: &Task) -> Result<Vec<(Numbers, Weights)>> {
    let estimator = &task.estimator;
    let (seed, split) = (task.seed as u64, Split::WithinPose);
    if estimator.hidden.is_empty() {
        let weights = fit_closed_form(training, split, seed)?.weights;
        let both = estimator.numbers().iter();
        return Ok(both.map(|&numbers| (numbers, weights.clone())).collect());
    }
    let kind = match estimator.closed_form {
        true => Kind::Both,
        false => Kind::Network,
    };
    let [epochs, rounded_epochs] = plan.epochs_of(estimator);
    let mut options = Options {
        hidden: estimator.hidden.clone(),
        epochs,
        rounded_epochs: 0,
        seed,
        ..Options::default()
    };
    if estimator.is_papers() {
        (options.learning_rate, options.batch) = (PAPER_RATE, PAPER_BATCH);
    }
    let float = fit(training, split, kind, &options, |_| ())?.weights;
    let mut models = vec![(Numbers::F32, float.clone())];
    for &numbers in estimator.numbers() {
        let Some(arithmetic) = numbers.arithmetic() else {
            continue;
        };
        let options = Options {
            epochs: 0,
            rounded_epochs,
            arithmetic,
            start: Some(float.network.clone()),
            ..options.clone()
        };
        models.push((
            numbers,
            fit(training, split, kind, &options, |_| ())?.weights,
        ));
    }
    Ok(models)
}

/// Of a model in floats.
fn floats(weights: &Weights, dataset: &Dataset) -> Result<Figures> {
    let answers = dataset.accepted().map(|(seen, truth)| {
        let found = weights.force_n(&seen.features_px());
        Answer {
            truth_n: norm(truth),
            found_n: norm(found),
            direction_deg: angle_deg(found, truth).unwrap_or(90.0),
        }
    });
    figures(answers)
}

/// Of a model as the chip computes it, to the force that it sends.
fn integers(weights: &Weights, dataset: &Dataset) -> Result<Figures> {
    let evaluation = Evaluation::of(&export(weights)?, dataset, None)?;
    figures(evaluation.judged.iter().map(|judged| Answer {
        truth_n: judged.truth_polar[2],
        found_n: judged.found_polar[2],
        direction_deg: judged.direction_deg,
    }))
}

/// One force.
struct Answer {
    truth_n: f64,
    found_n: f64,
    direction_deg: f64,
}

/// Of the forces within the calibrated range.
fn figures(answers: impl Iterator<Item = Answer>) -> Result<Figures> {
    let range = Range::default().force_n;
    let answers: Vec<Answer> = answers
        .filter(|answer| answer.truth_n > 0.0 && answer.truth_n <= range)
        .collect();
    let strong = || answers.iter().filter(|answer| answer.truth_n >= WEAK_N);
    ensure!(
        strong().count() > 0,
        "no frame to judge has a force of {WEAK_N} N or more"
    );
    let mean = |sum: f64, count: usize| sum / count as f64;
    let off_mn = |answer: &Answer| 1e3 * (answer.found_n - answer.truth_n);
    let square = answers.iter().map(|answer| off_mn(answer).powi(2)).sum();
    let worst = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    Ok(Figures {
        frames: answers.len(),
        direction_deg: rounded(mean(
            answers.iter().map(|answer| answer.direction_deg).sum(),
            answers.len(),
        )),
        strong_direction_deg: rounded(mean(
            strong().map(|answer| answer.direction_deg).sum(),
            strong().count(),
        )),
        force_rmse_mn: rounded(mean(square, answers.len()).sqrt()),
        worst_direction_deg: rounded(worst(&mut strong().map(|answer| answer.direction_deg))),
        worst_force_mn: rounded(worst(
            &mut answers.iter().map(|answer| off_mn(answer).abs()),
        )),
    })
}

/// To a hundred-thousandth: the file is to be read by people, too.
fn rounded(number: f64) -> f64 {
    (number * 1e5).round() / 1e5
}
