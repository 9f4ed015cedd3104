//! Accesses the flash's second bank, which keeps settings: sectors of 128 KiB, words of 256 bits.
//!
//! # Design
//! The program runs from the first bank and continues while the second one is programmed (0.1 ms a
//! word) or erased (1 to 2 s a sector). Callers wait without blocking other tasks. The bank is not
//! read meanwhile.
//!
//! # Note
//! A word whose programming was cut off fails its error correcting code, which is a bus error. The
//! MDMA reads the bank: an error of its transfer sets a flag, whereas one of the core's would be a
//! fault. The MPU makes the bank device memory (`caches`), so that the core neither reads it
//! speculatively nor delays writes to it.

use crate::block_move::{BlockMove, End};
use crate::seeded_bugs;
use embassy_stm32::pac::flash::Bank;
use embassy_stm32::pac::{FLASH, PWR};
use embassy_stm32::{Peri, peripherals};
use embassy_time::{Duration, Timer};
use hivtac_portable::storage::flash::{Failed, Flash, Place, Unreadable, WORD_BYTES, Word};

/// Address of the second bank.
pub const BASE: u32 = 0x0810_0000;
/// Bytes of the bank, log2.
pub const SIZE_LOG2: u32 = 20;

const CHANNEL: usize = 2;
const BANK: usize = 1;
const SECTOR_BYTES: u32 = 128 << 10;
/// Unlock the bank's control register, one after the other (RM0433, FLASH_KEYR).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// 64 bits at once: the fastest setting at the boards' supply voltage.
const PARALLELISM: u8 = 0b11;
/// The voltage detector's level under which nothing is written: 2.76 V when it falls (DS12110). A
/// supply that falls may be gone before a word is programmed.
const LOWEST_SUPPLY: u8 = 6;
/// Time of programming a word, and interval of checks for its end.
const WORD_TIME: Duration = Duration::from_micros(100);
/// Interval of checks for the end of erasing a sector.
const ERASE_STEP: Duration = Duration::from_millis(10);
/// Number of checks before an operation counts as failed: 10 ms for a word, 4 s for a sector.
const WORD_LOOKS: u32 = 100;
const ERASE_LOOKS: u32 = 400;

/// Number of words that are read at once: a few of them take as long as one.
const BLOCK_WORDS: usize = 32;
const BLOCK_BYTES: usize = BLOCK_WORDS * WORD_BYTES;

/// The MDMA's target, in DTCM, which is not cached. It is aligned to the longest burst there, 64
/// bytes: one that crosses 1 KiB is not allowed on that bus.
#[repr(C, align(64))]
struct Buffer([Word; BLOCK_WORDS]);

/// The bank. Ownership proves that no other code uses it.
pub struct SecondBank {
    _flash: Peri<'static, peripherals::FLASH>,
    _channel: Peri<'static, peripherals::MDMA_CH2>,
    mover: BlockMove<CHANNEL>,
    buffer: Buffer,
    /// Address of the block in the buffer; `None` if one of its words is unreadable.
    block: Option<u32>,
}

impl SecondBank {
    /// Takes bank and channel. Call once.
    pub fn new(
        flash: Peri<'static, peripherals::FLASH>,
        channel: Peri<'static, peripherals::MDMA_CH2>,
    ) -> Self {
        PWR.cr1().modify(|w| {
            w.set_pls(LOWEST_SUPPLY);
            w.set_pvde(true);
        });
        Self {
            _flash: flash,
            _channel: channel,
            mover: BlockMove::new(),
            buffer: Buffer([[0; WORD_BYTES]; BLOCK_WORDS]),
            block: None,
        }
    }

    /// Reads into the front of the buffer by MDMA; returns whether it succeeded.
    fn fetch(&mut self, source: u32, bytes: usize) -> bool {
        let to = End::Tcm(&raw mut self.buffer as u32);
        self.mover.start(End::Axi(source), to, bytes);
        let read = self.mover.wait();
        clear_errors(registers());
        read
    }

    /// Returns a word of the buffer.
    fn fetched(&self, nth: usize) -> Word {
        let words = &raw const self.buffer.0;
        // SAFETY: the buffer is ours, and the MDMA has ended; it is volatile as the compiler does
        // not see who wrote it.
        unsafe { words.cast::<Word>().add(nth % BLOCK_WORDS).read_volatile() }
    }

    /// Opens the control register for one operation, and closes it afterwards.
    async fn operate(
        &mut self,
        begin: impl FnOnce(Bank),
        step: Duration,
        looks: u32,
    ) -> Result<(), Failed> {
        self.block = None;
        if PWR.csr1().read().pvdo() {
            defmt::error!("the supply is too low to write flash");
            return Err(Failed);
        }
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

/// Returns a word's address; `None` if it is not in the bank.
fn address(place: Place) -> Option<u32> {
    let inside =
        place.word < SecondBank::SECTOR_WORDS && place.sector < (1 << SIZE_LOG2) / SECTOR_BYTES;
    inside.then(|| BASE + place.sector * SECTOR_BYTES + place.word * WORD_BYTES as u32)
}

/// Waits for the end of an operation; returns whether it ended in time.
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
    if seeded_bugs::ignores_flash_errors() {
        return false;
    }
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
