//! Answers the host's questions about the device.

use crate::settings::{name, of_pipeline};
use crate::{board, camera};
use core::fmt::Write;
use heapless::String;
use hivtac_sensor::markers::settings::Settings;
use hivtac_terms::temporal::Filter;
use hivtac_terms::threshold::ByteOrder;
use hivtac_wire::message::DeviceHello;
use hivtac_wire::version::HelloPrefix;

/// The device's hello.
pub fn hello() -> DeviceHello {
    let (settings, model, filter) = match of_pipeline() {
        Some(told) => (told.settings, told.model, told.temporal.filter),
        None => {
            let settings = Settings::usual(camera::GEOMETRY, ByteOrder::Swapped);
            (settings, None, Filter::None)
        }
    };
    DeviceHello {
        protocol: HelloPrefix::OURS.protocol,
        schema: HelloPrefix::OURS.schema,
        device_id: embassy_stm32::uid::uid(),
        board: text(format_args!("{} + {}", board::NAME, camera::NAME)),
        firmware: text(format_args!("hivtac {}", env!("CARGO_PKG_VERSION"))),
        model,
        width: camera::WIDTH,
        height: camera::HEIGHT,
        threshold: settings.threshold,
        preset: text(format_args!("{}", camera::PRESET.name())),
        dilations: settings.dilations,
        centroid: settings.centroid,
        name: name(),
        filter,
    }
}

/// Formats text that is known to fit; text beyond the capacity is dropped.
fn text<const N: usize>(words: core::fmt::Arguments) -> String<N> {
    let mut text = String::new();
    let _ = text.write_fmt(words);
    text
}
