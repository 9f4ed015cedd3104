//! The flash's second bank, in which settings are kept: sectors of 128 KiB, words of 256 bits.
//!
//! # Design
//! The program runs from the first bank and goes on while the second one is programmed (0.1 ms a
//! word) or erased (1 to 2 s a sector): whoever waits here gives way to everything else. Nothing
//! reads the bank meanwhile.
//!
//! # Note
//! A word whose programming was cut off reads as an error of its correcting code, which is a bus
//! error. It is the MDMA that reads: an error of its transfer is a flag, one of the core's a fault.
//! The MPU makes the bank device memory (`caches`), so that the core neither reads ahead in it nor
//! keeps back what it writes.

use crate::block_move::{BlockMove, End};
use embassy_stm32::pac::FLASH;
use embassy_stm32::pac::flash::Bank;
use embassy_stm32::{Peri, peripherals};
use embassy_time::{Duration, Timer};
use hivtac_storage::flash::{Failed, Flash, Place, Unreadable, WORD_BYTES, Word};

/// Address of the second bank.
pub const BASE: u32 = 0x0810_0000;
/// Bytes of the bank, log2.
pub const SIZE_LOG2: u32 = 20;

const CHANNEL: usize = 2;
const BANK: usize = 1;
const SECTOR_BYTES: u32 = 128 << 10;
/// Unlock the bank's control register, one after the other (RM0433, FLASH_KEYR).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// 64 bits at once: the fastest, at the supply of the boards.
const PARALLELISM: u8 = 0b11;
/// Of programming a word, and how often it is looked for its end.
const WORD_TIME: Duration = Duration::from_micros(100);
/// Of erasing a sector: looked for its end so often.
const ERASE_STEP: Duration = Duration::from_millis(10);
/// Looks at an operation before it counts as failed: 10 ms for a word, 4 s for a sector.
const WORD_LOOKS: u32 = 100;
const ERASE_LOOKS: u32 = 400;

/// Words that are read at once: a few of them cost as much as one.
const BLOCK_WORDS: usize = 32;
const BLOCK_BYTES: usize = BLOCK_WORDS * WORD_BYTES;

/// What the MDMA read, in DTCM, which is not cached.
#[repr(C, align(32))]
struct Buffer([Word; BLOCK_WORDS]);

/// The bank. Holding it says that nobody else uses it.
pub struct SecondBank {
    _flash: Peri<'static, peripherals::FLASH>,
    _channel: Peri<'static, peripherals::MDMA_CH2>,
    mover: BlockMove<CHANNEL>,
    buffer: Buffer,
    /// Where the block in the buffer begins; nothing when one of its words is unreadable.
    block: Option<u32>,
}

impl SecondBank {
    /// Takes bank and channel. Call once.
    pub fn new(
        flash: Peri<'static, peripherals::FLASH>,
        channel: Peri<'static, peripherals::MDMA_CH2>,
    ) -> Self {
        Self {
            _flash: flash,
            _channel: channel,
            mover: BlockMove::new(),
            buffer: Buffer([[0; WORD_BYTES]; BLOCK_WORDS]),
            block: None,
        }
    }

    /// Has the MDMA read into the front of the buffer; whether it could.
    fn fetch(&mut self, source: u32, bytes: usize) -> bool {
        let to = End::Tcm(&raw mut self.buffer as u32);
        self.mover.start(End::Axi(source), to, bytes);
        let read = self.mover.wait();
        clear_errors(registers());
        read
    }

    /// A word of the buffer.
    fn fetched(&self, nth: usize) -> Word {
        let words = &raw const self.buffer.0;
        // SAFETY: the buffer is ours, and the MDMA has ended; it is volatile as the compiler does
        // not see who wrote it.
        unsafe { words.cast::<Word>().add(nth % BLOCK_WORDS).read_volatile() }
    }

