//! The rig: the very ELF that is flashed, on an emulated STM32H743, with a simulated camera and a USB host.
//!
//! ```text
//! scene → camera (OV7725) ─DCMI→ DMA → firmware → OTG FIFOs → USB host → pty, TCP, or a script
//!            ↑ SCCB, XCLK, power ────────┘
//! ```
//!
//! It reads no symbol of the ELF. Time is virtual: the same firmware, scene, seed and script give the same bytes.
//! `docs/rig.md` says what is simulated and what is not.
//!
//! | module | subject |
//! |---|---|
//! | [`run`], [`report`] | one run from options to outcome |
//! | [`chip`], [`board`], `machine`, `dormant` | the microcontroller; which pins and clocks reach the camera and USB |
//! | [`dcmi`], [`camera`], [`frame_source`] | the camera interface; the sensor; what it looks at |
//! | [`mdma`] | the DMA controller that reaches DTCM |
//! | [`otg`], [`usb_host`], [`link`], [`script`] | the USB device core; the host; who uses its serial port |
//! | [`faults`], [`rules`], [`dma_reach`], [`truth`] | what goes wrong on request; what firmware must not do; what is true |

pub mod board;
pub mod camera;
pub mod chip;
pub mod dcmi;
pub mod dma_reach;
mod dormant;
pub mod faults;
pub mod frame_source;
pub mod link;
mod machine;
pub mod mdma;
pub mod otg;
pub mod report;
pub mod rules;
pub mod run;
pub mod script;
pub mod truth;
pub mod usb_host;
