//! A device's settings, rest positions and models, for the firmware and for the twin on a computer
//! (`host-tool/src/live/`). No register, no task, no allocation.
//!
//! | module | subject |
//! |---|---|
//! | [`camera`] | each camera's frame, rates and times |
//! | [`settings`] | the settings in use, as the host sees them; rest positions of a host |
//! | [`kept`] | compares the settings in use with the kept ones |
//! | [`model`] | which models fit, and how one replaces another |
//! | [`answer`] | the messages of hello, tare and sample |

pub mod answer;
pub mod camera;
pub mod kept;
pub mod model;
pub mod settings;
