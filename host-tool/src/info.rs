//! `hivtac info`: the device's identity, settings and counters.

use crate::device::Device;
use crate::health::{self, HealthJson};
use crate::output::{self, note};
use crate::settings;
use crate::settings::temporal::{FilterJson, filter_text};
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_host::reply::log_text;
use hivtac_host::shown::{shown, unit_number};
use hivtac_host::threshold::{text, to_json as threshold_json};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::temporal::Filter;
use hivtac_terms::threshold::Threshold;
use hivtac_terms::units::{MilliPx, Px};
use hivtac_wire::message::{
    DeviceHello, DeviceMessage, ModelIdentity, ModelSource, Request, Stats,
};
use hivtac_wire::settings::SettingsReport;
use serde::{Serialize, Serializer};
use std::time::Duration;

/// Show the device's identity, settings, counters and health
///
/// Example: hivtac info
#[derive(Args)]
pub struct InfoArguments {
    #[command(flatten)]
    device: Device,
    /// One JSON object instead of lines
    #[arg(long)]
    json: bool,
}

/// Prints the device's hello and counters, as lines or as one JSON object.
pub fn run(arguments: &InfoArguments) -> Result<(), Failure> {
    let patience = arguments.device.timeout;
    let (mut link, hello) = arguments.device.connect()?;
    let (hello, stats) = ask(&mut link, patience, hello)?;
    let settings = settings::ask(&mut link, patience)?;
    let health = health::ask(&mut link, patience)?;
    let info = Info {
        tare: Some(Tare::of(&settings)),
        health: Some(HealthJson::of(&health)),
        ..Info::new(&link.name, &hello, stats)
    };
    output::report(arguments.json, &info, || info.lines().join("\n")).map(|_| ())
}

/// Asks for the hello again, and for the counters.
pub fn ask(
    link: &mut Link,
    patience: Duration,
    mut hello: DeviceHello,
) -> Result<(DeviceHello, Option<Stats>), Failure> {
    let mut stats = None;
    link.request(Request::GetInfo, patience, |message| match message {
        DeviceMessage::Hello(newer) => hello = newer,
        DeviceMessage::Stats(newer) => stats = Some(newer),
        DeviceMessage::Log(line) => note(&log_text(&line)),
        _ => (),
    })?;
    Ok((hello, stats))
}

/// A device's identity, settings and counters.
#[derive(Serialize)]
pub struct Info<'a> {
    port: &'a str,
    protocol: u16,
    schema: String,
    device_id: String,
    name: &'a str,
    board: &'a str,
    firmware: &'a str,
    model: Option<Model<'a>>,
    width: u16,
    height: u16,
    #[serde(serialize_with = "as_json")]
    threshold: Threshold,
    preset: &'a str,
    dilations: u8,
    centroid: CentroidEstimator,
    #[serde(with = "FilterJson")]
    filter: Filter,
    stats: Option<Stats>,
    /// `None` for callers that do not show it.
    #[serde(skip_serializing_if = "Option::is_none")]
    tare: Option<Tare>,
    /// `None` for callers that do not show it.
    #[serde(skip_serializing_if = "Option::is_none")]
    health: Option<HealthJson>,
}

/// The rest position in use.
#[derive(Serialize)]
struct Tare {
    taken: bool,
    kept: bool,
    /// Distance from the kept rest position, px.
    drift_px: Option<f64>,
    /// Distance that re-zeroing moved it since it was taken, px.
    rezeroed_px: f64,
    /// Distance from it of the untouched film when last seen, px.
    seen_px: Option<f64>,
}

impl Tare {
    fn of(settings: &SettingsReport) -> Tare {
        let taken = settings.tare.is_some();
        Tare {
            taken,
            kept: taken && settings.kept.tare,
            drift_px: settings.drift.map(Px::to_f64),
            rezeroed_px: settings.rezeroed.to_f64(),
            seen_px: settings.seen.map(MilliPx::to_f64),
        }
    }

    fn text(&self) -> String {
        let state = match self {
            Tare { taken: false, .. } => "none; take one of the untouched film with `hivtac tare`",
            Tare { kept: true, .. } => "kept",
            _ => "taken, until restart",
        };
        let mut text = state.to_owned();
        if let Some(drift) = self.drift_px.filter(|_| !self.kept) {
            text += &format!("; {drift:.3} px from the kept one");
        }
        text + &settings::rest_text(self.rezeroed_px, self.seen_px)
    }
}

