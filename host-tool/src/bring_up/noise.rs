//! Takes a tare, and measures how still the markers are afterwards.

use super::complaints::hear;
use super::device::reason;
use super::report::Step;
use super::samples::{Wanted, collect};
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_host::usual_tare::TARE_PATIENCE;
use hivtac_terms::marker::MarkerList;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::Px;
use hivtac_wire::message::Request;
use serde_json::json;
use std::time::Duration;

/// Frames of the tare.
const TARE_FRAMES: u16 = 32;
/// Fewest frames for a judgement.
const LEAST_FRAMES: usize = 16;
/// Time for which frames are watched.
const WATCH: Duration = Duration::from_secs(5);
/// Multiple of the simulated sensor's noise from which noise is reported.
const MOST_TIMES: f64 = 3.0;

/// Takes a tare, and measures how far the markers of single frames lie from their mean.
///
/// # Errors
/// When the connection breaks.
pub fn step(link: &mut Link, patience: Duration, format: PixelFormat) -> Result<Step, Failure> {
    let mut complaints = Vec::new();
    let frames = TARE_FRAMES;
    let answer = link.request(
        Request::Tare { frames },
        patience + TARE_PATIENCE,
        |message| {
            hear(&mut complaints, message);
        },
    );
    if let Some(reason) = reason(answer)? {
        let found = "no tare was taken".to_owned();
        return Ok(Step::new("noise", found, vec![reason], json!(null)));
    }
    let wanted = Wanted {
        enough: 200,
        least: LEAST_FRAMES,
        watch: WATCH,
        patience,
    };
    let samples = collect(link, Request::StartWithMarkers, &wanted, &mut complaints)?;
    let frames: Vec<_> = samples.iter().map(|sample| sample.markers).collect();
    Ok(judge(&frames, format))
}

/// Judges the markers of frames at rest; those of frames without all markers are empty.
pub fn judge(frames: &[MarkerList], format: PixelFormat) -> Step {
    let markers = frames.iter().map(|seen| seen.len()).max().unwrap_or(0);
    let frames = frames
        .iter()
        .filter(|seen| markers > 0 && seen.len() == markers);
    let frames: Vec<&MarkerList> = frames.collect();
    let simulated_px = simulated_px(format);
    let deviations = deviations_px(&frames, markers);
    let squares = deviations.iter().flatten().map(|px| px * px).sum::<f64>();
    let square = squares / (2 * markers.max(1)) as f64;
    let (noise_px, times) = (square.sqrt(), square.sqrt() / simulated_px);
    let mut wrong = Vec::new();
    if frames.len() < LEAST_FRAMES {
        wrong.push(format!(
            "only {} frames showed all markers; `hivtac monitor` says why",
            frames.len()
        ));
    } else if times > MOST_TIMES {
        wrong.push(format!(
            "{times:.1} times what the simulated sensor has: light that flickers (use DC), a film \
             that shakes, too little light (gain), or a lens out of focus"
        ));
    }
    let found = format!(
        "tare taken; markers lie still to {noise_px:.4} px, {times:.1} times what the simulated \
         sensor has ({simulated_px} px)"
    );
    let figures = json!({
        "frames": frames.len(),
        "noise_px": noise_px,
        "simulated_px": simulated_px,
        "of_coordinates_px": deviations,
    });
    Step::new("noise", found, wrong, figures)
}

/// Standard deviation of a resting marker's coordinates on the simulated sensor, px. It is the root
/// mean square of the eight of four markers, measured by this command on the emulated board.
fn simulated_px(format: PixelFormat) -> f64 {
    match format {
        PixelFormat::Rgb565 => 0.009,
        PixelFormat::Yuv422 => 0.012,
        PixelFormat::Mono => 0.007,
    }
}

/// Standard deviations of each marker's coordinates, px.
fn deviations_px(frames: &[&MarkerList], markers: usize) -> Vec<[f64; 2]> {
    let count = frames.len().max(1) as f64;
    let deviation = |of: &dyn Fn(&MarkerList) -> Px| {
        let px = || frames.iter().map(|seen| of(seen).to_f64());
        let mean = px().sum::<f64>() / count;
        let squares = px().map(|px| (px - mean).powi(2));
        (squares.sum::<f64>() / count).sqrt()
    };
    (0..markers)
        .map(|id| {
            [
                deviation(&|seen| seen.at(id).x),
                deviation(&|seen| seen.at(id).y),
            ]
        })
        .collect()
}
