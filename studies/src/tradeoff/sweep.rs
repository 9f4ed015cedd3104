//! Training and judging: every task of a plan that is not finished yet.

use std::path::Path;
use std::sync::Mutex;

use anyhow::{Context, Result, anyhow, ensure};
use hivtac_calibration::data::dataset::{Dataset, Row};
use hivtac_calibration::data::loads::norm;
use hivtac_calibration::evaluation::answer::Chip;
use hivtac_calibration::evaluation::errors::{WEAK_N, angle_deg};
use hivtac_calibration::fit::fit;
use hivtac_calibration::network::Meaning;
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::{DirectionWeight, Options};
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::model::encode::with_steps;
use hivtac_terms::status::Status;
use rayon::prelude::*;

use super::frames::{Frames, frames};
use super::plan::{CENTROIDS, JUDGED_MM, JUDGED_N, Numbers, Plan, STEPS, Task};
use super::results::{Figures, Finished, Results};

/// Adam's first step and rows that share one, for the paper's network: the paper's.
const PAPER_RATE: f64 = 1e-3;
const PAPER_BATCH: usize = 64;
/// Directions count, those of weak forces more.
const DIRECTION_WEIGHT: DirectionWeight = DirectionWeight {
    mean: 3.0,
    floor_n: 0.01,
};
/// One in so many of the rows to train on tells the noise that a film's file holds.
const NOISE_ROWS: usize = 4;

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
    let noise = thinned(&training, NOISE_ROWS);
    let mut figures = Vec::new();
    for (numbers, weights) in models {
        match numbers {
            Numbers::F32 => figures.push((numbers, 0, floats(&weights, &judged)?)),
            _ => {
                let of_steps = integers(weights, &noise, &judged)?;
                figures.extend(of_steps.map(|(steps, figures)| (numbers, steps, figures)));
            }
        }
    }
    Ok(Finished { figures, task })
}

/// One of so many rows; the untouched film is in all of them.
fn thinned(dataset: &Dataset, one_of: usize) -> Dataset {
    let rest = dataset.about.rest;
    let rows = dataset.rows.iter().enumerate();
    let kept = rows.filter(|(number, _)| *number < rest || number % one_of == 0);
    Dataset {
        about: dataset.about.clone(),
        rows: kept.map(|(_, row)| row.clone()).collect(),
    }
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
    let seed = task.seed as u64;
    let [epochs, rounded_epochs] = plan.epochs_of(estimator);
    let mut options = Options {
        meaning: Meaning::ForceAndPlace,
        hidden: estimator.hidden.clone(),
        epochs,
        rounded_epochs: 0,
        direction_weight: Some(DIRECTION_WEIGHT),
        seed,
        ..Options::default()
    };
    if estimator.is_papers() {
        (options.learning_rate, options.batch) = (PAPER_RATE, PAPER_BATCH);
        options.direction_weight = None;
    }
    let float = fit(training, &options, |_| ())?.weights;
    let mut models = vec![(Numbers::F32, float.clone())];
    for numbers in Numbers::ALL {
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
        models.push((numbers, fit(training, &options, |_| ())?.weights));
    }
    Ok(models)
}

/// Of a model in floats.
fn floats(weights: &Weights, dataset: &Dataset) -> Result<Figures> {
    let answers = dataset.samples().map(|row| {
        let features = row.seen.features_px();
        let found = weights.force_n(&features);
        Answer {
            truth_n: norm(row.force_n),
            found_n: norm(found),
            direction_deg: angle_deg(found, row.force_n).unwrap_or(90.0),
            tip_mm: row.tip_mm,
            place_mm: weights.network.place_mm(&features),
            looks: 0,
            is_refused: false,
        }
    });
    figures(answers)
}

/// Of a model as the chip computes it, to the force that it sends: the network alone, and with
/// steps on the film, of which the markers' noise is that of the rows `noise`.
fn integers(
    weights: Weights,
    noise: &Dataset,
    judged: &Dataset,
) -> Result<[(u8, Figures); STEPS.len()]> {
    let alone = export(&weights)?;
    let film = export(&weights.with_film(1, noise)?)?;
    let mut all = Vec::new();
    for steps in STEPS {
        let stepping = with_steps(&film, steps).context("the film takes no such steps")?;
        let file = if steps == 0 { &alone } else { &stepping };
        all.push((steps, on_the_chip(file, judged)?));
    }
    all.try_into().map_err(|_| anyhow!("as many as steps"))
}

