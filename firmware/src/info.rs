//! What the device says about itself.

use crate::shared::SETTINGS;
use crate::{board, camera};
use core::cell::Cell;
use core::fmt::Write;
use heapless::String;
use hivtac_sensing::model::Model;
use hivtac_sensing::settings::Settings;
use hivtac_terms::threshold::ByteOrder;
use hivtac_wire::message::{DeviceHello, ModelIdentity};
use hivtac_wire::version::HelloPrefix;

/// Tells what settings the pipeline has from now on.
pub fn set_settings(settings: &Settings) {
    SETTINGS.lock(|cell| cell.set(Some(*settings)));
}

/// The device's hello.
pub fn hello(model: Option<&Model>) -> DeviceHello {
    let settings = SETTINGS
        .lock(Cell::get)
        .unwrap_or_else(|| Settings::usual(camera::GEOMETRY, ByteOrder::Swapped));
    DeviceHello {
        protocol: HelloPrefix::OURS.protocol,
        schema: HelloPrefix::OURS.schema,
        device_id: embassy_stm32::uid::uid(),
        board: text(format_args!("{} + {}", board::NAME, camera::NAME)),
        firmware: text(format_args!("hivtac {}", env!("CARGO_PKG_VERSION"))),
        model: model.map(identity),
        width: camera::WIDTH,
        height: camera::HEIGHT,
        threshold: settings.threshold,
        preset: text(format_args!("{}", camera::PRESET.name())),
        dilations: settings.dilations,
        centroid: settings.centroid,
    }
}

fn identity(model: &Model) -> ModelIdentity {
    ModelIdentity {
        crc: model.crc(),
        name: model.name(),
        simulated: model.is_simulated(),
        threshold: model.conditions.threshold,
    }
}

/// Text that is known to fit; what does not is left out.
fn text<const N: usize>(words: core::fmt::Arguments) -> String<N> {
    let mut text = String::new();
    let _ = text.write_fmt(words);
    text
}