    /// Opens the control register for one operation, and closes it behind that.
    async fn operate(
        &mut self,
        begin: impl FnOnce(Bank),
        step: Duration,
        looks: u32,
    ) -> Result<(), Failed> {
        self.block = None;
        let bank = registers();
        if bank.cr().read().lock() {
            for key in KEYS {
                bank.keyr().write_value(key);
            }
        }
        clear_errors(bank);
        begin(bank);
        cortex_m::asm::dsb();
        let ended = wait(bank, step, looks).await;
        bank.cr().write(|w| w.set_lock(true));
        if ended && !has_failed(bank) {
            Ok(())
        } else {
            Err(Failed)
        }
    }
}

impl Flash for SecondBank {
    const SECTOR_WORDS: u32 = SECTOR_BYTES / WORD_BYTES as u32;

    fn read(&mut self, place: Place) -> Result<Word, Unreadable> {
        let source = address(place).ok_or(Unreadable)?;
        let block = source & !(BLOCK_BYTES as u32 - 1);
        if self.block != Some(block) {
            self.block = self.fetch(block, BLOCK_BYTES).then_some(block);
        }
        if let Some(block) = self.block {
            return Ok(self.fetched((source - block) as usize / WORD_BYTES));
        }
        let read = self.fetch(source, WORD_BYTES);
        read.then(|| self.fetched(0)).ok_or(Unreadable)
    }

    async fn program(&mut self, place: Place, word: &Word) -> Result<(), Failed> {
        let to = address(place).ok_or(Failed)? as *mut u32;
        let begin = |bank: Bank| {
            bank.cr().write(|w| {
                w.set_pg(true);
                w.set_psize(PARALLELISM);
            });
            cortex_m::asm::dsb();
            for (nth, part) in word.as_chunks().0.iter().enumerate() {
                // SAFETY: an address of the bank, which nothing else of the program uses. The
                // eighth store has the word programmed.
                unsafe { to.add(nth).write_volatile(u32::from_le_bytes(*part)) }
            }
        };
        self.operate(begin, WORD_TIME, WORD_LOOKS).await
    }

    async fn erase(&mut self, sector: u32) -> Result<(), Failed> {
        address(Place { sector, word: 0 }).ok_or(Failed)?;
        let begin = |bank: Bank| {
            bank.cr().write(|w| {
                w.set_ser(true);
                w.set_psize(PARALLELISM);
                w.set_snb(sector as u8);
                w.set_start(true);
            });
        };
        self.operate(begin, ERASE_STEP, ERASE_LOOKS).await
    }
}

fn registers() -> Bank {
    FLASH.bank(BANK)
}

/// Of a word; `None` when it is not in the bank.
fn address(place: Place) -> Option<u32> {
    let inside =
        place.word < SecondBank::SECTOR_WORDS && place.sector < (1 << SIZE_LOG2) / SECTOR_BYTES;
    inside.then(|| BASE + place.sector * SECTOR_BYTES + place.word * WORD_BYTES as u32)
}

/// Waits for the end of an operation; whether it came in time.
async fn wait(bank: Bank, step: Duration, looks: u32) -> bool {
    for _ in 0..looks {
        Timer::after(step).await;
        let state = bank.sr().read();
        if !state.qw() && !state.bsy() {
            return true;
        }
    }
    false
}

fn has_failed(bank: Bank) -> bool {
    let state = bank.sr().read();
    state.wrperr() || state.pgserr() || state.strberr() || state.incerr() || state.operr()
}

fn clear_errors(bank: Bank) {
    bank.ccr().write(|w| {
        w.set_clr_eop(true);
        w.set_clr_wrperr(true);
        w.set_clr_pgserr(true);
        w.set_clr_strberr(true);
        w.set_clr_incerr(true);
        w.set_clr_operr(true);
        w.set_clr_rdperr(true);
        w.set_clr_rdserr(true);
        w.set_clr_sneccerr(true);
        w.set_clr_dbeccerr(true);
    });
}
