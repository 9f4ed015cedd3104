//! What a device does with settings, rest positions and models, whatever it runs on: the firmware,
//! or the twin on a computer (`host-tool/src/live/`). No register, no task, no allocation.
//!
//! | module | subject |
//! |---|---|
//! | [`camera`] | each camera's frame, rates and times |
//! | [`settings`] | the settings in use, as the host sees them; rest positions of a host |
//! | [`kept`] | the settings in use against the kept ones |
//! | [`model`] | which models fit, and how one replaces another |
//! | [`answer`] | the messages of hello, tare and sample |

pub mod answer;
pub mod camera;
pub mod kept;
pub mod model;
pub mod settings;
