//! A library for programs that communicate with a HiVTac sensor from a host.
//!
//! Connection: addresses ([`port`]), conversation ([`link`]), replies in words ([`reply`]), samples
//! read in a thread of their own ([`reader`]), sensors by name ([`named`]), interruption
//! ([`stop`]), errors ([`failure`]). Pictures: of the device ([`frame`], [`look`]), sensed
//! ([`one_picture`]), their faults ([`focus`]), in files ([`picture`], [`raw`], [`files`]). Values:
//! models as they are sent ([`model_file`]), direction of gravity ([`down`]), shape of what presses
//! ([`contact_shape`]), thresholds ([`threshold`]), forces ([`force_fields`], [`decimal`]), markers
//! ([`marker_fields`]), texts ([`shown`]), the usual tare ([`usual_tare`]), counts ([`tally`]),
//! true forces ([`truth`]), times ([`clock`]), what two fingers feel together ([`grip`]). Also the
//! live page ([`page`]), and recordings: written ([`bag`], [`ros`]) and read ([`recording`]). With
//! the feature `twin`, the simulated sensor in real time (`live`).
//!
//! A browser (`web/`) has neither ports nor files; modules that need them are left out there.

pub mod bag;
pub mod clock;
pub mod contact_shape;
pub mod decimal;
pub mod down;
pub mod failure;
#[cfg(not(target_family = "wasm"))]
pub mod files;
pub mod focus;
pub mod force_fields;
pub mod frame;
pub mod grip;
#[cfg(not(target_family = "wasm"))]
pub mod link;
#[cfg(feature = "twin")]
pub mod live;
pub mod look;
pub mod marker_fields;
#[cfg(not(target_family = "wasm"))]
pub mod model_file;
#[cfg(not(target_family = "wasm"))]
pub mod named;
pub mod one_picture;
pub mod page;
#[cfg(not(target_family = "wasm"))]
pub mod picture;
#[cfg(not(target_family = "wasm"))]
pub mod port;
#[cfg(not(target_family = "wasm"))]
pub mod raw;
#[cfg(not(target_family = "wasm"))]
pub mod reader;
pub mod recording;
pub mod reply;
pub mod ros;
pub mod shown;
#[cfg(not(target_family = "wasm"))]
pub mod stop;
pub mod tally;
pub mod threshold;
pub mod truth;
pub mod usual_tare;

// Helpers of the library's tests are those of the tool's, too.
#[cfg(test)]
extern crate self as hivtac_host;
