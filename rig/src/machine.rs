//! The board as the emulator runs it: one microcontroller, and what its core is made as.

use std::num::{NonZeroU32, NonZeroU64};
use std::path::Path;

use rigless::image::Image;
use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::snapshot::Store;

use crate::chip::Chip;

/// The core's clock, Hz. Only SysTick's reference depends on it.
const CORE_HZ: u64 = 480_000_000;

/// The board with its one microcontroller.
#[derive(Debug)]
pub struct Sensor {
    /// The microcontroller.
    pub chip: Chip,
    /// What the core is assumed to execute in a second of virtual time.
    pub instructions_per_second: NonZeroU64,
}

// Snapshots are not taken.
impl Store for Sensor {}

impl Board for Sensor {
    fn name(&self) -> &'static str {
        "weact-h743"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32h743"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.chip)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let core = armv7m::Core {
            variant: armv7m::Variant::M7,
            clock_hz: NonZeroU64::new(CORE_HZ).expect("not zero"),
            interrupt_lines: NonZeroU32::new(self.chip.cpu().interrupt_lines.into())
                .expect("the part has interrupts"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("not zero"),
            instructions_per_second: self.instructions_per_second,
            boot: "flash",
        };
        let mut config = armv7m::Config::new(core, &rigless::cpu::armv7m::windows(self.chip.bus()));
        config.fpu = armv7m::Fpu::FpV5Dp;
        config.mpu_regions = armv7m::MpuRegions::Sixteen;
        config.cpuid = 0x411F_C271;
        config.branch_prediction = armv7m::BranchPrediction::Always;
        config.caches = Some(armv7m::Caches {
            clidr: 0x0900_0003,
            ctr: 0x8303_C003,
            ccsidr: &[0xF00F_E019, 0xF01F_E009],
        });
        config.vector_table = Some(0x0800_0000);
        let mut core = config.spec();
        core.factory_images = vec![unique_id()];
        vec![Target::new("stm32h743", &mut self.chip, core)]
    }
}

/// The 96-bit number that every part is made with, at its address in system memory (RM0433 chapter 61).
fn unique_id() -> Image {
    let bytes = b"hivtac-rig-1".to_vec();
    Image::new(Path::new("unique-id"), bytes, Some(0x1FF1_E800)).expect("plain bytes are an image")
}
