//! The page that needs no server: `hivtac view` and `hivtac view --twin` in a browser.
//!
//! ```text
//! simulated sensor (hivtac_host) ─┐
//!                                 ├─ bytes ─ conversation ─ feed ─ events ─ the page's files
//! a device at the serial port ────┘
//! ```
//!
//! The page's files are those of `hivtac view` (`host-tool/src/page/files/`); `page/` has what only
//! this page needs. `cargo xtask web` puts both together with the WebAssembly module.
//!
//! | module | subject |
//! |---|---|
//! | [`engine`] | one sensor at a time, simulated or connected, and the page's requests to it |
//! | [`conversation`] | hello, commands one after the other, messages (`docs/wire.md`) |
//! | [`recorder`] | a recording in memory |
//! | [`simulated`] | the simulated sensor, frame by frame |
//! | [`photograph`] | the sensing's result for a user's picture |
//! | [`firmware`] | new firmware, checked and divided into blocks to write |
//! | [`same_bits`] | frames whose samples are the same bytes on every machine |
//! | `exports` | functions that the page's scripts call, of the WebAssembly module only |

pub mod conversation;
pub mod engine;
#[cfg(target_family = "wasm")]
mod exports;
pub mod firmware;
pub mod photograph;
pub mod recorder;
pub mod same_bits;
pub mod simulated;

#[cfg(test)]
mod tests {
    use hivtac_wire::usb::{PRODUCT_ID, VENDOR_ID};

    #[test]
    fn ports_are_sought_by_the_devices_identity() {
        let script = include_str!("../page/serial.js");
        let usb = format!("usbVendorId: {VENDOR_ID:#06x}, usbProductId: {PRODUCT_ID:#06x}");
        assert!(script.contains(&usb), "page/serial.js lacks {usb}");
    }
}
