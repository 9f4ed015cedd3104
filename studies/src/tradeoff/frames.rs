//! The frames of a sweep: rendered once for each size, seen with both centroid estimators, kept as
//! data sets.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, ensure};
use hivtac_calibration::data::dataset::{
    Dataset, Loads, Observation, Recipe, Row, measure, reasons,
};
use hivtac_calibration::network::{INPUTS, Layer, Meaning, Network, Standardization};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::{Training, Uncertainty, Weights};
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::threshold::ByteOrder;
use hivtac_twin::Frame;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::plan::{CENTROIDS, Plan, RENDERED, preset};

/// Frames of one size, as both estimators see them.
pub struct Frames {
    /// In the order of [`CENTROIDS`].
    pub datasets: [Dataset; 2],
    /// Of them.
    pub seen: FrameTally,
}

/// What became of the frames of one size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameTally {
    /// Frames with a load.
    pub frames: usize,
    /// Those without a force, by the estimator.
    pub rejected: [usize; 2],
    /// Over all features: the same frames have the same.
    pub fingerprint: u64,
}

/// What an estimator makes of a frame, and whether windows make the same of it.
type EstimatorResult = Result<Observation, String>;

/// A frame's force, N, where its tip touches the film, mm, and what both estimators make of it.
struct Looked {
    force_n: [f64; 3],
    tip_mm: Option<[f64; 2]>,
    looks: [EstimatorResult; 2],
}

/// The frames of a size, from `folder` or rendered into it. `progress` is called for each, from any
/// thread.
///
/// # Errors
/// When the folder holds something else or cannot be written, or the scene cannot be rendered.
pub fn frames(
    plan: &Plan,
    size: [u16; 2],
    folder: &Path,
    progress: impl Fn() + Sync,
) -> Result<Frames> {
    let recipes = CENTROIDS.map(|centroid| recipe(plan, size, centroid));
    let files = [0, 1].map(|i| file(folder, &recipes[i]));
    let mark = folder.join(format!("{}x{}.json", size[0], size[1]));
    if let Ok(text) = fs::read_to_string(&mark) {
        let seen: FrameTally = serde_json::from_str(&text)?;
        let datasets = [Dataset::load(&files[0])?, Dataset::load(&files[1])?];
        let same = |i: usize| -> Result<bool> { Ok(datasets[i].about == recipes[i].about()?) };
        ensure!(
            same(0)? && same(1)? && fingerprint(&datasets) == seen.fingerprint,
            "{} holds other frames: remove it, or use another folder",
            folder.display()
        );
        return Ok(Frames { datasets, seen });
    }
    let frames = rendered(&recipes, progress)?;
    for (dataset, file) in frames.datasets.iter().zip(&files) {
        dataset.save(file)?;
    }
    // Written last: it says that the others are whole.
    fs::write(&mark, serde_json::to_string(&frames.seen)?)?;
    Ok(frames)
}

fn recipe(plan: &Plan, [width, height]: [u16; 2], centroid: CentroidEstimator) -> Recipe {
    Recipe {
        preset: preset([width, height]),
        width,
        height,
        centroid,
        loads: Loads::Random(plan.rows),
        range: RENDERED,
        ..Recipe::default()
    }
}

fn file(folder: &Path, recipe: &Recipe) -> PathBuf {
    let centroid = match recipe.centroid {
        CentroidEstimator::BinaryMask => "binary",
        CentroidEstimator::RednessWeighted => "weighted",
    };
    folder.join(format!("{}x{}-{centroid}.csv", recipe.width, recipe.height))
}

fn rendered(recipes: &[Recipe; 2], progress: impl Fn() + Sync) -> Result<Frames> {
    let [recipe, _] = recipes;
    let looks = look(recipes, 0..recipe.rest, [None; 2], &progress)?;
    let mut datasets = [dataset(&recipes[0])?, dataset(&recipes[1])?];
    add(&mut datasets, recipe, looks)?;
    // As the chip is tared, so that what is judged by the rest position is.
    let files = [anything(&datasets[0])?, anything(&datasets[1])?];
    let [a, b] = files.each_ref().map(|file| Model::parse(file));
    let models = [a, b].map(|model| model.ok());
    let looks = look(recipes, recipe.rest..recipe.rows(), models, &progress)?;
    add(&mut datasets, recipe, looks)?;
    let rejected = |dataset: &Dataset| dataset.rejected().values().sum();
    let seen = FrameTally {
        frames: recipe.rows() - recipe.rest,
        rejected: [rejected(&datasets[0]), rejected(&datasets[1])],
        fingerprint: fingerprint(&datasets),
    };
    Ok(Frames { datasets, seen })
}

