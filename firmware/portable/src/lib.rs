//! The firmware without registers: what runs on a computer, too, and is tested there.
//!
//! | module | subject |
//! |---|---|
//! | [`capture`] | which rows belong to which frame, while a camera is captured without a pause |
//! | [`device`] | what a device does with settings, rest positions and models |
//! | [`storage`] | data in flash, through power cuts at any time |
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod capture;
pub mod device;
pub mod storage;
