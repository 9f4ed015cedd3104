//! Memory types of addresses, as a program's MPU regions set them, and the rules that follow.
//!
//! Both caches of this firmware are on, and the emulator has none. So a wrong memory type would go
//! unnoticed here, and on silicon it gives stale pixels or a core that waits for ever.

use std::fmt::Display;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::rules::Rules;

/// Regions of the unit (MPU_TYPE.DREGION).
const REGIONS: usize = 16;
/// ITCM and DTCM, which are never cached: start, bytes.
const TIGHTLY_COUPLED: [(u64, u64); 2] = [(0, 64 << 10), (0x2000_0000, 128 << 10)];
/// External memory that is normal memory in the default map (ARMv7-M, B3.1), in steps of this size.
/// No board has any.
const EXTERNAL: std::ops::Range<u64> = 0x6000_0000..0xA000_0000;
const EXTERNAL_STEP: usize = 0x1000_0000;

/// The memories of the part, each by an address.
const MEMORIES: [u64; 7] = [
    0,
    0x0800_0000,
    0x0810_0000,
    0x2000_0000,
    0x2400_0000,
    0x3000_0000,
    0x3800_0000,
];

/// The memory types that the rules distinguish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    NoAccess,
    /// Strongly ordered, or device: read only as the program says.
    Device,
    NonCacheable,
    WriteThrough,
    WriteBack,
}

/// A region's registers: MPU_RBAR and MPU_RASR.
#[derive(Clone, Copy, Debug, Default)]
struct Region {
    base: u64,
    attributes: u64,
}

#[derive(Debug, Default)]
struct State {
    is_on: bool,
    selected: usize,
    regions: [Region; REGIONS],
}

/// The regions, shared by the unit and by whoever checks an address.
#[derive(Clone, Debug, Default)]
pub struct MemoryTypes(Arc<Mutex<State>>);

impl MemoryTypes {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Forgets all regions, as a reset does.
    pub fn reset(&self) {
        *self.lock() = State::default();
    }

    /// Selects a region: a write of MPU_RNR.
    pub fn select(&self, number: u64) {
        self.lock().selected = number as usize % REGIONS;
    }

    /// Sets the region's base: a write of MPU_RBAR, which may select another region.
    pub fn set_base(&self, value: u64) {
        const VALID: u64 = 1 << 4;
        let mut state = self.lock();
        if value & VALID != 0 {
            state.selected = value as usize % REGIONS;
        }
        let selected = state.selected;
        state.regions[selected].base = value & !0x1F;
    }

    /// Sets the region's size and type: a write of MPU_RASR.
    pub fn set_attributes(&self, value: u64) {
        let mut state = self.lock();
        let selected = state.selected;
        state.regions[selected].attributes = value;
    }

    /// Switches the regions on or off. Notes a breach if the core may then read external memory
    /// ahead of the program.
    pub fn switch(&self, on: bool, rules: &Rules) {
        let mut state = self.lock();
        state.is_on = on;
        let readable = |address: &u64| {
            let of = state.type_of(*address);
            !matches!(of, Type::NoAccess | Type::Device)
        };
        let found = EXTERNAL.step_by(EXTERNAL_STEP).find(readable);
        if let Some(address) = found.filter(|_| on) {
            rules.broken(|| {
                format!(
                    "MPU: {address:#x} is normal memory and no board has it: the core may read \
                     there ahead of the program, and wait for ever (ST AN4838, section 4)"
                )
            });
        }
    }

    /// Returns a memory that the program may both write and execute; `None` without one.
    pub fn writable_code(&self) -> Option<u64> {
        let state = self.lock();
        let is_writable_code = |address: &u64| {
            let region = state.region_of(*address);
            region.is_none_or(Region::is_writable_code)
        };
        MEMORIES.into_iter().find(is_writable_code)
    }

    /// Notes a breach if caches may hold other bytes than those that a DMA reads from `source` or
    /// writes to `target`. Ranges are a first address and a length in bytes.
    pub fn check_dma(
        &self,
        name: impl Display,
        source: Option<(u64, u64)>,
        target: Option<(u64, u64)>,
        rules: &Rules,
    ) {
        let state = self.lock();
        if !state.is_on {
            return;
        }
        let ends = |(from, bytes): (u64, u64)| [from, from + bytes.max(1) - 1];
        let is_dirty = |address: &u64| state.type_of(*address) == Type::WriteBack;
        let is_cached = |address: &u64| {
            matches!(
                state.type_of(*address),
                Type::WriteBack | Type::WriteThrough
            )
        };
        let read = source.and_then(|source| ends(source).into_iter().find(is_dirty));
        let written = target.and_then(|target| ends(target).into_iter().find(is_cached));
        if let Some(address) = read.or(written) {
            rules.broken(|| {
                format!(
                    "{name} moves bytes at {address:#010x}, which the MPU leaves cacheable: the \
                     core and the DMA may see different bytes (ST AN4839)"
                )
            });
        }
    }
}

impl State {
    fn type_of(&self, address: u64) -> Type {
        let is_tightly_coupled =
            |(base, bytes): &(u64, u64)| (*base..base + bytes).contains(&address);
        if TIGHTLY_COUPLED.iter().any(is_tightly_coupled) {
            return Type::NonCacheable;
        }
        self.region_of(address)
            .map_or_else(|| default_type(address), Region::memory_type)
    }

