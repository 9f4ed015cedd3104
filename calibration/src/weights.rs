//! The weights file: a trained network in floats, with everything that the exporter needs for a
//! model file.

use std::{fs, path::Path};

use anyhow::{Context, Result, ensure};
use hivtac_terms::marker::LEAST_MARKERS;
use serde::{Deserialize, Serialize};

use crate::data::conditions::Conditions;
use crate::data::range::Range;
use crate::data::rest::Rest;
use crate::forward::FilmModel;
use crate::network::Network;
pub use crate::uncertainty::Uncertainty;

/// The file's name of its format.
const FORMAT: &str = "hivtac-weights 2";

/// A weights file: JSON whose floats are written exactly, so that reading gives the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weights {
    /// Name and version of the format.
    pub format: String,
    /// Conditions of the network's training data.
    pub conditions: Conditions,
    /// The rest position.
    pub rest: Rest,
    /// The range of forces that it was trained for.
    pub range: Range,
    /// Uncertainties of the quantized network on forces that it was not trained on.
    pub uncertainty: Uncertainty,
    /// How it was trained, for the reader.
    pub training: Training,
    /// The forward model, which improves the network's answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film: Option<FilmModel>,
    /// The network; none for other layouts than the square of four dots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub network: Option<Network>,
}

/// How a network was trained.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// Description of the data, from its file.
    pub scene: String,
    /// Seed of the data.
    pub data_seed: u64,
    /// Rows trained on.
    pub rows: usize,
    /// Seed of first weights, shuffling and the choice of held-out rows.
    pub seed: u64,
    /// Passes over the data in floats.
    pub epochs: usize,
    /// Passes with the chip's rounding.
    pub rounded_epochs: usize,
    /// The unit of the split; `within-pose` for single rows.
    #[serde(default)]
    pub split: String,
}

impl Weights {
    /// The name of this version's format.
    pub fn format() -> String {
        FORMAT.into()
    }

    /// Reads and checks a weights file.
    ///
    /// # Errors
    /// When it cannot be read, is not a weights file of this version, or its parts do not match
    /// each other.
    pub fn load(path: &Path) -> Result<Self> {
        let text =
            fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&text)
            .with_context(|| format!("{} is not a usable weights file", path.display()))
    }

    /// Reads and checks the text of a weights file.
    ///
    /// # Errors
    /// When it is not a weights file of this version, or its parts do not match each other.
    pub fn parse(text: &str) -> Result<Self> {
        let weights: Self = serde_json::from_str(text)?;
        ensure!(
            weights.format == FORMAT,
            "its format is `{}`, this program reads `{FORMAT}`",
            weights.format
        );
        weights.check()?;
        Ok(weights)
    }

    /// Checks that the parts match each other and that every number is in range.
    ///
    /// # Errors
    /// Names the part that is wrong.
    pub fn check(&self) -> Result<()> {
        let markers = self.conditions.markers;
        self.conditions.layout()?;
        if let Some(network) = &self.network {
            network.validate()?;
            ensure!(
                markers == LEAST_MARKERS,
                "network: only one of four markers can be, and there are {markers}"
            );
        }
        if let Some(film) = &self.film {
            film.check()?;
            ensure!(
                self.network
                    .as_ref()
                    .is_none_or(|it| it.meaning.tells_place()),
                "film: only a network with places can have one"
            );
            ensure!(
                film.rest_px.len() == markers,
                "film.rest_px is of {} markers, and there are {markers}",
                film.rest_px.len()
            );
        }
        ensure!(
            self.network.is_some() || self.film.is_some(),
            "there is neither a network nor a film"
        );
        self.check_numbers()
    }

    /// The network.
    ///
    /// # Errors When the file has none, as for other layouts than the square of four dots.
    pub fn network(&self) -> Result<&Network> {
        let network = self.network.as_ref();
        network.context("these weights have no network, as their film has other dots than four")
    }

    fn check_numbers(&self) -> Result<()> {
        let Range {
            force_n,
            alpha_deg,
            beta_deg,
            place_mm,
        } = self.range;
        ensure!(
            force_n > 0.0 && force_n <= 1000.0,
            "range.force_n is {force_n}: use above 0, to 1000"
        );
        for (name, angle) in [("alpha_deg", alpha_deg), ("beta_deg", beta_deg)] {
            ensure!(
                (0.0..=90.0).contains(&angle),
                "range.{name} is {angle}: use 0 to 90"
            );
        }
        ensure!(
            (0.0..=1000.0).contains(&place_mm),
            "range.place_mm is {place_mm}: use 0 to 1000"
        );
        let Uncertainty {
            across_n,
            along_n,
            place_mm,
            ..
        } = &self.uncertainty;
        for (name, sigmas) in [
            ("across_n", across_n),
            ("along_n", along_n),
            ("place_mm", place_mm),
        ] {
            let wrong = sigmas.iter().find(|sigma| !(0.0..=1000.0).contains(*sigma));
            ensure!(
                wrong.is_none(),
                "uncertainty.{name} has {}: use 0 to 1000",
                wrong.unwrap_or(&0.0)
            );
        }
        let rest = self.rest.to_sensor().context("rest")?;
        ensure!(
            rest.areas.len() == self.conditions.markers,
            "rest is of {} markers, and there are {}",
            rest.areas.len(),
            self.conditions.markers
        );
        Ok(())
    }

    /// Writes the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string(self)? + "\n";
        fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
    }
}
