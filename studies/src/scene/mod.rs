//! `hivtac-studies scene …`: a look at the simulated sensor (`docs/scene.md`).

mod canvas;
mod dimensions;
mod effects;
mod render;
mod tolerances;

use anyhow::Result;
use clap::Subcommand;

/// The simulated sensor: its frames, its lengths, and the errors by each of these.
#[derive(Subcommand)]
pub enum SceneCommand {
    /// Render one frame of a scene as a PNG picture.
    Render(render::RenderArgs),
    /// Print the lengths that `hardware/` shares with the simulated sensor, as JSON.
    Dimensions(dimensions::DimensionsArgs),
    /// Measure with a film that lets light through, LEDs mirrored, a colour camera's pixels.
    Effects(effects::Effects),
    /// Build units with one dimension of the kit off by its tolerance; measure after ten loads.
    Tolerances(tolerances::Tolerances),
}

impl SceneCommand {
    /// Runs the command.
    pub fn run(&self) -> Result<()> {
        match self {
            SceneCommand::Render(args) => args.run(),
            SceneCommand::Dimensions(args) => args.run(),
            SceneCommand::Effects(study) => study.run(),
            SceneCommand::Tolerances(study) => study.run(),
        }
    }
}
