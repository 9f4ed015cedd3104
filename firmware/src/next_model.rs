//! Replaces the model in use by a new one, between two frames.

use crate::dtcm_table::Sensor;
use crate::model::{self, ModelFile};
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
    pub fn of(file: &ModelFile) -> Self {
        Self {
            source: file.source,
            slot: file.slot,
        }
    }
}

/// Replaces the sensor's model, as [`hivtac_portable::device::model::Fitting::replace`] says.
/// Returns the wanted threshold if its pixels differ from the camera's.
pub fn bring_into_use(
    next: ModelFile,
    afresh: bool,
    sensor: &mut Sensor,
    in_use: &mut InUse,
) -> Option<Threshold> {
    let now = InUse::of(&next);
    let Ok(wanted) = model::fitting().replace(sensor, next.model(), afresh) else {
        // Never happens: the settings were checked with the model.
        now.slot.into_iter().for_each(model_slots::give_back);
        return None;
    };
    let before = core::mem::replace(in_use, now);
    before.slot.into_iter().for_each(model_slots::give_back);
    wanted
}
