//! The memory protection unit (MPU), enforced or ignored.
//!
//! While the emulator's core enforces it, every access of the program is checked against its
//! regions, which takes most of a run's time. If it is ignored, this module has its registers: no
//! access of the program is checked, but memory types are ([`MemoryTypes`]). A program that stays
//! within its own regions behaves the same in both cases, bit for bit.

use std::num::NonZeroU64;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rigless::device::{DeviceContext, ErasedDevice, RegisterFile, RequestChange};
use rigless::soc::{Bus, Error, RegisterSpec, Width, Window};
use rigless::time::EventId;

use crate::memory_types::MemoryTypes;
use crate::rules::Rules;

/// Base address of its registers (ARMv7-M, B3.5.4).
const BASE: u64 = 0xE000_ED90;
const BYTES: NonZeroU64 = NonZeroU64::new(0x2C).expect("some");
/// MPU_TYPE, and its value with 16 regions.
const TYPE: u64 = 0;
const SIXTEEN_REGIONS: u64 = 16 << 8;
/// MPU_RNR, MPU_RBAR and MPU_RASR; the aliases of the latter two are not simulated.
const NUMBER: u64 = 8;
const BASE_ADDRESS: u64 = 0xC;
const ATTRIBUTES: u64 = 0x10;
/// MPU_CTRL, which has the bit that switches the unit on.
const CTRL: u64 = 4;
/// MPU_CTRL's address, for code that checks the core's own register.
pub const CTRL_ADDRESS: u64 = BASE + CTRL;
/// MPU_CTRL.ENABLE.
pub const ENABLE: u64 = 1;

/// Whether the regions that a program sets are enforced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Protection {
    /// The emulator's core enforces them.
    #[default]
    Enforced,
    /// They are ignored: several times as fast.
    Ignored,
}

/// Registers of a unit that is not enforced.
#[derive(Debug)]
pub struct Mpu {
    slot: usize,
    layout: &'static [RegisterSpec],
    is_on: Arc<AtomicBool>,
    types: MemoryTypes,
    rules: Rules,
}

impl Mpu {
    /// Replaces the core's own registers by these.
    ///
    /// # Errors
    /// If the addresses are already taken.
    pub fn fit(bus: &mut Bus, rules: Rules) -> Result<Self, Error> {
        let slot = bus.add_window(Window::new("MPU", BASE, BYTES))?;
        Ok(Self {
            slot,
            layout: bus.slots()[slot].peripheral().registers,
            is_on: Arc::default(),
            types: MemoryTypes::default(),
            rules,
        })
    }

    /// Returns their slot on the bus.
    pub fn slot(&self) -> usize {
        self.slot
    }

    /// Returns the memory types that its regions set.
    pub fn types(&self) -> &MemoryTypes {
        &self.types
    }

    /// Returns a flag that is set once the program has switched the unit on.
    pub fn is_on(&self) -> Arc<AtomicBool> {
        self.is_on.clone()
    }
}

impl ErasedDevice for Mpu {
    fn layout(&self) -> &'static [RegisterSpec] {
        self.layout
    }

    fn read_window(&mut self, offset: u64, _width: Width, _context: &mut DeviceContext<'_>) -> u64 {
        match offset {
            TYPE => SIXTEEN_REGIONS,
            CTRL => self.is_on.load(Ordering::Relaxed).into(),
            _ => 0,
        }
    }

    fn write_window(
        &mut self,
        offset: u64,
        _width: Width,
        value: u64,
        _context: &mut DeviceContext<'_>,
    ) {
        match offset {
            CTRL => {
                let on = value & ENABLE != 0;
                self.is_on.store(on, Ordering::Relaxed);
                self.types.switch(on, &self.rules);
            }
            NUMBER => self.types.select(value),
            BASE_ADDRESS => self.types.set_base(value),
            ATTRIBUTES => self.types.set_attributes(value),
            _ => {}
        }
    }

    fn reset(&mut self) {
        self.is_on.store(false, Ordering::Relaxed);
        self.types.reset();
    }

    // It has a window, no register of the part's, and no events.
    fn read(
        &mut self,
        _row: usize,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        None
    }

    fn write(
        &mut self,
        _row: usize,
        _value: u64,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
    }

    fn on_event(&mut self, _: EventId, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {}

    fn on_request(&mut self, _: RequestChange, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {}

    fn on_clock(&mut self, _hz: u64, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {}

    fn poll(&mut self, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {}

    fn on_access(
        &mut self,
        _token: u64,
        _value: u64,
        _: &mut RegisterFile,
        _: &mut DeviceContext<'_>,
    ) {
    }

    fn on_refused(&mut self, _token: u64, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {}
}
