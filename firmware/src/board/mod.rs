//! The board in use: all of its pins and clocks. A second board is one more file with the same
//! names.

mod free_bus;
mod silicon;
mod weact;
pub use weact::*;
