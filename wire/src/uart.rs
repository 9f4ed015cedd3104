//! Defines the UART on which a device sends its samples in addition to USB.

/// Bits a second; each byte has one start bit, eight data bits and one stop bit. Common adapters
/// go that fast.
pub const BAUD: u32 = 2_000_000;
