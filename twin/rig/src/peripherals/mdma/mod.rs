//! The master DMA controller (MDMA), which alone reaches DTCM and ITCM: it moves blocks of memory
//! on software request.
//!
//! RM0433 rev 7 chapter 14. A request moves its whole block at its end, after the time that the
//! block takes at 240 MHz. Simulated: 16 channels, software requests for one block, increments,
//! sizes with packing, flags, interrupt, errors. Not simulated: hardware triggers, repeated blocks,
//! linked lists, endianness, offsets other than the size. Their use ends the run with an error, as
//! does a transfer that the manual forbids.

mod block;

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::emulator::Memory;
use rigless::soc::Layout;
use rigless::soc::stm32h743::generated::mdma::Register;
use rigless::time::{EventId, VirtualNanos};

use crate::busy_bus::{Chance, InterruptLine};
use crate::faults::{Faults, Kind};
use crate::memory_types::MemoryTypes;
use crate::peripherals::flash::{BANK, Bank};
use crate::rules::Rules;
use block::{Block, asked_for};

const CHANNELS: usize = 16;
/// Number of a channel's registers in the vendor's table; the first channel's begin at row 1.
const ROWS: usize = 13;
/// One buffer of 128 bytes is read in 16 beats of 8 bytes and written in 32 of 4. Arbitration takes
/// as many cycles as reading: an assumption.
const BUFFER_BYTES: u64 = 128;
const BUFFER_CYCLES: u64 = 64;
const BUS_HZ: u64 = 240_000_000;
/// The largest factor by which a busy bus lengthens a block. A band takes 84 µs at most, half of
/// the time in which the camera sends it.
const LONGEST_WAIT: u64 = 16;
/// Rows of a channel.
mod row {
    pub const ISR: usize = 0;
    pub const IFCR: usize = 1;
    pub const CR: usize = 3;
    pub const TCR: usize = 4;
    pub const BNDTR: usize = 5;
    pub const SAR: usize = 6;
    pub const DAR: usize = 7;
    pub const LAR: usize = 9;
    pub const TBR: usize = 10;
}

/// Flags of ISR; CR has their enables one bit higher.
mod flag {
    pub const ERROR: u32 = 1 << 0;
    pub const CHANNEL: u32 = 1 << 1;
    pub const BLOCK: u32 = 1 << 3;
    pub const BUFFER: u32 = 1 << 4;
    pub const ALL: u32 = 0x1F;
    pub const ACTIVE: u32 = 1 << 16;
}

/// CR bits.
const ENABLE: u64 = 1;
const REQUEST: u64 = 1 << 16;

#[derive(Debug, Default)]
struct Channel {
    flags: u32,
    /// The block that is being moved, and the event at its end.
    under_way: Option<(Block, EventId)>,
}

/// The controller.
#[derive(Debug)]
pub struct Mdma {
    rules: Rules,
    faults: Faults,
    bank: Bank,
    /// Memory types, unless the emulator's core has them.
    types: Option<MemoryTypes>,
    /// Decides the next block's wait.
    chance: Chance,
    channels: [Channel; CHANNELS],
    interrupt: InterruptLine,
    /// Blocks that ended, with bytes not yet moved.
    to_move: Vec<Block>,
    memory_bytes: u64,
}

impl Mdma {
    /// Returns a controller at rest. `seed` decides the time for which others hold the bus under
    /// [`Kind::BusBusy`].
    pub fn new(
        rules: Rules,
        faults: Faults,
        bank: Bank,
        types: Option<MemoryTypes>,
        seed: u64,
    ) -> Self {
        Self {
            rules,
            interrupt: InterruptLine::new(faults.clone(), seed),
            faults,
            bank,
            types,
            chance: Chance::new(seed),
            channels: Default::default(),
            to_move: Vec::new(),
            memory_bytes: 0,
        }
    }

    /// Returns the count of bytes moved out of memories, that is, of bands and snapshots. Bytes of
    /// the flash do not count.
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// Returns the factor by which the bus lengthens a block.
    fn patience(&mut self, now_ns: u64) -> u64 {
        if !self.faults.on(Kind::BusBusy, now_ns) {
            return 1;
        }
        1 + self.chance.below(LONGEST_WAIT)
    }

