//! All hard cases on one sheet, with what the sensing makes of them.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_twin::hard_cases::{HardCase, hard_cases};
use hivtac_twin::{Frame, Preset, Scene};

use super::canvas::{BLACK, CHARACTER, Canvas, Colour, WHITE};
use super::pipeline::{Pipeline, worst_px};

/// The moment of a moving case that is shown, s.
pub const SHOWN_S: f64 = 0.25;

/// Frame size of the cases.
pub const SIZE: [u32; 2] = [320, 240];
/// Pictures on the sheet have half of it, px.
const PICTURE: [u32; 2] = [SIZE[0] / 2, SIZE[1] / 2];
/// Width of a picture's place: 24 characters of text below it.
const PLACE: u32 = 24 * CHARACTER;
/// Places in a row.
const COLUMNS: u32 = 7;
/// Pixels between places.
const GAP: u32 = 8;
/// A line of text, px.
const LINE: u32 = CHARACTER + 3;
/// The legend above all.
const LEGEND: [(&str, Colour); 3] = [
    ("found, within tolerance", RIGHT),
    ("no force, and why", REJECTED),
    ("found, and wrong", WRONG),
];

const RIGHT: Colour = [0, 110, 60];
const REJECTED: Colour = [0, 80, 170];
const WRONG: Colour = [200, 0, 0];

/// Arguments of `scene cases`.
#[derive(Args)]
pub struct CasesArgs {
    /// The PNG file to write.
    #[arg(long)]
    out: PathBuf,
    /// Geometry preset: paper or ov7725.
    #[arg(long, default_value = "ov7725")]
    preset: Preset,
    /// Pictures in a row.
    #[arg(long, default_value_t = COLUMNS, value_parser = clap::value_parser!(u32).range(1..=20))]
    columns: u32,
    /// Only cases with this in their names.
    #[arg(long, default_value = "")]
    only: String,
}

impl CasesArgs {
    /// All cases as the `ov7725` camera sees them.
    pub(super) fn all(out: PathBuf) -> CasesArgs {
        CasesArgs {
            out,
            preset: Preset::Ov7725,
            columns: COLUMNS,
            only: String::new(),
        }
    }

    pub(super) fn run(&self) -> Result<()> {
        let cases: Vec<HardCase> = hard_cases()
            .into_iter()
            .filter(|case| case.name.contains(&self.only))
            .collect();
        anyhow::ensure!(
            !cases.is_empty(),
            "no hard case has `{}` in its name",
            self.only
        );
        let place = [PLACE + GAP, PICTURE[1] + 2 * LINE + 2 * GAP];
        let rows = (cases.len() as u32).div_ceil(self.columns);
        let top = LINE + 2 * GAP;
        let mut sheet = Canvas::new(GAP + self.columns * place[0], top + rows * place[1], WHITE);
        legend(&mut sheet);

        let nominal = Scene::preset("rest", self.preset, SIZE[0], SIZE[1], 1)?;
        let mut pipeline = Pipeline::tared(&nominal)?;
        for (number, case) in (0..).zip(&cases) {
            let frame = shown(case, self.preset)?;
            let x = GAP + number % self.columns * place[0];
            let y = top + number / self.columns * place[1];
            draw(
                &mut sheet,
                [x.into(), y.into()],
                case,
                &frame,
                &mut pipeline,
            );
        }
        sheet.save(&self.out)?;
        println!(
            "wrote {}: {} cases, {}×{}",
            self.out.display(),
            cases.len(),
            sheet.width(),
            sheet.height()
        );
        Ok(())
    }
}

fn shown(case: &HardCase, preset: Preset) -> Result<Frame> {
    Ok(case.scene(preset, SIZE[0], SIZE[1], 1)?.frame(0, SHOWN_S))
}

fn legend(sheet: &mut Canvas) {
    for (number, (words, colour)) in (0..).zip(LEGEND) {
        let x = i64::from(GAP) + number * i64::from(26 * CHARACTER);
        sheet.text([x, GAP.into()], 1, words, colour);
    }
}

fn draw(
    sheet: &mut Canvas,
    [x, y]: [i64; 2],
    case: &HardCase,
    frame: &Frame,
    pipeline: &mut Pipeline,
) {
    sheet.paste([x, y], &Canvas::of_frame(frame, 1).halved());
    let (said, colour) = outcome(case, frame, pipeline);
    let below = y + i64::from(PICTURE[1] + 4);
    sheet.text([x, below], 1, &case.name, BLACK);
    sheet.text([x, below + i64::from(LINE)], 1, &said, colour);
}

/// What the sensing makes of a frame.
fn outcome(case: &HardCase, frame: &Frame, pipeline: &mut Pipeline) -> (String, Colour) {
    let measurement = pipeline.measure(frame);
    match measurement.centroids_px {
        Some(centroids_px) if measurement.rejected.is_empty() => {
            let worst = worst_px(&centroids_px, &frame.truth);
            let right = worst <= case.tolerance_px(frame.width);
            let said = format!("within {worst:.2} px");
            (said, if right { RIGHT } else { WRONG })
        }
        _ => (measurement.rejected, REJECTED),
    }
}
