//! A conversation with a HiVTac sensor, for programs on the host: where it is ([`port`]), what is
//! said ([`link`]), which sensor a name means ([`named`]), which way it is held ([`down`]), how it
//! fails ([`failure`]), its pictures
//! ([`frame`], [`look`]) and those in files ([`picture`], [`raw`], [`files`]), what its thresholds
//! say ([`threshold`]), how its forces ([`force_fields`], [`decimal`])
//! and texts ([`shown`]) are written, a live page of it ([`page`]), what was
//! recorded of it ([`recording`]), and how a program is interrupted ([`stop`]).

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
pub mod recording;
pub mod shown;
pub mod stop;
pub mod threshold;
