//! `hivtac update`: a model of one's own for a device, without a compiler.

use crate::command::{send, tell};
use crate::info;
use crate::lines::to_json;
use crate::output::print;
use crate::settings::KEEP_PATIENCE;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::files::read_at_most;
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::shown::shown;
use hivtac_sensor::force::model::Model;
use hivtac_wire::message::{
    DeviceHello, MODEL_BYTES, MODEL_PART_BYTES, ModelIdentity, ModelPart, ModelSource, Request,
};
use serde::Serialize;
use std::time::{Duration, Instant};

/// How to update.
pub struct Options {
    /// Where the device is.
    pub address: Address,
    /// Longest wait for its hello and replies.
    pub patience: Duration,
    /// One JSON object instead of a line.
    pub json: bool,
}

/// Sends a model file, which the device checks, keeps and uses from then on.
///
/// # Errors
/// A file that is no model, before anything is asked of the device; what the device refuses; those
/// of [`Link::connect`].
pub fn model(options: &Options, path: &str) -> Result<(), Failure> {
    let file = read(path)?;
    let model = Model::parse(&file).map_err(|error| unusable(path, error))?;
    let begun = Instant::now();
    let (mut link, hello) = Link::connect(&options.address, options.patience)?;
    let bytes = file.len() as u32;
    send(&mut link, Request::BeginModel { bytes }, options.patience)?;
    for part in parts(&file) {
        send(&mut link, Request::ModelPart(part), options.patience)?;
    }
    link.request(Request::UseModel, options.patience.max(KEEP_PATIENCE), tell)?;
    let (hello, _) = info::ask(&mut link, options.patience, hello)?;
    let used = in_use(&link, hello, |used| {
        used.source == ModelSource::Kept && used.crc == model.crc()
    })?;
    say(options, &used, begun.elapsed())
}

/// Has the device use the model that is built into its firmware, and forget the one it keeps.
///
/// # Errors
/// What the device refuses; those of [`Link::connect`].
pub fn built_in_model(options: &Options) -> Result<(), Failure> {
    let begun = Instant::now();
    let (mut link, hello) = Link::connect(&options.address, options.patience)?;
    link.request(
        Request::UseBuiltInModel,
        options.patience.max(KEEP_PATIENCE),
        tell,
    )?;
    let (hello, _) = info::ask(&mut link, options.patience, hello)?;
    let used = in_use(&link, hello, |used| used.source == ModelSource::BuiltIn)?;
    say(options, &used, begun.elapsed())
}

fn read(path: &str) -> Result<Vec<u8>, Failure> {
    let file = read_at_most(path, MODEL_BYTES as u64).map_err(|error| unusable(path, error))?;
    file.ok_or_else(|| {
        unusable(
            path,
            format!("a model for a device has at most {MODEL_BYTES} bytes"),
        )
    })
}

fn unusable(path: &str, why: impl std::fmt::Display) -> Failure {
    Failure::input(format!("{path}: {why}"))
}

fn parts(file: &[u8]) -> impl Iterator<Item = ModelPart> + '_ {
    let chunks = (0..)
        .step_by(MODEL_PART_BYTES)
        .zip(file.chunks(MODEL_PART_BYTES));
    chunks.map(|(offset, chunk)| ModelPart {
        offset,
        // A chunk has at most as many bytes as a part.
        bytes: chunk.iter().copied().collect(),
    })
}

/// The model that the device says it uses, which is the wanted one.
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

/// What an update did.
#[derive(Serialize)]
struct Update<'a> {
    model: info::Model<'a>,
    seconds: f64,
}

fn say(options: &Options, used: &ModelIdentity, took: Duration) -> Result<(), Failure> {
    let seconds = took.as_secs_f64();
    let line = match options.json {
        true => to_json(&Update {
            model: info::Model::of(used),
            seconds,
        }),
        false => format!(
            "in use and kept: {}, CRC {:08x}, after {seconds:.1} s; take a new tare if the markers \
             are seen otherwise now (`hivtac info`)",
            shown(&used.name),
            used.crc
        ),
    };
    print(&line).map(|_| ())
}
