//! A conversation with a HiVTac sensor, for programs on the host: where it is ([`port`]), what is
//! said ([`link`]), how it fails ([`failure`]), what its thresholds say ([`threshold`]), how its
//! texts are shown ([`shown`]), and how a program is interrupted ([`stop`]).

pub mod failure;
pub mod frame;
pub mod link;
pub mod port;
pub mod shown;
pub mod stop;
pub mod threshold;
