//! Records what ended the program, so that the next start can report it to the host.
//!
//! # Design The record is at the end of DTCM (`memory.x`). It survives a reset, but not power-on,
//! after which it is not read. The core writes DTCM past the caches, so the record is in memory
//! when the reset comes. The backup domain would need a clock and a key, and a small battery or
//! capacitor keeps it through a short power cut. Each word of the record is one word of DTCM's
//! error correction.
//!
//! `hard_fault.s` enters [`hard_fault`] with a stack of its own, as the program's may be used up.
//! Nothing here can panic.
//!
//! # Limitations The program counter before a watchdog's reset is unknown: this microcontroller's
//! watchdog has no interrupt.

use crate::HEADER;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering, compiler_fence};
use cortex_m::peripheral::SCB;
use heapless::String;
use hivtac_portable::device::answer::text;
use hivtac_wire::failure::{Failure, FailureKind, PLACE_BYTES};

core::arch::global_asm!(include_str!("hard_fault.s"));

/// Indices of the record's words; a panic's path follows.
const KIND: usize = 0;
const STARTS: usize = 1;
const COUNT: usize = 2;
const PROGRAM: usize = 3;
const PROGRAM_COUNTER: usize = 4;
const LINK_REGISTER: usize = 5;
const STATUS: usize = 6;
const ADDRESS: usize = 7;
const EXCEPTION: usize = 8;
const LINE: usize = 9;
const PATH: usize = 10;
const WORDS: usize = 20;
/// Bytes of a panic's path that are kept, its last ones.
const PATH_BYTES: usize = 4 * (WORDS - PATH);

/// A checksum's start: memory of zeros is no record.
const CHECK_START: u32 = 0x4869_5654;

/// The core's Configurable Fault Status Register, the addresses of faults, and the bits that say
/// that an address is valid (ARMv7-M, B3.2.15 to B3.2.18).
const CFSR: *const u32 = 0xE000_ED28 as *const u32;
const MMFAR: *const u32 = 0xE000_ED34 as *const u32;
const BFAR: *const u32 = 0xE000_ED38 as *const u32;
const MMFAR_VALID: u32 = 1 << 7;
const BFAR_VALID: u32 = 1 << 15;
const UNDEFINED_INSTRUCTION: u32 = 1 << 16;

/// The record and its checksum. It is not initialized. Written by whoever ends the program, and at
/// boot; read by the memory task.
#[unsafe(link_section = ".kept.failure")]
static FAILURE: Kept = Kept {
    check: AtomicU32::new(0),
    words: [const { AtomicU32::new(0) }; WORDS],
};

struct Kept {
    check: AtomicU32,
    words: [AtomicU32; WORDS],
}

/// A record's words.
type Words = [u32; WORDS];

impl Kept {
    /// The record, if any.
    fn read(&self) -> Option<Words> {
        let mut words = [0; WORDS];
        for (word, kept) in words.iter_mut().zip(&self.words) {
            *word = kept.load(Ordering::Relaxed);
        }
        let is_whole = self.check.load(Ordering::Relaxed) == check(&words);
        (is_whole && words[PROGRAM] == program()).then_some(words)
    }

    fn write(&self, words: &Words) {
        for (kept, word) in self.words.iter().zip(words) {
            kept.store(*word, Ordering::Relaxed);
        }
        compiler_fence(Ordering::SeqCst);
        self.check.store(check(words), Ordering::Relaxed);
        cortex_m::asm::dsb();
    }

    fn forget(&self) {
        let words = [0; WORDS];
        self.write(&words);
        self.check.store(!check(&words), Ordering::Relaxed);
        cortex_m::asm::dsb();
    }
}

fn check(words: &Words) -> u32 {
    let sum = |sum: u32, word: &u32| sum.rotate_left(5) ^ word;
    words.iter().fold(CHECK_START, sum)
}

/// This program's identity: its checksum, as an update writes it.
fn program() -> u32 {
    // SAFETY: a constant in flash; volatile as an image has another value there than the compiler
    // knows.
    unsafe { (&raw const HEADER.crc).read_volatile() }
}

/// Records a failure, unless one was recorded in this run: the first counts. Returns whether it was
/// the first.
fn record(mut words: Words) -> bool {
    let last = FAILURE.read();
    if last.is_some_and(|last| last[STARTS] == 0) {
        return false;
    }
    let earlier = last.map_or(0, |last| last[COUNT]);
    words[COUNT] = earlier.saturating_add(1);
    words[PROGRAM] = program();
    FAILURE.write(&words);
    true
}

/// Words of a failure of this kind, about which nothing else is known.
fn words(kind: FailureKind) -> Words {
    let mut words = [0; WORDS];
    words[KIND] = kind as u32;
    words
}

