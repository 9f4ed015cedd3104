//! The second bank of the flash, in which firmware stores its settings, and the option bytes: words
//! of 256 bits with an error correcting code, contents that outlive a run, and power cuts during an
//! operation.
//!
//! Registers, keys, write buffer, queue and times are rigless' (RM0433 chapter 4, DS12110 table
//! 140: 0.1 ms to program a word, 1 s to erase a sector, at 64 bits). A change of options takes 20
//! µs, for want of a figure, and the core does not wait. This module has the operations: blank
//! words, words torn by a cut, and the accesses that firmware must not make to them. A torn word
//! reads as a bus error, which the MDMA reports. A read by the core is not checked, because the
//! emulator's core reads flash by itself.

mod contents;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::emulator::Host;
use rigless::image::Image;
use rigless::soc::Width;
use rigless::soc::stm32h743::generated::flash::{Register, optsr_cur};
use rigless::soc::stm32h743::peripherals::flash::{self, OptionBytes};
use rigless::time::EventId;

use crate::faults::{Faults, Kind};
use crate::rules::Rules;
pub use contents::{
    BANK, Contents, Cut, FACTORY_OPTIONS, LEVEL, Leaves, Operation, SECTOR_BYTES, WORD_BYTES,
};

/// SR bits: an operation runs, or waits.
const BUSY: u64 = 1 << 0 | 1 << 2;
/// SR bit: the operation failed.
const OPERATION_ERROR: u64 = 1 << 22;
/// CR2: the sector's number, three bits from here.
const SECTOR_BIT: u32 = 8;

/// Returns the bank's contents with which the emulator begins.
///
/// # Errors
/// Never: plain bytes are a valid image.
pub fn image(contents: &Contents) -> anyhow::Result<Image> {
    let (name, bytes) = (Path::new("flash"), contents.array.clone());
    Ok(Image::new(name, bytes, Some(BANK.start.into()))?)
}

/// Returns the emulator's contents of the bank.
pub fn read_array(host: &mut dyn Host) -> Vec<u8> {
    let addresses = (u64::from(BANK.start)..u64::from(BANK.end)).step_by(8);
    let words = addresses.map(|address| host.read(address, Width::W64).unwrap_or(u64::MAX));
    words.flat_map(u64::to_le_bytes).collect()
}

/// The bank, as the interface, the MDMA and the run share it.
#[derive(Clone, Debug)]
pub struct Bank(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    contents: Contents,
    cut: Option<Cut>,
    operations: Vec<Operation>,
    /// Words that were read or programmed, by their addresses.
    touched: BTreeSet<u32>,
    under_way: bool,
    /// The operation under way ends with an error.
    fails: bool,
    /// The operation at whose end the power is cut.
    cut_at_its_end: Option<Operation>,
    /// The operation in which the power was cut, and its result.
    was_cut: Option<(Operation, Leaves)>,
}

