//! Holds the settings in use, as the host sees them and as they are kept. The pipeline publishes
//! them, the USB tasks read them.

use crate::dtcm_table::Sensor;
use core::cell::Cell;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
pub use hivtac_portable::device::settings::{InUse, OfPipeline, rest, tared};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_wire::message::{ModelSource, Outcome};
use hivtac_wire::settings::Name;

/// The pipeline's settings; `None` before it is configured. Written at boot and by the pipeline;
/// read by the USB tasks and the memory task.
static PIPELINE: CriticalSectionMutex<Cell<Option<OfPipeline>>> =
    CriticalSectionMutex::new(Cell::new(None));

/// The device's name. Written at boot and by the USB tasks; read by them and the memory task.
static NAME: CriticalSectionMutex<Cell<Name>> = CriticalSectionMutex::new(Cell::new(Name::new()));

/// The known direction of gravity. Written at boot, by the USB tasks, and by the memory task on a
/// reset to a new device's settings. Read by the memory task and, before each frame, by the
/// pipeline.
static DOWN: CriticalSectionMutex<Cell<Down>> = CriticalSectionMutex::new(Cell::new(Down::Fixed));

/// The shape of what presses. Written at boot, by the USB tasks, and by the memory task on a reset
/// to a new device's settings. Read by the memory task and, before each frame, by the pipeline.
static CONTACT_SHAPE: CriticalSectionMutex<Cell<ContactShape>> =
    CriticalSectionMutex::new(Cell::new(ContactShape::Unknown));

/// Publishes the pipeline's settings, with the source of its model.
pub fn follow(sensor: &Sensor, source: ModelSource) {
    let settings = OfPipeline::of(sensor, source);
    PIPELINE.lock(|cell| cell.set(Some(settings)));
}

/// Returns the pipeline's settings; `None` before it is configured.
pub fn of_pipeline() -> Option<OfPipeline> {
    PIPELINE.lock(copy)
}

/// Sets the device's name.
pub fn set_name(name: Name) {
    NAME.lock(|cell| cell.set(name));
}

/// The device's name.
pub fn name() -> Name {
    NAME.lock(copy)
}

/// Sets the direction of gravity from the next frame on: unknown if it is not a valid direction.
pub fn set_down(down: Down) {
    DOWN.lock(|cell| cell.set(hivtac_portable::device::settings::known(down)));
}

/// Returns the known direction of gravity.
pub fn down() -> Down {
    DOWN.lock(Cell::get)
}

/// Sets the shape of what presses, from the next frame on.
///
/// # Errors
/// [`Outcome::InvalidArgument`] if its radius is out of range; then nothing changes.
pub fn set_contact_shape(shape: ContactShape) -> Result<(), Outcome> {
    if !shape.is_sound() {
        return Err(Outcome::InvalidArgument);
    }
    CONTACT_SHAPE.lock(|cell| cell.set(shape));
    Ok(())
}

/// Returns the shape of what presses.
pub fn contact_shape() -> ContactShape {
    CONTACT_SHAPE.lock(Cell::get)
}

fn copy<T: Clone + Default>(cell: &Cell<T>) -> T {
    let value = cell.take();
    cell.set(value.clone());
    value
}

/// Returns the settings in use; `None` before the pipeline is configured.
pub fn in_use() -> Option<InUse> {
    of_pipeline().map(|pipeline| InUse::of(pipeline, name(), down(), contact_shape()))
}
