//! DMA1's stream 0, which writes the camera interface's words into memory.
//!
//! RM0433 rev 7 chapter 15. Simulated: words from a peripheral in direct mode, one block or
//! circular, double buffer, registers locked while the stream runs, flags, interrupt. Not
//! simulated: other streams, directions, sizes and the FIFO. Their use ends the run with an error.
//!
//! A word is a read of the bus, as on the chip. Words of a line that flows come by a [`Feed`], all
//! at once, which spares the emulator its bus.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::emulator::Memory;
use rigless::soc::stm32h743::generated::dma1::Register;
use rigless::soc::{Layout, Width};

use crate::rules::Rules;

/// The stream's position among DMAMUX1's requests and DMA1's interrupts.
const STREAM: usize = 0;
/// Index of its first register, S0CR, and the count of a stream's registers.
const FIRST_ROW: usize = 4;
const ROWS: usize = 6;
const STREAMS: usize = 8;
/// Bytes of a word.
const WORD: u64 = 4;

/// S0CR bits.
mod control {
    pub const ENABLE: u64 = 1 << 0;
    pub const ERROR_INTERRUPT: u64 = 1 << 2;
    pub const HALF_INTERRUPT: u64 = 1 << 3;
    pub const COMPLETE_INTERRUPT: u64 = 1 << 4;
    /// DMEIE to TCIE: the interrupts, which may be changed while the stream runs.
    pub const INTERRUPTS: u64 = 0x1E;
    pub const CIRCULAR: u64 = 1 << 8;
    pub const DOUBLE_BUFFER: u64 = 1 << 18;
    /// CT: the second target is being filled.
    pub const SECOND: u64 = 1 << 19;
    /// PFCTRL, DIR, PINC, MINC, PSIZE and MSIZE, and their values for words from a peripheral.
    pub const KIND: u64 = 1 << 5 | 3 << 6 | 1 << 9 | 1 << 10 | 3 << 11 | 3 << 13;
    pub const WORDS_FROM_PERIPHERAL: u64 = 1 << 10 | 2 << 11 | 2 << 13;
}
/// S0FCR: DMDIS, the FIFO in place of direct mode.
const USES_FIFO: u64 = 1 << 2;

/// LISR flags of the stream.
mod flag {
    pub const ERROR: u64 = 1 << 3;
    pub const HALF: u64 = 1 << 4;
    pub const COMPLETE: u64 = 1 << 5;
}

/// Words that a peripheral hands over at once, and whether the stream takes any.
#[derive(Debug, Default)]
pub struct Handover {
    /// The stream runs.
    pub is_ready: bool,
    /// Words that wait for the next request.
    pub words: Vec<u32>,
}

/// The handover, shared by the stream and the peripheral.
#[derive(Clone, Debug, Default)]
pub struct Feed(Arc<Mutex<Handover>>);

impl Feed {
    /// Locks the handover. One thread runs the whole rig, therefore the lock never waits.
    pub fn lock(&self) -> MutexGuard<'_, Handover> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The controller.
#[derive(Debug)]
pub struct Dma {
    feed: Feed,
    rules: Rules,
    /// Words of a block, which a stream that runs has locked, and those still to come.
    programmed: u64,
    left: u64,
    target: u64,
    is_requested: bool,
    /// A word is being read.
    is_reading: bool,
    interrupt: Level,
    /// The stream's registers after the last access.
    kept: [u64; ROWS],
    /// Words on their way into memory, by their addresses.
    to_write: Vec<(u64, u32)>,
}

impl Dma {
    /// Returns a controller out of reset.
    pub fn new(feed: Feed, rules: Rules) -> Self {
        Self {
            feed,
            rules,
            programmed: 0,
            left: 0,
            target: 0,
            is_requested: false,
            is_reading: false,
            interrupt: Level::Low,
            kept: [0; ROWS],
            to_write: Vec::new(),
        }
    }

    /// Resets the controller with the part, which drops all requests.
    pub fn part_reset(&mut self) {
        *self = Self::new(self.feed.clone(), self.rules.clone());
        *self.feed.lock() = Handover::default();
    }

