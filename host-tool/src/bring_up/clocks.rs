//! Checks the clocks: frames must have the camera's set rate, and all of them must be read.

use super::report::Step;
use super::samples::{Wanted, collect};
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_wire::message::{DeviceMessage, Request, Sample, Stats};
use serde_json::json;
use std::time::Duration;

/// Time for which frames are watched.
const WATCH: Duration = Duration::from_secs(3);
/// Largest relative error of the rate; crystals are a hundred times better.
const RATE_PART: f64 = 0.01;

/// Watches frames and judges their rate and losses.
///
/// # Errors
/// When the connection breaks or the device does not answer.
pub fn step(link: &mut Link, patience: Duration, frame_time_us: u32) -> Result<Step, Failure> {
    let mut complaints = Vec::new();
    let before = stats(link, patience)?;
    let wanted = Wanted {
        enough: 200,
        least: 10,
        watch: WATCH,
        patience,
    };
    let samples = collect(link, Request::Start, &wanted, &mut complaints)?;
    let after = stats(link, patience)?;
    let mut step = judge(&samples, frame_time_us, complaints);
    let lost = before.zip(after).map_or_else(Vec::new, losses);
    step.add(lost);
    Ok(step)
}

fn stats(link: &mut Link, patience: Duration) -> Result<Option<Stats>, Failure> {
    let mut stats = None;
    link.request(Request::GetInfo, patience, |message| {
        if let DeviceMessage::Stats(newer) = message {
            stats = Some(newer);
        }
    })?;
    Ok(stats)
}

/// Frames that were not read, by cause, each with what to do.
fn losses((before, after): (Stats, Stats)) -> Vec<String> {
    let lost = |count: fn(&Stats) -> u32, what: &str| {
        let lost = count(&after).saturating_sub(count(&before));
        (lost > 0).then(|| format!("{lost} {what}"))
    };
    let causes = [
        lost(
            |stats| stats.dropped_size,
            "frames had too few or too many bytes: PIXCLK or HSYNC are disturbed; a shorter ribbon",
        ),
        lost(
            |stats| stats.dropped_overrun,
            "frames were lost by overruns of the camera interface",
        ),
        lost(
            |stats| stats.dropped_busy,
            "frames were overwritten before they were read",
        ),
        lost(
            |stats| stats.camera_timeouts,
            "times the camera was silent: VSYNC or PIXCLK do not come; the ribbon, or XCLK",
        ),
    ];
    causes.into_iter().flatten().collect()
}

/// Judges the rate by the device's clock. Because USB works, the device's crystal is right within a
/// quarter of a percent, and the camera's clock comes from the same crystal.
pub fn judge(samples: &[Sample], frame_time_us: u32, mut complaints: Vec<String>) -> Step {
    let wanted_hz = 1e6 / f64::from(frame_time_us.max(1));
    let Some(rate_hz) = rate_hz(samples) else {
        complaints.push("no frames come: VSYNC and PIXCLK of the ribbon, and XCLK".to_owned());
        let figures = json!({ "samples": samples.len(), "wanted_hz": wanted_hz });
        return Step::new("clocks", "no frames".to_owned(), complaints, figures);
    };
    let ratio = rate_hz / wanted_hz;
    let off = |ratio: f64, right: f64| (ratio / right - 1.0).abs() <= RATE_PART;
    let wrong = match ratio {
        _ if off(ratio, 1.0) => None,
        _ if off(ratio, 2.0) => Some(
            "twice as many frames as there should be: VSYNC bounces, or \
                                      the camera's clock is doubled",
        ),
        _ if off(ratio, 0.5) => Some(
            "half the frames that there should be: the camera's clock \
                                      loop does not multiply as set",
        ),
        _ => Some(
            "the camera's clock is not what it should be: XCLK, or a camera with a crystal \
                   of its own",
        ),
    };
    let found = format!("{rate_hz:.2} frames a second, {wanted_hz:.2} wanted");
    let figures = json!({
        "samples": samples.len(),
        "rate_hz": rate_hz,
        "wanted_hz": wanted_hz,
    });
    let wrong = wrong.into_iter().map(str::to_owned).collect();
    Step::new("clocks", found, wrong, figures)
}

/// Frame numbers over time; `None` for fewer than two samples.
fn rate_hz(samples: &[Sample]) -> Option<f64> {
    let [first, .., last] = samples else {
        return None;
    };
    let frames = last.frame.checked_sub(first.frame)?;
    let time_us = last.time_us.checked_sub(first.time_us)?;
    (frames > 0 && time_us > 0).then(|| f64::from(frames) / (time_us as f64 / 1e6))
}
