//! Selects the board in use, with all of its pins and clocks. A cargo feature selects it; each
//! board is one file with the same names.

mod parts;
mod silicon;
pub use parts::{StatusLed, UartPort, UsbPort};
pub use silicon::revision as silicon_revision;

#[cfg(feature = "board-openmv-h7")]
mod openmv_h7;
#[cfg(feature = "board-openmv-h7")]
pub use openmv_h7::*;
#[cfg(feature = "board-weact")]
mod weact;
#[cfg(feature = "board-weact")]
pub use weact::*;

#[cfg(not(any(feature = "board-weact", feature = "board-openmv-h7")))]
compile_error!("no board: build with --features board-weact or board-openmv-h7");
#[cfg(all(feature = "board-weact", feature = "board-openmv-h7"))]
compile_error!("two boards: build board-openmv-h7 with --no-default-features");
