//! `hivtac-studies scene …`: pictures and figures of the simulated sensor (`docs/scene.md`).

mod canvas;
mod cases;
mod figures;
mod film;
mod guide;
mod overlay;
mod pipeline;
mod render;

use anyhow::Result;
use clap::Subcommand;

/// Look at the simulated sensor.
#[derive(Subcommand)]
pub enum SceneCommand {
    /// Render one frame of a scene as a PNG picture.
    Render(render::RenderArgs),
    /// Press the film once: where tip and markers go, and where the markers are seen.
    Film(film::FilmArgs),
    /// Draw all hard cases on one sheet, with what the sensing makes of them.
    Cases(cases::CasesArgs),
    /// Draw the pictures of the documentation.
    Figures(figures::FiguresArgs),
}

impl SceneCommand {
    /// Does it.
    ///
    /// # Errors
    /// When the arguments ask for what there is not, or a file cannot be read or written.
    pub fn run(&self) -> Result<()> {
        match self {
            SceneCommand::Render(args) => args.run(),
            SceneCommand::Film(args) => args.run(),
            SceneCommand::Cases(args) => args.run(),
            SceneCommand::Figures(args) => args.run(),
        }
    }
}
