//! Carries out the host's requests and answers them.

use super::Device;
use hivtac_portable::device::kept;
use hivtac_portable::device::settings;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network;
use hivtac_sensor::known_answer;
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::health::{BrownOut, Health, Problem, ResetReason};
use hivtac_wire::kept::{KeptModel, Record};
use hivtac_wire::message::{
    Command, DeviceMessage, LogLevel, MODEL_BYTES, ModelPart, ModelSource, Outcome, Request,
};
use hivtac_wire::settings::{Name, RestPosition, Selection};

impl Device {
    pub(super) fn obey(&mut self, Command { id, request }: Command) {
        if let Some(outcome) = self.carry_out(id, request) {
            self.out.reply(id, outcome);
        }
    }

    /// Returns the outcome; `None` if a later frame or message answers.
    fn carry_out(&mut self, id: u16, request: Request) -> Option<Outcome> {
        match request {
            Request::GetInfo => {
                let hello = self.hello();
                self.out.answer(DeviceMessage::Hello(hello));
                self.stats.uptime_us = self.now_us;
                self.out.answer(DeviceMessage::Stats(self.stats));
            }
            Request::Start | Request::StartWithMarkers => {
                self.with_markers = request == Request::StartWithMarkers;
                self.streams = true;
            }
            Request::Stop => self.streams = false,
            Request::SetThreshold(threshold) => return self.set_threshold(id, threshold),
            Request::Expose => {
                self.camera.expose(self.light);
                self.sensor.forget_frame();
            }
            Request::SetCamera(settings) => return Some(self.set_camera(settings)),
            Request::Inspect => {
                let inspection = self.camera.inspection();
                self.out.answer(DeviceMessage::Inspection(inspection));
            }
            Request::Snapshot => return self.ask_snapshot(id),
            Request::Tare { frames } => return self.tare(id, frames, false),
            Request::TareAnyway { frames } => return self.tare(id, frames, true),
            Request::SetTare(position) => return Some(self.set_tare(position)),
            Request::SetName(name) => self.name = name,
            Request::SetContactShape(shape) if !shape.is_sound() => {
                return Some(Outcome::InvalidArgument);
            }
            Request::SetContactShape(shape) => self.contact_shape = shape,
            Request::SetTemporal(settings) => {
                let set = self.sensor.set_temporal(settings);
                return Some(set.map_or(Outcome::InvalidArgument, |()| Outcome::Done));
            }
            Request::BeginModel { bytes } => return Some(self.begin_model(bytes)),
            Request::ModelPart(part) => return Some(self.model_part(&part)),
            Request::UseModel => return self.use_model(id),
            Request::UseBuiltInModel => {
                self.record.model = None;
                return self.use_built_in(id, false);
            }
            Request::GetSettings => {
                let (camera, keeper) = (self.camera.report(), self.keeper());
                let report = kept::report(self.in_use(), camera, &self.record, &keeper);
                self.out.answer(DeviceMessage::Settings(report));
            }
            Request::GetHealth => {
                let health = self.health();
                self.out.answer(DeviceMessage::Health(health));
            }
            Request::StartLoader => {
                let why = "a twin has no loader: it runs no firmware";
                self.say(LogLevel::Error, format_args!("{why}"));
                return Some(Outcome::Unsupported);
            }
            Request::Keep(selection) => self.keep(selection),
            Request::Reset => return self.reset(id),
        }
        Some(Outcome::Done)
    }

    fn set_threshold(&mut self, id: u16, threshold: Threshold) -> Option<Outcome> {
        if self.next_threshold.is_some() {
            return Some(Outcome::Busy);
        }
        if threshold.check().is_err() {
            return Some(Outcome::InvalidArgument);
        }
        if !self.fitting.sends(&threshold) {
            return Some(Outcome::Unsupported);
        }
        if threshold.format() != self.sensor.threshold().format() {
            self.wait_for(id, threshold);
            return None;
        }
        // It was checked.
        let _ = self.sensor.set_threshold(threshold);
        self.sensor.forget_frame();
        Some(Outcome::Done)
    }

    /// Asks the camera for the pixels of a threshold.
    fn wait_for(&mut self, id: u16, threshold: Threshold) {
        self.next_threshold = Some((id, threshold));
        self.camera.pixels = threshold.format();
    }

    fn set_camera(&mut self, settings: CameraSettings) -> Outcome {
        if !self.camera.accepts(&settings) {
            return Outcome::InvalidArgument;
        }
        self.camera.set(settings, self.light);
        self.sensor.forget_frame();
        Outcome::Done
    }

