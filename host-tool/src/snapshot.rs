//! `hivtac snapshot`: writes one frame, as the sensing saw it, into files.

use crate::device::Device;
use crate::lines::status_text;
use crate::output;
use crate::request::show_log;
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::frame::{Frame, Taken};
use hivtac_host::link::Link;
use hivtac_host::look;
use hivtac_host::marker_fields::MarkerJson;
use hivtac_host::picture::{Channels, encode};
use hivtac_host::raw;
use hivtac_host::threshold;
use hivtac_wire::message::{Request, Sample};
use serde::Serialize;
use serde_json::Value;
use std::time::Duration;

/// Save a frame as the sensing saw it, while forces go on
///
/// It says what the device itself found in it, too. `hivtac sense` on the picture or the raw
/// frame finds the same; on that of YUV422 only on the raw frame, with the device's model.
///
/// Example: hivtac snapshot frame.png --mask mask.png
#[derive(Args)]
pub struct SnapshotArguments {
    #[command(flatten)]
    device: Device,
    #[command(flatten)]
    files: SnapshotFiles,
    /// One JSON object instead of lines
    #[arg(long)]
    json: bool,
}

/// Which files to write; each is of the same frame.
#[derive(Args)]
#[group(required = true, multiple = true)]
struct SnapshotFiles {
    /// The frame, as PNG
    #[arg(value_name = "FILE.png")]
    picture: Option<String>,
    /// The frame's bytes as the camera sent them, as PAM with two bytes a pixel
    #[arg(long, value_name = "FILE.pam")]
    raw: Option<String>,
    /// Mask: pixels that pass the threshold, white, and those by dilation, grey, as PNG
    #[arg(long, value_name = "FILE.png")]
    mask: Option<String>,
}

/// Takes a frame, writes the files, and prints the device's own result for it.
pub fn run(arguments: &SnapshotArguments) -> Result<(), Failure> {
    let SnapshotArguments {
        device,
        files,
        json,
    } = arguments;
    let (mut link, hello) = device.connect()?;
    let taken = snapshot(&mut link, device.timeout)?;
    write_files(files, &taken.frame, hello.dilations)?;
    let report = Report::new(&taken, files);
    output::report(*json, &report, || report.text()).map(|_| ())
}

/// Takes one frame with its sample and its markers. Samples flow only until it is complete.
pub fn snapshot(link: &mut Link, patience: Duration) -> Result<Taken, Failure> {
    link.request(Request::StartWithMarkers, patience, show_log)?;
    let taken = link.snapshot(patience, show_log)?;
    link.request(Request::Stop, patience, show_log)?;
    Ok(taken)
}

fn write_files(files: &SnapshotFiles, frame: &Frame, dilations: u8) -> Result<(), Failure> {
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

/// The frame's data and the device's own result.
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
    /// The device's markers; `None` if it found none.
    markers: Option<Vec<MarkerJson>>,
    /// The status of the frame's sample; `None` if the sample was lost.
    status: Option<Vec<&'static str>>,
    #[serde(skip)]
    threshold_text: String,
}

impl<'f> Report<'f> {
    fn new(taken: &Taken, files: &'f SnapshotFiles) -> Report<'f> {
        let Taken { frame, sample } = taken;
        let markers = sample.as_ref().and_then(Sample::found);
        Report {
            frame: frame.number,
            time_us: frame.time_us,
            width: frame.width,
            height: frame.height,
            threshold: threshold::to_json(&frame.threshold),
            picture: files.picture.as_deref(),
            raw: files.raw.as_deref(),
            mask: files.mask.as_deref(),
            markers: markers.map(MarkerJson::all),
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
