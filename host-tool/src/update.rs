//! `hivtac update`: sends a model or new firmware to a device, without a compiler.

use crate::device::Device;
use crate::firmware::{self, FirmwareArguments};
use crate::info;
use crate::output;
use crate::request::show_log;
use clap::{Args, Subcommand};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::model_file;
use hivtac_host::reply::KEEP_PATIENCE;
use hivtac_host::shown::shown;
use hivtac_wire::message::{DeviceHello, ModelIdentity, ModelSource, Request};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Give the device a model of its own, or new firmware
#[derive(Subcommand)]
pub enum UpdateCommand {
    Model(ModelArguments),
    Firmware(FirmwareArguments),
}

/// Send a model file, which the device checks, keeps through restarts and uses from then on
///
/// Forces go on with the earlier model until then. A file that is damaged, unsound, or made for
/// another camera or unit is refused, and nothing changes.
///
/// Example: hivtac update model thumb.hvtm
#[derive(Args)]
pub struct ModelArguments {
    #[command(flatten)]
    device: Device,
    /// The model file of `hivtac-calibrate`
    #[arg(value_name = "FILE.hvtm", required_unless_present = "built_in")]
    file: Option<String>,
    /// The model that is built into the firmware instead of a file; the kept one is forgotten
    #[arg(long, conflicts_with = "file")]
    built_in: bool,
    /// One JSON object instead of a line
    #[arg(long)]
    json: bool,
}

/// Sends a model file, has the built-in model used, or updates the firmware.
pub fn run(command: &UpdateCommand) -> Result<(), Failure> {
    match command {
        UpdateCommand::Model(arguments) => match &arguments.file {
            Some(path) => model(arguments, path),
            None => built_in_model(arguments),
        },
        UpdateCommand::Firmware(arguments) => firmware::update(arguments),
    }
}

/// Sends a model file, which the device checks, keeps and then uses.
///
/// # Errors
/// When the file is not a model, which is checked before anything is sent; when the device refuses;
/// those of [`Link::connect`].
pub fn model(arguments: &ModelArguments, path: &str) -> Result<(), Failure> {
    let device = &arguments.device;
    let address = device.address()?;
    let (file, crc) = model_file::read(path)?;
    let begun = Instant::now();
    let (mut link, hello) = Link::connect(&address, device.timeout)?;
    for request in model_file::requests(&file) {
        let patience = match request {
            Request::UseModel => device.timeout.max(KEEP_PATIENCE),
            _ => device.timeout,
        };
        link.request(request, patience, show_log)?;
    }
    let (hello, _) = info::ask(&mut link, device.timeout, hello)?;
    let used = in_use(&link, hello, |used| {
        used.source == ModelSource::Kept && used.crc == crc
    })?;
    say(arguments, &used, begun.elapsed())
}

/// Has the device use its built-in model, and forget the one it keeps.
///
/// # Errors
/// When the device refuses; those of [`Link::connect`].
pub fn built_in_model(arguments: &ModelArguments) -> Result<(), Failure> {
    let device = &arguments.device;
    let address = device.address()?;
    let begun = Instant::now();
    let (mut link, hello) = Link::connect(&address, device.timeout)?;
    link.request(
        Request::UseBuiltInModel,
        device.timeout.max(KEEP_PATIENCE),
        show_log,
    )?;
    let (hello, _) = info::ask(&mut link, device.timeout, hello)?;
    let used = in_use(&link, hello, |used| used.source == ModelSource::BuiltIn)?;
    say(arguments, &used, begun.elapsed())
}

/// The model that the device now reports; an error if it is not the wanted one.
fn in_use(
    link: &Link,
    hello: DeviceHello,
    is_wanted: impl Fn(&ModelIdentity) -> bool,
) -> Result<ModelIdentity, Failure> {
    let used = hello.model.filter(is_wanted);
    used.ok_or_else(|| {
        let message = format!(
            "{} says that it uses another model after the update; look with `hivtac info`, and try \
             again",
            link.name
        );
        Failure::new(Kind::Refused, message)
    })
}

/// The result of an update.
#[derive(Serialize)]
struct Update<'a> {
    model: info::Model<'a>,
    seconds: f64,
}

fn say(arguments: &ModelArguments, used: &ModelIdentity, took: Duration) -> Result<(), Failure> {
    let seconds = took.as_secs_f64();
    let update = Update {
        model: info::Model::of(used),
        seconds,
    };
    let text = || {
        format!(
            "in use and kept: {}, CRC {:08x}, after {seconds:.1} s; take a new tare if the markers \
             are seen otherwise now (`hivtac info`)",
            shown(&used.name),
            used.crc
        )
    };
    output::report(arguments.json, &update, text).map(|_| ())
}
