//! Answers the host's questions about the device.

use crate::settings::{name, of_pipeline};
use crate::{board, camera};
use hivtac_portable::device::answer::{self, Identity};
use hivtac_wire::message::DeviceHello;

/// The device's hello.
pub fn hello() -> DeviceHello {
    let identity = Identity {
        device_id: embassy_stm32::uid::uid(),
        board: board::NAME,
        camera: camera::fitted().name,
        program: format_args!("hivtac {}", env!("CARGO_PKG_VERSION")),
        preset: camera::PRESET,
        geometry: camera::GEOMETRY,
    };
    answer::hello(&identity, of_pipeline(), name())
}
