//! Peripherals of the STM32H743 that the emulator lacks, or has too roughly. They know nothing of
//! this sensor's camera or messages. `README.md` says what each simulates and what ties it to the
//! rig.

pub mod crc;
pub mod crs;
pub mod dcmi;
pub mod dma;
pub mod flash;
pub mod iwdg;
pub mod mdma;
pub mod otg;
pub(crate) mod rom;
