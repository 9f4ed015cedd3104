//! Sets up the caches and the memory protection unit (MPU).
//!
//! Both caches are on, because code and model are in flash, which is slow without them. Memory that
//! the DMA writes and the core reads is in AXI SRAM, whose lower five eighths one MPU region makes
//! normal, non-cacheable memory. So no cache line can hold a stale pixel, and no code has to
//! invalidate one. DTCM is never cached.

use crate::{flash, seeded_bugs};
use cortex_m::Peripherals;
use cortex_m::peripheral::MPU;

/// `MPU_RASR` of a region, with the attributes in the architecture's bits (ARMv7-M, B3.5.9).
struct Region {
    base: u32,
    /// log2 of the size in bytes.
    size_log2: u32,
    /// Number of the region's eighths that are disabled.
    disabled_eighths: u32,
    access: u32,
    /// TEX, S, C, B.
    memory_type: u32,
    execute: bool,
}

const NO_ACCESS: u32 = 0b000 << 24;
const FULL_ACCESS: u32 = 0b011 << 24;
const READ_ONLY: u32 = 0b110 << 24;
const STRONGLY_ORDERED: u32 = 0;
/// TEX = 0, C = 0, B = 1.
const DEVICE: u32 = 1 << 16;
/// TEX = 1, C = 0, B = 0; shareable, as two bus masters use it.
const NORMAL_NON_CACHEABLE: u32 = 1 << 19 | 1 << 18;
/// TEX = 0, C = 1, B = 0.
const WRITE_THROUGH: u32 = 1 << 17;
/// TEX = 1, C = 1, B = 1.
const WRITE_BACK: u32 = 1 << 19 | 1 << 17 | 1 << 16;
const NEVER_EXECUTE: u32 = 1 << 28;

/// External memory (0x6000_0000 to 0xDFFF_FFFF) is not fitted. The core may read there
/// speculatively and then wait for ever (ST AN4838, section 4): no access at all.
const EXTERNAL_MEMORY: Region = Region {
    base: 0,
    size_log2: 32,
    disabled_eighths: 0b1000_0111,
    access: NO_ACCESS,
    memory_type: STRONGLY_ORDERED,
    execute: false,
};

/// All SRAM and DTCM, as in the default map, but never executed.
const DATA: Region = Region {
    base: 0x2000_0000,
    size_log2: 29,
    disabled_eighths: 0,
    access: FULL_ACCESS,
    memory_type: WRITE_BACK,
    execute: false,
};

/// AXI SRAM: the DMA buffers. Its upper three eighths have a model and no DMA buffer (`memory.x`).
const DMA_BUFFERS: Region = Region {
    base: 0x2400_0000,
    size_log2: 19,
    disabled_eighths: 0b1110_0000,
    access: FULL_ACCESS,
    memory_type: NORMAL_NON_CACHEABLE,
    execute: false,
};

/// ITCM, after its code is loaded. A stray write, such as through a null pointer, faults instead of
/// changing the program.
const NEAR_CODE: Region = Region {
    base: 0,
    size_log2: 16,
    disabled_eighths: 0,
    access: READ_ONLY,
    memory_type: NORMAL_NON_CACHEABLE,
    execute: true,
};

/// The program and its constants, as in the default map, but read-only.
const PROGRAM: Region = Region {
    base: 0x0800_0000,
    size_log2: 20,
    disabled_eighths: 0,
    access: READ_ONLY,
    memory_type: WRITE_THROUGH,
    execute: true,
};

/// The flash's second bank as device memory: no speculative reads while it is programmed or erased,
/// and writes arrive at once and in order.
const KEPT: Region = Region {
    base: flash::BASE,
    size_log2: flash::SIZE_LOG2,
    disabled_eighths: 0,
    access: FULL_ACCESS,
    memory_type: DEVICE,
    execute: false,
};

/// If regions overlap, the later one counts. Code is never writable, and writable memory is never
/// executed.
const REGIONS: [Region; 6] = [EXTERNAL_MEMORY, DATA, DMA_BUFFERS, NEAR_CODE, PROGRAM, KEPT];

/// Sets the MPU regions and enables both caches. Call first, before any access to a DMA buffer.
pub fn enable(core: &mut Peripherals) {
    set_regions(&mut core.MPU);
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

fn set_regions(mpu: &mut MPU) {
    const ENABLE: u32 = 1;
    /// All other addresses use the architecture's default memory map.
    const PRIVILEGED_DEFAULT: u32 = 1 << 2;
    cortex_m::asm::dmb();
    // SAFETY: the caches are still off, and memory in use keeps the type of the default map or, as
    // ITCM, is never cached.
    unsafe {
        mpu.ctrl.write(0);
        for (number, region) in (0..).zip(REGIONS) {
            if is_left_out(number) {
                continue;
            }
            mpu.rnr.write(number);
            mpu.rbar.write(region.base);
            mpu.rasr.write(region.attributes());
        }
        mpu.ctrl.write(ENABLE | PRIVILEGED_DEFAULT);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Returns whether a seeded bug leaves a region out.
fn is_left_out(number: u32) -> bool {
    match number {
        0 => seeded_bugs::allows_external_memory(),
        2 => seeded_bugs::caches_dma_buffers(),
        _ => false,
    }
}

impl Region {
    fn attributes(&self) -> u32 {
        const ENABLE: u32 = 1;
        let execute = if self.execute { 0 } else { NEVER_EXECUTE };
        execute
            | self.access
            | self.memory_type
            | self.disabled_eighths << 8
            | (self.size_log2 - 1) << 1
            | ENABLE
    }
}