    /// Writes the words that were moved, before the core goes on.
    pub fn settle(&mut self, memory: &mut dyn Memory) {
        let mut words = self.to_write.drain(..).peekable();
        while let Some((address, word)) = words.next() {
            // Two at once where they lie in one double word: half as many writes.
            let next = words.next_if(|next| address % 8 == 0 && next.0 == address + WORD);
            let written = match next {
                Some((_, upper)) => {
                    let both = u64::from(word) | u64::from(upper) << 32;
                    memory.write(address, Width::W64, both)
                }
                None => memory.write(address, Width::W32, word.into()),
            };
            if written.is_err() {
                self.rules.broken(|| {
                    format!("DMA1 stream 0 writes to {address:#010x}, which is no memory")
                });
            }
        }
    }

    fn was_running(&self) -> bool {
        self.kept[0] & control::ENABLE != 0
    }

    /// Notes the registers, and whether the stream runs.
    fn note(&mut self, registers: &RegisterFile) {
        for (nth, kept) in self.kept.iter_mut().enumerate() {
            *kept = registers.get(row(nth));
        }
        self.feed.lock().is_ready = self.was_running();
    }

    fn stream_written(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let kept = self.kept[register.index() - FIRST_ROW];
        let running = self.was_running();
        match register {
            Register::S0cr if running => {
                let open = control::ENABLE | control::INTERRUPTS;
                registers.restore(register, !open, kept);
            }
            Register::S0m0ar | Register::S0m1ar if running => {
                let control = registers.get(Register::S0cr);
                let doubles = control & control::DOUBLE_BUFFER != 0;
                let second = control & control::SECOND != 0;
                let is_current = (register == Register::S0m1ar) == second;
                if !doubles || is_current {
                    registers.set(register, kept);
                }
                if doubles && is_current {
                    self.fail(registers, context);
                }
            }
            _ if running => registers.set(register, kept),
            Register::S0ndtr => self.programmed = registers.get(register) & 0xFFFF,
            _ => {}
        }
        if register != Register::S0cr {
            return;
        }
        let runs = registers.get(register) & control::ENABLE != 0;
        match (running, runs) {
            (false, true) => self.start(registers, context),
            (true, false) => self.stop(registers),
            _ => {}
        }
        self.drive(registers, context);
    }

    fn start(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let mut control = registers.get(Register::S0cr);
        let kind = control & control::KIND;
        let uses_fifo = registers.get(Register::S0fcr) & USES_FIFO != 0;
        if kind != control::WORDS_FROM_PERIPHERAL || uses_fifo {
            self.rules.broken(|| {
                format!(
                    "DMA1 stream 0: S0CR = {control:#x} asks for something else than words from a \
                     peripheral in direct mode, which is not simulated"
                )
            });
        }
        if control & control::DOUBLE_BUFFER != 0 {
            control |= control::CIRCULAR;
            registers.set(Register::S0cr, control);
        }
        registers.set(Register::S0ndtr, self.programmed);
        self.is_reading = false;
        self.begin_block(registers);
        self.read_on(registers, context);
    }

    fn begin_block(&mut self, registers: &RegisterFile) {
        let control = registers.get(Register::S0cr);
        let second = control & (control::DOUBLE_BUFFER | control::SECOND);
        let is_second = second == control::DOUBLE_BUFFER | control::SECOND;
        self.left = self.programmed;
        self.target = registers.get(match is_second {
            true => Register::S0m1ar,
            false => Register::S0m0ar,
        });
    }

    /// Ends the transfer: at the end of a block that is not repeated, or on the program's request.
    fn stop(&mut self, registers: &mut RegisterFile) {
        self.left = 0;
        raise(registers, flag::COMPLETE);
        disable(registers);
    }

    fn fail(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        (self.left, self.is_reading) = (0, false);
        raise(registers, flag::ERROR);
        disable(registers);
        self.drive(registers, context);
    }

    fn runs(&self, registers: &RegisterFile) -> bool {
        registers.get(Register::S0cr) & control::ENABLE != 0 && self.left > 0
    }

    /// Moves words into memory, as far as the stream runs.
    fn take(&mut self, mut words: &[u32], registers: &mut RegisterFile) {
        while !words.is_empty() && self.runs(registers) {
            let (now, later) = words.split_at(words.len().min(self.left as usize));
            words = later;
            for word in now {
                self.to_write.push((self.target, *word));
                self.target += WORD;
            }
            let was_half = self.is_half();
            self.left -= now.len() as u64;
            registers.set(Register::S0ndtr, self.left);
            if self.is_half() && !was_half {
                raise(registers, flag::HALF);
            }
            if self.left == 0 {
                self.end_block(registers);
            }
        }
    }

