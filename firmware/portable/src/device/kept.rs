//! Compares the settings in use with the kept ones.

use crate::device::settings::{InUse, drift};
use hivtac_wire::kept::Record;
use hivtac_wire::settings::{CameraReport, Found, Selection, SettingsReport};

/// Returns which settings in use are kept in `record`.
pub fn selection(used: &InUse, camera: &CameraReport, record: &Record) -> Selection {
    Selection {
        name: used.name == record.name,
        threshold: used.own_threshold() == record.threshold,
        tare: used.tare == record.tare,
        temporal: used.temporal == record.temporal,
        camera: camera.settings == record.camera,
        down: used.down == record.down,
        contact_shape: used.contact_shape == record.contact_shape,
    }
}

/// Puts the selected settings of those in use into a record.
pub fn keep(record: &mut Record, selection: Selection, used: InUse, camera: &CameraReport) {
    if selection.threshold {
        record.threshold = used.own_threshold();
    }
    if selection.tare {
        record.tare = used.tare;
    }
    if selection.name {
        record.name = used.name;
    }
    if selection.temporal {
        record.temporal = used.temporal;
    }
    if selection.camera {
        record.camera = camera.settings;
    }
    if selection.down {
        record.down = used.down;
    }
    if selection.contact_shape {
        record.contact_shape = used.contact_shape;
    }
}

/// The state of the record's storage.
pub struct Keeper {
    /// Its content at the start.
    pub found: Found,
    /// Number of flash sectors erased so far.
    pub erases: u32,
    /// Number of failed attempts to write since the start.
    pub failures: u32,
}

/// Returns the report of the settings in use and the kept ones.
pub fn report(
    used: InUse,
    camera: CameraReport,
    record: &Record,
    keeper: &Keeper,
) -> SettingsReport {
    let kept = selection(&used, &camera, record);
    let both = used.tare.zip(record.tare);
    let drift = both.and_then(|(used, kept)| drift(&used, &kept));
    let InUse {
        name,
        threshold,
        tare,
        temporal,
        rezeroed,
        seen,
        down,
        contact_shape,
        ..
    } = used;
    SettingsReport {
        name,
        threshold,
        tare,
        kept,
        found: keeper.found,
        erases: keeper.erases,
        failures: keeper.failures,
        temporal,
        rezeroed,
        seen,
        drift,
        camera,
        down,
        contact_shape,
    }
}
