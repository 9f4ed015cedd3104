//! Guides a person at a bench to a unit's own model: instructions, live numbers, and finally the
//! model and its errors.

mod plan;
mod verdict;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::data::collect::assemble::{DIRECTION_DEG, Gauge, How, assemble};
use crate::data::collect::direction_deg;
use crate::data::collect::folder::{self, Recording};
use crate::data::collect::gauge_port::GaugeArgs;
use crate::data::collect::poses::{self, Task};
use crate::data::collect::record::{self, FreeArgs, RecordArgs, seconds};
use crate::forward::Known;
use crate::quantize::export;
use crate::weights::Weights;
use plan::MOST_LOADS;
use verdict::Verdict;

/// Weights of the models of the simulated sensor, by the number of dots.
const DEFAULT_WEIGHTS: [(usize, &str); 2] = [
    (4, include_str!("../../models/default.weights")),
    (8, include_str!("../../models/8v/default.weights")),
];
/// Files in the recording's folder: the loads, the unit's weights and its model.
const LOADS: &str = "loads.csv";
const WEIGHTS: &str = "unit.weights";
const MODEL: &str = "unit.hvtm";

/// Options of the guided `unit`.
#[derive(Debug, clap::Args)]
pub struct GuideArgs {
    /// Guides through the loads: the folder for the recording and for the unit's model. The same
    /// command goes on where it was interrupted.
    #[arg(long, value_name = "FOLDER")]
    into: Option<PathBuf>,
    /// Port of the sensor: serial port, pseudo-terminal, or tcp:HOST:PORT; found by its USB id when
    /// not given.
    #[arg(long, value_name = "PORT", requires = "into")]
    port: Option<String>,
    /// Longest wait for the sensor's answers and for its next frame, s.
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    timeout: f64,
    /// Other loads than the usual ten: a list of poses as `collect record` takes it, of ten at
    /// most.
    #[arg(long, value_name = "FILE", requires = "into")]
    poses: Option<PathBuf>,
    /// Length of a load, s of the sensor's clock.
    #[arg(long, value_name = "S", default_value_t = 8.0, value_parser = seconds)]
    seconds: f64,
    /// Length of the untouched film before the loads, s.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    rest_seconds: f64,
    #[command(flatten)]
    free: FreeArgs,
    /// Standard uncertainty of the direction of presses anywhere, degrees.
    #[arg(long, value_name = "DEG", default_value_t = DIRECTION_DEG, value_parser = direction_deg)]
    direction_deg: f64,
    #[command(flatten)]
    gauge_port: GaugeArgs,
    /// The gauge's own recording, once all loads are done, as `collect align` takes it.
    #[arg(long, value_name = "FILE", requires = "into")]
    gauge: Vec<PathBuf>,
}

impl GuideArgs {
    /// The folder, if a person is to be guided.
    pub fn folder(&self) -> Option<&Path> {
        self.into.as_deref()
    }

    /// Guides through the remaining loads. When none remains, fits the unit to them.
    ///
    /// # Errors
    /// When sensor, gauge or folder fail; what was recorded before stays. When the loads cannot be
    /// aligned with the gauge, or no unit explains them.
    pub fn lead(&self, into: &Path, weights: Option<&Path>, known: Known<'_>) -> Result<()> {
        let tasks = self.tasks(known.from.is_some())?;
        let weights = weights.map(Weights::load).transpose()?;
        let left =
            || Ok::<_, anyhow::Error>(poses::left(&tasks, &folder::done(into)?, |it| it.pose));
        if !left()?.is_empty() {
            self.record(into, &tasks)?;
        }
        match (left()?.len(), self.free.free) {
            (0, _) => return self.fit(into, weights, known),
            (_, Some(_)) => println!(
                "Pressing anywhere is not done: the same command goes on with the time that is \
                 left."
            ),
            (count, None) => println!(
                "{count} of {} loads are left: the same command goes on with them.",
                tasks.len()
            ),
        }
        Ok(())
    }

    /// The person's tasks: presses anywhere, or loads; fewer loads for a new film in a unit with
    /// known camera.
    fn tasks(&self, is_swapped: bool) -> Result<Vec<Task>> {
        if let Some(task) = self.free.task() {
            return Ok(vec![task]);
        }
        let planned = match &self.poses {
            Some(file) => plan::of_poses(&poses::load(file)?),
            None if is_swapped => plan::swapped(),
            None => plan::usual(),
        };
        ensure!(
            planned.len() <= MOST_LOADS,
            "{} loads are listed: {MOST_LOADS} are enough",
            planned.len()
        );
        Ok(plan::tasks(&planned, self.seconds))
    }

    fn record(&self, into: &Path, tasks: &[Task]) -> Result<()> {
        let args = RecordArgs {
            into: into.to_owned(),
            port: self.port.clone(),
            timeout: self.timeout,
            poses: None,
            seconds: self.seconds,
            free: self.free,
            rest_seconds: self.rest_seconds,
            gauge: self.gauge_port.clone(),
        };
        record::record_tasks(&args, Some(tasks.to_vec()))
    }

    fn fit(&self, into: &Path, weights: Option<Weights>, known: Known<'_>) -> Result<()> {
        let recording = Recording::read(into)?;
        let weights = match weights {
            Some(weights) => weights,
            None => default_weights(recording.conditions.markers)?,
        };
        let gauge = Gauge::of(&self.gauge, self.gauge_port.gauge_unit)?;
        let how = How {
            unit: self.gauge_port.gauge_unit,
            holds: true,
            direction_deg: self.direction_deg,
        };
        let (dataset, report) = assemble(&recording, &gauge, how)?;
        println!("All loads are recorded.\n{report}");
        dataset.save(&into.join(LOADS))?;
        println!("they are in {}", into.join(LOADS).display());
        eprintln!("Fitting the unit, and judging it on loads left out: half a minute or so.");
        let (own, found) = weights.for_unit(&dataset, known)?;
        print!("{found}");
        own.save(&into.join(WEIGHTS))?;
        let model = into.join(MODEL);
        fs::write(&model, export(&own)?)
            .with_context(|| format!("cannot write {}", model.display()))?;
        println!("the unit's model is {}", model.display());
        println!("{}", Verdict::of(&found.left_out));
        println!(
            "Next: give the model to the sensor, `hivtac update model {}`; then `hivtac tare \
             --keep`.",
            model.display()
        );
        Ok(())
    }
}

/// The weights of the simulated sensor with this many dots.
fn default_weights(markers: usize) -> Result<Weights> {
    let known = DEFAULT_WEIGHTS.iter().find(|(of, _)| *of == markers);
    let (_, text) = known.with_context(|| format!("no weights are known for {markers} dots"))?;
    Weights::parse(text)
}
