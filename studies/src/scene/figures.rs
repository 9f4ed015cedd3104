//! Draws the pictures of `docs/scene.md` and `docs/building-a-sensor.md`.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::data::dataset::reasons;
use hivtac_sensor::force::model::Model;
use hivtac_twin::hard_cases::{HardCase, hard_cases};
use hivtac_twin::{Frame, Load, Options, Preset, Scene};

use super::canvas::{BLACK, CHARACTER, Canvas, Colour, WHITE};
use super::render::mark_truth;
use crate::press::{Tared, TestedUnit};

/// Frame size of all pictures.
pub const SIZE: [u32; 2] = [320, 240];
/// Time of the shown frame of a moving hard case, s.
pub const SHOWN_S: f64 = 0.25;

/// The model that measures hard cases.
static MODEL: &[u8] = include_bytes!("../../../calibration/models/default.hvtm");
/// Distance between pictures, and above and below a caption, px.
const GAP: u32 = 8;
/// Height of a line of text, px.
const LINE: u32 = CHARACTER + 3;
/// Width of a hard case, 24 characters of text below its picture; and number of cases in a row.
const CASE_WIDTH: u32 = 24 * CHARACTER;
const CASE_COLUMNS: u32 = 7;
/// Colours of the outcomes of hard cases.
const RIGHT: Colour = [0, 110, 60];
const REJECTED: Colour = [0, 80, 170];
const WRONG: Colour = [200, 0, 0];
const LEGEND: [(&str, Colour); 3] = [
    ("found, within tolerance", RIGHT),
    ("no force, and why", REJECTED),
    ("found, and wrong", WRONG),
];
/// The loads of the frames: |F| in N, α and β in degrees.
const LOADS: [(f64, f64, f64); 3] = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.2, 8.0, -6.0)];

/// A picture: its caption, and the faults of the simulated sensor in it.
struct Step {
    caption: &'static str,
    wrong: fn(&mut Options),
}