impl Bank {
    /// Returns a bank with these contents and a planned cut of the power.
    pub fn new(contents: Contents, cut: Option<Cut>) -> Self {
        Self(Arc::new(Mutex::new(State {
            contents,
            cut,
            operations: Vec::new(),
            touched: BTreeSet::new(),
            under_way: false,
            fails: false,
            cut_at_its_end: None,
            was_cut: None,
        })))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the programming and erasing operations of the run, including an interrupted one.
    pub fn operations(&self) -> Vec<Operation> {
        self.lock().operations.clone()
    }

    /// Returns the addresses of the words that were read or programmed during the run. The
    /// program's behaviour depends on no other word of the bank.
    pub fn touched(&self) -> BTreeSet<u32> {
        self.lock().touched.clone()
    }

    /// Returns whether the power was cut.
    pub fn was_cut(&self) -> bool {
        self.lock().was_cut.is_some()
    }

    /// Returns whether a read of this many bytes is a bus error. Notes a breach if the read would
    /// wait for an operation.
    pub fn refuses(&self, address: u64, bytes: u64, rules: &Rules) -> bool {
        let range = address..address + bytes;
        if range.end <= u64::from(BANK.start) || range.start >= u64::from(BANK.end) {
            return false;
        }
        let mut state = self.lock();
        state.touched.extend(words(&range));
        if state.under_way {
            rules.broken(|| {
                format!(
                    "flash: {address:#x} is read while its bank is programmed or erased; the bus \
                     waits for that (RM0433, FLASH read operations)"
                )
            });
        }
        state.contents.is_torn(range)
    }

    /// Returns the contents at the end of a run; `array` are the emulator's contents of the bank.
    pub fn left(&self, array: Vec<u8>) -> Contents {
        let state = self.lock();
        let mut contents = state.contents.clone();
        contents.array = array;
        if let Some((operation, Leaves::Torn)) = &state.was_cut {
            contents.operate(operation, Leaves::Torn);
        }
        contents
    }
}

/// Iterates over the words of the bank that overlap a range of addresses.
fn words(range: &Range<u64>) -> impl Iterator<Item = u32> + use<> {
    let from = range.start.max(BANK.start.into()) as u32 / WORD_BYTES * WORD_BYTES;
    let to = range.end.min(BANK.end.into()) as u32;
    (from..to).step_by(WORD_BYTES as usize)
}

impl State {
    /// Begins an operation, which may fail.
    fn begin(&mut self, operation: Operation, fails: bool, rules: &Rules) {
        let number = self.operations.len() as u64;
        let leaves = self.cut.filter(|cut| cut.operation == number);
        self.operations.push(operation);
        if let Operation::Program { word, .. } = operation {
            self.touched.insert(word);
        }
        (self.under_way, self.fails) = (true, fails);
        match leaves.map(|cut| cut.leaves) {
            None => {}
            Some(Leaves::After) => self.cut_at_its_end = Some(operation),
            Some(leaves) => {
                self.was_cut = Some((operation, leaves));
                return;
            }
        }
        match operation {
            Operation::Program { word, .. } => {
                if !self.contents.programmed(word) {
                    rules.broken(|| {
                        format!(
                            "flash: the word at {word:#x} is programmed twice without an erase, \
                             which spoils its ECC (RM0433, single write sequence)"
                        )
                    });
                }
                if fails {
                    self.contents.operate(&operation, Leaves::Torn);
                }
            }
            Operation::Erase { .. } if fails => {}
            Operation::Erase { sector } => self.contents.erased(sector),
            Operation::Options { options } => {
                self.check_options(options, rules);
                if !fails {
                    self.contents.operate(&operation, Leaves::After);
                }
            }
        }
    }

    /// Notes a breach if more changes than the brown-out level: a wrong option may lock the chip.
    fn check_options(&self, options: u32, rules: &Rules) {
        let before = self.contents.options;
        if (options ^ before) & !LEVEL != 0 {
            rules.broken(|| {
                format!("flash: options other than BOR_LEV are changed: {before:#x}, {options:#x}")
            });
        }
    }

    /// Ends an operation; returns whether it failed.
    fn end(&mut self) -> bool {
        self.under_way = false;
        if let Some(operation) = self.cut_at_its_end.take() {
            self.was_cut = Some((operation, Leaves::After));
        }
        std::mem::take(&mut self.fails)
    }
}

/// The flash interface.
#[derive(Debug)]
pub struct Flash {
    interface: flash::Flash,
    bank: Bank,
    rules: Rules,
    faults: Faults,
    /// The word with the latest store, and the stored bytes.
    word: u32,
    bytes: [u8; WORD_BYTES as usize],
}

impl Flash {
    /// Returns the interface out of reset.
    pub fn new(bank: Bank, rules: Rules, faults: Faults) -> Self {
        Self {
            interface: flash::Flash::new(),
            bank,
            rules,
            faults,
            word: 0,
            bytes: [0xFF; WORD_BYTES as usize],
        }
    }

