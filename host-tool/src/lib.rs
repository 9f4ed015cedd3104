//! A library for programs that communicate with a HiVTac sensor from a host.
//!
//! Connection: addresses ([`port`]), conversation ([`link`]), samples read in a thread of their own
//! ([`reader`]), sensors by name ([`named`]), interruption ([`stop`]), errors ([`failure`]). Pictures: of the device ([`frame`], [`look`]), in
//! files ([`picture`], [`raw`], [`files`]). Values: direction of gravity ([`down`]), shape of what
//! presses ([`contact_shape`]), thresholds ([`threshold`]), forces ([`force_fields`], [`decimal`]),
//! texts ([`shown`]). Also the live page ([`page`]) and recordings ([`recording`]).

pub mod contact_shape;
pub mod decimal;
pub mod down;
pub mod failure;
pub mod files;
pub mod force_fields;
pub mod frame;
pub mod link;
pub mod look;
pub mod named;
pub mod page;
pub mod picture;
pub mod port;
pub mod raw;
pub mod reader;
pub mod recording;
pub mod shown;
pub mod stop;
pub mod threshold;
