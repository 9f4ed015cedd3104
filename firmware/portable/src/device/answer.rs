//! The messages of hello, tare and sample.

use crate::device::settings::OfPipeline;
use core::fmt::{self, Write};
use heapless::String;
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::Measurement;
use hivtac_sensor::tare::{Refusal, TareBuilder};
use hivtac_sensor::temporal::{Followed, Moment};
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::Filter;
use hivtac_terms::threshold::ByteOrder;
use hivtac_wire::message::{DeviceHello, Outcome, Sample};
use hivtac_wire::settings::Name;
use hivtac_wire::version::HelloPrefix;

/// A device's identity for a host.
pub struct Identity<'a> {
    /// The unit's number.
    pub device_id: [u8; 12],
    /// Its board.
    pub board: &'a str,
    /// Its camera.
    pub camera: &'a str,
    /// Its program, and that program's version.
    pub program: fmt::Arguments<'a>,
    /// Its lens and pixels.
    pub preset: Preset,
    /// The sensor with its camera.
    pub geometry: Geometry,
}

/// Returns the hello of a device with these settings; `None` before it is configured.
pub fn hello(identity: &Identity<'_>, pipeline: Option<OfPipeline>, name: Name) -> DeviceHello {
    let geometry = identity.geometry;
    let (settings, model, filter) = match pipeline {
        Some(in_use) => (in_use.settings, in_use.model, in_use.temporal.filter),
        None => {
            let settings = Settings::usual(geometry, ByteOrder::Swapped);
            (settings, None, Filter::None)
        }
    };
    DeviceHello {
        protocol: HelloPrefix::OURS.protocol,
        schema: HelloPrefix::OURS.schema,
        device_id: identity.device_id,
        board: text(format_args!("{} + {}", identity.board, identity.camera)),
        firmware: text(identity.program),
        model,
        width: geometry.width,
        height: geometry.height,
        threshold: settings.threshold,
        preset: text(format_args!("{}", identity.preset.name())),
        dilations: settings.dilations,
        centroid: settings.centroid,
        name,
        filter,
    }
}

/// Formats text; an end that does not fit is cut.
pub fn text<const N: usize>(words: fmt::Arguments) -> String<N> {
    struct Cut<const N: usize>(String<N>);
    impl<const N: usize> Write for Cut<N> {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            for character in text.chars() {
                if self.0.push(character).is_err() {
                    break;
                }
            }
            Ok(())
        }
    }
    let mut text = Cut(String::new());
    // Never fails: text beyond the capacity is dropped.
    let _ = text.write_fmt(words);
    text.0
}

/// Returns the reply to a tare that is refused.
pub fn refused(refusal: Refusal) -> Outcome {
    match refusal {
        Refusal::MarkersImplausible => Outcome::MarkersImplausible,
        Refusal::Unsteady => Outcome::Unsteady,
        Refusal::NotAtRest => Outcome::NotAtRest,
        Refusal::Touched(looks_like) => Outcome::Touched { looks_like },
    }
}

/// Returns the reply to a tare that had not enough good frames in time.
pub fn given_up(tare: &TareBuilder) -> Outcome {
    if tare.saw_implausible() {
        Outcome::MarkersImplausible
    } else if let Some(looks_like) = tare.saw_touch() {
        Outcome::Touched { looks_like }
    } else {
        Outcome::NoGoodFrames
    }
}

/// Returns the sample of a measured frame. `on_the_way` has the status bits of events before the
/// frame was measured.
pub fn sample(
    sequence: u32,
    moment: Moment,
    on_the_way: Status,
    measurement: &Measurement,
    followed: &Followed,
    with_markers: bool,
) -> Sample {
    Sample {
        sequence,
        frame: moment.frame,
        time_us: moment.time_us,
        status: followed.status | on_the_way,
        force: followed.force,
        contacts: measurement.contacts,
        markers: (measurement.markers)
            .filter(|_| with_markers && measurement.lost == Lost::NONE)
            .unwrap_or_default(),
    }
}
