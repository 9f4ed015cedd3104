//! The commands that make weights files: a network, its film, a unit's own.

use std::path::PathBuf;

use anyhow::{Result, bail, ensure};
use clap::Args;
use hivtac_calibration::data::dataset::Dataset;
use hivtac_calibration::evaluation::errors::{Errors, WEAK_N};
use hivtac_calibration::fit::fit;
use hivtac_calibration::forward::Known;
use hivtac_calibration::network::Meaning;
use hivtac_calibration::progress::bar;
use hivtac_calibration::train::Options;
use hivtac_calibration::unit::GuideArgs;
use hivtac_calibration::weights::Weights;

/// Options of `train`.
#[derive(Args)]
pub struct TrainArgs {
    /// The data set.
    #[arg(long)]
    data: PathBuf,
    #[command(flatten)]
    options: Options,
    /// The weights file to write.
    #[arg(long)]
    out: PathBuf,
}

impl TrainArgs {
    pub fn run(self) -> Result<()> {
        let (dataset, anywhere) = Dataset::load(&self.data)?.without_free();
        if anywhere > 0 {
            println!(
                "{anywhere} frames of presses anywhere are left out: no network learns directions \
                 or places that nobody noted"
            );
            ensure!(
                dataset.rows.iter().any(|row| row.force_n != [0.0; 3]),
                "nothing else is in {}: train on poses that a stage set",
                self.data.display()
            );
        }
        let options = Options {
            meaning: match dataset.knows_places() {
                true => Meaning::ForceAndPlace,
                false => Meaning::ForceVector,
            },
            ..self.options
        };
        trained(&dataset, &options)?.save(&self.out)
    }
}

/// Trains, and prints the errors on held-out rows.
pub fn trained(dataset: &Dataset, options: &Options) -> Result<Weights> {
    let bar = bar("training", options.epochs + options.rounded_epochs);
    let fitted = fit(dataset, options, |progress| {
        bar.inc(1);
        let phase = if progress.rounded {
            "with rounding"
        } else {
            "in floats"
        };
        bar.set_message(format!("loss {:.5} {phase}", progress.loss));
    })?;
    bar.finish_and_clear();
    println!("contact reading `{}`", fitted.weights.conditions.contact);
    print_errors("held-out rows, floats", &fitted.float);
    print_errors("held-out rows, quantized", &fitted.quantized);
    Ok(fitted.weights)
}

fn print_errors(what: &str, errors: &Errors) {
    let place = errors.place_rmse_mm().map_or(String::new(), |mm| {
        format!(", RMSE of the place {:.0} µm along x and y each", mm * 1e3)
    });
    println!(
        "{what}: {} rows, mean direction error {:.3}° ({:.3}° from {} mN up), RMSE of |F| {:.3} \
         mN{}",
        errors.count(),
        errors.mean_direction_deg(),
        errors.mean_strong_direction_deg(),
        WEAK_N * 1e3,
        errors.magnitude_rmse_n() * 1e3,
        place,
    );
}

/// Options of `film`.
#[derive(Args)]
pub struct FilmArgs {
    /// The weights file.
    #[arg(long)]
    weights: PathBuf,
    /// Presses anywhere (`dataset --samples 6000 --seed 5`), 200 and more; without them the film's
    /// tables stay.
    #[arg(long, required_unless_present = "others")]
    data: Option<PathBuf>,
    /// Gauss–Newton steps from the network's answer, 0 to 3.
    #[arg(long, default_value_t = 1)]
    steps: u8,
    /// Solve the films of other units anew, some minutes; otherwise the weights file's data on them
    /// stay.
    #[arg(long)]
    others: bool,
    /// The weights file to write.
    #[arg(long)]
    out: PathBuf,
}

impl FilmArgs {
    pub fn run(&self) -> Result<()> {
        let mut weights = Weights::load(&self.weights)?;
        if let Some(data) = &self.data {
            weights = weights.with_film(self.steps, &Dataset::load(data)?)?;
        }
        if self.others {
            weights = weights.with_others()?;
        }
        weights.save(&self.out)
    }
}

/// Options of `unit`.
#[derive(Args)]
pub struct UnitArgs {
    #[command(flatten)]
    guide: GuideArgs,
    /// A weights file with a film (`calibration/models/default.weights`, which `--into` begins with
    /// when none is named).
    #[arg(long, required_unless_present = "into")]
    weights: Option<PathBuf>,
    /// The weights of the same unit with its old film, when only the film was swapped: its camera
    /// and its dots are known, and three loads are enough.
    #[arg(long, value_name = "WEIGHTS")]
    from: Option<PathBuf>,
    /// Fit to this data set of the unit: frames without force, and frames of each load, with its
    /// place (`x_mm`, `y_mm`); without places, all in the film's middle, or where the data set says
    /// so, pressed anywhere.
    #[arg(
        long,
        required_unless_present = "into",
        conflicts_with = "into",
        requires = "out"
    )]
    data: Option<PathBuf>,
    /// Standard uncertainty of a load's |F|, N.
    #[arg(long, default_value_t = 0.001)]
    gauge_n: f64,
    /// Standard uncertainty of where the stage's zero is on the film, mm.
    #[arg(long, default_value_t = 0.1)]
    stage_mm: f64,
    /// Standard uncertainty of each place, besides that of the stage's zero, mm: 0 with a stage,
    /// some tenths where a place was found by eye.
    #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = length)]
    place_mm: f64,
    /// The weights file to write; with `--into` it is `unit.weights` there, and the model is
    /// `unit.hvtm`.
    #[arg(long, requires = "data")]
    out: Option<PathBuf>,
}

fn length(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(mm) if (0.0..=10.0).contains(&mm) => Ok(mm),
        _ => Err("a number of millimetres from 0 to 10 is needed".to_owned()),
    }
}

impl UnitArgs {
    pub fn run(&self) -> Result<()> {
        let from = self.from.as_deref().map(Weights::load).transpose()?;
        let known = Known {
            gauge_n: self.gauge_n,
            stage_mm: self.stage_mm,
            place_mm: self.place_mm,
            from: from.as_ref(),
        };
        let (weights, data, out) = match (self.guide.folder(), &self.weights, &self.data, &self.out)
        {
            (Some(into), weights, ..) => return self.guide.lead(into, weights.as_deref(), known),
            (None, Some(weights), Some(data), Some(out)) => (weights, data, out),
            _ => bail!("--weights, --data and --out are needed, or --into"),
        };
        let dataset = Dataset::load(data)?;
        let (weights, fit) = Weights::load(weights)?.for_unit(&dataset, known)?;
        print!("{fit}");
        weights.save(out)
    }
}
