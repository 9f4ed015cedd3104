//! `hivtac-studies scene …`: pictures and figures of the simulated sensor (`docs/scene.md`).

mod canvas;
mod dimensions;
mod figures;
mod film;
mod render;
mod tolerances;

use anyhow::Result;
use clap::Subcommand;

/// Look at the simulated sensor: its frames and its film.
#[derive(Subcommand)]
pub enum SceneCommand {
    /// Render one frame of a scene as a PNG picture.
    Render(render::RenderArgs),
    /// Press the film once: where tip and markers go, and where the markers are seen.
    Film(film::FilmArgs),
    /// Print the lengths that `hardware/` shares with the simulated sensor, as JSON.
    Dimensions(dimensions::DimensionsArgs),
    /// Build units with one dimension of the kit off by its tolerance; measure after ten loads.
    Tolerances(tolerances::Tolerances),
    /// Draw the pictures of the documentation: frames, hard cases, and the guide's.
    Figures(figures::FiguresArgs),
}

impl SceneCommand {
    /// Runs the command.
    pub fn run(&self) -> Result<()> {
        match self {
            SceneCommand::Render(args) => args.run(),
            SceneCommand::Film(args) => args.run(),
            SceneCommand::Dimensions(args) => args.run(),
            SceneCommand::Tolerances(study) => study.run(),
            SceneCommand::Figures(args) => args.run(),
        }
    }
}