/// The model in use.
#[derive(Serialize)]
pub struct Model<'a> {
    crc: String,
    name: &'a str,
    markers: u8,
    simulated: bool,
    source: &'static str,
    #[serde(serialize_with = "as_json")]
    threshold: Threshold,
}

impl<'a> Model<'a> {
    /// From the identity that a device sends.
    pub fn of(model: &'a ModelIdentity) -> Model<'a> {
        Model {
            crc: format!("{:08x}", model.crc),
            name: &model.name,
            markers: model.markers,
            simulated: model.simulated,
            source: match model.source {
                ModelSource::BuiltIn => "built-in",
                ModelSource::Kept => "kept",
                ModelSource::Fallback => "fallback",
            },
            threshold: model.threshold,
        }
    }

    fn text(&self) -> String {
        let origin = match self.simulated {
            true => "simulated sensor",
            false => "this unit",
        };
        let name = shown(self.name);
        format!(
            "{name}, CRC {}, trained on: {origin}; {}",
            self.crc, self.source
        )
    }
}

fn as_json<S: Serializer>(threshold: &Threshold, serializer: S) -> Result<S::Ok, S::Error> {
    threshold_json(threshold).serialize(serializer)
}

impl<'a> Info<'a> {
    /// Of a device at `port`.
    pub fn new(port: &'a str, hello: &'a DeviceHello, stats: Option<Stats>) -> Info<'a> {
        Info {
            port,
            protocol: hello.protocol,
            schema: format!("{:#018x}", hello.schema),
            device_id: unit_number(&hello.device_id),
            name: &hello.name,
            board: &hello.board,
            firmware: &hello.firmware,
            model: hello.model.as_ref().map(Model::of),
            width: hello.width,
            height: hello.height,
            threshold: hello.threshold,
            preset: &hello.preset,
            dilations: hello.dilations,
            centroid: hello.centroid,
            filter: hello.filter,
            stats,
            tare: None,
            health: None,
        }
    }

    fn lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!("port       {}", self.port),
            format!("device     {}{}", self.device_id, self.called()),
            format!("board      {}", shown(self.board)),
            format!("firmware   {}", shown(self.firmware)),
            format!("protocol   {}, schema {}", self.protocol, self.schema),
            format!("model      {}", self.model_text()),
            format!("frame      {} × {} px", self.width, self.height),
            format!("threshold  {}", text(&self.threshold)),
            format!(
                "markers    preset {}, dilations {}, centroids {}",
                shown(self.preset),
                self.dilations,
                self.centroid.name()
            ),
        ];
        let model = self.model.as_ref().map(|model| &model.threshold);
        if let Some(made_for) = model.filter(|made_for| **made_for != self.threshold) {
            lines.push(format!(
                "           no force with it: the model was made for {}",
                text(made_for)
            ));
        }
        lines.push(format!("filter     {}", filter_text(self.filter)));
        if self
            .model
            .as_ref()
            .is_some_and(|model| model.source == "fallback")
        {
            lines.push(
                "           the kept model cannot be used; send it again with `hivtac update model`"
                    .to_owned(),
            );
        }
        let tare = self.tare.iter();
        lines.extend(tare.map(|tare| format!("tare       {}", tare.text())));
        lines.extend(self.stats.iter().flat_map(stats_lines));
        lines.extend(self.health.iter().flat_map(HealthJson::lines));
        lines
    }

    fn model_text(&self) -> String {
        let text = self.model.as_ref().map(Model::text);
        text.unwrap_or_else(|| "none".to_owned())
    }

    fn called(&self) -> String {
        match self.name {
            "" => String::new(),
            name => format!(", called {}", shown(name)),
        }
    }
}

/// The counters since boot.
fn stats_lines(stats: &Stats) -> [String; 4] {
    [
        format!(
            "frames     {} exposed, {} processed; dropped: busy {}, overrun {}, size {}, \
             set-up {}",
            stats.frames_exposed,
            stats.frames_processed,
            stats.dropped_busy,
            stats.dropped_overrun,
            stats.dropped_size,
            stats.dropped_setup
        ),
        format!(
            "camera     {} timeouts, {} restarts, {} overruns",
            stats.camera_timeouts, stats.camera_restarts, stats.capture_overruns
        ),
        format!(
            "USB        {} samples dropped, {} frames from the host rejected",
            stats.usb_dropped, stats.host_frames_rejected
        ),
        format!(
            "time       up {:.3} s; last frame took {} µs, its sample was ready {} µs after the \
             middle of its exposure",
            stats.uptime_us as f64 / 1e6,
            stats.processing_us,
            stats.latency_us
        ),
    ]
}
