//! Which models fit a sensor, how one replaces another, and how a sensor starts.

use crate::device::settings;
use core::fmt;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::{Model, ModelError, Origin};
use hivtac_sensor::markers::settings::{Settings, SettingsError};
use hivtac_sensor::markers::tables::Table;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_wire::kept::Record;
use hivtac_wire::message::Outcome;

/// The camera and the unit that a model must fit.
#[derive(Clone, Copy, Debug)]
pub struct Fitting {
    /// Its lens and pixels.
    pub preset: Preset,
    /// Lens, frame and markers of the sensor with its camera.
    pub geometry: Geometry,
    /// The pixels that the camera can send; the first ones if no other are requested.
    pub pixels: &'static [PixelFormat],
    /// The unit's number.
    pub device_id: [u8; 12],
}

/// Why a model is refused.
#[derive(Debug)]
pub enum Refusal {
    /// It is not a model file, or not a sound one.
    Unusable(ModelError),
    /// It was made for a different camera than this one: lens, frame, pixels.
    Frames(Preset, Geometry),
    /// It was calibrated on a sensor with a different microcontroller.
    Unit,
    /// The sensor cannot have the settings that it needs.
    Settings,
}

impl Refusal {
    /// Returns the reply.
    pub fn outcome(&self) -> Outcome {
        match self {
            Refusal::Unusable(_) | Refusal::Settings => Outcome::ModelUnusable,
            Refusal::Frames(..) | Refusal::Unit => Outcome::AnotherSensor,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Unusable(error) => error.fmt(f),
            Refusal::Frames(preset, own) => write!(
                f,
                "the model is for another camera than {} at {}x{}",
                preset.name(),
                own.width,
                own.height
            ),
            Refusal::Unit => f.write_str("the model was calibrated on another unit"),
            Refusal::Settings => f.write_str("the model asks for frames that cannot be read"),
        }
    }
}

impl Fitting {
    /// Returns whether the camera sends pixels of a threshold.
    pub fn sends(&self, threshold: &Threshold) -> bool {
        self.pixels.contains(&threshold.format())
    }

    /// Reads a model file, and proves that it is sound and fits this sensor.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn check<'m>(&self, file: &'m [u8]) -> Result<Model<'m>, Refusal> {
        match Model::parse(file) {
            Ok(model) => match self.misfit(&model) {
                None => Ok(model),
                Some(refusal) => Err(refusal),
            },
            Err(error) => Err(Refusal::Unusable(error)),
        }
    }

    /// Why a sound model cannot be used here; `None` if it can.
    fn misfit(&self, model: &Model<'_>) -> Option<Refusal> {
        let conditions = &model.conditions;
        if conditions.geometry != self.geometry || !self.sends(&conditions.threshold) {
            return Some(Refusal::Frames(self.preset, self.geometry));
        }
        if matches!(conditions.origin, Origin::Unit(unit) if unit != self.device_id) {
            return Some(Refusal::Unit);
        }
        match self.settings(Some(model), None).check() {
            Ok(()) => None,
            Err(_) => Some(Refusal::Settings),
        }
    }

    /// Returns the settings for the camera's frames. The threshold is the first of these whose
    /// pixels the camera sends: the user's `own`, the model's, the usual one of the camera's
    /// pixels. A built-in model for other pixels then gives no force, and every sample reports
    /// that.
    pub fn settings(&self, model: Option<&Model<'_>>, own: Option<Threshold>) -> Settings {
        let order = ByteOrder::Swapped;
        let geometry = self.geometry;
        let usual = match model.filter(|model| self.sends(&model.conditions.threshold)) {
            Some(model) => Settings {
                geometry,
                ..model.conditions.settings(order)
            },
            None => {
                let usual = Settings::usual(geometry, order);
                let pixels = self.pixels.first().copied();
                Settings {
                    threshold: pixels.map_or(usual.threshold, Threshold::red),
                    ..usual
                }
            }
        };
        let own = own.filter(|own| self.sends(own) && own.check().is_ok());
        Settings {
            threshold: own.unwrap_or(usual.threshold),
            ..usual
        }
    }

    /// Replaces the sensor's model. The threshold becomes the new model's, unless a user has set a
    /// different one. The rest position stays if markers are found in the same way. With `afresh`,
    /// the threshold is always the model's, and the rest position is discarded.
    ///
    /// Returns the wanted threshold if its pixels differ from the camera's. Until the camera sends
    /// them, the previous threshold stays, and there is no force.
    ///
    /// # Errors
    /// Settings out of range: never for a [checked](Self::check) model. Nothing changes then.
    pub fn replace<'m, const BLOBS: usize, T: Table>(
        &self,
        sensor: &mut Sensor<'m, BLOBS, T>,
        next: Option<Model<'m>>,
        afresh: bool,
    ) -> Result<Option<Threshold>, SettingsError> {
        let used = *sensor.settings();
        let made_for = sensor.model().map(|model| model.conditions.threshold);
        let is_own = made_for.is_some_and(|threshold| threshold != used.threshold);
        let own = (is_own && !afresh).then_some(used.threshold);
        let mut settings = self.settings(next.as_ref(), own);
        let wanted = settings.threshold;
        let sends_it = wanted.format() == used.threshold.format();
        if !sends_it {
            settings.threshold = used.threshold;
        }
        match afresh {
            true => sensor.configure(settings, next)?,
            false => sensor.reconfigure(settings, next)?,
        }
        Ok((!sends_it).then_some(wanted))
    }
}

/// A kept setting that a start could not use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unusable {
    /// The rest position does not fit these settings.
    Tare,
    /// The limits of contact, slip or filter are out of range.
    Temporal,
}

/// Gives a configured sensor the kept rest position and limits; `warn` hears of those that cannot
/// be used.
pub fn start<const BLOBS: usize, T: Table>(
    sensor: &mut Sensor<'_, BLOBS, T>,
    kept: &Record,
    mut warn: impl FnMut(Unusable),
) {
    let tare = kept.tare.as_ref();
    match tare.map(|tare| settings::rest(tare, sensor)) {
        Some(Ok(rest)) => {
            let down = tare.and_then(|tare| tare.down);
            sensor.set_tare_under(Some(rest), Drift::UNSEEN, down);
        }
        Some(Err(_)) => warn(Unusable::Tare),
        None => {}
    }
    if sensor.set_temporal(kept.temporal).is_err() {
        warn(Unusable::Temporal);
    }
}
