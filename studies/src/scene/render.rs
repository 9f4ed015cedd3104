//! `scene render`: one frame of a scene as a picture.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use hivtac_twin::hard_cases::hard_cases;
use hivtac_twin::{Layout, Options, Preset, Scene, Truth};

use super::canvas::{BLACK, CHARACTER, CYAN, Canvas};

/// Frame size of named scenes.
const SIZE: [u32; 2] = [320, 240];
/// Time of the shown frame of a moving hard case, s.
const SHOWN_S: f64 = 0.25;

/// Arguments of `scene render`.
#[derive(Args)]
pub struct RenderArgs {
    /// A scene file (docs/scene-file.md), or a name: of a motion of the usual sensor (rest, static,
    /// demo, …), or of a hard case (docs/results/hard-cases.md).
    scene: String,
    /// The PNG file to write.
    #[arg(long)]
    out: PathBuf,
    /// The dots instead of the scene's: a layout's name (4, 8v).
    #[arg(long, value_name = "NAME")]
    layout: Option<String>,
    /// Draw a cross at the true centroid of every marker, and its identity.
    #[arg(long)]
    overlay: bool,
    /// Seconds from the beginning of the scene; 0 by default, for hard cases as on their sheet.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    at: Option<f64>,
    /// The frame's number: it selects the noise.
    #[arg(long, default_value_t = 0)]
    number: u64,
    /// Side of the square that each pixel becomes.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
    scale: u32,
}

impl RenderArgs {
    pub(super) fn run(&self) -> Result<()> {
        if let Some(at) = self.at.filter(|at| !at.is_finite() || *at < 0.0) {
            bail!("--at {at}: use seconds from 0 on");
        }
        let (mut scene, usual_s) = scene(&self.scene)?;
        if let Some(name) = &self.layout {
            let layout: Layout = name.parse()?;
            let options = scene.options().clone();
            scene = scene.with_options(Options { layout, ..options })?;
        }
        let frame = scene.frame(self.number, self.at.unwrap_or(usual_s));
        let mut canvas = Canvas::of_frame(&frame, self.scale);
        if self.overlay {
            mark_truth(&mut canvas, &frame.truth, self.scale);
        }
        canvas.save(&self.out)?;
        let (out, load) = (self.out.display(), frame.truth.force);
        println!(
            "wrote {out}: {}×{} {}, |F| {:.1} mN, α {:.2}°, β {:.2}°",
            frame.width,
            frame.height,
            frame.format,
            load.magnitude_n() * 1e3,
            load.alpha_deg(),
            load.beta_deg()
        );
        Ok(())
    }
}

/// The scene of a file or a name, and the time to show, s.
fn scene(source: &str) -> Result<(Scene, f64)> {
    let path = Path::new(source);
    if path.extension().is_some_and(|end| end == "toml") || path.is_file() {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {source}"))?;
        let scene = Scene::from_toml(&text);
        return Ok((
            scene.with_context(|| format!("{source} is not a usable scene"))?,
            0.0,
        ));
    }
    let [width, height] = SIZE;
    if let Some(case) = hard_cases().iter().find(|case| case.name == source) {
        let scene = case.scene(Preset::Ov7725, width, height, 1)?;
        return Ok((scene, SHOWN_S));
    }
    let scene = Scene::preset(source, Preset::Ov7725, width, height, 1);
    let said = || format!("{source} is no scene file (*.toml), no motion and no hard case");
    Ok((scene.with_context(said)?, 0.0))
}

/// Draws a cross at each marker's true centroid, with its identity, into a picture of a frame at a
/// scale.
fn mark_truth(canvas: &mut Canvas, truth: &Truth, scale: u32) {
    for (id, marker) in truth.markers.iter().enumerate() {
        if let Some(marker) = marker {
            let at = marker.centroid_px.map(|px| in_picture(px, scale));
            cross(canvas, at, scale);
            // Outside of the pattern, where no other marker is.
            let width = i64::from(scale * CHARACTER);
            let right = [1, 2].contains(&id);
            let beside = 10 * i64::from(scale);
            let x = at[0] + if right { beside } else { -beside - width };
            canvas.edged_text([x, at[1] - width / 2], scale, &id.to_string(), CYAN);
        }
    }
}

/// The pixel in a picture at a scale that contains a point of the frame.
fn in_picture(px: f64, scale: u32) -> i64 {
    ((px + 0.5) * f64::from(scale)).floor() as i64
}

/// Draws a cross of one-pixel lines at any scale, with a dark edge; its middle marks the place.
fn cross(canvas: &mut Canvas, [x, y]: [i64; 2], scale: u32) {
    let arm = 3 * i64::from(scale);
    let length = 2 * arm + 1;
    if scale > 2 {
        canvas.fill([x - arm - 1, y - 1], [length + 2, 3], BLACK);
        canvas.fill([x - 1, y - arm - 1], [3, length + 2], BLACK);
    }
    canvas.fill([x - arm, y], [length, 1], CYAN);
    canvas.fill([x, y - arm], [1, length], CYAN);
}
