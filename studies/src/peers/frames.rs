//! The frames: rendered once, seen by the sensing and by its peer.

use std::collections::BTreeSet;

use anyhow::{Context, Result, anyhow};
use hivtac_calibration::data::dataset::{
    Dataset, Detectors, Loads, MarkerDetector, Recipe, Sensing, generate_files,
};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::fit::fit;
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::Options;
use hivtac_sensor::force::model::Model;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_twin::Contact;

use super::PeersArgs;
use super::models::How;
use crate::scene::size::Size;

/// Opens a peer's detector for frames of so many columns and rows.
pub type Open<'a> = dyn Fn(u16, u16) -> Result<Box<dyn MarkerDetector>> + Sync + 'a;

/// Seeds of loads and noise.
const TRAINING_SEED: u64 = 11;
const TEST_SEED: u64 = 12;

/// What one of the two saw.
pub struct Sets {
    /// Four fifths of the poses.
    pub training: Dataset,
    /// The others.
    pub test: Dataset,
}

/// What both saw of the same frames.
pub struct Frames {
    /// The sensing, with centroids weighted with redness.
    pub ours: Sets,
    /// The peer.
    pub theirs: Sets,
    /// How the test frames are made.
    pub test_recipe: Recipe,
}

impl Frames {
    /// Renders them, or goes on with what is there.
    pub fn make(args: &PeersArgs, contact: Contact, size: Size, detector: &Open) -> Result<Self> {
        let recipe = |loads: Loads, rest: usize, seed: u64| -> Result<Recipe> {
            Ok(Recipe {
                preset: args.preset,
                width: u16::try_from(size.width)?,
                height: u16::try_from(size.height)?,
                centroid: CentroidEstimator::RednessWeighted,
                contact,
                loads,
                rest,
                range: Range::default(),
                seed,
                ..Recipe::default()
            })
        };
        let rest = Recipe::default().rest;
        let training = recipe(Loads::TrainingPoses(args.training), rest, TRAINING_SEED)?;
        let test = recipe(Loads::HeldOutPoses(args.test), 0, TEST_SEED)?;
        let see = |recipe: &Recipe, part: &str, model: Option<&Model<'_>>| {
            let mut about = recipe.about()?;
            let ours = (
                args.file(contact, size, &format!("{part}.csv")),
                about.clone(),
            );
            about.conditions.centroid = CentroidEstimator::BinaryMask;
            about.scene.push_str("; markers by the peer");
            let theirs = args.file(contact, size, &format!("{part}-peer.csv"));
            if args.kept_frames {
                return Ok([Dataset::load(&ours.0)?, Dataset::load(&theirs)?]);
            }
            let files = vec![ours, (theirs, about)];
            let open = || -> Result<Detectors<'_>> {
                let sensing = match model {
                    None => Sensing::unmodelled(recipe)?,
                    Some(model) => Sensing::tared(model)?,
                };
                Ok(vec![
                    Box::new(sensing),
                    detector(recipe.width, recipe.height)?,
                ])
            };
            let bar = hivtac_calibration::progress::bar(
                &format!("{contact} {size} {part}"),
                recipe.rows(),
            );
            let made = generate_files(recipe, files, open, |rows| bar.inc(rows))?;
            bar.finish_and_clear();
            let made: [Dataset; 2] = made.try_into().map_err(|_| anyhow!("two files"))?;
            Ok::<_, anyhow::Error>(made)
        };
        let [ours, theirs] = see(&training, "training", None)?;
        // Any model of these frames: what is refused depends on its rest position and contact
        // reading only.
        let smallest = Options {
            hidden: Vec::new(),
            epochs: 1,
            rounded_epochs: 0,
            ..Options::default()
        };
        let bytes = export(&fit(&ours, &smallest, |_| ())?.weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"));
        let model = model.context("the model that tells what the chip refuses")?;
        let [our_test, their_test] = see(&test, "test", Some(&model))?;
        Ok(Self {
            ours: Sets {
                training: ours,
                test: our_test,
            },
            theirs: Sets {
                training: theirs,
                test: their_test,
            },
            test_recipe: test,
        })
    }

    /// How many of the first test frames were refused.
    pub fn rejected(&self, how: How, rows: usize) -> usize {
        let test = match how {
            How::Paper => &self.theirs.test,
            How::Float | How::Chip => &self.ours.test,
        };
        let rows = test.rows.iter().take(rows);
        rows.filter(|row| row.seen.is_err()).count()
    }
}

fn tests(sizes: &[Frames]) -> impl Iterator<Item = &Dataset> {
    let both = sizes.iter().map(|f| [&f.ours.test, &f.theirs.test]);
    both.flatten()
}

/// The test frames that there are at every size: the first ones, when some were interrupted.
pub fn rendered_everywhere(sizes: &[Frames]) -> usize {
    let rows = tests(sizes).map(|test| test.rows.len());
    rows.min().unwrap_or(0)
}

/// Their numbers, of those that everyone accepts at every size.
pub fn seen_everywhere(sizes: &[Frames]) -> Vec<usize> {
    let seen = |row: &usize| tests(sizes).all(|test| test.rows[*row].seen.is_ok());
    (0..rendered_everywhere(sizes)).filter(seen).collect()
}

/// Of how many poses the frames of these numbers are.
pub fn poses(frames: &Frames, numbers: &[usize]) -> usize {
    let pose = |&i: &usize| frames.ours.test.rows[i].place.pose;
    numbers.iter().map(pose).collect::<BTreeSet<_>>().len()
}