    /// Returns the region that decides about an address; `None` if it is the default map.
    fn region_of(&self, address: u64) -> Option<&Region> {
        let mut regions = self.regions.iter().rev().filter(|_| self.is_on);
        regions.find(|region| region.has(address))
    }
}

impl Region {
    fn has(&self, address: u64) -> bool {
        const ENABLE: u64 = 1;
        let bytes = 1_u64 << ((self.attributes >> 1 & 0x1F) + 1);
        let base = self.base & !(bytes - 1);
        if self.attributes & ENABLE == 0 || !(base..base + bytes).contains(&address) {
            return false;
        }
        let eighth = (address - base) * 8 / bytes;
        bytes < 256 || self.attributes >> (8 + eighth) & 1 == 0
    }

    /// ARMv7-M, B3.5.9: XN, and AP for privileged code, as the whole firmware is.
    fn is_writable_code(&self) -> bool {
        let (never_executed, access) = (self.attributes >> 28 & 1, self.attributes >> 24 & 7);
        never_executed == 0 && (1..=3).contains(&access)
    }

    /// ARMv7-M, B3.5.9: AP, and TEX, C, B.
    fn memory_type(&self) -> Type {
        let bits = |from: u32, count: u32| self.attributes >> from & ((1 << count) - 1);
        if bits(24, 3) == 0 {
            return Type::NoAccess;
        }
        match (bits(19, 3), bits(17, 1), bits(16, 1)) {
            (0, 0, _) | (2, 0, 0) => Type::Device,
            (1, 0, 0) | (4..=7, 0, 0) => Type::NonCacheable,
            (0 | 4..=7, 1, 0) => Type::WriteThrough,
            _ => Type::WriteBack,
        }
    }
}

/// ARMv7-M, table B3-1.
fn default_type(address: u64) -> Type {
    match address {
        0..0x2000_0000 | 0x8000_0000..0xA000_0000 => Type::WriteThrough,
        0x2000_0000..0x4000_0000 | 0x6000_0000..0x8000_0000 => Type::WriteBack,
        _ => Type::Device,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SRAM: u64 = 0x2400_0000;
    /// Full access, TEX = 1, 512 KiB, the upper half disabled.
    const NON_CACHEABLE: u64 = 3 << 24 | 1 << 19 | 0xF0 << 8 | 18 << 1 | 1;

    fn breach(types: &MemoryTypes, target: (u64, u64)) -> Option<String> {
        let rules = Rules::default();
        types.check_dma("DMA1", None, Some(target), &rules);
        rules.first()
    }

    #[test]
    fn the_last_region_with_an_enabled_eighth_decides() {
        let types = MemoryTypes::default();
        types.select(3);
        types.set_base(SRAM);
        types.set_attributes(NON_CACHEABLE);
        assert_eq!(breach(&types, (SRAM, 4)), None, "the unit is off");
        types.switch(true, &Rules::default());
        assert_eq!(breach(&types, (SRAM, 4)), None);
        assert_eq!(breach(&types, (SRAM, 256 << 10)), None);
        let beyond = breach(&types, (SRAM, (256 << 10) + 1)).unwrap();
        assert!(beyond.contains("0x24040000"), "{beyond}");
        types.set_base(SRAM | 1 << 4 | 5);
        types.set_attributes(3 << 24 | 1 << 17 | 18 << 1 | 1);
        assert!(breach(&types, (SRAM, 4)).is_some(), "region 5 is cacheable");
        types.reset();
        assert_eq!(breach(&types, (SRAM, 4)), None);
    }

    #[test]
    fn tightly_coupled_memory_is_never_cached() {
        let types = MemoryTypes::default();
        types.switch(true, &Rules::default());
        assert_eq!(breach(&types, (0x2000_0000, 128 << 10)), None);
        assert!(breach(&types, (0x3000_0000, 1)).is_some());
    }

    #[test]
    fn memory_is_written_or_executed_as_its_region_says() {
        const ALL: u64 = 31 << 1 | 1;
        const NEVER_EXECUTED: u64 = 1 << 28;
        let types = MemoryTypes::default();
        assert_eq!(types.writable_code(), Some(0), "the unit is off");
        types.switch(true, &Rules::default());
        types.set_attributes(6 << 24 | ALL);
        assert_eq!(types.writable_code(), None, "read-only");
        types.set_attributes(NEVER_EXECUTED | 3 << 24 | ALL);
        assert_eq!(types.writable_code(), None, "data");
        types.set_attributes(3 << 24 | 28 << 1 | 1);
        assert_eq!(types.writable_code(), Some(0));
    }

    #[test]
    fn external_memory_must_have_no_access_or_be_device_memory() {
        let breach = |attributes: u64| {
            let (types, rules) = (MemoryTypes::default(), Rules::default());
            types.set_attributes(attributes);
            types.switch(true, &rules);
            rules.first()
        };
        const ALL: u64 = 31 << 1 | 1;
        assert!(breach(0).unwrap().contains("0x60000000"));
        assert_eq!(breach(ALL), None, "no access");
        assert_eq!(breach(3 << 24 | 1 << 16 | ALL), None, "device memory");
        assert!(breach(3 << 24 | 1 << 19 | ALL).is_some());
        let no_upper_half = breach(0xF0 << 8 | ALL).unwrap();
        assert!(no_upper_half.contains("0x80000000"), "{no_upper_half}");
    }
}
