//! `hivtac tare`: takes the film's present position as its rest position.

use crate::device::Device;
use crate::output;
use crate::request::{keep, show_log};
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::usual_tare::{TARE_FRAMES, TARE_PATIENCE, taken_over};
use hivtac_wire::message::{DeviceMessage, Request};
use hivtac_wire::settings::{Moved, Selection, TareReport};
use serde::Serialize;
use serde_json::json;
use std::time::Duration;

/// Longest time between two frames; an emulated device is slower than a real one.
const SLOWEST_FRAME: Duration = Duration::from_millis(500);
/// Take the present position of the film as its rest position, until the device restarts
///
/// Refused while something moves the film or touches it, compared with the earlier tare. Shows the
/// markers' places, their scatter, and their distance from the earlier ones.
///
/// Example: hivtac tare --keep
#[derive(Args)]
pub struct TareArguments {
    #[command(flatten)]
    device: Device,
    /// Good frames to average
    #[arg(
        long,
        value_name = "N",
        default_value_t = TARE_FRAMES,
        value_parser = clap::value_parser!(u16).range(1..=256)
    )]
    frames: u16,
    /// Keep it through restarts
    #[arg(long)]
    keep: bool,
    /// Though something moves or touches the film
    #[arg(long)]
    force: bool,
    /// One JSON object instead of a line
    #[arg(long)]
    json: bool,
}

/// The result of a tare, px.
#[derive(Serialize)]
struct Tared {
    frames: u16,
    kept: bool,
    markers: Vec<[f64; 2]>,
    spread_px: f64,
    moved: Option<MovedPx>,
}

/// Distance of the new rest position from the old one, and the part that a motion of the camera
/// explains.
#[derive(Serialize)]
struct MovedPx {
    farthest_px: f64,
    shift_px: [f64; 2],
    turn_deg: f64,
    larger: f64,
    beside_px: f64,
}

/// Takes the mean of the next good frames as the rest position, and prints the result.
pub fn run(tare: &TareArguments) -> Result<(), Failure> {
    let frames = tare.frames;
    let wait = TARE_PATIENCE + SLOWEST_FRAME * frames.into();
    let (mut link, _) = tare.device.connect()?;
    let request = match tare.force {
        true => Request::TareAnyway { frames },
        false => Request::Tare { frames },
    };
    let mut report = None;
    link.request(request, wait, |message| match message {
        DeviceMessage::Tared(newest) => report = Some(newest),
        other => show_log(other),
    })?;
    if tare.keep {
        let selection = Selection {
            tare: true,
            ..Selection::NONE
        };
        keep(&mut link, selection)?;
    }
    let report = report.map(|report| Tared::of(tare, &report));
    let line = match &report {
        Some(report) => report.line(),
        None => taken_over(frames),
    };
    output::tell(tare.json, &line, &json!(report))
}

impl Tared {
    fn of(tare: &TareArguments, report: &TareReport) -> Tared {
        Tared {
            frames: tare.frames,
            kept: tare.keep,
            markers: (report.rest.markers.iter())
                .map(|marker| [marker.x.to_f64(), marker.y.to_f64()])
                .collect(),
            spread_px: report.spread.to_f64(),
            moved: report.moved.as_ref().map(MovedPx::of),
        }
    }

    fn line(&self) -> String {
        let kept = if self.kept { " and kept" } else { "" };
        let markers = self.markers.iter();
        let markers: Vec<String> = markers.map(|[x, y]| format!("({x:.2}, {y:.2})")).collect();
        let moved = match &self.moved {
            Some(moved) => moved.text(),
            None => "the first one".to_owned(),
        };
        format!(
            "tare taken over {} frames{kept}: markers at {} px, spread {:.3} px, {moved}",
            self.frames,
            markers.join(", "),
            self.spread_px
        )
    }
}

impl MovedPx {
    fn of(moved: &Moved) -> MovedPx {
        MovedPx {
            farthest_px: moved.farthest.to_f64(),
            shift_px: [moved.shift.0.to_f64(), moved.shift.1.to_f64()],
            turn_deg: f64::from(moved.turn.0) * 1e-3,
            larger: moved.larger.to_f64(),
            beside_px: moved.beside.to_f64(),
        }
    }

    fn text(&self) -> String {
        let [x, y] = self.shift_px;
        format!(
            "{:.3} px from the rest before: as if the camera had shifted the picture by ({x:.2}, \
             {y:.2}) px, turned it by {:.2}° and enlarged it by {:.2} %, but for {:.3} px",
            self.farthest_px,
            self.turn_deg,
            1e2 * self.larger,
            self.beside_px
        )
    }
}
