//! `hivtac-calibrate`: from data to a model on the chip.

mod training;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, Parser, Subcommand, ValueEnum};
use hivtac_calibration::check::check;
use hivtac_calibration::collect::CollectCommand;
use hivtac_calibration::conditions::{CentroidName, PixelName, preset};
use hivtac_calibration::dataset::{Dataset, Loads, Recipe, Split, Spread, generate, generate_file};
use hivtac_calibration::evaluate::Evaluation;
use hivtac_calibration::network::Meaning;
use hivtac_calibration::peers::PeersArgs;
use hivtac_calibration::progress::bar;
use hivtac_calibration::quantize::export;
use hivtac_calibration::scene::SceneCommand;
use hivtac_calibration::tradeoff::{Step, TradeoffArgs};
use hivtac_calibration::train::Options;
use hivtac_calibration::weights::{Range, Weights};
use hivtac_scene::Contact;

/// From data to a model on the chip: data sets, training, quantization, a check.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render frames of known forces, let the pipeline look at them, write forces and features as CSV. An interrupted
    /// run goes on where it was.
    Dataset {
        #[command(flatten)]
        recipe: RecipeArgs,
        /// The CSV file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Calibration data from a real unit and a force gauge.
    #[command(subcommand)]
    Collect(CollectCommand),
    /// Train a network on a data set; writes a weights file.
    Train {
        /// The data set.
        #[arg(long)]
        data: PathBuf,
        #[command(flatten)]
        options: training::OptionArgs,
        /// The weights file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Take a network trained in PyTorch, from a safetensors file; writes a weights file.
    Import {
        /// The safetensors file (layout: docs/calibration.md).
        #[arg(long)]
        tensors: PathBuf,
        /// The data set that it was trained on.
        #[arg(long)]
        data: PathBuf,
        /// The weights file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Make the uncertainties of a weights file anew, from a data set that it was not made from; writes a weights file.
    Uncertainty {
        /// The weights file.
        #[arg(long)]
        weights: PathBuf,
        /// The data set: best many sessions (`dataset --sessions 60`).
        #[arg(long)]
        data: PathBuf,
        /// The weights file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Put the nominal film, run forwards, beside the network of a weights file that tells places; the noise of markers is taken
    /// from a data set. Writes a weights file.
    Film {
        /// The weights file.
        #[arg(long)]
        weights: PathBuf,
        /// Presses anywhere (`dataset --reach-mm 4`), 200 and more.
        #[arg(long)]
        data: PathBuf,
        /// Gauss–Newton steps from the network's answer, 0 to 3.
        #[arg(long, default_value_t = 1)]
        steps: u8,
        /// The weights file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Fit a unit's film and camera to a handful of known loads (4 and more, best ten: some tilted, four of them 2 to 3 mm off the
    /// middle, several frames each), and print what was found; writes a weights file for that unit.
    Unit {
        /// A weights file with a film (`film`).
        #[arg(long)]
        weights: PathBuf,
        /// The unit's data set: frames without force, and frames of each load, with its place
        /// (`x_mm`, `y_mm`); without places, all in the film's middle.
        #[arg(long)]
        data: PathBuf,
        /// Standard uncertainty of a load's |F|, N.
        #[arg(long, default_value_t = 0.001)]
        gauge_n: f64,
        /// Standard uncertainty of where the stage's zero is on the film, mm.
        #[arg(long, default_value_t = 0.1)]
        stage_mm: f64,
        /// The weights file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Quantize a weights file; writes a model file. The same weights give the same bytes on every machine.
    Export {
        /// The weights file.
        #[arg(long)]
        weights: PathBuf,
        /// Take the rest position from this data set instead (mean of its frames without force).
        #[arg(long)]
        rest: Option<PathBuf>,
        /// The model file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Measure freshly rendered frames with a model file and print how far its forces are from the truth.
    Check {
        /// The model file.
        #[arg(long)]
        model: PathBuf,
        #[command(flatten)]
        frames: CheckArgs,
    },
    /// Judge a model file on a data set: the paper's figures and numbers as one HTML file.
    Evaluate {
        /// The model file.
        #[arg(long)]
        model: PathBuf,
        /// A data set that it was not made from; best the paper's poses (`dataset --per-pose`).
        #[arg(long)]
        data: PathBuf,
        /// Only what a training with this split did not see.
        #[arg(long, value_enum)]
        held_out: Option<Split>,
        /// The seed of that training.
        #[arg(long, default_value_t = 1, requires = "held_out")]
        training_seed: u64,
        /// The HTML file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// All of this from scratch, for the model that firmware and host tool embed: a tip anywhere within ±4 mm.
    DefaultModel {
        /// Pixel format.
        #[arg(long, value_enum, default_value = "rgb565")]
        format: PixelName,
        /// Where default.weights and default.hvtm go.
        #[arg(long, default_value = "calibration/models")]
        out_dir: PathBuf,
    },
    /// Speed against accuracy: sweep frame sizes, estimators, arithmetics and scans, and write docs/tradeoff.md; or pick the best
    /// under limits. An interrupted sweep goes on.
    Tradeoff(TradeoffArgs),
    /// Compare with the paper's own pipeline (OpenCV, a float network 3×512) on the same rendered frames. What it renders and
    /// trains is kept in a folder: an interrupted run goes on where it was.
    Peers(PeersArgs),
    /// Look at the simulated sensor: frames, its film, what each of its effects does.
    #[command(subcommand)]
    Scene(SceneCommand),
}

#[derive(Args)]
struct RecipeArgs {
    /// Geometry preset: paper or ov7725.
    #[arg(long, default_value = "ov7725")]
    preset: String,
    /// Columns of a frame.
    #[arg(long, default_value_t = 320)]
    width: u16,
    /// Rows of a frame.
    #[arg(long, default_value_t = 240)]
    height: u16,
    /// Pixel format.
    #[arg(long, value_enum, default_value = "rgb565")]
    format: PixelName,
    /// How markers' positions are taken: from all pixels of the mask alike, or weighted with their redness, or with what
    /// stands for it in other formats than RGB565.
    #[arg(long, value_enum, default_value = "redness-weighted")]
    centroid: CentroidName,
    /// What α, β and |F| mean: force (the force on the film), stick (the way of a tip that sticks, and the force along it) or
    /// slip:0.6 (the same, until it slides at that ratio of friction).
    #[arg(long, default_value_t)]
    contact: Contact,
    /// Random loads in each session, besides the frames of the untouched film.
    #[arg(long, default_value_t = 40_000, conflicts_with = "per_pose")]
    samples: usize,
    /// Instead: as many loads for each of the paper's 357 poses.
    #[arg(long)]
    per_pose: Option<usize>,
    /// Which of those poses: all, or the four fifths or the fifth that comparisons train on and hold out.
    #[arg(long, value_enum, default_value_t, requires = "per_pose")]
    poses: PosesArg,
    /// Frames of the untouched film in each session.
    #[arg(long, default_value_t = Recipe::default().rest)]
    rest: usize,
    /// Largest force, N.
    #[arg(long, default_value_t = Recipe::default().range.force_n)]
    force_n: f64,
    /// Largest |α|, degrees.
    #[arg(long, default_value_t = Recipe::default().range.alpha_deg)]
    alpha_deg: f64,
    /// Largest |β|, degrees.
    #[arg(long, default_value_t = Recipe::default().range.beta_deg)]
    beta_deg: f64,
    /// The tip presses anywhere up to this far from the film's middle along x and y, mm, and rows say
    /// where; 0: the middle.
    #[arg(long, default_value_t = 0.0, conflicts_with_all = ["per_pose", "offset_mm"])]
    reach_mm: f64,
    /// Sessions: the first is nominal, the others are built, mounted, lit, focused and pressed a little differently.
    #[arg(long, default_value_t = 1)]
    sessions: usize,
    /// In all sessions but the first, each marker is glued up to this far from its place along x and y, mm.
    #[arg(long, default_value_t = Spread::default().glue_mm)]
    glue_mm: f64,
    /// In all sessions but the first, the tip touches the film up to this far from its middle along x and y, mm.
    #[arg(long, default_value_t = Spread::default().offset_mm)]
    offset_mm: f64,
    /// Decides forces, sessions and noise.
    #[arg(long = "data-seed", visible_alias = "seed", default_value_t = 1)]
    data_seed: u64,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum PosesArg {
    #[default]
    All,
    Training,
    HeldOut,
}

#[derive(Args)]
struct CheckArgs {
    /// Frames to render.
    #[arg(long, default_value_t = 4000)]
    samples: usize,
    /// Decides forces and noise; use another seed than the training data's.
    #[arg(long, default_value_t = 1_000_001)]
    seed: u64,
    /// Friction ratio of the frames for a model of the contact reading `slip`, whose file does not hold it.
    #[arg(long, default_value_t = 0.6)]
    friction: f64,
}

impl RecipeArgs {
    fn recipe(&self) -> Result<Recipe> {
        Ok(Recipe {
            preset: preset(&self.preset)?,
            width: self.width,
            height: self.height,
            format: self.format,
            centroid: self.centroid,
            contact: self.contact,
            loads: match self.per_pose {
                Some(each) => match self.poses {
                    PosesArg::All => Loads::PaperPoses(each),
                    PosesArg::Training => Loads::TrainingPoses(each),
                    PosesArg::HeldOut => Loads::HeldOutPoses(each),
                },
                None => Loads::Random(self.samples),
            },
            rest: self.rest,
            range: Range {
                force_n: self.force_n,
                alpha_deg: self.alpha_deg,
                beta_deg: self.beta_deg,
                place_mm: self.reach_mm,
            },
            sessions: self.sessions,
            spread: Spread {
                glue_mm: self.glue_mm,
                offset_mm: self.offset_mm,
            },
            seed: self.data_seed,
        })
    }
}

fn main() -> Result<()> {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    match Cli::parse().command {
        Command::Dataset { recipe, out } => rendered(&recipe.recipe()?, Some(&out)).map(drop),
        Command::Collect(command) => command.run(),
        Command::Train { data, options, out } => options.train(&Dataset::load(&data)?)?.save(&out),
        Command::Import { tensors, data, out } => {
            training::import(&Dataset::load(&data)?, &tensors)?.save(&out)
        }
        Command::Uncertainty { weights, data, out } => {
            training::judged(Weights::load(&weights)?, &Dataset::load(&data)?)?.save(&out)
        }
        Command::Film {
            weights,
            data,
            steps,
            out,
        } => {
            let weights = Weights::load(&weights)?;
            weights.with_film(steps, &Dataset::load(&data)?)?.save(&out)
        }
        Command::Unit {
            weights,
            data,
            gauge_n,
            stage_mm,
            out,
        } => {
            let weights = Weights::load(&weights)?;
            let (weights, fit) = weights.for_unit(&Dataset::load(&data)?, gauge_n, stage_mm)?;
            print!("{fit}");
            weights.save(&out)
        }
        Command::Export { weights, rest, out } => export_file(&weights, rest.as_deref(), &out),
        Command::Evaluate {
            model,
            data,
            held_out,
            training_seed,
            out,
        } => {
            let split = held_out.map(|split| (split, training_seed));
            evaluate_file(&model, &data, split, &out)
        }
        Command::Check { model, frames } => check_file(&model, &frames),
        Command::DefaultModel { format, out_dir } => default_model(format, &out_dir),
        Command::Tradeoff(args) => args.run(sweep_bars),
        Command::Peers(args) => args.run(),
        Command::Scene(command) => command.run(),
    }
}

fn rendered(recipe: &Recipe, out: Option<&Path>) -> Result<Dataset> {
    let bar = bar("rendering", recipe.rows());
    let dataset = match out {
        Some(out) => generate_file(recipe, out, |rows| bar.inc(rows))?,
        None => generate(recipe, || bar.inc(1))?,
    };
    bar.finish_and_clear();
    let rejected = dataset.rejected();
    println!(
        "data set: {} frames, {} rejected; contact reading `{}`",
        dataset.rows.len(),
        rejected.values().sum::<usize>(),
        dataset.about.conditions.contact
    );
    rejected
        .iter()
        .for_each(|(status, count)| println!("  {status}: {count}"));
    Ok(dataset)
}

fn export_file(weights: &Path, rest: Option<&Path>, out: &Path) -> Result<()> {
    let mut weights = Weights::load(weights)?;
    if let Some(data) = rest {
        weights.rest = Dataset::load(data)?.rest()?;
    }
    let bytes = export(&weights)?;
    fs::write(out, &bytes).with_context(|| format!("cannot write {}", out.display()))?;
    println!("wrote {} ({} bytes)", out.display(), bytes.len());
    Ok(())
}

fn evaluate_file(
    model: &Path,
    data: &Path,
    held_out: Option<(Split, u64)>,
    out: &Path,
) -> Result<()> {
    let bytes = fs::read(model).with_context(|| format!("cannot read {}", model.display()))?;
    let evaluation = Evaluation::of(&bytes, &Dataset::load(data)?, held_out)
        .with_context(|| format!("cannot judge {} on {}", model.display(), data.display()))?;
    fs::write(out, evaluation.to_html())
        .with_context(|| format!("cannot write {}", out.display()))?;
    println!("{evaluation}\nwrote {}", out.display());
    Ok(())
}

fn check_file(model: &Path, args: &CheckArgs) -> Result<()> {
    let bytes = fs::read(model).with_context(|| format!("cannot read {}", model.display()))?;
    let bar = bar("checking", args.samples);
    let report = check(&bytes, args.samples, args.seed, args.friction, || {
        bar.inc(1)
    })
    .with_context(|| format!("cannot check {}", model.display()))?;
    bar.finish_and_clear();
    println!("{report}");
    Ok(())
}

fn default_model(format: PixelName, out_dir: &Path) -> Result<()> {
    let (weights, model) = (
        out_dir.join("default.weights"),
        out_dir.join("default.hvtm"),
    );
    let recipe = Recipe {
        format,
        loads: Loads::Random(80_000),
        range: Range {
            force_n: 0.25,
            alpha_deg: 10.0,
            beta_deg: 10.0,
            place_mm: 4.2,
        },
        ..Recipe::default()
    };
    let film = Recipe {
        loads: Loads::Random(6_000),
        seed: 5,
        ..recipe
    };
    let options = Options {
        meaning: Meaning::ForceAndPlace,
        epochs: 400,
        rounded_epochs: 300,
        direction_weight: Some(3.0),
        ..Options::default()
    };
    let network = training::run(&rendered(&recipe, None)?, Split::default(), &options, None)?;
    network
        .with_film(1, &rendered(&film, None)?)?
        .save(&weights)?;
    export_file(&weights, None, &model)?;
    let frames = CheckArgs {
        samples: 4000,
        seed: 1_000_001,
        friction: 0.6,
    };
    check_file(&model, &frames)
}

/// What to call at every step of so many frames and trainings.
fn sweep_bars([frames, trainings]: [usize; 2]) -> impl Fn(Step) + Sync {
    let (rendering, training) = (bar("rendering", frames), bar("training", trainings));
    move |step| match step {
        Step::Frame => rendering.inc(1),
        Step::Training => training.inc(1),
    }
}
