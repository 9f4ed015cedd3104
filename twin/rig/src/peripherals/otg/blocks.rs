//! The core's three register blocks on the bus: global, device, and FIFOs.
//!
//! The vendor's register tables leave out the FIFOs and some endpoints. The part's slots are
//! therefore replaced by slots that cover every word, with the same clock gate. The reset line and
//! the clock follow the slot.

use rigless::device::{DeviceContext, ErasedDevice, Level, RegisterFile, RequestChange};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::{CPU, MEMORY, Stm32h743};
use rigless::soc::{
    Access, Bus, Error, Gate, Peripheral, ReadAction, RegisterSpec, Width, WriteModify,
};
use rigless::time::{EventId, VirtualNanos};
use std::sync::LazyLock;

use super::{ENDPOINTS, SharedCore};
use crate::usb_host::SharedHost;

const BASE: u64 = 0x4008_0000;
/// OTG_FS global interrupt.
const LINES: &[u16] = &[101];
/// Offset of power and clock gating in the vendor's file; the FIFOs follow it.
const FIFO_OFFSET: u64 = 0xE00;

/// The block of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Which {
    Global,
    Device,
    Fifo,
}

static GLOBAL: LazyLock<&'static [RegisterSpec]> = LazyLock::new(|| words((0..0x400).step_by(4)));
static DEVICE: LazyLock<&'static [RegisterSpec]> = LazyLock::new(|| words((0..0x420).step_by(4)));
static FIFO: LazyLock<&'static [RegisterSpec]> = LazyLock::new(|| {
    let first_fifo = 0x1000 - FIFO_OFFSET as u32;
    words(std::iter::once(0).chain((0..ENDPOINTS as u32).map(|n| first_fifo + n * 0x1000)))
});

/// Returns a register table of plain words, made once per process.
fn words(offsets: impl Iterator<Item = u32>) -> &'static [RegisterSpec] {
    let word = |offset: u32| RegisterSpec {
        name: Box::leak(format!("WORD_{offset:05X}").into_boxed_str()),
        offset,
        width: Width::W32,
        reset: 0,
        access: Access::ReadWrite,
        read: ReadAction::None,
        write: WriteModify::None,
        fields: &[],
    };
    Box::leak(offsets.map(word).collect::<Vec<_>>().into_boxed_slice())
}

impl Which {
    const ALL: [Which; 3] = [Which::Global, Which::Device, Which::Fifo];

    fn peripheral(self) -> Peripheral {
        let (name, base, size, registers) = match self {
            Which::Global => ("OTG2_HS_GLOBAL", BASE, 0x400, *GLOBAL),
            Which::Device => ("OTG2_HS_DEVICE", BASE + 0x800, 0x420, *DEVICE),
            Which::Fifo => ("OTG2_HS_PWRCLK", BASE + FIFO_OFFSET, 0x3_F200, *FIFO),
        };
        Peripheral {
            name,
            base,
            size,
            interrupts: LINES,
            registers,
        }
    }
}

/// The three blocks of a part.
#[derive(Debug)]
pub struct Blocks {
    blocks: [Block; 3],
    slots: [usize; 3],
    /// The bus that holds the part's own slots.
    donor: Bus,
}

impl Blocks {
    /// Replaces the part's own blocks.
    ///
    /// # Errors
    /// If the part is not laid out as expected.
    pub fn fit(part: &mut Stm32h743, core: &SharedCore, host: &SharedHost) -> Result<Self, Error> {
        let mut slots = [0; 3];
        for (which, slot) in Which::ALL.into_iter().zip(&mut slots) {
            *slot = part.bus().slot(which.peripheral().name)?;
        }
        let block = |which| Block {
            which,
            core: core.clone(),
            host: host.clone(),
            tick: None,
        };
        let mut blocks = Self {
            blocks: Which::ALL.map(block),
            slots,
            donor: donor(part)?,
        };
        blocks.exchange(part);
        Ok(blocks)
    }

    /// Exchanges these blocks with the part's own ones, in either direction. A part is reset with
    /// its own blocks in place.
    pub fn exchange(&mut self, part: &mut Stm32h743) {
        for slot in self.slots {
            std::mem::swap(part.bus_mut().slot_mut(slot), self.donor.slot_mut(slot));
        }
    }

