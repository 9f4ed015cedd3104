//! The board as the emulator runs it: one microcontroller and the settings of its core.

use std::num::{NonZeroU32, NonZeroU64};

use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::snapshot::Store;

use crate::chip::Chip;
use crate::mpu::Mpu;
use crate::peripherals::rom;
use crate::translations;

/// The core's clock, Hz. Only SysTick's reference depends on it.
const CORE_HZ: u64 = 480_000_000;

/// The board with its one microcontroller.
#[derive(Debug)]
pub struct Sensor {
    /// The microcontroller.
    pub chip: Chip,
    /// Instructions that the core is assumed to execute in a second of virtual time.
    pub instructions_per_second: NonZeroU64,
    /// The way in which the program is entered.
    pub entry: Entry,
}

/// The ways in which a program is entered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Entry {
    /// By a reset, from flash.
    #[default]
    Reset,
    /// By the ROM's loader, with its vector table in use.
    Loader,
}

// The rig takes no snapshots.
impl Store for Sensor {}

impl Board for Sensor {
    fn name(&self) -> &'static str {
        self.chip.board().name()
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
        let vectors = match self.entry {
            Entry::Reset => rom::FLASH,
            Entry::Loader => rom::BASE,
        };
        config.vector_table = Some(vectors);
        let mut core = config.spec();
        core.factory_images = vec![
            rom::unique_id(),
            rom::temperature_calibration(),
            rom::loader(),
            rom::firmware_loader(),
        ];
        translations::keep(&mut core, self.chip.mpu.as_ref().map(Mpu::is_on));
        vec![Target::new("stm32h743", &mut self.chip, core)]
    }
}
