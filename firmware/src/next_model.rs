//! The model in use, and how another one takes its place: between two frames.

use crate::dtcm_table::Sensor;
use crate::model::{self, Chosen};
use crate::model_slots;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::ModelSource;

/// Where the model in use is from.
pub struct InUse {
    /// Where it came from.
    pub source: ModelSource,
    /// The slot that it lies in; none for a built-in one.
    slot: Option<u8>,
}

impl InUse {
    /// Of the model that the sensor begins with.
    pub fn of(chosen: &Chosen) -> Self {
        Self {
            source: chosen.source,
            slot: chosen.slot,
        }
    }
}

/// Has the sensor use a model. The threshold becomes the model's, unless a user has set another
/// one; the rest position stays when markers are seen as before. `afresh` takes the model's
/// threshold and no rest position, whatever there was.
///
/// Gives the threshold that is to be in use, when it is of other pixels than the camera sends: the
/// one before stays meanwhile, and with it there is no force.
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
        // Never: they were checked when the model was.
        now.slot.into_iter().for_each(model_slots::give_back);
        return None;
    }
    let before = core::mem::replace(in_use, now);
    before.slot.into_iter().for_each(model_slots::give_back);
    (!sends_it).then_some(wanted)
}