    /// Returns whether half of the block was moved.
    fn is_half(&self) -> bool {
        2 * (self.programmed - self.left) >= self.programmed
    }

    fn end_block(&mut self, registers: &mut RegisterFile) {
        let control = registers.get(Register::S0cr);
        if control & control::CIRCULAR == 0 {
            return self.stop(registers);
        }
        raise(registers, flag::COMPLETE);
        if control & control::DOUBLE_BUFFER != 0 {
            registers.set(Register::S0cr, control ^ control::SECOND);
        }
        registers.set(Register::S0ndtr, self.programmed);
        self.begin_block(registers);
    }

    /// Reads the next word if the peripheral asks for it.
    fn read_on(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        if self.is_requested && !self.is_reading && self.runs(registers) {
            self.is_reading = true;
            context.read_from(registers.get(Register::S0par), Width::W32, 0);
        }
    }

    /// Sets the interrupt by the flags.
    fn drive(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let (enabled, flags) = (registers.get(Register::S0cr), registers.get(Register::Lisr));
        let pairs = [
            (control::ERROR_INTERRUPT, flag::ERROR),
            (control::HALF_INTERRUPT, flag::HALF),
            (control::COMPLETE_INTERRUPT, flag::COMPLETE),
        ];
        let raises = |&(enable, flag): &(u64, u64)| enabled & enable != 0 && flags & flag != 0;
        let wanted = Level::from(pairs.iter().any(raises));
        if wanted != self.interrupt {
            self.interrupt = wanted;
            context.interrupt(STREAM, wanted);
        }
    }
}

fn row(nth: usize) -> Register {
    Register::from_index(FIRST_ROW + nth).expect("a stream has six registers")
}

fn raise(registers: &mut RegisterFile, flag: u64) {
    registers.set(Register::Lisr, registers.get(Register::Lisr) | flag);
}

fn disable(registers: &mut RegisterFile) {
    let control = registers.get(Register::S0cr);
    registers.set(Register::S0cr, control & !control::ENABLE);
}

impl Device for Dma {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        match register {
            Register::Lifcr | Register::Hifcr => {
                let status = match register {
                    Register::Lifcr => Register::Lisr,
                    _ => Register::Hisr,
                };
                registers.set(status, registers.get(status) & !value);
                registers.set(register, 0);
                self.drive(registers, context);
            }
            _ => match register.index().checked_sub(FIRST_ROW) {
                Some(index) if index < ROWS => self.stream_written(register, registers, context),
                Some(index) if index % ROWS == 0 && value & control::ENABLE != 0 => {
                    let number = (index / ROWS).min(STREAMS - 1);
                    self.rules
                        .broken(|| format!("DMA1 stream {number} is enabled: not simulated"));
                }
                _ => {}
            },
        }
        self.note(registers);
    }

    fn on_request(
        &mut self,
        change: RequestChange,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if change.instance != "DMAMUX1" || change.request != STREAM {
            return;
        }
        self.is_requested = change.level == Level::High;
        if !self.is_requested {
            return;
        }
        let words = std::mem::take(&mut self.feed.lock().words);
        if words.is_empty() {
            self.read_on(registers, context);
        } else {
            self.take(&words, registers);
            self.drive(registers, context);
        }
        self.note(registers);
    }

    fn on_access(
        &mut self,
        _token: u64,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        // A stream that was stopped meanwhile does not wait for this word.
        if std::mem::take(&mut self.is_reading) {
            self.take(&[value as u32], registers);
            self.drive(registers, context);
            self.read_on(registers, context);
        }
        self.note(registers);
    }

    fn on_refused(
        &mut self,
        _token: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if self.is_reading {
            self.fail(registers, context);
        }
        self.note(registers);
    }

