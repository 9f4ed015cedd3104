//! `hivtac snapshot`: one frame as the sensing saw it, into files.

use crate::command::tell;
use crate::finding::MarkerJson;
use crate::lines::{status_text, to_json};
use crate::output::print;
use hivtac_host::failure::Failure;
use hivtac_host::frame::{Frame, Taken, take};
use hivtac_host::link::Link;
use hivtac_host::look;
use hivtac_host::picture::{Channels, encode};
use hivtac_host::port::Address;
use hivtac_host::raw;
use hivtac_host::threshold;
use hivtac_wire::message::Request;
use serde::Serialize;
use serde_json::Value;
use std::time::Duration;

/// Which files to write; each is of the same frame.
#[derive(Debug)]
pub struct Files {
    /// The frame as PNG.
    pub picture: Option<String>,
    /// The bytes as the camera sent them, with a header.
    pub raw: Option<String>,
    /// The mask as PNG.
    pub mask: Option<String>,
}

/// Takes a frame and writes the files, and says what the device itself made of it.
pub fn run(
    address: &Address,
    patience: Duration,
    files: &Files,
    json: bool,
) -> Result<(), Failure> {
    let (mut link, hello) = Link::connect(address, patience)?;
    let taken = snapshot(&mut link, patience)?;
    write_files(files, &taken.frame, hello.dilations)?;
    let report = Report::new(&taken, files);
    print(&match json {
        true => to_json(&report),
        false => report.text(),
    })?;
    Ok(())
}

/// One frame with its sample and the markers in it: samples flow meanwhile, and no longer.
pub fn snapshot(link: &mut Link, patience: Duration) -> Result<Taken, Failure> {
    link.request(Request::StartWithMarkers, patience, tell)?;
    let taken = take(link, patience, tell)?;
    link.request(Request::Stop, patience, tell)?;
    Ok(taken)
}

fn write_files(files: &Files, frame: &Frame, dilations: u8) -> Result<(), Failure> {
    let (width, height) = (frame.width, frame.height);
    if let Some(path) = &files.raw {
        let name = frame.format().name();
        let no_file = || Failure::input(format!("{path} cannot hold {name}; save a PNG instead"));
        write(path, &raw::of(frame).ok_or_else(no_file)?)?;
    }
    if let Some(path) = &files.picture {
        let levels = look::levels(frame);
        write(
            path,
            &encode(path, Channels::Colour, width, height, &levels)?,
        )?;
    }
    if let Some(path) = &files.mask {
        let nothing = || Failure::input("the device's threshold means nothing".to_owned());
        let mask = look::mask(frame, dilations).ok_or_else(nothing)?;
        write(path, &encode(path, Channels::Grey, width, height, &mask)?)?;
    }
    Ok(())
}

fn write(path: &str, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes)
        .map_err(|error| Failure::input(format!("cannot write {path}: {error}")))
}

/// What was taken, and what the device made of it.
#[derive(Serialize)]
struct Report<'f> {
    frame: u32,
    time_us: u64,
    width: u16,
    height: u16,
    threshold: Value,
    picture: Option<&'f str>,
    raw: Option<&'f str>,
    mask: Option<&'f str>,
    /// As the device found them; none when it did not.
    markers: Option<Vec<MarkerJson>>,
    /// Of the frame's sample; nothing when that was lost.
    status: Option<Vec<&'static str>>,
    #[serde(skip)]
    threshold_text: String,
}

impl<'f> Report<'f> {
    fn new(taken: &Taken, files: &'f Files) -> Report<'f> {
        let Taken { frame, sample } = taken;
        let markers = sample.as_ref().and_then(|sample| sample.markers);
        Report {
            frame: frame.number,
            time_us: frame.time_us,
            width: frame.width,
            height: frame.height,
            threshold: threshold::to_json(&frame.threshold),
            picture: files.picture.as_deref(),
            raw: files.raw.as_deref(),
            mask: files.mask.as_deref(),
            markers: markers.map(|four| MarkerJson::all(&four)),
            status: sample
                .as_ref()
                .map(|sample| sample.status.names().collect()),
            threshold_text: threshold::text(&frame.threshold),
        }
    }

    fn text(&self) -> String {
        let found = match (&self.markers, &self.status) {
            (Some(_), _) => "the device found its markers".to_owned(),
            (None, Some(names)) => format!("the device: {}", status_text(names, false)),
            (None, None) => "what the device made of it was lost on the way".to_owned(),
        };
        let files = [self.picture, self.raw, self.mask];
        let files: Vec<_> = files.into_iter().flatten().collect();
        format!(
            "frame {} at {:.6} s: {} × {} px, {}; {found}\nwritten: {}",
            self.frame,
            self.time_us as f64 / 1e6,
            self.width,
            self.height,
            self.threshold_text,
            files.join(", ")
        )
    }
}
