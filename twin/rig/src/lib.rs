//! The rig: runs the very ELF that is flashed, on an emulated STM32H743, with a simulated camera
//! and a USB host.
//!
//! ```text
//! scene → camera (OV7725) ─DCMI→ DMA → firmware → OTG FIFOs → USB host → pty, TCP, or a script
//!            ↑ SCCB, XCLK, power ────────┘
//! ```
//!
//! The rig reads no symbol of the ELF. Time is virtual: the same firmware, scene, seed and script
//! give the same bytes. `docs/rig.md` lists what is simulated and what is not.
//!
//! | module | subject |
//! |---|---|
//! | [`command`], [`run`], [`report`] | one run from arguments to outcome |
//! | [`chip`], [`board`], [`machine`], `dma_requests`, [`mpu`], `translations` | the microcontroller; which pins and clocks reach the camera and USB |
//! | [`peripherals`] | its camera interface, USB core, MDMA, flash, ROM, watchdog and clock recovery |
//! | [`camera`], [`frame_source`], `control_bus` | the sensor; its pictures; faults of its control bus |
//! | [`usb_host`], [`link`], [`usbip`], [`script`] | the host; who uses its serial port, or the device itself |
//! | [`faults`], [`rules`], `late_line`, `late_flags`, `late_enable`, [`dma_reach`], [`memory_types`], `start_rules`, `power` | faults on request; rules that firmware must not break; memory after a power-on |
//! | [`uart_line`] | the listener at the UART for samples |
//! | [`awake`] | how long the core sleeps |
//! | [`truth`], [`arrivals`] | the truth of each frame; the arrival of its sample |

pub mod arrivals;
pub mod awake;
pub mod board;
mod busy_bus;
pub mod camera;
pub mod chip;
pub mod command;
mod control_bus;
pub mod dma_reach;
mod dma_requests;
pub mod faults;
pub mod frame_source;
mod late_enable;
mod late_flags;
mod late_line;
pub mod link;
pub mod machine;
pub mod memory_types;
pub mod mpu;
pub mod peripherals;
mod power;
pub mod report;
pub mod rules;
pub mod run;
pub mod script;
mod start_rules;
mod translations;
pub mod truth;
pub mod uart_line;
pub mod usb_host;
pub mod usbip;
