//! The pictures of `docs/building-a-sensor.md`: what a camera sees of a sensor that is being built.

use std::path::Path;

use anyhow::Result;
use hivtac_twin::{Load, Options, Preset, Scene};

use super::canvas::{BLACK, CHARACTER, Canvas, WHITE};

/// A picture: its caption, and what of the simulated sensor is not as it should be.
struct Step {
    caption: &'static str,
    wrong: fn(&mut Options),
}

/// From the bare film to a sensor that is right; each but the last has one thing wrong.
const STEPS: [Step; 8] = [
    Step {
        caption: "film on its posts",
        wrong: |options| options.missing = [true; 4],
    },
    Step {
        caption: "lens too near",
        wrong: |options| {
            options.lens.aperture_mm = 0.75;
            options.lens.focus_mm = 3.0;
        },
    },
    Step {
        caption: "too little light",
        wrong: |options| options.gain = 0.3,
    },
    Step {
        caption: "too much light",
        wrong: |options| options.gain = 1.8,
    },
    Step {
        caption: "light of the room",
        wrong: |options| {
            options.gain = 0.6;
            options.haze = 120.0;
        },
    },
    Step {
        caption: "turned by 8°",
        wrong: |options| options.mounting.roll_deg = 8.0,
    },
    Step {
        caption: "beside the middle",
        wrong: |options| options.mounting.shift_px = [24.0, -10.0],
    },
    Step {
        caption: "right",
        wrong: |_| {},
    },
];
const COLUMNS: u32 = 4;
/// Pixels between pictures, and above and below a caption.
const GAP: u32 = 8;

/// Draws all steps on one sheet, each at half its size.
pub fn draw(out: &Path) -> Result<()> {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1)?;
    let (width, height) = (scene.camera().width() / 2, scene.camera().height() / 2);
    let rows = STEPS.len() as u32 / COLUMNS;
    let cell = [width + GAP, height + 2 * GAP + CHARACTER];
    let mut sheet = Canvas::new(COLUMNS * cell[0] - GAP, rows * cell[1], WHITE);
    for (number, step) in (0..).zip(STEPS) {
        let mut options = scene.options().clone();
        (step.wrong)(&mut options);
        let frame = (scene.clone())
            .with_options(options)?
            .render_load(&Load::REST, u64::from(number))?;
        let [x, y] = [number % COLUMNS * cell[0], number / COLUMNS * cell[1]].map(i64::from);
        sheet.paste([x, y], &Canvas::of_frame(&frame, 1).halved());
        let below = y + i64::from(height + GAP);
        sheet.text([x, below], 1, step.caption, BLACK);
    }
    sheet.save(out)?;
    println!("wrote {}", out.display());
    Ok(())
}
