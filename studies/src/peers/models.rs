//! The models that are compared.

use anyhow::{Context, Result, anyhow};
use hivtac_calibration::data::dataset::Dataset;
use hivtac_calibration::data::rest::features_from_q16;
use hivtac_calibration::evaluation::check::vector_n;
use hivtac_calibration::fit::fit;
use hivtac_calibration::network::{Arithmetic, Meaning};
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::{DirectionWeight, Options};
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force;
use hivtac_sensor::force::model::Model as Chip;
use hivtac_sensor::force::network::Network;
use hivtac_twin::Contact;

use super::frames::{Frames, Sets};
use super::{PeersArgs, there};
use crate::scene::size::Size;

const SEED: u64 = 1;

/// How a model computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// The paper's: the peer's markers, floats.
    Paper,
    /// The sensing's markers, floats: what quantization starts from.
    Float,
    /// The sensing's markers, the chip's integers.
    Chip,
}

/// One of the models.
pub struct Model {
    pub name: &'static str,
    pub how: How,
    pub weights: Weights,
}

/// True force and answer of each test frame; `None` where there was none to answer to.
pub type Answers = Vec<Option<[[f64; 3]; 2]>>;

impl Model {
    /// What it makes of the test frames.
    pub fn answers(&self, frames: &Frames) -> Result<Answers> {
        match self.how {
            How::Paper => Ok(self.in_floats(&frames.theirs)),
            How::Float => Ok(self.in_floats(&frames.ours)),
            How::Chip => self.in_integers(&frames.ours),
        }
    }

    fn in_floats(&self, sets: &Sets) -> Answers {
        let answer = |row: &hivtac_calibration::data::dataset::Row| {
            let seen = row.seen.as_ref().ok()?;
            Some([row.force_n, self.weights.force_n(&seen.features_px())])
        };
        sets.test.rows.iter().map(answer).collect()
    }

    fn in_integers(&self, sets: &Sets) -> Result<Answers> {
        let bytes = export(&self.weights)?;
        let model = Chip::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let mut network = Network::new();
        let answer = |row: &hivtac_calibration::data::dataset::Row| {
            let Ok(seen) = &row.seen else { return Ok(None) };
            let features = features_from_q16(&seen.features_q16)?;
            let output = network.run(&model, &features, &model.rest.features);
            let (force, _) = force::of_outputs(&model, &output);
            Ok(Some([row.force_n, vector_n(force)]))
        };
        sets.test.rows.iter().map(answer).collect()
    }
}

/// All of them, trained on a size's frames or read from the folder.
pub fn all(args: &PeersArgs, contact: Contact, size: Size, frames: &Frames) -> Result<Vec<Model>> {
    let kept = Kept {
        args,
        contact,
        size,
    };
    let ours = &frames.ours.training;
    let paper = kept.trained(
        &format!("paper-{}-passes", args.epochs),
        &frames.theirs.training,
        &paper(args),
    )?;
    let model = |name, how, weights| Model { name, how, weights };
    let mut models = vec![model("the paper's", How::Paper, paper)];
    for tier in [plain_tier(args), fine_tier(args)] {
        let [float, int16, int8] = tier.files;
        let alone = kept.trained(float, ours, &tier.float)?;
        let rounded = |file, options: &Options| {
            let options = Options {
                start: Some(alone.network.clone()),
                ..options.clone()
            };
            kept.trained(file, ours, &options)
        };
        let (int16, int8) = (rounded(int16, &tier.int16)?, rounded(int8, &tier.int8)?);
        let rows = [(How::Float, alone), (How::Chip, int16), (How::Chip, int8)];
        let named = tier.names.into_iter().zip(rows);
        models.extend(named.map(|(name, (how, weights))| model(name, how, weights)));
    }
    Ok(models)
}

/// The weights files of one reading and size.
struct Kept<'a> {
    args: &'a PeersArgs,
    contact: Contact,
    size: Size,
}

impl Kept<'_> {
    /// A network of this name, from the folder or trained.
    fn trained(&self, name: &str, data: &Dataset, options: &Options) -> Result<Weights> {
        let file = format!("{name}.weights");
        let path = self.args.file(self.contact, self.size, &file);
        if there(&path) {
            return Weights::load(&path);
        }
        println!("training {}", path.display());
        let fitted =
            fit(data, options, |_| ()).with_context(|| format!("training {}", path.display()))?;
        fitted.weights.save(&path)?;
        Ok(fitted.weights)
    }
}

/// The paper's network (its Section 6).
fn paper(args: &PeersArgs) -> Options {
    Options {
        hidden: args.hidden.clone(),
        meaning: Meaning::AnglesMagnitude,
        arithmetic: Arithmetic::Int16,
        epochs: args.epochs,
        rounded_epochs: 0,
        learning_rate: 1e-3,
        batch: 64,
        whitened: false,
        seed: SEED,
        ..Options::default()
    }
}

/// A network of ours in floats, and what it becomes on the chip.
struct Tier {
    /// In the tables: floats, int16, int8.
    names: [&'static str; 3],
    files: [&'static str; 3],
    float: Options,
    int16: Options,
    int8: Options,
}

/// Floats, with the trainer's defaults.
fn plain(args: &PeersArgs) -> Options {
    Options {
        arithmetic: Arithmetic::Int16,
        epochs: args.our_epochs,
        rounded_epochs: 0,
        direction_weight: None,
        seed: SEED,
        ..Options::default()
    }
}

/// As the default model is trained, only longer.
fn plain_tier(args: &PeersArgs) -> Tier {
    let float = plain(args);
    let int16 = Options {
        epochs: 0,
        rounded_epochs: args.our_rounded_epochs,
        ..float.clone()
    };
    Tier {
        names: ["64-64 float", "64-64 int16", "64-64 int8"],
        files: ["64-64-float", "64-64-int16", "64-64-int8"],
        int8: Options {
            arithmetic: Arithmetic::Int8PerChannel,
            ..int16.clone()
        },
        float,
        int16,
    }
}

/// Wider, with everything that makes a network fine: directions of weak forces count, unused
/// weights decay, and in int8 each unit of the first layer has four parts.
fn fine_tier(args: &PeersArgs) -> Tier {
    let float = Options {
        hidden: vec![128, 64],
        batch: 128,
        learning_rate: 1e-2,
        direction_weight: Some(DirectionWeight {
            mean: 3.0,
            floor_n: 0.01,
        }),
        weight_decay: 0.02,
        ..plain(args)
    };
    let int16 = Options {
        epochs: 0,
        rounded_epochs: args.our_rounded_epochs,
        // Begins with a third of it: the weights are in their place.
        learning_rate: 3e-3,
        ..float.clone()
    };
    Tier {
        names: ["128-64 float", "128-64 int16", "4×128-64 int8"],
        files: ["128-64-float", "128-64-int16", "4x128-64-int8"],
        int8: Options {
            arithmetic: Arithmetic::Int8PerChannel,
            unit_parts: 4,
            ..int16.clone()
        },
        float,
        int16,
    }
}
