//! Shared code of the tests that cross folders.
//!
//! [`golden`] runs recorded cases through the sensing and prints the results. The same code runs on
//! the host and, in `tests/qemu`, on an emulated Cortex-M7. All other modules need a host (feature
//! `host`, on by default).
#![no_std]

#[cfg(feature = "host")]
extern crate std;

pub mod golden;

#[cfg(feature = "host")]
pub mod artifact;
#[cfg(feature = "host")]
pub mod browser;
#[cfg(feature = "host")]
pub mod hard;
#[cfg(feature = "host")]
pub mod judged;
#[cfg(feature = "host")]
pub mod models;
#[cfg(feature = "host")]
pub mod pictures;
#[cfg(feature = "host")]
pub mod qemu;
#[cfg(feature = "host")]
pub mod script;
#[cfg(feature = "host")]
pub mod tared;
#[cfg(feature = "host")]
pub mod workspaces;
