//! Contains deliberate bugs, each behind a cargo feature that is off by default.
//!
//! They prove that the tests on the emulated microcontroller detect such mistakes. Without these
//! features every constant here has its correct value, and the program is the same as without this
//! file.

/// DMAMUX1 request line of DCMI (RM0433, table "DMAMUX1: assignment of multiplexer inputs"), or its
/// neighbour's.
pub const DCMI_DMA_REQUEST: u8 = if cfg!(feature = "bug-dmamux-request") {
    76
} else {
    75
};

/// True if DCMI samples on the edge on which the camera changes its data, and takes blanking for
/// data.
pub const INVERTED_POLARITIES: bool = cfg!(feature = "bug-polarity");

/// True if the camera's format register is wrong: an OV7725 left at YUV, an MT9V034 that does not
/// bin.
pub const CAMERA_REGISTER: bool = cfg!(feature = "bug-camera-register");

/// The DMA transfers one part in this many of a band.
pub const BAND_DIVISOR: u16 = if cfg!(feature = "bug-half-buffer") {
    2
} else {
    1
};

/// True if USB is clocked by an untrimmed oscillator.
pub const USB_FROM_HSI48: bool = cfg!(feature = "bug-usb-clock");
