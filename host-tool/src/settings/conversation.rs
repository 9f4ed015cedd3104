//! Shows or changes the settings of a device.

use super::camera;
use super::file::{self, File, Kept};
use super::name::name;
use super::temporal::{self, Change};
use crate::device::Target;
use crate::output::{self, note};
use crate::request::{keep, send, set_camera, show_log};
use hivtac_host::contact_shape::text as text_of_shape;
use hivtac_host::down::text as text_of_down;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::reply::KEEP_PATIENCE;
use hivtac_host::shown::shown;
use hivtac_host::threshold::text;
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::units::MilliPx;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Request};
use hivtac_wire::settings::{Found, Name, RestPosition, Selection, SettingsReport};
use serde_json::{Value, json};
use std::time::Duration;

/// Asks a device for its settings.
///
/// # Errors
/// When the device refuses or does not answer.
pub fn ask(link: &mut Link, patience: Duration) -> Result<SettingsReport, Failure> {
    let mut report = None;
    link.request(Request::GetSettings, patience, |message| match message {
        DeviceMessage::Settings(newest) => report = Some(newest),
        other => show_log(other),
    })?;
    report.ok_or_else(|| link.lost("its settings did not come"))
}

/// A connection to a device whose settings are shown or changed.
pub struct Conversation {
    link: Link,
    hello: DeviceHello,
    patience: Duration,
    json: bool,
}

impl Conversation {
    /// Connects to the target's device.
    pub fn begin(target: &Target) -> Result<Conversation, Failure> {
        Conversation::begin_at(&target.device.address()?, target)
    }

    /// Connects to the device at an address.
    pub fn begin_at(address: &Address, target: &Target) -> Result<Conversation, Failure> {
        let patience = target.device.timeout;
        let (link, hello) = Link::connect(address, patience)?;
        Ok(Conversation {
            link,
            hello,
            patience,
            json: target.json,
        })
    }

    fn settings(&mut self) -> Result<SettingsReport, Failure> {
        ask(&mut self.link, self.patience)
    }

    fn send(&mut self, request: Request) -> Result<(), Failure> {
        send(&mut self.link, request, self.patience)
    }

    fn tell(&self, line: &str, object: Value) -> Result<(), Failure> {
        output::tell(self.json, line, &object)
    }

    /// Shows the settings.
    pub fn show(&mut self) -> Result<(), Failure> {
        let report = self.settings()?;
        let kept = Kept::new(&self.hello.device_id, &report);
        output::report(self.json, &kept, || lines(&report).join("\n")).map(|_| ())
    }

    /// Sets the device's name, and keeps it.
    pub fn set_name(&mut self, name: &Name) -> Result<(), Failure> {
        self.send(Request::SetName(name.clone()))?;
        let selection = Selection {
            name: true,
            ..Selection::NONE
        };
        keep(&mut self.link, selection)?;
        let line = format!("this device is now called {}", shown(name));
        self.tell(&line, json!({ "name": name.as_str(), "kept": true }))
    }

    /// Changes how forces are followed, and keeps that.
    pub fn set_temporal(&mut self, change: Change) -> Result<(), Failure> {
        let settings = change.of(self.settings()?.temporal);
        settings
            .check()
            .map_err(|error| Failure::new(Kind::Input, format!("{error}; nothing was changed")))?;
        self.send(Request::SetTemporal(settings))?;
        let selection = Selection {
            temporal: true,
            ..Selection::NONE
        };
        keep(&mut self.link, selection)?;
        let named = |(name, _): &(&str, String)| *name == change.name();
        let texts = temporal::texts(&settings).into_iter().find(named);
        let (name, text) = texts.unwrap_or_default();
        self.tell_set(name, &text, true)
    }

    /// Sets the camera, and keeps that.
    pub fn set_camera(&mut self, change: camera::Change) -> Result<(), Failure> {
        let settings = change
            .of(&self.settings()?.camera)
            .map_err(|error| Failure::new(Kind::Input, format!("{error}; nothing was changed")))?;
        set_camera(&mut self.link, settings, self.patience)?;
        let selection = Selection {
            camera: true,
            ..Selection::NONE
        };
        keep(&mut self.link, selection)?;
        let named = |(name, _): &(&str, String)| *name == change.name();
        let texts = camera::texts(&self.settings()?.camera);
        let (name, text) = texts.into_iter().find(named).unwrap_or_default();
        self.tell_set(name, &text, true)
    }

    /// Sets the direction of gravity, and keeps it.
    pub fn set_down(&mut self, down: Down) -> Result<(), Failure> {
        self.link.set_down(down)?;
        let selection = Selection {
            down: true,
            ..Selection::NONE
        };
        keep(&mut self.link, selection)?;
        let report = self.settings()?;
        let taken = report.tare.map(|tare| tare.down);
        if report.down.direction().is_some() && taken == Some(None) {
            note(
                "hivtac: nobody knows which way the sensor was held when its tare was taken: take \
                 it anew",
            );
        }
        self.tell_set("down", &text_of_down(report.down), true)
    }

    /// Sets the contact's shape, and keeps it if `is_kept`.
    pub fn set_contact_shape(&mut self, shape: ContactShape, is_kept: bool) -> Result<(), Failure> {
        self.send(Request::SetContactShape(shape))?;
        if is_kept {
            let selection = Selection {
                contact_shape: true,
                ..Selection::NONE
            };
            keep(&mut self.link, selection)?;
        }
        self.tell_set("contact", &text_of_shape(shape), is_kept)
    }

