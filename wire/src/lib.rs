//! Defines the one contract between firmware and host: every message and the framing. Normative
//! text: `docs/wire.md`.
//!
//! A frame on the wire is `COBS(postcard(message) ++ CRC-32) ++ 0x00`.
#![cfg_attr(not(feature = "images"), no_std)]
#![forbid(unsafe_code)]

#[cfg(all(test, not(feature = "images")))]
extern crate std;

pub mod decoder;
pub mod failure;
pub mod frame;
pub mod health;
pub mod image;
pub mod kept;
pub mod message;
pub mod settings;
pub mod uart;
pub mod usb;
pub mod version;

#[cfg(test)]
mod examples;
#[cfg(test)]
mod properties;