fn dataset(recipe: &Recipe) -> Result<Dataset> {
    Ok(Dataset {
        about: recipe.about()?,
        rows: Vec::new(),
    })
}

/// Renders rows and looks at each with both estimators.
fn look(
    recipes: &[Recipe; 2],
    rows: std::ops::Range<usize>,
    models: [Option<Model<'_>>; 2],
    progress: impl Fn() + Sync,
) -> Result<Vec<Looked>> {
    let scene = recipes[0].scene(0)?;
    let eyes = || -> Result<[Box<Sensor<'_>>; 2]> {
        Ok([eye(&recipes[0], models[0])?, eye(&recipes[1], models[1])?])
    };
    let looks = rows.into_par_iter().map_init(eyes, |eyes, row| {
        let eyes = eyes.as_mut().map_err(|error| anyhow!("{error}"))?;
        let frame = scene.render_load(&recipes[0].load(row)?, row as u64)?;
        progress();
        let looks = eyes.each_mut().map(|eye| look_once(eye, &frame));
        Ok(Looked {
            force_n: frame.truth.force.vector_n(),
            tip_mm: frame.truth.touches_mm,
            looks,
        })
    });
    looks.collect()
}

/// A model of a data set's conditions and rest position that tells a place. What is refused depends
/// on nothing else: it answers nothing but zeros.
fn anything(dataset: &Dataset) -> Result<Vec<u8>> {
    let outputs = Meaning::ForceAndPlace.outputs();
    let even = |numbers: usize| Standardization {
        mean: vec![0.0; numbers],
        sigma: vec![1.0; numbers],
    };
    export(&Weights {
        format: Weights::format(),
        conditions: dataset.about.conditions.clone(),
        rest: dataset.rest()?,
        range: RENDERED,
        uncertainty: Uncertainty::default(),
        training: Training::default(),
        film: None,
        network: Network {
            meaning: Meaning::ForceAndPlace,
            input: even(INPUTS),
            output: even(outputs),
            layers: vec![Layer {
                weights: vec![vec![0.0; INPUTS]; outputs],
                bias: vec![0.0; outputs],
            }],
            ..Network::default()
        },
    })
}

fn eye<'m>(recipe: &Recipe, model: Option<Model<'m>>) -> Result<Box<Sensor<'m>>> {
    let geometry = Geometry::preset(recipe.preset, recipe.width, recipe.height);
    let settings = Settings {
        centroid: recipe.centroid,
        ..Settings::usual(geometry, ByteOrder::Native)
    };
    let mut sensor = Box::new(Sensor::new());
    sensor
        .configure(settings, model)
        .map_err(|error| anyhow!("{error}"))?;
    sensor.set_tare(model.map(|model| model.rest), Drift::NONE);
    Ok(sensor)
}

fn look_once(sensor: &mut Sensor<'_>, frame: &Frame) -> EstimatorResult {
    observation(&measure(sensor, frame))
}

/// What the chip would take a force from.
fn observation(measurement: &Measurement) -> Result<Observation, String> {
    let why = reasons(measurement.status);
    match (measurement.markers, measurement.features) {
        (Some(markers), Some(features)) if why.is_empty() => Ok(Observation {
            features_q16: Features::to_array(&features),
            areas_px: markers.map(|marker| marker.area),
        }),
        _ => Err(why),
    }
}

fn add(datasets: &mut [Dataset; 2], recipe: &Recipe, looked: Vec<Looked>) -> Result<()> {
    for Looked {
        force_n,
        tip_mm,
        looks,
    } in looked
    {
        let place = recipe.place(datasets[0].rows.len());
        for (i, seen) in looks.into_iter().enumerate() {
            datasets[i].rows.push(Row {
                place,
                force_n,
                tip_mm,
                clock_n: None,
                seen,
            });
        }
    }
    Ok(())
}

/// FNV-1a over all features.
fn fingerprint(datasets: &[Dataset; 2]) -> u64 {
    let rows = datasets.iter().flat_map(|dataset| &dataset.rows);
    let numbers = rows.flat_map(|row| {
        let seen = row.seen.as_ref();
        seen.map_or([Q::default(); 11], |seen| seen.features_q16)
    });
    numbers
        .flat_map(|number| number.bits().to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}
