//! `hivtac tare`, `hivtac threshold` and `hivtac expose`: one command each.

use crate::output::{self, note};
use crate::settings;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::{Link, log_text};
use hivtac_host::port::Address;
use hivtac_host::threshold::{text, to_json};
use hivtac_terms::threshold::Threshold;
use hivtac_terms::units::Px;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Request};
use hivtac_wire::settings::{Moved, Selection, TareReport};
use serde::Serialize;
use serde_json::json;
use std::time::Duration;

/// Time a device may need for a frame at its slowest; an emulated one is slower than a real one.
const SLOWEST_FRAME: Duration = Duration::from_millis(500);
/// Time a tare may need besides.
pub const TARE_PATIENCE: Duration = Duration::from_secs(10);
/// Good frames that a tare averages when nothing else is said.
pub const TARE_FRAMES: u16 = 32;

/// How to take a tare.
pub struct Tare {
    /// Good frames to average, 1–256.
    pub frames: u16,
    /// Though something moves or touches the film.
    pub force: bool,
    /// Through restarts.
    pub keep: bool,
    /// One JSON object instead of a line.
    pub json: bool,
}

/// What a tare gave: pixels.
#[derive(Serialize)]
struct Tared {
    frames: u16,
    kept: bool,
    markers: [[f64; 2]; 4],
    spread_px: f64,
    moved: Option<MovedPx>,
}

/// How far the rest position is from the one before, and what a camera's motion explains of it.
#[derive(Serialize)]
struct MovedPx {
    farthest_px: f64,
    shift_px: [f64; 2],
    turn_deg: f64,
    larger: f64,
    beside_px: f64,
}

/// A tare when nothing else is said: the request, how long it may take, and what is said once it is
/// done.
pub fn usual_tare(patience: Duration) -> (Request, Duration, String) {
    let frames = TARE_FRAMES;
    let done = taken_over(frames);
    (Request::Tare { frames }, patience.max(TARE_PATIENCE), done)
}

fn taken_over(frames: u16) -> String {
    format!("tare taken over {frames} frames")
}

/// Takes the mean of the next good frames as the rest position, and tells it.
pub fn tare(address: &Address, patience: Duration, tare: &Tare) -> Result<(), Failure> {
    let Tare { frames, keep, .. } = *tare;
    let wait = TARE_PATIENCE + SLOWEST_FRAME * frames.into();
    let (mut link, _) = Link::connect(address, patience)?;
    let request = match tare.force {
        true => Request::TareAnyway { frames },
        false => Request::Tare { frames },
    };
    let mut report = None;
    link.request(request, wait, |message| match message {
        DeviceMessage::Tared(newest) => report = Some(newest),
        other => tell(other),
    })?;
    if keep {
        let selection = Selection {
            tare: true,
            ..Selection::NONE
        };
        settings::keep(&mut link, selection)?;
    }
    let report = report.map(|report| Tared::of(tare, &report));
    let line = match &report {
        Some(report) => report.line(),
        None => taken_over(frames),
    };
    output::tell(tare.json, &line, &json!(report))
}

impl Tared {
    fn of(tare: &Tare, report: &TareReport) -> Tared {
        Tared {
            frames: tare.frames,
            kept: tare.keep,
            markers: (report.rest.markers).map(|marker| [px(marker.x), px(marker.y)]),
            spread_px: px(report.spread),
            moved: report.moved.as_ref().map(MovedPx::of),
        }
    }

    fn line(&self) -> String {
        let kept = if self.kept { " and kept" } else { "" };
        let markers = self.markers.map(|[x, y]| format!("({x:.2}, {y:.2})"));
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
            farthest_px: px(moved.farthest),
            shift_px: [px(moved.shift.0), px(moved.shift.1)],
            turn_deg: f64::from(moved.turn.0) * 1e-3,
            larger: moved.larger.to_f64(),
            beside_px: px(moved.beside),
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

/// Pixels, exactly.
pub fn px(px: Px) -> f64 {
    f64::from(px.0) / f64::from(Px::ONE.0)
}

/// Has exposure and gain found anew for the light that there is.
pub fn expose(address: &Address, patience: Duration, json: bool) -> Result<(), Failure> {
    let (mut link, _) = Link::connect(address, patience)?;
    send(&mut link, Request::Expose, patience)?;
    output::tell(
        json,
        "exposure and gain found; take a new tare",
        &json!({ "exposed": true }),
    )
}

/// Sets the threshold, until the device restarts or for good: this one, or when none is given that
/// of its model.
pub fn threshold(
    address: &Address,
    patience: Duration,
    wanted: Option<Threshold>,
    keep: bool,
    json: bool,
) -> Result<(), Failure> {
    let (mut link, hello) = Link::connect(address, patience)?;
    let wanted = wanted.map_or_else(|| of_model(&hello), Ok)?;
    set_threshold(&mut link, &hello, wanted, patience, keep)?;
    let kept = if keep { " and kept" } else { "" };
    output::tell(
        json,
        &format!("threshold set{kept}: {}", text(&wanted)),
        &json!({ "threshold": to_json(&wanted), "kept": keep }),
    )
}

/// Sets a threshold, until the device restarts or for good, and says when there will be no forces
/// with it.
pub fn set_threshold(
    link: &mut Link,
    device: &DeviceHello,
    wanted: Threshold,
    patience: Duration,
    keep: bool,
) -> Result<(), Failure> {
    send(link, Request::SetThreshold(wanted), patience)?;
    if keep {
        let selection = Selection {
            threshold: true,
            ..Selection::NONE
        };
        settings::keep(link, selection)?;
    }
    let made_for = device.model.as_ref().map(|model| model.threshold);
    if let Some(made_for) = made_for.filter(|made_for| *made_for != wanted) {
        note(&format!(
            "hivtac: samples have markers but no force (model_mismatch): the device's model was \
             made for {}; `hivtac threshold --model` goes back to that",
            text(&made_for)
        ));
    }
    Ok(())
}

fn of_model(hello: &DeviceHello) -> Result<Threshold, Failure> {
    let none = || {
        let message = "the device has no usable model; say which threshold with --hsv or --cr";
        Failure::new(Kind::Refused, message.to_owned())
    };
    let model = hello.model.as_ref().ok_or_else(none)?;
    Ok(model.threshold)
}

/// Sends a command and waits for its reply.
pub fn send(link: &mut Link, request: Request, wait: Duration) -> Result<(), Failure> {
    link.request(request, wait, tell)
}

/// Shows a line that the device logs; of other messages nothing.
pub fn tell(message: DeviceMessage) {
    if let DeviceMessage::Log(line) = message {
        note(&log_text(&line));
    }
}
