//! The twin in real time: a simulated sensor that answers a host as a device does.
//!
//! ```text
//! scene, course, hand → eye (renders) → device (senses, answers) → line → host
//! ```
//!
//! Frames come at the camera's own rate, from the very scene that tests and calibration use.
//! Sensing and settings are the code that the firmware runs (`hivtac-sensor`, `hivtac-portable`).
//! Only the chip's capture, USB and flash are missing. So nothing is kept once the twin ends.
//!
//! | module | subject |
//! |---|---|
//! | [`calibrated`] | a calibrated unit, whose dots move as its model has it |
//! | [`camera`] | the camera: its settings, the light that it needs, its times |
//! | [`device`] | frames and a host's bytes in, messages out |
//! | [`eye`] | renders the camera's picture: the scene, its disturbances, and what presses |
//! | [`hand`] | the presses of a person's one or two fingers |
//! | [`pair`] | two presses at once, on a film of eight dots |
//! | [`course`] | a recorded course of forces |
//! | [`run`] | the clock: one frame after the other, in real time |
//! | [`line`] | bytes to and from a host |

pub mod calibrated;
pub mod camera;
pub mod course;
pub mod device;
pub mod eye;
pub mod hand;
pub mod line;
mod outbox;
pub mod pair;
pub mod run;
#[cfg(test)]
mod tested;