    fn ask_snapshot(&mut self, id: u16) -> Option<Outcome> {
        if self.snapshot.is_some() || self.out.sends_snapshot() {
            return Some(Outcome::Busy);
        }
        self.snapshot = Some(id);
        None
    }

    fn set_tare(&mut self, position: Option<RestPosition>) -> Outcome {
        let rest = position.map(|position| settings::rest(&position, &self.sensor));
        match rest.transpose() {
            Ok(rest) => {
                self.give_up_tare();
                // It was taken at another time, so the film may have drifted.
                let down = position.and_then(|position| position.down);
                self.sensor.set_tare_under(rest, Drift::UNSEEN, down);
                Outcome::Done
            }
            Err(outcome) => outcome,
        }
    }

    fn begin_model(&mut self, bytes: u32) -> Outcome {
        let length = bytes as usize;
        if length == 0 || length > MODEL_BYTES {
            return Outcome::InvalidArgument;
        }
        self.upload = Some((length, Vec::with_capacity(length)));
        Outcome::Done
    }

    fn model_part(&mut self, part: &ModelPart) -> Outcome {
        match &mut self.upload {
            Some((length, file))
                if part.offset as usize == file.len()
                    && file.len() + part.bytes.len() <= *length =>
            {
                file.extend_from_slice(&part.bytes);
                Outcome::Done
            }
            _ => Outcome::InvalidArgument,
        }
    }

    fn use_model(&mut self, id: u16) -> Option<Outcome> {
        let whole = self
            .upload
            .take()
            .filter(|(length, file)| file.len() == *length);
        let Some((length, file)) = whole else {
            return Some(Outcome::InvalidArgument);
        };
        if let Err(refusal) = self.fitting.check(&file) {
            self.say(LogLevel::Error, format_args!("{refusal}"));
            return Some(refusal.outcome());
        }
        // Models stay until the twin ends: some ten kilobytes for each upload.
        let Ok(model) = Model::parse(file.leak()) else {
            return Some(Outcome::ModelUnusable);
        };
        self.record.model = Some(KeptModel {
            slot: 0,
            bytes: length as u32,
            crc: model.crc(),
        });
        self.replace(id, Some(model), ModelSource::Kept, false)
    }

    fn use_built_in(&mut self, id: u16, afresh: bool) -> Option<Outcome> {
        let model = Model::parse(self.built_in).ok();
        self.replace(id, model, ModelSource::BuiltIn, afresh)
    }

    fn replace(
        &mut self,
        id: u16,
        model: Option<Model<'static>>,
        source: ModelSource,
        afresh: bool,
    ) -> Option<Outcome> {
        self.give_up_tare();
        let Ok(wanted) = self.fitting.replace(&mut self.sensor, model, afresh) else {
            return Some(Outcome::ModelUnusable);
        };
        self.source = source;
        self.sensor.forget_frame();
        if afresh {
            // The usual settings are always valid.
            let _ = self.sensor.set_temporal(TemporalSettings::USUAL);
        }
        match wanted.filter(|_| self.next_threshold.is_none()) {
            Some(threshold) => {
                self.wait_for(id, threshold);
                None
            }
            None => Some(Outcome::Done),
        }
    }

    fn keep(&mut self, selection: Selection) {
        let (used, camera) = (self.in_use(), self.camera.report());
        kept::keep(&mut self.record, selection, used, &camera);
    }

    fn reset(&mut self, id: u16) -> Option<Outcome> {
        self.record = Record::default();
        self.name = Name::new();
        self.down = Down::default();
        self.contact_shape = ContactShape::default();
        self.camera.set(CameraSettings::default(), self.light);
        self.use_built_in(id, true)
    }

    /// The self-test: of a device's checks, those that a twin can fail. It has neither stack nor
    /// temperature nor supply; it reports the latter two as 25 °C and watched.
    fn health(&mut self) -> Health {
        let answers_right = Model::parse(self.built_in).is_ok_and(|model| {
            let expected = known_answer::of(&model, &mut Network::new());
            self.sensor.known_answer(&model) == expected
        });
        let problem = |problem: Problem, is_there: bool| match is_there {
            true => problem.bit(),
            false => 0,
        };
        let problems = problem(Problem::ModelMissing, self.sensor.model().is_none())
            | problem(Problem::Arithmetic, !answers_right);
        Health {
            reset: ResetReason::PowerOn,
            temperature_centidegrees: Some(2_500),
            stack_used: 0,
            stack_bytes: 0,
            problems,
            at_start: 0,
            brown_out: BrownOut::High,
            failure: None,
        }
    }
}
