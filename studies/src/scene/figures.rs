//! The pictures of `docs/scene.md` and `docs/building-a-sensor.md`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use hivtac_scene::{Load, Preset, Scene};

use super::canvas::{BLACK, CHARACTER, Canvas, WHITE};
use super::cases::CasesArgs;
use super::{guide, overlay};

/// Arguments of `scene figures`.
#[derive(Args)]
pub struct FiguresArgs {
    /// The folder to write into.
    #[arg(long, default_value = "docs/pictures")]
    out_dir: PathBuf,
}

/// The loads of the frames: |F| in N, α and β in degrees.
const LOADS: [(f64, f64, f64); 3] = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.2, 8.0, -6.0)];
/// Pixels between frames, and above and below a caption.
const GAP: u32 = 8;

impl FiguresArgs {
    pub(super) fn run(&self) -> Result<()> {
        let folder = self.out_dir.display();
        fs::create_dir_all(&self.out_dir).with_context(|| format!("cannot make {folder}"))?;
        let file = |name: &str| self.out_dir.join(name);
        frames(&file("frames.png"))?;
        CasesArgs::all(file("hard-cases.png")).run()?;
        guide::draw(&file("guide.png"))
    }
}

/// Frames under growing loads side by side, with the true centroids.
fn frames(out: &Path) -> Result<()> {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1)?;
    let (width, height) = (scene.camera().width(), scene.camera().height());
    let count = LOADS.len() as u32;
    let mut picture = Canvas::new(
        count * (width + GAP) - GAP,
        height + 2 * GAP + CHARACTER,
        WHITE,
    );
    for (number, (force_n, alpha, beta)) in (0..).zip(LOADS) {
        let load = Load::from_angles(force_n, alpha, beta)?;
        let frame = scene.render_load(&load, u64::from(number))?;
        let mut canvas = Canvas::of_frame(&frame, 1);
        overlay::draw(&mut canvas, &frame.truth, 1);
        let x = i64::from(number * (width + GAP));
        picture.paste([x, 0], &canvas);
        let caption = match force_n {
            0.0 => "at rest".to_owned(),
            _ => format!("|F| = {force_n} N, α = {alpha}°, β = {beta}°"),
        };
        let below = i64::from(height + GAP);
        picture.text([x, below], 1, &caption, BLACK);
    }
    picture.save(out)?;
    println!("wrote {}", out.display());
    Ok(())
}
