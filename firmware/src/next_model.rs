//! Replaces the model in use by a new one, between two frames.

use crate::dtcm_table::Sensor;
use crate::model::{self, Chosen};
use crate::model_slots;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::ModelSource;

/// The source of the model in use.
pub struct InUse {
    /// Its source.
    pub source: ModelSource,
    /// The slot that holds it; `None` for a built-in model.
    slot: Option<u8>,
}

impl InUse {
    /// The source and slot of the sensor's first model.
    pub fn of(chosen: &Chosen) -> Self {
        Self {
            source: chosen.source,
            slot: chosen.slot,
        }
    }
}

/// Replaces the sensor's model. The threshold becomes the new model's, unless a user has set a
/// different one. The rest position stays if markers are found in the same way. With `afresh`, the
/// threshold is always the model's, and the rest position is discarded.
///
/// Returns the wanted threshold if its pixels differ from the camera's. Until the camera sends
/// them, the previous threshold stays, and there is no force.
pub fn bring_into_use(
    next: Chosen,
    afresh: bool,
    sensor: &mut Sensor,
    in_use: &mut InUse,
) -> Option<Threshold> {
    let used = *sensor.settings();
    let made_for = sensor.model().map(|model| model.conditions.threshold);
    let is_own = made_for.is_some_and(|threshold| threshold != used.threshold);
    let own = (is_own && !afresh).then_some(used.threshold);
    let mut settings = model::settings(next.model.as_ref(), own);
    let wanted = settings.threshold;
    let sends_it = wanted.format() == used.threshold.format();
    if !sends_it {
        settings.threshold = used.threshold;
    }
    let now = InUse::of(&next);
    let configured = match afresh {
        true => sensor.configure(settings, next.model),
        false => sensor.reconfigure(settings, next.model),
    };
    if configured.is_err() {
        // Never happens: the settings were checked with the model.
        now.slot.into_iter().for_each(model_slots::give_back);
        return None;
    }
    let before = core::mem::replace(in_use, now);
    before.slot.into_iter().for_each(model_slots::give_back);
    (!sends_it).then_some(wanted)
}
