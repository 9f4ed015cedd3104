//! Recipes of data sets: camera, sessions, loads.

use anyhow::{Context, Result, ensure};
use clap::Args;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;
use hivtac_twin::{Contact, Format, Load, Options, PresetCamera, Scene};
use serde::{Deserialize, Serialize};

use super::session::Session;
use super::{About, Place};
use crate::data::conditions::{Conditions, pixel_format};
use crate::data::loads::{PaperPoses, RandomLoads};
use crate::data::range::Range;

/// The loads of each session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Loads {
    /// This many, with force and angles uniform within the range.
    Random(usize),
    /// This many for each of the paper's 357 poses, with the force uniform within the range.
    PaperPoses(usize),
    /// Measured with a unit, in this many poses; cannot be rendered.
    Measured(usize),
}

/// The recipe of a data set. Fields without an argument are for studies, which make their recipes
/// themselves.
#[derive(Args, Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// Lens and camera.
    #[arg(skip = Recipe::default().preset)]
    pub preset: Preset,
    /// Columns of a frame.
    #[arg(long, default_value_t = Recipe::default().width)]
    pub width: u16,
    /// Rows of a frame.
    #[arg(long, default_value_t = Recipe::default().height)]
    pub height: u16,
    /// Pixel format: rgb565, yuv422 or mono.
    #[arg(long, value_parser = pixel_format, default_value = "rgb565")]
    pub format: PixelFormat,
    /// How markers' positions are taken.
    #[arg(skip = Recipe::default().centroid)]
    pub centroid: CentroidEstimator,
    /// The meaning of the loads' labels.
    #[arg(skip)]
    pub contact: Contact,
    /// Random loads of each session.
    #[arg(id = "samples", long, value_name = "COUNT", value_parser = random)]
    #[arg(default_value = "80000")]
    pub loads: Loads,
    /// Frames of the untouched film, first in each session.
    #[arg(skip = Recipe::default().rest)]
    pub rest: usize,
    /// The limits of the forces; the paper's poses have limits of their own for angles.
    #[command(flatten)]
    pub range: Range,
    /// Sessions: the first is the nominal sensor, the others are mounted, lit and focused a little
    /// differently.
    #[arg(skip = Recipe::default().sessions)]
    pub sessions: usize,
    /// Decides loads, sessions and noise.
    #[arg(long, default_value_t = Recipe::default().seed)]
    pub seed: u64,
}

fn random(count: &str) -> Result<Loads, String> {
    let count = count.parse().map_err(|_| "a number is needed")?;
    Ok(Loads::Random(count))
}

impl Recipe {
    /// The frames on which the default model of a preset is trained.
    pub fn of(preset: Preset) -> Self {
        let usual = Self {
            preset,
            ..Self::default()
        };
        match preset {
            Preset::Paper | Preset::Ov7725 => usual,
            Preset::Mt9v034 => Self {
                width: 160,
                height: 152,
                format: PixelFormat::Mono,
                ..usual
            },
        }
    }
}

impl Default for Recipe {
    /// The frames on which the default model's network is trained.
    fn default() -> Self {
        Self {
            preset: Preset::Ov7725,
            width: 320,
            height: 240,
            format: PixelFormat::Rgb565,
            centroid: CentroidEstimator::RednessWeighted,
            contact: Contact::Force,
            loads: Loads::Random(80_000),
            rest: 64,
            range: Range::RENDERED,
            sessions: 1,
            seed: 1,
        }
    }
}

impl Recipe {
    /// Frames of each session.
    pub fn session_rows(&self) -> usize {
        let loads = match self.loads {
            Loads::Random(count) => count,
            Loads::PaperPoses(each) => each.saturating_mul(PaperPoses::COUNT),
            Loads::Measured(_) => 0,
        };
        loads.saturating_add(self.rest)
    }

    /// Frames of all sessions.
    pub fn rows(&self) -> usize {
        self.session_rows().saturating_mul(self.sessions)
    }

    /// # Errors
    /// When there would be no frame, or more frames than a file may hold.
    pub(super) fn check(&self) -> Result<()> {
        ensure!(
            !matches!(self.loads, Loads::Measured(_)),
            "measured loads cannot be rendered"
        );
        ensure!(
            !self.range.knows_places() || matches!(self.loads, Loads::Random(_)),
            "only random loads press anywhere: the others press the middle"
        );
        ensure!(self.sessions > 0, "a data set needs at least one session");
        ensure!(self.rows() > 0, "a data set needs at least one frame");
        ensure!(
            self.rows() <= 100_000_000,
            "{} frames are more than a data set holds",
            self.rows()
        );
        Ok(())
    }

    /// The scene of a session.
    ///
    /// # Errors
    /// When the scene does not support the frame size.
    pub fn scene(&self, session: usize) -> Result<Scene> {
        let scene = Scene::preset(
            "rest",
            self.preset,
            self.width.into(),
            self.height.into(),
            self.seed,
        )?;
        let session = Session::numbered(session, self.seed);
        let mut options = session.options(self.width);
        options.markers = self.preset.usual_markers();
        options.film.contact = self.contact;
        options.format = match self.format {
            PixelFormat::Rgb565 => Format::Rgb565,
            PixelFormat::Yuv422 => Format::Yuv422,
            PixelFormat::Mono => Format::Mono,
        };
        Ok(scene.with_options(options)?)
    }

    /// A row's position: its session and, among the paper's poses, its pose.
    pub fn place(&self, row: usize) -> Place {
        let (session, within) = (row / self.session_rows(), row % self.session_rows());
        let pose = match self.loads {
            Loads::PaperPoses(each) => within.checked_sub(self.rest).map(|row| row / each),
            Loads::Random(_) | Loads::Measured(_) => None,
        };
        Place { session, pose }
    }

    /// The load of a row.
    ///
    /// # Errors
    /// When the limits cannot be those of a force.
    pub fn load(&self, row: usize) -> Result<Load> {
        let within = row % self.session_rows();
        if within < self.rest {
            return Ok(Load::REST);
        }
        let (range, seed) = (self.range, self.seed);
        let force_n = range.force_n;
        match (self.loads, self.place(row).pose) {
            (Loads::Measured(_), _) => Ok(Load::REST),
            (_, Some(pose)) => PaperPoses { force_n, seed }.load(pose, row),
            (_, None) => RandomLoads { range, seed }.load(row),
        }
        .with_context(|| format!("row {row}"))
    }

    /// The header of the data set's file.
    ///
    /// # Errors
    /// When the scene does not support the frame size.
    pub fn about(&self) -> Result<About> {
        let scene = self.scene(0)?;
        let options: &Options = scene.options();
        Ok(About {
            conditions: Conditions {
                centroid: self.centroid,
                contact: self.contact,
                ..Conditions::simulated(self.preset, self.width, self.height, self.format)
            },
            scene: format!(
                "reduced film, gain {}, falloff {}, noise {} of 255 levels",
                options.gain, options.falloff, options.noise
            ),
            loads: self.loads,
            rest: self.rest,
            sessions: self.sessions,
            seed: self.seed,
            range: self.range,
            free: None,
            down: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        recipe: Recipe,
    }

    #[test]
    fn without_arguments_it_is_the_default() {
        assert_eq!(Command::parse_from(["dataset"]).recipe, Recipe::default());
    }
}
