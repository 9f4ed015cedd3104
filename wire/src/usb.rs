//! Defines the device's identity on USB, by which a host finds it.

/// Vendor: pid.codes.
pub const VENDOR_ID: u16 = 0x1209;
/// Product: pid.codes' number for tests; must be replaced before devices are given away.
pub const PRODUCT_ID: u16 = 0x0001;
/// Manufacturer string.
pub const MANUFACTURER: &str = "HiVTac";
/// Product string.
pub const PRODUCT: &str = "HiVTac force sensor";
