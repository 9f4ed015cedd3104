//! How the device shows itself on USB, so that a host finds it.

/// Vendor: pid.codes.
pub const VENDOR_ID: u16 = 0x1209;
/// Product: pid.codes' number for tests; to be replaced before devices are given away.
pub const PRODUCT_ID: u16 = 0x0001;
/// Manufacturer string.
pub const MANUFACTURER: &str = "HiVTac";
/// Product string.
pub const PRODUCT: &str = "HiVTac force sensor";
