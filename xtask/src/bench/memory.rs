//! What memory costs where it has wait states.
//!
//! The modelled cycles stand for code in ITCM and data in DTCM, which answer without waiting (Arm,
//! *Cortex-M7 Processor Technical Reference Manual*, "Tightly coupled memories"). The image keeps
//! rows of pixels and the model file in memories of their own (`tests/qemu/memory.x`), so that
//! loads from them can be counted, and charged when the chip has them elsewhere:
//!
//! - a load from AXI SRAM that no cache answers: the AXI bus runs at half the core's clock (RM0433,
//!   "Bus matrix"); request, interconnect both ways, a read with no wait state and the answer are
//!   taken as six of its cycles;
//! - 32 bytes of flash into the data cache: 256 bits are read at once, with four wait states at
//!   240 MHz (RM0433, "FLASH read access latency"), and take four beats of the 64-bit bus; with the
//!   interconnect thirteen of its cycles.
//!
//! The bus's share of both is an assumption that a board has to confirm (`--board`).

use super::record::Record;

/// Core cycles of a load from AXI SRAM that is not cached.
pub const AXI_LOAD: u64 = 12;
/// Core cycles of 32 bytes of flash into the data cache.
pub const FLASH_LINE: u64 = 26;
/// Room for a model beside everything else in DTCM.
pub const DTCM_FOR_WEIGHTS: u64 = 48 * 1024;

/// Where the image has the rows of pixels: `ROWS` in its memory.x.
const ROWS: std::ops::Range<u64> = 0x6000_0000..0x6010_0000;
/// Where the image has the model file: `WEIGHTS`.
const WEIGHTS: std::ops::Range<u64> = 0x6010_0000..0x6030_0000;

/// Where data was loaded from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads {
    /// Loads of pixels.
    pub rows: u64,
    /// Different 32 bytes of the model file that were loaded.
    pub weight_lines: u64,
}

impl Loads {
    /// What a record has of each.
    pub fn of(record: &Record) -> Loads {
        Loads {
            rows: record.loads(ROWS).0,
            weight_lines: record.loads(WEIGHTS).1,
        }
    }

    /// Extra cycles when pixels are read from AXI SRAM, uncached.
    pub fn rows_in_axi(&self) -> u64 {
        self.rows * AXI_LOAD
    }

    /// Extra cycles when weights are read from flash, each line once.
    pub fn weights_in_flash(&self) -> u64 {
        self.weight_lines * FLASH_LINE
    }

    /// Whether the model fits DTCM.
    pub fn weights_fit(&self) -> bool {
        self.weight_lines * 32 <= DTCM_FOR_WEIGHTS
    }
}
