//! Deliberate bugs, each behind a cargo feature that is off by default.
//!
//! They exist to prove that the tests on the emulated microcontroller notice such mistakes. With no
//! feature set every constant here has its right value and the program is the same as if this file
//! did not exist.

/// DMAMUX1 request line of DCMI (RM0433, table "DMAMUX1: assignment of multiplexer inputs"), or its
/// neighbour's.
pub const DCMI_DMA_REQUEST: u8 = if cfg!(feature = "bug-dmamux-request") {
    76
} else {
    75
};

/// True when DCMI samples on the edge on which the camera changes its data, and mistakes blanking
/// for data.
pub const INVERTED_POLARITIES: bool = cfg!(feature = "bug-polarity");

/// True when the camera's register for its format is wrong: an OV7725 left at YUV, an MT9V034 that
/// does not bin.
pub const CAMERA_REGISTER: bool = cfg!(feature = "bug-camera-register");

/// The part of a band that the DMA is told to transfer: one in this many.
pub const BAND_DIVISOR: u16 = if cfg!(feature = "bug-half-buffer") {
    2
} else {
    1
};

/// True when USB is clocked by an oscillator that nothing trims.
pub const USB_FROM_HSI48: bool = cfg!(feature = "bug-usb-clock");