    fn control_written(
        &mut self,
        nth: usize,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let patience = self.patience(context.now().0);
        let channel = &mut self.channels[nth];
        if value & ENABLE == 0 {
            channel.under_way = None;
            return;
        }
        if value & REQUEST == 0 || channel.under_way.is_some() {
            return;
        }
        match asked_for(&|row| registers.get(register(nth, row)), value) {
            Ok(block) => {
                if let Some(types) = &self.types {
                    let name = format_args!("MDMA channel {nth}");
                    let [from, to] =
                        [block.source, block.destination].map(|at| Some((at, block.bytes)));
                    types.check_dma(name, from, to, &self.rules);
                }
                let cycles = block.bytes.div_ceil(BUFFER_BYTES) * BUFFER_CYCLES;
                let end = context.now().0 + patience * cycles * 1_000_000_000 / BUS_HZ;
                channel.under_way = Some((block, context.schedule(VirtualNanos(end))));
            }
            Err(why) => self
                .rules
                .broken(|| format!("MDMA channel {nth}: {why} (RM0433, MDMA registers)")),
        }
    }

    /// Ends a block after its time.
    fn end_block(
        &mut self,
        nth: usize,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let Some((block, _)) = self.channels[nth].under_way else {
            return;
        };
        if self.bank.refuses(block.source, block.bytes, &self.rules) {
            self.end(nth, flag::ERROR, registers);
        } else {
            self.to_move.push(block);
            self.end(nth, flag::CHANNEL | flag::BLOCK | flag::BUFFER, registers);
        }
        self.drive(registers, context);
    }

    /// Moves the bytes of blocks that ended, before the core goes on.
    pub fn settle(&mut self, memory: &mut dyn Memory) {
        for block in self.to_move.drain(..) {
            if block.copy(memory).is_err() {
                self.rules
                    .broken(|| format!("MDMA: {block:x?} is not all memory"));
            }
        }
    }

    fn end(&mut self, nth: usize, flags: u32, registers: &mut RegisterFile) {
        let channel = &mut self.channels[nth];
        let block = channel.under_way.take().map(|(block, _)| block);
        if let Some(block) = block.filter(|block| !is_flash(block.source)) {
            self.memory_bytes += block.bytes;
        }
        channel.flags |= flags;
        let control = register(nth, row::CR);
        registers.set(control, registers.get(control) & !ENABLE);
    }

    fn drive(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let wants = |(nth, channel): (usize, &Channel)| {
            let enables = registers.get(register(nth, row::CR)) as u32 >> 1 & flag::ALL;
            channel.flags & enables != 0
        };
        let level = Level::from(self.channels.iter().enumerate().any(wants));
        self.interrupt.drive(level, context);
    }
}

fn is_flash(address: u64) -> bool {
    u32::try_from(address).is_ok_and(|address| BANK.contains(&address))
}

fn register(nth: usize, row: usize) -> Register {
    Register::from_index(1 + nth * ROWS + row).expect("16 channels of 13 registers")
}

impl Device for Mdma {
    type Register = Register;

    fn read(
        &mut self,
        register: Register,
        _registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.interrupt.read_back(context);
        let index = register.index().checked_sub(1)?;
        let channel = &self.channels[index / ROWS];
        let active = if channel.under_way.is_some() {
            flag::ACTIVE
        } else {
            0
        };
        (index % ROWS == row::ISR).then_some((channel.flags | active).into())
    }

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let Some(index) = register.index().checked_sub(1) else {
            return;
        };
        let nth = index / ROWS;
        match index % ROWS {
            row::IFCR => self.channels[nth].flags &= !(value as u32 & flag::ALL),
            row::CR => self.control_written(nth, value, registers, context),
            _ => {}
        }
        self.drive(registers, context);
    }

    fn on_event(
        &mut self,
        event: EventId,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if self.interrupt.falls_at(event, context) {
            return;
        }
        for nth in 0..CHANNELS {
            if self.channels[nth]
                .under_way
                .is_some_and(|(_, end)| end == event)
            {
                self.end_block(nth, registers, context);
            }
        }
    }

    fn reset(&mut self) {
        self.channels = Default::default();
        self.to_move.clear();
        self.interrupt.reset();
    }
}