fn on_the_chip(file: &[u8], judged: &Dataset) -> Result<Figures> {
    let model = Model::parse(file).map_err(|error| anyhow!("{error}"))?;
    let mut chip = Chip::new(model, &judged.rest()?)?;
    let mut answers = Vec::new();
    for row in judged.samples() {
        let (force, status, looks) = chip.force_and_looks(row.seen)?;
        let found = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
        let place = force.place.as_ref();
        answers.push(Answer {
            truth_n: norm(row.force_n),
            found_n: norm(found),
            direction_deg: angle_deg(found, row.force_n).unwrap_or(90.0),
            tip_mm: row.tip_mm,
            place_mm: place.map(|place| [place.x, place.y].map(|part| f64::from(part.0) * 1e-3)),
            looks,
            is_refused: status.intersects(Status::NO_FORCE),
        });
    }
    figures(answers.into_iter())
}

/// One force.
struct Answer {
    truth_n: f64,
    found_n: f64,
    direction_deg: f64,
    tip_mm: Option<[f64; 2]>,
    place_mm: Option<[f64; 2]>,
    looks: u8,
    /// Whether no single contact explains the markers: the chip sends no force then.
    is_refused: bool,
}

impl Answer {
    /// Whether the load is one of those that are judged.
    fn counts(&self) -> bool {
        let near = |tip_mm: [f64; 2]| tip_mm.iter().all(|part| part.abs() <= JUDGED_MM);
        self.truth_n > 0.0 && self.truth_n <= JUDGED_N && self.tip_mm.is_none_or(near)
    }

    /// The mean square error of both coordinates of the place, mm².
    fn place_square(&self) -> f64 {
        let (Some(found), Some(truth)) = (self.place_mm, self.tip_mm) else {
            return 0.0;
        };
        [0, 1]
            .map(|axis| (found[axis] - truth[axis]).powi(2))
            .iter()
            .sum::<f64>()
            / 2.0
    }
}

/// Of the forces that are judged.
fn figures(answers: impl Iterator<Item = Answer>) -> Result<Figures> {
    let judged: Vec<Answer> = answers.filter(Answer::counts).collect();
    let (refused, all): (Vec<_>, Vec<_>) = judged.iter().partition(|answer| answer.is_refused);
    let is_strong = |answer: &&Answer| answer.truth_n >= WEAK_N;
    let strong: Vec<&Answer> = all.iter().copied().filter(is_strong).collect();
    ensure!(
        !strong.is_empty(),
        "no frame to judge has a force of {WEAK_N} N or more"
    );
    let mean = |of: &dyn Fn(&Answer) -> f64, answers: &[&Answer]| {
        answers.iter().map(|answer| of(answer)).sum::<f64>() / answers.len() as f64
    };
    let worst = |of: &dyn Fn(&Answer) -> f64, answers: &[&Answer]| {
        rounded(answers.iter().map(|answer| of(answer)).fold(0.0, f64::max))
    };
    let off_mn = |answer: &Answer| 1e3 * (answer.found_n - answer.truth_n).abs();
    let direction = |answer: &Answer| answer.direction_deg;
    Ok(Figures {
        frames: all.len(),
        direction_deg: rounded(mean(&direction, &all)),
        strong_direction_deg: rounded(mean(&direction, &strong)),
        force_rmse_mn: rounded(mean(&|answer| off_mn(answer).powi(2), &all).sqrt()),
        place_rmse_um: rounded(1e3 * mean(&Answer::place_square, &strong).sqrt()),
        worst_direction_deg: worst(&direction, &strong),
        worst_force_mn: worst(&off_mn, &all),
        unexplained: refused.len(),
        looks: rounded(
            judged
                .iter()
                .map(|answer| f64::from(answer.looks))
                .sum::<f64>()
                / judged.len() as f64,
        ),
    })
}

/// To a hundred-thousandth: the file is to be read by people, too.
fn rounded(number: f64) -> f64 {
    (number * 1e5).round() / 1e5
}
