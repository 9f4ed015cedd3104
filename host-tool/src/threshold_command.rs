//! `hivtac threshold`: sets which pixels belong to a marker.

use crate::auto_threshold::{self, AutoArguments};
use crate::device::Device;
use crate::hsv;
use crate::output;
use crate::set_threshold::set_threshold;
use clap::{Args, Subcommand};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::threshold::{text, to_json};
use hivtac_terms::threshold::{HsvBox, Mono, Threshold, Yuv422};
use hivtac_wire::message::DeviceHello;
use serde_json::json;

/// Set which pixels a marker may have, and with that the camera's pixel format, until the
/// device restarts
///
/// There are forces only with the threshold that the device's model was made for; markers there
/// are all the same, as `hivtac-calibrate collect` needs them. Another pixel format forgets the
/// tare.
///
/// Example: hivtac threshold --hsv 170,10,100,255,45,255
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct ThresholdArguments {
    #[command(subcommand)]
    auto: Option<ThresholdCommand>,
    #[command(flatten)]
    device: Device,
    #[command(flatten)]
    wanted: Option<WantedThreshold>,
    /// Keep it through restarts
    #[arg(long)]
    keep: bool,
    /// One JSON object instead of a line
    #[arg(long)]
    json: bool,
}

/// How the threshold is found.
#[derive(Subcommand)]
enum ThresholdCommand {
    Auto(AutoArguments),
}

/// The threshold to set.
#[derive(Args)]
#[group(required = true, multiple = false)]
struct WantedThreshold {
    /// RGB565; inclusive bounds in OpenCV's 8-bit HSV: hue 0–179 (h0 > h1 wraps), saturation and
    /// value 0–255
    #[arg(long, value_name = "h0,h1,s0,s1,v0,v1", value_parser = hsv::parse)]
    hsv: Option<HsvBox>,
    /// YUV422; lowest Cr, 0–255
    #[arg(long, value_name = "LOW")]
    cr: Option<u8>,
    /// Mono; inclusive bounds of the luma, 0–255. An MT9V034 sends it, an OV7725 does not
    #[arg(long, value_name = "l0,l1", value_parser = hsv::parse_luma)]
    luma: Option<Mono>,
    /// The one that the device's model was made for
    #[arg(long)]
    model: bool,
}

impl WantedThreshold {
    /// The wanted threshold; `None` for the model's.
    fn threshold(&self) -> Option<Threshold> {
        let hsv = self.hsv.map(Threshold::Rgb565);
        let cr = self.cr.map(|cr_low| Threshold::Yuv422(Yuv422 { cr_low }));
        hsv.or(cr).or(self.luma.map(Threshold::Mono))
    }
}

/// Sets the given or the model's threshold, until the device restarts or for good; or finds one.
pub fn run(arguments: &ThresholdArguments) -> Result<(), Failure> {
    let ThresholdArguments {
        auto,
        device,
        wanted,
        keep,
        json,
    } = arguments;
    if let Some(ThresholdCommand::Auto(arguments)) = auto {
        return auto_threshold::run(arguments);
    }
    let (mut link, hello) = device.connect()?;
    let wanted = wanted.as_ref().and_then(WantedThreshold::threshold);
    let wanted = wanted.map_or_else(|| of_model(&hello), Ok)?;
    set_threshold(&mut link, &hello, wanted, device.timeout, *keep)?;
    let kept = if *keep { " and kept" } else { "" };
    output::tell(
        *json,
        &format!("threshold set{kept}: {}", text(&wanted)),
        &json!({ "threshold": to_json(&wanted), "kept": keep }),
    )
}

fn of_model(hello: &DeviceHello) -> Result<Threshold, Failure> {
    let none = || {
        let message = "the device has no usable model; say which threshold with --hsv or --cr";
        Failure::new(Kind::Refused, message.to_owned())
    };
    let model = hello.model.as_ref().ok_or_else(none)?;
    Ok(model.threshold)
}
