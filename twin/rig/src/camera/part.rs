//! What differs between one camera and another.

use std::fmt::Debug;

use super::output::Output;
use crate::frame_source::{FrameSource, Picture};
use crate::rules::Rules;
use crate::truth::Exposed;

/// A camera's registers, and what follows from them.
pub trait Part: Debug + Send {
    /// What the registers make it send, at an input clock in Hz. `None` while it sends nothing.
    fn output(&self, clock_hz: u64) -> Option<Output>;

    /// A frame begins: what is automatic has moved, and this is how it is exposed.
    fn expose(&mut self, output: &Output) -> Timing;

    /// The picture of an exposure, as the registers have it.
    fn picture(&self, source: &dyn FrameSource, exposed: Exposed, rules: &Rules) -> Picture;

    /// What a register holds.
    fn read(&self, address: u8) -> u16;

    /// What it answers in the place of a register when it is another part of its maker's.
    fn read_as_another(&self, address: u8) -> u16;

    /// Writes a register; whether that was a reset of all of them.
    fn write(&mut self, address: u8, value: u16) -> bool;

    /// One of its registers goes back to what it holds after a reset: one that colours or levels
    /// depend on, and no timing.
    fn forget(&mut self);

    /// Its reset line was low.
    fn reset(&mut self);
}

/// When a frame's rows are exposed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// How long each row is exposed, ns.
    pub exposure_ns: u64,
    /// From the exposure of the first row to that of one below the last, ns; 0 with a global
    /// shutter.
    pub readout_ns: u64,
    /// From the edge that begins the frame to the end of the middle row's exposure, ns.
    pub ends_ns: u64,
}

/// The cameras that there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// OmniVision OV7725.
    #[default]
    Ov7725,
    /// onsemi MT9V034, mono.
    Mt9v034,
}

impl Kind {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Ov7725 => "ov7725",
            Kind::Mt9v034 => "mt9v034",
        }
    }
}