/// From the bare film to a correct sensor; each picture but the last has one fault.
const STEPS: [Step; 8] = [
    Step {
        caption: "film on its posts",
        wrong: |options| options.missing = [true; 4].into(),
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

/// Number of the guide's pictures in a row.
const GUIDE_COLUMNS: u32 = 4;

/// Arguments of `scene figures`.
#[derive(Args)]
pub struct FiguresArgs {
    /// The folder to write into: frames.png, hard-cases.png and guide.png.
    #[arg(long, default_value = "docs/pictures")]
    out_dir: PathBuf,
}

impl FiguresArgs {
    pub(super) fn run(&self) -> Result<()> {
        let folder = self.out_dir.display();
        fs::create_dir_all(&self.out_dir).with_context(|| format!("cannot make {folder}"))?;
        self.save("frames.png", &frames()?)?;
        self.save("hard-cases.png", &cases()?)?;
        self.save("guide.png", &guide()?)
    }

    fn save(&self, name: &str, picture: &Canvas) -> Result<()> {
        let file = self.out_dir.join(name);
        picture.save(&file)?;
        println!("wrote {}", file.display());
        Ok(())
    }
}

fn at_rest() -> Result<Scene> {
    Ok(Scene::preset("rest", Preset::Ov7725, SIZE[0], SIZE[1], 1)?)
}

/// Draws frames under growing loads, next to each other, with the true centroids.
fn frames() -> Result<Canvas> {
    let scene = at_rest()?;
    let count = LOADS.len() as u32;
    let size = [count * (SIZE[0] + GAP) - GAP, SIZE[1] + 2 * GAP + CHARACTER];
    let mut picture = Canvas::new(size[0], size[1], WHITE);
    for (number, (force_n, alpha, beta)) in (0..).zip(LOADS) {
        let load = Load::from_angles(force_n, alpha, beta)?;
        let frame = scene.render_load(&load, u64::from(number))?;
        let mut canvas = Canvas::of_frame(&frame, 1);
        mark_truth(&mut canvas, &frame.truth, 1);
        let x = i64::from(number * (SIZE[0] + GAP));
        picture.paste([x, 0], &canvas);
        let caption = match force_n {
            0.0 => "at rest".to_owned(),
            _ => format!("|F| = {force_n} N, α = {alpha}°, β = {beta}°"),
        };
        picture.text([x, i64::from(SIZE[1] + GAP)], 1, &caption, BLACK);
    }
    Ok(picture)
}

/// Draws all hard cases, each at half its size, with the sensing's results.
fn cases() -> Result<Canvas> {
    let cases = hard_cases();
    let place = [CASE_WIDTH + GAP, SIZE[1] / 2 + 2 * LINE + 2 * GAP];
    let rows = (cases.len() as u32).div_ceil(CASE_COLUMNS);
    let top = LINE + 2 * GAP;
    let mut sheet = Canvas::new(GAP + CASE_COLUMNS * place[0], top + rows * place[1], WHITE);
    for (number, (words, colour)) in (0..).zip(LEGEND) {
        let x = i64::from(GAP) + number * i64::from(26 * CHARACTER);
        sheet.text([x, GAP.into()], 1, words, colour);
    }
    let model = Model::parse(MODEL).map_err(|error| anyhow!("the default model: {error}"))?;
    let unit = TestedUnit::new(&model.conditions, Options::default(), 0.5, 1)?;
    let mut tared = unit.tare(&model)?;
    for (number, case) in (0..).zip(&cases) {
        let scene = case.scene(Preset::Ov7725, SIZE[0], SIZE[1], 1)?;
        let frame = scene.frame(0, SHOWN_S);
        let (said, colour) = outcome(case, &frame, &mut tared);
        let x = i64::from(GAP + number % CASE_COLUMNS * place[0]);
        let y = i64::from(top + number / CASE_COLUMNS * place[1]);
        sheet.paste([x, y], &Canvas::of_frame(&frame, 1).halved());
        let below = y + i64::from(SIZE[1] / 2 + 4);
        sheet.text([x, below], 1, &case.name, BLACK);
        sheet.text([x, below + i64::from(LINE)], 1, &said, colour);
    }
    Ok(sheet)
}

/// The sensing's result for a frame, with its colour.
fn outcome(case: &HardCase, frame: &Frame, tared: &mut Tared<'_>) -> (String, Colour) {
    let seen = tared.measure(frame);
    let rejected = reasons(seen.status);
    let Some(markers) = seen.markers.filter(|_| rejected.is_empty()) else {
        return (rejected, REJECTED);
    };
    let off_px = markers
        .iter()
        .zip(&frame.truth.markers)
        .map(|(found, truth)| {
            truth.map_or(f64::INFINITY, |truth| {
                let [x, y] = truth.centroid_px;
                (found.x.to_f64() - x).hypot(found.y.to_f64() - y)
            })
        });
    let worst_px = off_px.fold(0.0, f64::max);
    let is_right = worst_px <= case.tolerance_px(frame.width);
    let said = format!("within {worst_px:.2} px");
    (said, if is_right { RIGHT } else { WRONG })
}

/// Draws the guide's steps, each at half its size.
fn guide() -> Result<Canvas> {
    let scene = at_rest()?;
    let rows = STEPS.len() as u32 / GUIDE_COLUMNS;
    let cell = [SIZE[0] / 2 + GAP, SIZE[1] / 2 + 2 * GAP + CHARACTER];
    let mut sheet = Canvas::new(GUIDE_COLUMNS * cell[0] - GAP, rows * cell[1], WHITE);
    for (number, step) in (0..).zip(STEPS) {
        let mut options = scene.options().clone();
        (step.wrong)(&mut options);
        let scene = scene.clone().with_options(options)?;
        let frame = scene.render_load(&Load::REST, u64::from(number))?;
        let x = i64::from(number % GUIDE_COLUMNS * cell[0]);
        let y = i64::from(number / GUIDE_COLUMNS * cell[1]);
        sheet.paste([x, y], &Canvas::of_frame(&frame, 1).halved());
        let below = y + i64::from(SIZE[1] / 2 + GAP);
        sheet.text([x, below], 1, step.caption, BLACK);
    }
    Ok(sheet)
}