/// Counts this start. Call once, at boot. After a power-on the memory has no record, and after a
/// reset by the watchdog that recorded nothing, the watchdog is the failure.
pub fn started(was_unpowered: bool, by_watchdog: bool) {
    if was_unpowered {
        FAILURE.forget();
    } else if by_watchdog {
        record(words(FailureKind::Watchdog));
    }
    if let Some(mut words) = FAILURE.read() {
        words[STARTS] = words[STARTS].saturating_add(1);
        FAILURE.write(&words);
    }
}

/// Forgets the failure: new firmware may come.
pub fn forget() {
    FAILURE.forget();
}

/// What ended the program in an earlier run; `None` if nothing did since power-on.
pub fn last() -> Option<Failure> {
    let words = FAILURE.read()?;
    let mut kinds = FailureKind::ALL.into_iter();
    let known = |word: u32| Some(word).filter(|word| *word != 0);
    Some(Failure {
        kind: kinds.find(|kind| *kind as u32 == words[KIND])?,
        starts_ago: words[STARTS],
        count: words[COUNT],
        program_counter: known(words[PROGRAM_COUNTER]),
        link_register: known(words[LINK_REGISTER]),
        address: (words[STATUS] & (MMFAR_VALID | BFAR_VALID) != 0).then_some(words[ADDRESS]),
        fault_status: words[STATUS],
        exception: words[EXCEPTION] as u16,
        place: place(&words),
    })
}

/// The end of a panic's path, and its line.
fn place(words: &Words) -> String<PLACE_BYTES> {
    let mut bytes = [0; PATH_BYTES];
    for (four, word) in bytes
        .as_chunks_mut()
        .0
        .iter_mut()
        .zip(words.iter().skip(PATH))
    {
        *four = word.to_le_bytes();
    }
    let is_path = |byte: &&u8| byte.is_ascii_graphic();
    let length = bytes.iter().take_while(is_path).count();
    let path = bytes.get(..length).unwrap_or(&[]);
    match core::str::from_utf8(path) {
        Ok(path) if !path.is_empty() => text(format_args!("{path}:{}", words[LINE])),
        _ => String::new(),
    }
}

/// Records a panic and where it was. Returns whether it was the first of this run.
fn record_panic(info: &PanicInfo) -> bool {
    let mut words = words(FailureKind::Panic);
    if let Some(location) = info.location() {
        words[LINE] = location.line();
        let path = location.file().as_bytes();
        let end = path.get(path.len().saturating_sub(PATH_BYTES)..);
        let fours = end.unwrap_or(&[]).chunks(4);
        for (word, four) in words.iter_mut().skip(PATH).zip(fours) {
            let bytes = four.iter().rev();
            *word = bytes.fold(0, |word, byte| word << 8 | u32::from(*byte));
        }
    }
    record(words)
}

/// Records an interrupt that has no handler.
pub fn record_interrupt(number: i16) {
    let mut words = words(FailureKind::UnknownInterrupt);
    words[EXCEPTION] = number.wrapping_add(16) as u32;
    record(words);
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    // A panic of the log itself is not logged.
    if record_panic(info) {
        defmt::error!("{}", defmt::Display2Format(info));
    }
    SCB::sys_reset()
}

/// A panic of code that logs by itself: an instruction whose fault [`hard_fault`] takes for one,
/// with the place that called.
#[defmt::panic_handler]
fn panic_logged() -> ! {
    cortex_m::asm::udf()
}

/// Continues the fault's handler: records the fault and resets. Instruction, link register and
/// program status are those at the fault, and zero if the stack could not take them.
#[unsafe(no_mangle)]
extern "C" fn hard_fault(program_counter: u32, link_register: u32, program_status: u32) -> ! {
    // SAFETY: registers of the core, which reading does not change.
    let [status, memory_address, bus_address] =
        [CFSR, MMFAR, BFAR].map(|register| unsafe { register.read_volatile() });
    let kind = match FailureKind::of_fault(status) {
        _ if program_counter == 0 => FailureKind::StackOverflow,
        FailureKind::UsageFault if is_udf(status, program_counter) => FailureKind::Panic,
        kind => kind,
    };
    let mut words = words(kind);
    words[PROGRAM_COUNTER] = program_counter;
    words[LINK_REGISTER] = link_register;
    words[STATUS] = status;
    words[ADDRESS] = match status & BFAR_VALID {
        0 => memory_address,
        _ => bus_address,
    };
    words[EXCEPTION] = program_status & 0x1FF;
    record(words);
    SCB::sys_reset()
}

/// Whether the fault is one of the instruction UDF, which only a panic has.
fn is_udf(status: u32, program_counter: u32) -> bool {
    if status & UNDEFINED_INSTRUCTION == 0 {
        return false;
    }
    let at = program_counter as *const u16;
    // SAFETY: the core has fetched this instruction.
    let instruction = unsafe { at.read_volatile() };
    instruction & 0xFF00 == 0xDE00
}
