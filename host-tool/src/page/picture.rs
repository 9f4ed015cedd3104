//! Encodes a frame for the page: a line of JSON, then its pixels, then its mask.

use super::Limits;
use crate::focus::Focus;
use crate::frame::Taken;
use crate::look::{self, PASSED};
use crate::marker_fields::MarkerJson;
use crate::shown::to_json;
use hivtac_terms::status::Status;
use hivtac_wire::message::{DeviceHello, Sample};
use serde::Serialize;

/// The data about a frame in the line of JSON.
#[derive(Serialize)]
struct PictureJson {
    frame: u32,
    width: u16,
    height: u16,
    /// The threshold it was read with.
    threshold: Limits,
    /// Number of pixels that pass, without those that dilation adds.
    passed: usize,
    /// The device's markers; `None` if it found none.
    markers: Option<Vec<MarkerJson>>,
    /// Faults of the picture with advice. Empty while something presses the film, which moves and
    /// changes the markers, and for dots of an unknown layout.
    wrong: Vec<String>,
}

/// The line with its end, three levels a pixel, and the mask with a byte a pixel.
pub fn bytes(taken: &Taken, device: &DeviceHello) -> Vec<u8> {
    let frame = &taken.frame;
    let pixels = usize::from(frame.width) * usize::from(frame.height);
    let mask = look::mask(frame, device.dilations).unwrap_or_else(|| vec![0; pixels]);
    let sample = taken.sample.as_ref();
    let is_pressed = sample.is_some_and(|sample| sample.status.contains(Status::CONTACT));
    let markers = sample.and_then(Sample::found);
    let header = PictureJson {
        frame: frame.number,
        width: frame.width,
        height: frame.height,
        threshold: Limits::of(&frame.threshold),
        passed: mask.iter().filter(|&&level| level == PASSED).count(),
        markers: markers.map(MarkerJson::all),
        wrong: match is_pressed {
            true => Vec::new(),
            false => Focus::of(frame, device).map_or_else(|_| Vec::new(), |focus| focus.wrong),
        },
    };
    let line = to_json(&header) + "\n";
    [line.as_bytes(), &look::levels(frame), &mask].concat()
}
