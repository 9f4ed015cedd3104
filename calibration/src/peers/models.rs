//! The models that are compared.

use anyhow::{Context, Result, anyhow};
use hivtac_scene::Contact;
use hivtac_sensing::force::Force;
use hivtac_sensing::model::Model as Chip;
use hivtac_sensing::network::Network;

use super::frames::{Frames, Sets};
use super::{PeersArgs, there};
use crate::check::vector_n;
use crate::dataset::Split;
use crate::fit::{Kind, fit, fit_closed_form};
use crate::network::{Arithmetic, Meaning};
use crate::quantize::export;
use crate::scene::size::Size;
use crate::train::Options;
use crate::weights::{Weights, features_from_q16};

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
        let answer = |row: &crate::dataset::Row| {
            let seen = row.seen.as_ref().ok()?;
            Some([row.force_n, self.weights.force_n(&seen.features_px())])
        };
        sets.test.rows.iter().map(answer).collect()
    }

    fn in_integers(&self, sets: &Sets) -> Result<Answers> {
        let bytes = export(&self.weights)?;
        let model = Chip::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let mut network = Network::new();
        let answer = |row: &crate::dataset::Row| {
            let Ok(seen) = &row.seen else { return Ok(None) };
            let features = features_from_q16(&seen.features_q16)?;
            let output = network.run(&model, &features, &model.rest.features);
            let (force, _) = Force::of_outputs(&model, output.values);
            Ok(Some([row.force_n, vector_n(force)]))
        };
        sets.test.rows.iter().map(answer).collect()
    }
}

/// All of them, trained on a size's frames or read from the folder.
pub fn all(args: &PeersArgs, contact: Contact, size: Size, frames: &Frames) -> Result<Vec<Model>> {
    let (ours, theirs) = (&frames.ours.training, &frames.theirs.training);
    let kept = |name: &str, make: &dyn Fn() -> Result<Weights>| -> Result<Weights> {
        let path = args.file(contact, size, &format!("{name}.weights"));
        if there(&path) {
            return Weights::load(&path);
        }
        println!("training {}", path.display());
        let weights = make().with_context(|| format!("training {}", path.display()))?;
        weights.save(&path)?;
        Ok(weights)
    };
    let trained = |data, kind, options: Options| {
        Ok(fit(data, Split::WithinPose, kind, &options, |_| ())?.weights)
    };
    let paper = Options {
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
    };
    let float = Options {
        arithmetic: Arithmetic::Int16,
        epochs: args.our_epochs,
        rounded_epochs: 0,
        seed: SEED,
        ..Options::default()
    };
    let name = format!("paper-{}-passes", args.epochs);
    let paper = kept(&name, &|| trained(theirs, Kind::Network, paper.clone()))?;
    let alone = kept("64-64-float", &|| {
        trained(ours, Kind::Network, float.clone())
    })?;
    let rounded = |arithmetic| Options {
        arithmetic,
        epochs: 0,
        rounded_epochs: args.our_rounded_epochs,
        start: Some(alone.network.clone()),
        ..float.clone()
    };
    let int8 = kept("64-64-int8", &|| {
        trained(ours, Kind::Network, rounded(Arithmetic::Int8PerChannel))
    })?;
    let int16 = kept("64-64-int16", &|| {
        trained(ours, Kind::Network, rounded(Arithmetic::Int16))
    })?;
    let form = kept("closed-form", &|| {
        Ok(fit_closed_form(ours, Split::WithinPose, SEED)?.weights)
    })?;
    let both = Options {
        arithmetic: Arithmetic::Int8PerChannel,
        rounded_epochs: args.our_rounded_epochs,
        ..float.clone()
    };
    let both = kept("both", &|| trained(ours, Kind::Both, both.clone()))?;
    let model = |name, how, weights| Model { name, how, weights };
    Ok(vec![
        model("the paper's", How::Paper, paper),
        model("64-64 float", How::Float, alone),
        model("64-64 int16", How::Chip, int16),
        model("64-64 int8", How::Chip, int8),
        model("closed form", How::Chip, form),
        model("closed form + 64-64 int8", How::Chip, both),
    ])
}