    /// Loads the option bytes into the registers, as a reset does.
    pub fn load_options(&mut self, registers: &mut RegisterFile) {
        let options = OptionBytes {
            optsr: self.bank.lock().contents.options.into(),
            ..OptionBytes::FACTORY
        };
        self.interface.keep_options(options, registers);
    }

    /// Checks whether an operation began or ended.
    fn look(&mut self, registers: &mut RegisterFile, now_ns: u64, operation: Option<Operation>) {
        let changes_options = optsr_cur::OPT_BUSY.is_set(registers.get(Register::OptsrCur));
        if registers.get(Register::Sr1) & BUSY != 0 && !changes_options {
            self.rules.broken(|| {
                "flash: the bank that the program runs from is programmed or erased, for which \
                 the core waits"
                    .into()
            });
        }
        let writes_bank = registers.get(Register::Sr2) & BUSY != 0;
        if changes_options && writes_bank {
            let text = "flash: options are changed while the second bank is written";
            self.rules.broken(|| text.into());
        }
        let mut state = self.bank.lock();
        match (operation, writes_bank || changes_options, state.under_way) {
            (Some(operation), true, false) => {
                let options = registers.get(Register::OptsrPrg) as u32;
                let operation = match changes_options {
                    true => Operation::Options { options },
                    false => operation,
                };
                let fails = self.faults.on(Kind::FlashFails, now_ns);
                state.begin(operation, fails, &self.rules);
            }
            // An operation that ended, and failed.
            (_, false, true) if state.end() => {
                let last = state.operations.last().copied();
                drop(state);
                self.fail(last, registers);
            }
            _ => {}
        }
    }

    /// Shows that an operation failed.
    fn fail(&mut self, operation: Option<Operation>, registers: &mut RegisterFile) {
        if let Some(Operation::Options { .. }) = operation {
            self.load_options(registers);
            for register in [Register::OptsrCur, Register::OptsrCur_] {
                let status = registers.get(register) | optsr_cur::OPTCHANGEERR.mask();
                registers.set(register, status);
            }
        } else {
            let status = registers.get(Register::Sr2);
            registers.set(Register::Sr2, status | OPERATION_ERROR);
        }
    }
}

impl Device for Flash {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.interface.write(register, value, registers, context);
        let number = (registers.get(Register::Cr2) >> SECTOR_BIT) as u32 & 7;
        let sector = BANK.start + number * SECTOR_BYTES;
        self.look(
            registers,
            context.now().0,
            Some(Operation::Erase { sector }),
        );
    }

    fn write_region(
        &mut self,
        address: u64,
        width: Width,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> bool {
        let (word, at) = (address as u32 / WORD_BYTES * WORD_BYTES, address as usize);
        if word != self.word {
            (self.word, self.bytes) = (word, [0xFF; WORD_BYTES as usize]);
        }
        let stored = self.bytes[at % WORD_BYTES as usize..].iter_mut();
        let value_bytes = value.to_le_bytes();
        (stored.zip(value_bytes).take(width.bytes() as usize))
            .for_each(|(byte, value)| *byte = value);
        let taken = (self.interface).write_region(address, width, value, registers, context);
        let (word, bytes) = (self.word, self.bytes);
        self.look(
            registers,
            context.now().0,
            Some(Operation::Program { word, bytes }),
        );
        taken
    }

    fn on_event(
        &mut self,
        event: EventId,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.interface.on_event(event, registers, context);
        self.look(registers, context.now().0, None);
    }

    fn on_access(
        &mut self,
        token: u64,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.interface.on_access(token, value, registers, context);
        self.look(registers, context.now().0, None);
    }

    fn on_refused(
        &mut self,
        token: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.interface.on_refused(token, registers, context);
        self.look(registers, context.now().0, None);
    }

    fn reset(&mut self) {
        Device::reset(&mut self.interface);
        self.bank.lock().under_way = false;
    }
}
