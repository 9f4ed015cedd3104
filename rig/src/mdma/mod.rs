//! The master DMA controller, which alone reaches DTCM and ITCM: blocks of memory on software
//! request.
//!
//! RM0433 rev 7 chapter 14. A request moves its block after the time that it takes at 240 MHz, all
//! at once at its end. Simulated: 16 channels, software requests for one block, increments, sizes
//! with packing, flags, interrupt, errors. Not simulated: hardware triggers, repeated blocks,
//! linked lists, endianness, offsets other than the size; using them ends the run with an error,
//! and so does a transfer that the manual forbids.

mod block;

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::soc::stm32h743::generated::mdma::Register;
use rigless::soc::{Layout, Width};
use rigless::time::{EventId, VirtualNanos};

use crate::busy_bus::{Chance, InterruptLine};
use crate::faults::{Faults, Kind};
use crate::flash::{BANK, Bank};
use crate::rules::Rules;
use block::{Block, asked_for};

const CHANNELS: usize = 16;
/// Registers of a channel in the vendor's table, the first channel's from row 1 on.
const ROWS: usize = 13;
/// One buffer of 128 bytes is read in 16 beats of 8 bytes, written in 32 of 4, with as many cycles
/// again for arbitration as reading takes: an assumption.
const BUFFER_BYTES: u64 = 128;
const BUFFER_CYCLES: u64 = 64;
const BUS_HZ: u64 = 240_000_000;
/// A block on a busy bus takes at most so many times as long: 84 µs for a band, half of what the
/// camera takes to send it.
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
    /// Accesses that are not yet answered.
    open: u64,
    /// Tells the answers of one block from those of another.
    generation: u64,
}

/// The controller.
#[derive(Debug)]
pub struct Mdma {
    rules: Rules,
    faults: Faults,
    bank: Bank,
    /// Decides the next block's wait.
    chance: Chance,
    channels: [Channel; CHANNELS],
    interrupt: InterruptLine,
    memory_bytes: u64,
}

impl Mdma {
    /// A controller at rest.
    /// `seed` decides how long others hold the bus under [`Kind::BusBusy`].
    pub fn new(rules: Rules, faults: Faults, bank: Bank, seed: u64) -> Self {
        Self {
            rules,
            interrupt: InterruptLine::new(faults.clone(), seed),
            faults,
            bank,
            chance: Chance::new(seed),
            channels: Default::default(),
            memory_bytes: 0,
        }
    }

    /// Bytes moved so far out of memories, which is what bands and snapshots are; not those of the
    /// flash.
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// How often a block takes the time that it takes alone.
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
            channel.generation += 1;
            return;
        }
        if value & REQUEST == 0 || channel.under_way.is_some() {
            return;
        }
        match asked_for(&|row| registers.get(register(nth, row)), value) {
            Ok(block) => {
                let cycles = block.bytes.div_ceil(BUFFER_BYTES) * BUFFER_CYCLES;
                let end = context.now().0 + patience * cycles * 1_000_000_000 / BUS_HZ;
                channel.under_way = Some((block, context.schedule(VirtualNanos(end))));
            }
            Err(why) => self
                .rules
                .broken(|| format!("MDMA channel {nth}: {why} (RM0433, MDMA registers)")),
        }
    }

    /// Asks for the reads of a block; each answer becomes a write.
    fn move_block(
        &mut self,
        nth: usize,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let channel = &mut self.channels[nth];
        let Some((block, _)) = channel.under_way else {
            return;
        };
        if self.bank.refuses(block.source, block.bytes, &self.rules) {
            self.end(nth, flag::ERROR, registers);
            self.drive(registers, context);
            return;
        }
        let channel = &mut self.channels[nth];
        channel.generation += 1;
        channel.open = block.bytes / 8;
        for offset in (0..block.bytes).step_by(8) {
            let token = Token {
                nth,
                generation: channel.generation,
                offset,
                written: false,
            };
            context.read_from(block.source + offset, Width::W64, token.pack());
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

/// What an access was made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Token {
    nth: usize,
    generation: u64,
    offset: u64,
    written: bool,
}

impl Token {
    fn pack(self) -> u64 {
        self.generation << 32 | (self.nth as u64) << 24 | self.offset << 1 | u64::from(self.written)
    }

    fn unpack(token: u64) -> Self {
        Self {
            nth: (token >> 24 & 0xF) as usize,
            generation: token >> 32,
            offset: token >> 1 & 0x3F_FFFF,
            written: token & 1 == 1,
        }
    }
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
                self.move_block(nth, registers, context);
            }
        }
    }

    fn on_access(
        &mut self,
        token: u64,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let token = Token::unpack(token);
        let channel = &mut self.channels[token.nth];
        let Some((block, _)) = channel.under_way else {
            return;
        };
        if token.generation != channel.generation & 0xFFFF_FFFF {
            return;
        }
        if !token.written {
            let token = Token {
                written: true,
                ..token
            };
            context.write_to(
                block.destination + token.offset,
                Width::W64,
                value,
                token.pack(),
            );
            return;
        }
        channel.open -= 1;
        if channel.open == 0 {
            self.end(
                token.nth,
                flag::CHANNEL | flag::BLOCK | flag::BUFFER,
                registers,
            );
            self.drive(registers, context);
        }
    }

    fn on_refused(
        &mut self,
        token: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let nth = Token::unpack(token).nth;
        self.channels[nth].generation += 1;
        self.end(nth, flag::ERROR, registers);
        self.drive(registers, context);
    }

    fn reset(&mut self) {
        self.channels = Default::default();
        self.interrupt.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_come_back() {
        let token = Token {
            nth: 15,
            generation: 77,
            offset: 65_528,
            written: true,
        };
        assert_eq!(Token::unpack(token.pack()), token);
    }
}