    /// Prints the new setting, and whether it was kept.
    fn tell_set(&self, name: &str, text: &str, is_kept: bool) -> Result<(), Failure> {
        let and_kept = if is_kept { " and kept" } else { "" };
        let line = format!("{name} set{and_kept}: {text}");
        self.tell(
            &line,
            json!({ "setting": name, "text": text, "kept": is_kept }),
        )
    }

    /// Saves the settings in a file.
    pub fn export(&mut self, path: &str) -> Result<(), Failure> {
        let report = self.settings()?;
        file::write(path, &File::new(&self.hello.device_id, &report))?;
        let line = format!("settings in use written to {path}");
        self.tell(&line, json!({ "file": path }))
    }

    /// Sets and keeps the settings of a file.
    pub fn import(&mut self, path: &str, file: &File) -> Result<(), Failure> {
        let is_own = file.is_of(&self.hello.device_id);
        if !is_own && file.tare.is_some() {
            note(&format!(
                "hivtac: {path} is of another device ({}): its rest position is left out; take a \
                 tare",
                shown(&file.device_id)
            ));
        }
        let tare = file.tare.filter(|_| is_own);
        let camera = self.settings()?.camera;
        let can = camera.limits.check(&file.camera);
        can.map_err(|error| Failure::of_file(path, format!("{error}; nothing was changed")))?;
        self.set(file, tare, camera.settings)?;
        let line = format!("settings of {path} are in use and kept");
        let parts = json!({ "file": path, "kept": true, "tare": tare.is_some() });
        self.tell(&line, parts)
    }

    /// Has the device forget all that it keeps.
    pub fn reset(&mut self) -> Result<(), Failure> {
        send(&mut self.link, Request::Reset, KEEP_PATIENCE)?;
        let line = "everything that was kept is forgotten; take a tare";
        self.tell(line, json!({ "kept": false }))
    }

    /// Sets and keeps all settings with this rest position, after the camera was set.
    fn set(
        &mut self,
        file: &File,
        tare: Option<RestPosition>,
        camera: CameraSettings,
    ) -> Result<(), Failure> {
        let name = name(&file.name).unwrap_or_default();
        let threshold = file.threshold;
        let unkept = |failure: Failure| {
            let what = "nothing was kept: a restart brings back the settings from before";
            Failure::new(failure.kind, format!("{failure}; {what}"))
        };
        // A change of pixel format forgets the rest position.
        if threshold != self.hello.threshold {
            self.send(Request::SetThreshold(threshold))
                .map_err(unkept)?;
        }
        if file.camera != camera {
            set_camera(&mut self.link, file.camera, self.patience).map_err(unkept)?;
        }
        self.link.set_down(file.down).map_err(unkept)?;
        self.send(Request::SetTare(tare)).map_err(unkept)?;
        let temporal = file.temporal;
        self.send(Request::SetTemporal(temporal)).map_err(unkept)?;
        let shape = file.contact_shape;
        self.send(Request::SetContactShape(shape)).map_err(unkept)?;
        self.send(Request::SetName(name)).map_err(unkept)?;
        keep(&mut self.link, Selection::ALL)
    }
}

/// Text about a rest position since it was taken: its motion by re-zeroing, and the last distance
/// of the untouched film from it, px. It is appended to a text about the position.
pub fn rest_text(rezeroed_px: f64, seen_px: Option<f64>) -> String {
    let mut text = String::new();
    if rezeroed_px != 0.0 {
        text += &format!("; re-zeroed by {rezeroed_px:.3} px");
    }
    if let Some(seen) = seen_px {
        text += &format!("; untouched, last seen {seen:.3} px from there");
    }
    text
}

fn lines(report: &SettingsReport) -> Vec<String> {
    let until = |kept: bool| match kept {
        true => "kept",
        false => "until restart",
    };
    let name = match report.name.as_str() {
        "" => "none".to_owned(),
        name => shown(name),
    };
    let taken = report.tare.map_or("none", |_| "taken");
    let seen_px = report.seen.map(MilliPx::to_f64);
    let tare = taken.to_owned() + &rest_text(report.rezeroed.to_f64(), seen_px);
    let found = match report.found {
        Found::Nothing => "no settings found at the start",
        Found::Settings => "settings found at the start",
        Found::AnotherVersion => {
            "settings of another version of the firmware, which this one does not read; they stay \
             until something is kept"
        }
    };
    let mut lines = vec![
        format!("name       {name} ({})", until(report.kept.name)),
        format!(
            "threshold  {} ({})",
            text(&report.threshold),
            until(report.kept.threshold)
        ),
        format!("tare       {tare} ({})", until(report.kept.tare)),
    ];
    let temporal = until(report.kept.temporal);
    let texts = temporal::texts(&report.temporal).into_iter();
    lines.extend(texts.map(|(name, text)| format!("{name:<11}{text} ({temporal})")));
    let camera = until(report.kept.camera);
    let texts = camera::texts(&report.camera).into_iter();
    lines.extend(texts.map(|(name, text)| format!("{name:<11}{text} ({camera})")));
    let down = until(report.kept.down);
    lines.push(format!("down       {} ({down})", text_of_down(report.down)));
    let shape = text_of_shape(report.contact_shape);
    let is_kept = until(report.kept.contact_shape);
    lines.push(format!("contact    {shape} ({is_kept})"));
    lines.extend([
        format!("flash      {found}"),
        format!(
            "           {} sectors erased in its life, {} failed attempts to write since the start",
            report.erases, report.failures
        ),
    ]);
    lines
}
