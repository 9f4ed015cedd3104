//! The interface of one kind of camera: everything in which cameras differ.

use std::fmt::Debug;

use super::output::Output;
use crate::frame_source::{FrameSource, Picture};
use crate::rules::Rules;
use crate::truth::Exposed;

/// A camera's registers and their effects.
pub trait Part: Debug + Send {
    /// Returns the output by the registers at an input clock in Hz. Returns `None` while the camera
    /// sends nothing.
    fn output(&self, clock_hz: u64) -> Option<Output>;

    /// Begins a frame: automatic control moves. Returns the timing of its exposure.
    fn expose(&mut self, output: &Output) -> Timing;

    /// Returns the picture of an exposure, by the registers.
    fn picture(&self, source: &dyn FrameSource, exposed: Exposed, rules: &Rules) -> Picture;

    /// Returns the value of a register.
    fn read(&self, address: u16) -> u16;

    /// Returns the answer of a different part from the same maker to a read of a register.
    fn read_as_another(&self, address: u16) -> u16;

    /// Writes a register. Returns whether the write was a reset of all registers.
    fn write(&mut self, address: u16, value: u16) -> bool;

    /// Sets one register back to its value after a reset. It affects colours or levels, but no
    /// timing.
    fn forget(&mut self);

    /// Handles a low level of the reset line.
    fn reset(&mut self);
}

/// Times of the exposure of a frame's rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Exposure time of each row, ns.
    pub exposure_ns: u64,
    /// Time from the exposure of the first row to that of a row just below the last, ns; 0 with a
    /// global shutter.
    pub readout_ns: u64,
    /// Time from the edge that begins the frame to the end of the middle row's exposure, ns.
    pub ends_ns: u64,
}

/// The kinds of camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// OmniVision OV7725.
    #[default]
    Ov7725,
    /// onsemi MT9V034, mono.
    Mt9v034,
    /// OmniVision OV5640.
    Ov5640,
}

impl Kind {
    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Ov7725 => "ov7725",
            Kind::Mt9v034 => "mt9v034",
            Kind::Ov5640 => "ov5640",
        }
    }
}
