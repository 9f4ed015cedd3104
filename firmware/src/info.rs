//! What the device says about itself.

use crate::{board, camera};
use core::cell::Cell;
use core::fmt::Write;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use heapless::String;
use hivtac_sensing::model::Model;
use hivtac_wire::message::{DeviceHello, HsvBox, ModelIdentity};
use hivtac_wire::version::HelloPrefix;

static THRESHOLD: CriticalSectionMutex<Cell<HsvBox>> =
    CriticalSectionMutex::new(Cell::new(HsvBox {
        hue_low: 0,
        hue_high: 0,
        saturation_low: 0,
        saturation_high: 0,
        value_low: 0,
        value_high: 0,
    }));

/// The pipeline tells which threshold it uses.
pub fn set_threshold(threshold: HsvBox) {
    THRESHOLD.lock(|cell| cell.set(threshold));
}

/// The device's hello.
pub fn hello(model: Option<&Model>) -> DeviceHello {
    DeviceHello {
        protocol: HelloPrefix::OURS.protocol,
        schema: HelloPrefix::OURS.schema,
        device_id: embassy_stm32::uid::uid(),
        board: text(format_args!("{} + {}", board::NAME, camera::NAME)),
        firmware: text(format_args!("hivtac {}", env!("CARGO_PKG_VERSION"))),
        model: model.map(identity),
        width: camera::WIDTH,
        height: camera::HEIGHT,
        threshold: THRESHOLD.lock(Cell::get),
    }
}

fn identity(model: &Model) -> ModelIdentity {
    ModelIdentity {
        crc: model.crc(),
        name: model.name(),
        simulated: model.is_simulated(),
    }
}

/// Text that is known to fit; what does not is left out.
fn text(words: core::fmt::Arguments) -> String<32> {
    let mut text = String::new();
    let _ = text.write_fmt(words);
    text
}