    /// Returns the model of a slot; `None` if it is not one of the three.
    pub fn model(&mut self, slot: usize) -> Option<&mut dyn ErasedDevice> {
        let nth = self.slots.iter().position(|had| *had == slot)?;
        Some(&mut self.blocks[nth])
    }

    /// Makes the host check the port at an instant: at the start, and after a reset.
    pub fn wake_host(&mut self, bus: &mut Bus, at: VirtualNanos) {
        let (_, mut context) = bus.drive(at, self.slots[0]);
        self.blocks[0].schedule_host(at.0, &mut context);
    }
}

/// Returns a bus with the part's instances in the part's order, in which gates have the same bits,
/// and with the rig's blocks.
fn donor(part: &Stm32h743) -> Result<Bus, Error> {
    let ours = Which::ALL.map(Which::peripheral);
    let replaced = |had: &Peripheral| {
        ours.into_iter()
            .find(|our| our.name == had.name)
            .unwrap_or(*had)
    };
    let instances: Vec<Peripheral> = part.bus().peripherals().map(replaced).collect();
    let gate = Gate::by("RCC", "AHB1ENR", "USB2OTGHSEN");
    let builder = Bus::builder(CPU, &MEMORY, instances);
    ours.iter()
        .fold(builder, |builder, our| builder.gate(our.name, gate))
        .build()
}

/// One block.
#[derive(Debug)]
pub struct Block {
    which: Which,
    core: SharedCore,
    host: SharedHost,
    tick: Option<EventId>,
}

impl Block {
    fn offset(&self, row: usize) -> u32 {
        self.which.peripheral().registers[row].offset
    }

    fn drive(&self, context: &mut DeviceContext<'_>) {
        let level = Level::from(self.core.lock().interrupt());
        self.core.line().drive(level, context);
    }

    fn schedule_host(&mut self, at_ns: u64, context: &mut DeviceContext<'_>) {
        self.tick = Some(context.schedule(VirtualNanos(at_ns)));
    }

    fn read_word(&self, offset: u32, now_ns: u64) -> u32 {
        let mut core = self.core.lock();
        match self.which {
            Which::Global => core.read_global(offset),
            Which::Device => core.read_device(offset, now_ns),
            Which::Fifo if offset == 0 => 0,
            Which::Fifo => core.read_fifo(),
        }
    }

    fn write_word(&self, offset: u32, value: u32) {
        let mut core = self.core.lock();
        match self.which {
            Which::Global => core.write_global(offset, value),
            Which::Device => core.write_device(offset, value),
            Which::Fifo => {
                if let Some(fifo) = (offset + FIFO_OFFSET as u32).checked_sub(0x1000) {
                    core.write_fifo((fifo / 0x1000) as usize, value);
                }
            }
        }
    }
}

impl ErasedDevice for Block {
    fn layout(&self) -> &'static [RegisterSpec] {
        self.which.peripheral().registers
    }

    fn read(
        &mut self,
        row: usize,
        _registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.core.line().read_back(context);
        let value = self.read_word(self.offset(row), context.now().0);
        self.drive(context);
        Some(value.into())
    }

    fn write(
        &mut self,
        row: usize,
        value: u64,
        _registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.write_word(self.offset(row), value as u32);
        self.drive(context);
    }

    fn on_event(
        &mut self,
        event: EventId,
        _registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.core.line().falls_at(event, context);
        if self.tick != Some(event) {
            return;
        }
        let next = self
            .host
            .lock()
            .tick(context.now().0, &mut self.core.lock());
        self.schedule_host(next, context);
        self.drive(context);
    }

    /// The clock comes from the board, with its error ([`crate::board::Wiring`]).
    fn on_clock(
        &mut self,
        _hz: u64,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
    }

    fn reset(&mut self) {
        if self.which == Which::Global {
            self.core.lock().reset();
        }
    }

    fn reset_line(&mut self, _registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.reset();
        if self.which == Which::Global {
            self.schedule_host(context.now().0, context);
        }
    }

    fn on_request(
        &mut self,
        _change: RequestChange,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
    }
    fn poll(&mut self, _registers: &mut RegisterFile, _context: &mut DeviceContext<'_>) {}
    fn on_access(
        &mut self,
        _token: u64,
        _value: u64,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
    }
    fn on_refused(
        &mut self,
        _token: u64,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
    }
}
