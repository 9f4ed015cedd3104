//! Quickly checks a model file: frames outside its training go through the whole pipeline and are
//! compared with the truth.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::{Result, anyhow, bail, ensure};
use hivtac_sensor::force::Force;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::conditions::ContactReading;
use hivtac_terms::threshold::ByteOrder;
use hivtac_twin::{Contact, Options};
use rayon::prelude::*;

use crate::data::conditions::{layout, meaning};
use crate::data::dataset::{Loads, Recipe, measure, reasons};
use crate::data::range::Range;
use crate::evaluation::errors::{Errors, WEAK_N};

/// The result of a check.
#[derive(Clone, Debug)]
pub struct Report {
    /// The model: its widths and preset, and the meaning of its outputs.
    pub model: String,
    /// Meaning of the frames' labels.
    pub contact: Contact,
    /// Errors of all frames with a force, including those with a warning.
    pub errors: Errors,
    /// Frames without a force, by status.
    pub rejected: BTreeMap<String, usize>,
}

/// Renders `samples` frames of random loads inside the model's calibrated range, and lets the
/// pipeline measure them.
///
/// # Errors
/// When the bytes are not a model, or its conditions cannot be rendered.
pub fn check(
    model: &[u8],
    samples: usize,
    seed: u64,
    progress: impl Fn() + Sync,
) -> Result<Report> {
    let model = Model::parse(model).map_err(|error| anyhow!("not a usable model file: {error}"))?;
    ensure!(
        model.is_simulated(),
        "the model was made from a unit's own data, and `check` renders frames of the simulated \
         sensor: use `evaluate` with data of that unit"
    );
    let recipe = recipe(&model, samples, seed)?;
    let scene = recipe.scene(0)?;
    let options = Options {
        layout: layout(model.rest.areas.len())?,
        ..scene.options().clone()
    };
    let scene = scene.with_options(options)?;
    let eyes = || sensor(&model);
    let measured = (0..samples).into_par_iter().map_init(eyes, |sensor, row| {
        let sensor = sensor.as_mut().map_err(|error| anyhow!("{error}"))?;
        let frame = scene.render_load(&recipe.load(row)?, row as u64)?;
        let measurement = measure(sensor, &frame);
        progress();
        let force = measurement.force.ok_or_else(|| reasons(measurement.status));
        Ok((frame.truth.force, force))
    });
    let mut report = Report {
        model: describe(&model),
        contact: recipe.contact,
        errors: Errors::default(),
        rejected: BTreeMap::new(),
    };
    for (truth, found) in measured.collect::<Result<Vec<_>>>()? {
        match found {
            Ok(found) => {
                report.errors.add(vector_n(found), truth.vector_n());
                // The place of a weak press is too uncertain to count.
                let place = found.place.filter(|_| truth.magnitude_n() >= WEAK_N);
                if let Some(place) = place {
                    let found_mm = [place.x, place.y].map(|part| f64::from(part.0) * 1e-3);
                    report.errors.add_place(found_mm, truth.offset_mm());
                }
            }
            Err(status) => *report.rejected.entry(status).or_default() += 1,
        }
    }
    Ok(report)
}

/// Random loads inside the model's calibrated range.
///
/// # Errors
/// When the model lacks some of the conditions that its frames depend on.
pub fn recipe(model: &Model<'_>, samples: usize, seed: u64) -> Result<Recipe> {
    let geometry = model.conditions.geometry;
    let range = Range {
        force_n: f64::from(model.range.magnitude.0) / 1e6,
        alpha_deg: f64::from(model.range.alpha.0) / 1e3,
        beta_deg: f64::from(model.range.beta.0) / 1e3,
        place_mm: f64::from(model.range.place.0) / 1e3,
    };
    let (width, height) = (geometry.width, geometry.height);
    Ok(Recipe {
        preset: model.conditions.preset,
        width,
        height,
        format: model.conditions.threshold.format(),
        centroid: model.conditions.centroid,
        contact: match model.conditions.contact {
            ContactReading::Force => Contact::Force,
            ContactReading::Stick => Contact::Stick,
            ContactReading::Slip => bail!(
                "the model's contact reading is `slip`, and its file does not hold the friction \
                 ratio: use `evaluate` with data of that ratio"
            ),
        },
        loads: Loads::Random(samples),
        rest: 0,
        range,
        sessions: 1,
        seed,
    })
}

/// A sensor with a model, for rendered frames.
///
/// # Errors
/// When the model is invalid for this sensing.
pub fn sensor<'m>(model: &Model<'m>) -> Result<Box<Sensor<'m>>> {
    let mut sensor = Box::new(Sensor::new());
    let settings = model.conditions.settings(ByteOrder::Native);
    sensor
        .configure(settings, Some(*model))
        .map_err(|error| anyhow!("{error}"))?;
    Ok(sensor)
}

/// The force's vector in N, computed from its angles: valid for every contact reading.
pub fn vector_n(force: Force) -> [f64; 3] {
    let degrees = |angle: i32| (f64::from(angle) / 1e3).to_radians();
    let (sin_a, cos_a) = degrees(force.alpha.0).sin_cos();
    let (sin_b, cos_b) = degrees(force.beta.0).sin_cos();
    [sin_a * cos_b, sin_b, -cos_a * cos_b].map(|part| part * f64::from(force.magnitude.0) / 1e6)
}

fn describe(model: &Model<'_>) -> String {
    let origin = if model.is_simulated() {
        "trained on a simulated sensor"
    } else {
        "calibrated on a unit"
    };
    format!("{} (CRC {:08x}), {origin}", model.name(), model.crc())
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            model,
            contact,
            errors,
            rejected,
        } = self;
        writeln!(f, "model                 {model}")?;
        writeln!(
            f,
            "frames                simulated: the same simulated sensor as in training, other \
             loads and noise"
        )?;
        writeln!(
            f,
            "labels                contact reading `{contact}`: {}",
            meaning(*contact)
        )?;
        writeln!(f, "forces                {}", errors.count())?;
        writeln!(
            f,
            "mean direction error  {:.3}° (angle between vectors)",
            errors.mean_direction_deg()
        )?;
        let (strong, weak) = (errors.strong_count(), WEAK_N * 1e3);
        writeln!(
            f,
            "  |F| ≥ {weak} mN        {:.3}° ({strong} frames)",
            errors.mean_strong_direction_deg()
        )?;
        writeln!(
            f,
            "RMSE of |F|           {:.3} mN",
            errors.magnitude_rmse_n() * 1e3
        )?;
        writeln!(
            f,
            "RMSE of Fx, Fy        {:.3} mN",
            errors.lateral_rmse_n() * 1e3
        )?;
        if let Some(each_mm) = errors.place_rmse_mm() {
            writeln!(
                f,
                "RMSE of place x, y    {:.1} µm from {weak} mN up",
                each_mm * 1e3
            )?;
        }
        write!(
            f,
            "frames without force  {}",
            rejected.values().sum::<usize>()
        )?;
        rejected
            .iter()
            .try_for_each(|(status, count)| write!(f, "\n  {status}: {count}"))
    }
}
