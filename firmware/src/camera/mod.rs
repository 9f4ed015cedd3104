//! The camera in use. A second camera is one more file with the same names.

mod ov7725;
mod ov7725_registers;
pub use ov7725::*;