    /// A reset leaves the level of the request as it was driven last.
    fn reset(&mut self) {
        let is_requested = self.is_requested;
        self.part_reset();
        self.is_requested = is_requested;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::Mcu;
    use rigless::soc::stm32h743::Stm32h743;
    use rigless::time::VirtualNanos;

    const FIRST: u64 = 0x2400_0000;
    const SECOND: u64 = 0x2400_1000;
    const RUNS: u64 =
        control::WORDS_FROM_PERIPHERAL | control::DOUBLE_BUFFER | control::COMPLETE_INTERRUPT;

    /// A controller in its slot.
    struct Bench {
        part: Stm32h743,
        slot: usize,
        dma: Dma,
    }

    impl Bench {
        /// Returns a controller with a stream that runs, with blocks of four words.
        fn running() -> Bench {
            let part = Stm32h743::new().unwrap();
            let slot = part.bus().slot("DMA1").unwrap();
            let dma = Dma::new(Feed::default(), Rules::default());
            let mut bench = Bench { part, slot, dma };
            bench.write(Register::S0m0ar, FIRST);
            bench.write(Register::S0m1ar, SECOND);
            bench.write(Register::S0ndtr, 4);
            bench.write(Register::S0cr, RUNS | control::ENABLE);
            bench
        }

        fn write(&mut self, register: Register, value: u64) {
            let (registers, mut context) = self.part.bus_mut().drive(VirtualNanos(0), self.slot);
            registers.set(register, value);
            Device::write(&mut self.dma, register, value, registers, &mut context);
        }

        fn get(&mut self, register: Register) -> u64 {
            let (registers, _) = self.part.bus_mut().drive(VirtualNanos(0), self.slot);
            registers.get(register)
        }

        /// Hands words over with a request.
        fn feed(&mut self, words: &[u32]) {
            self.dma.feed.lock().words.extend(words);
            let (registers, mut context) = self.part.bus_mut().drive(VirtualNanos(0), self.slot);
            let change = RequestChange {
                instance: "DMAMUX1",
                request: STREAM,
                level: Level::High,
            };
            self.dma.on_request(change, registers, &mut context);
        }
    }

    #[test]
    fn blocks_go_to_the_two_targets_in_turn() {
        let mut bench = Bench::running();
        assert!(bench.dma.feed.lock().is_ready);
        bench.feed(&[1, 2, 3, 4, 5]);
        let addresses: Vec<u64> = bench.dma.to_write.iter().map(|(to, _)| *to).collect();
        let expected = [FIRST, FIRST + 4, FIRST + 8, FIRST + 12, SECOND];
        assert_eq!(addresses, expected);
        assert_eq!(bench.get(Register::S0ndtr), 3);
        assert_eq!(bench.get(Register::Lisr), flag::HALF | flag::COMPLETE);
        assert_eq!(bench.dma.interrupt, Level::High);
        assert_ne!(bench.get(Register::S0cr) & control::SECOND, 0);
        bench.write(Register::Lifcr, flag::COMPLETE);
        assert_eq!(bench.dma.interrupt, Level::Low);
    }

    #[test]
    fn registers_are_locked_while_the_stream_runs() {
        let mut bench = Bench::running();
        bench.write(Register::S0ndtr, 9);
        assert_eq!(bench.get(Register::S0ndtr), 4);
        bench.write(Register::S0m1ar, SECOND + 32);
        assert_eq!(bench.get(Register::S0m1ar), SECOND + 32, "the next target");
        bench.write(Register::S0m0ar, FIRST + 32);
        assert_eq!(bench.get(Register::S0m0ar), FIRST, "the present one");
        assert_eq!(bench.get(Register::Lisr), flag::ERROR);
        assert!(!bench.dma.feed.lock().is_ready);
    }

    #[test]
    fn a_stream_that_is_stopped_takes_nothing_and_begins_anew() {
        let mut bench = Bench::running();
        bench.feed(&[1, 2]);
        bench.write(Register::S0cr, RUNS);
        assert_eq!(bench.get(Register::Lisr), flag::HALF | flag::COMPLETE);
        bench.feed(&[3]);
        assert_eq!(bench.dma.to_write.len(), 2);
        bench.write(Register::S0cr, RUNS | control::ENABLE);
        assert_eq!(bench.get(Register::S0ndtr), 4);
        bench.feed(&[4]);
        assert_eq!(bench.dma.to_write.last(), Some(&(FIRST, 4)));
    }

    #[test]
    fn what_is_not_simulated_ends_the_run() {
        let mut bench = Bench::running();
        bench.write(Register::S1cr, control::ENABLE);
        let message = bench.dma.rules.first().unwrap();
        assert!(message.contains("stream 1"), "{message}");
    }
}
