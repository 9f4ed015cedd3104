//! A conversation with a HiVTac sensor, for programs on the host: where it is ([`port`]), what is said ([`link`]), how it
//! fails ([`failure`]), and how a program is interrupted ([`stop`]).

pub mod failure;
pub mod link;
pub mod port;
pub mod stop;
