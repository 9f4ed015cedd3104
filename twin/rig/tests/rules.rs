//! Tests of the chip's rules: a program that breaks one ends the run with a message. The programs
//! are a few instructions that write registers, in an ELF that the test makes.

use std::num::NonZeroU64;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::common;
use hivtac_rig::arrivals::Arrivals;
use hivtac_rig::board;
use hivtac_rig::camera::part;
use hivtac_rig::chip::Revision;
use hivtac_rig::faults::Faults;
use hivtac_rig::frame_source::TestPicture;
use hivtac_rig::machine::Entry;
use hivtac_rig::mpu::Protection;
use hivtac_rig::peripherals::flash::{Contents, Cut, FACTORY_OPTIONS, LEVEL, Operation};
use hivtac_rig::run::{INSTRUCTIONS_PER_SECOND, Limits, Options, Outcome, Program, run};
use hivtac_rig::script::Script;
use hivtac_rig::truth::TruthLog;

const AHB1ENR: u32 = 0x5802_44D8;
const AHB2ENR: u32 = 0x5802_44DC;
const DMA1_STREAM0: u32 = 0x4002_0010;
const DCMI_CR: u32 = 0x4802_0000;

/// Returns an ELF that writes (address, value) pairs and then stands still.
fn program(writes: &[(u32, u32)]) -> Vec<u8> {
    const BASE: u32 = 0x0800_0000;
    // ldr r0, table; loop: ldmia r0!, {r1, r2}; cbz r1, end; str r2, [r1]; b loop; end: b end
    const CODE: [u16; 6] = [0x4802, 0xC806, 0xB109, 0x600A, 0xE7FB, 0xE7FE];
    let mut image = Vec::new();
    image.extend(
        [0x2002_0000, BASE + 8 + 1]
            .iter()
            .flat_map(|word: &u32| word.to_le_bytes()),
    );
    image.extend(CODE.iter().flat_map(|half| half.to_le_bytes()));
    image.extend((BASE + 24).to_le_bytes());
    for (address, value) in writes.iter().chain(&[(0, 0)]) {
        image.extend([address.to_le_bytes(), value.to_le_bytes()].concat());
    }
    common::elf(BASE, &image)
}

fn run_program(
    elf: &Path,
    flash: Option<&Path>,
    cut: Option<Cut>,
    protection: Protection,
) -> anyhow::Result<Outcome> {
    run(Options {
        flash: flash.map(Path::to_owned),
        cut,
        elf: elf.to_owned(),
        board: board::Kind::Weact,
        camera: part::Kind::Ov7725,
        source: Box::new(TestPicture),
        truth: TruthLog::default(),
        arrivals: Arrivals::default(),
        faults: Faults::default(),
        seed: 1,
        revision: Revision::V,
        entry: Entry::Reset,
        protection,
        program: Program::Script(Script::default()),
        limits: Limits {
            frames: None,
            virtual_ns: Some(20_000_000),
        },
        instructions_per_second: NonZeroU64::new(INSTRUCTIONS_PER_SECOND).unwrap(),
        interrupt: Arc::new(AtomicBool::new(false)),
    })
}

fn outcome(writes: &[(u32, u32)]) -> Result<Outcome, String> {
    outcome_where(Protection::Enforced, writes)
}

fn outcome_where(protection: Protection, writes: &[(u32, u32)]) -> Result<Outcome, String> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), program(writes)).unwrap();
    run_program(file.path(), None, None, protection).map_err(|error| format!("{error:#}"))
}

/// Returns the writes for DMA1 stream 0, peripheral to memory, from DCMI_DR to an address.
fn dma_to(memory: u32) -> [(u32, u32); 5] {
    [
        (AHB1ENR, 1),
        (DMA1_STREAM0 + 0x04, 16),
        (DMA1_STREAM0 + 0x08, DCMI_CR + 0x28),
        (DMA1_STREAM0 + 0x0C, memory),
        (DMA1_STREAM0, 1 << 10 | 2 << 11 | 2 << 13 | 1),
    ]
}

#[test]
fn a_dma_buffer_in_dtcm_ends_the_run() {
    let error = outcome(&dma_to(0x2000_1000)).unwrap_err();
    for part in ["DMA1 stream 0", "0x20001000", "DTCM", "AXI SRAM"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_dma_buffer_in_axi_sram_does_not() {
    let outcome = outcome(&dma_to(0x2400_0000)).unwrap();
    assert_eq!(outcome.report.refused, [] as [String; 0]);
    assert!(
        outcome.report.virtual_ns >= 19_000_000,
        "{}",
        outcome.report.line()
    );
}

#[test]
fn a_dma_stream_that_a_timer_drives_ends_the_run() {
    const DMAMUX1_CHANNEL0: u32 = 0x4002_0800;
    const TIM6_UPDATE: u32 = 69;
    let mut writes = dma_to(0x2400_0000).to_vec();
    writes.insert(1, (DMAMUX1_CHANNEL0, TIM6_UPDATE));
    let error = outcome(&writes).unwrap_err();
    assert!(error.contains("DMAMUX1 channel 0"), "{error}");
}

#[test]
fn a_real_time_clock_on_the_internal_oscillator_ends_the_run() {
    const RCC_BDCR: u32 = 0x5802_4470;
    // PWR_CR1.DBP: the backup domain takes writes.
    const UNLOCK: (u32, u32) = (0x5802_4800, 1 << 8);
    let from = |source: u32| outcome(&[UNLOCK, (RCC_BDCR, 1 << 15 | source << 8)]);
    assert!(from(1).is_ok(), "LSE");
    let error = from(2).unwrap_err();
    assert!(error.contains("LSI"), "{error}");
}

#[test]
fn a_memory_that_is_written_before_the_supply_is_valid_ends_the_run() {
    const PWR_CR3: u32 = 0x5802_480C;
    assert!(outcome(&[(PWR_CR3, 6), (0x2000_0000, 1)]).is_ok());
    let error = outcome(&[(0x2000_0000, 1), (PWR_CR3, 6)]).unwrap_err();
    assert!(
        error.contains("DTCM") && error.contains("PWR_CR3"),
        "{error}"
    );
}

/// The program makes a region read-only and writes to it; the writes after that would end the run.
#[test]
fn a_program_that_breaks_its_own_protection_gets_no_further() {
    const MPU_CTRL: u32 = 0xE000_ED94;
    const PRIVILEGED_DEFAULT: u32 = 1 << 2;
    const READ_ONLY: u32 = 0b110 << 24;
    // External memory, which no board has.
    const NO_EXTERNAL: u32 = 0b1000_0111 << 8 | 31 << 1 | 1;
    let mut writes = vec![
        (MPU_CTRL + 4, 1),
        (MPU_CTRL + 8, 0),
        (MPU_CTRL + 12, NO_EXTERNAL),
        (MPU_CTRL + 4, 0),
        (MPU_CTRL + 8, 0x2400_0000),
        (MPU_CTRL + 12, READ_ONLY | 15 << 1 | 1),
        (MPU_CTRL, PRIVILEGED_DEFAULT | 1),
        (0x2400_0000, 1),
    ];
    writes.extend(dma_to(0x2000_1000));
    outcome_where(Protection::Enforced, &writes).unwrap();
    let error = outcome_where(Protection::Ignored, &writes).unwrap_err();
    assert!(error.contains("DTCM"), "{error}");
}

#[test]
fn a_mode_that_is_not_simulated_is_no_silent_success() {
    let error = outcome(&[(AHB2ENR, 1), (DCMI_CR, 1 << 14 | 1 << 3)]).unwrap_err();
    assert!(error.contains("JPEG"), "{error}");
}

#[test]
fn registers_without_their_clock_are_refused_and_reported() {
    let outcome = outcome(&[(DCMI_CR, 1 << 14)]).unwrap();
    assert!(
        outcome
            .report
            .refused
            .iter()
            .any(|line| line.contains("DCMI")),
        "{:?}",
        outcome.report.refused
    );
    let outcome = self::outcome(&[(0x4008_0008, 1)]).unwrap();
    assert!(
        outcome
            .report
            .refused
            .iter()
            .any(|line| line.contains("OTG2")),
        "{:?}",
        outcome.report.refused
    );
}

const FLASH_KEYR1: u32 = 0x5200_2004;
const BANK_1: u32 = 0x0800_0000;
const BANK_2: u32 = 0x0810_0000;
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// FLASH_CR: PG, and 64 bits at a time.
const PROGRAM: u32 = 1 << 1 | 3 << 4;
/// FLASH_CR: SER of sector 0, START, and 64 bits at a time.
const ERASE: u32 = 1 << 2 | 1 << 7 | 3 << 4;

/// Returns the writes that program the 32 bytes of a word. `bank` is 0 for the first.
fn program_word(bank: u32, address: u32) -> Vec<(u32, u32)> {
    let stores = (0..8).map(|nth| (address + 4 * nth, 0x1111_1111 * nth));
    let mut writes = unlocked(bank, PROGRAM);
    writes.extend(stores);
    writes
}

fn unlocked(bank: u32, control: u32) -> Vec<(u32, u32)> {
    let keyr = FLASH_KEYR1 + 0x100 * bank;
    vec![(keyr, KEYS[0]), (keyr, KEYS[1]), (keyr + 8, control)]
}

/// Returns writes without an effect that take longer than programming a word.
fn pause() -> Vec<(u32, u32)> {
    vec![(0x2000_0100, 0); 20_000]
}

fn with_flash(writes: &[(u32, u32)], flash: &Path, cut: Option<Cut>) -> (Outcome, Contents) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), program(writes)).unwrap();
    let outcome = run_program(file.path(), Some(flash), cut, Protection::Enforced).unwrap();
    (outcome, Contents::load(flash).unwrap())
}

#[test]
fn what_is_programmed_is_there_in_the_next_run() {
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    let (outcome, contents) = with_flash(&program_word(1, BANK_2 + 64), &flash, None);
    let expected = Operation::Program {
        word: BANK_2 + 64,
        bytes: contents.word(BANK_2 + 64).unwrap().try_into().unwrap(),
    };
    assert_eq!(outcome.report.flash_operations, [expected]);
    assert_eq!(
        contents.array[60..72],
        [255, 255, 255, 255, 0, 0, 0, 0, 0x11, 0x11, 0x11, 0x11]
    );
    let (_, contents) = with_flash(&program_word(1, BANK_2), &flash, None);
    assert_eq!(contents.array[4..8], contents.array[68..72]);
    assert_eq!(contents.torn(), 0);
}

#[test]
fn a_cut_leaves_a_word_before_torn_or_after() {
    let folder = tempfile::tempdir().unwrap();
    for (leaves, torn, byte) in [("before", 0, 0xFF), ("torn", 1, 0xFF), ("after", 0, 0x11)] {
        let flash = folder.path().join(leaves);
        let cut = format!("0:{leaves}").parse().unwrap();
        let (outcome, contents) = with_flash(&program_word(1, BANK_2), &flash, Some(cut));
        assert!(outcome.report.power_was_cut);
        assert!(outcome.report.virtual_ns < 10_000_000, "it ends there");
        assert_eq!(
            (contents.torn(), contents.array[4]),
            (torn, byte),
            "{leaves}"
        );
    }
}

#[test]
fn a_cut_erase_leaves_words_of_each_kind() {
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    with_flash(&program_word(1, BANK_2 + 64), &flash, None);
    let cut = "0".parse().unwrap();
    let (_, contents) = with_flash(&unlocked(1, ERASE), &flash, Some(cut));
    assert_eq!(contents.torn(), 1365);
    assert_eq!(contents.array[68], 0x11, "the third word is as it was");
}

/// FLASH_OPTKEYR, FLASH_OPTCR with OPTSTART, FLASH_OPTSR_PRG.
const OPTION_KEYS: [(u32, u32); 2] = [(0x5200_2008, 0x0819_2A3B), (0x5200_2008, 0x4C5D_6E7F)];
const OPTSTART: (u32, u32) = (0x5200_2018, 2);

fn options(value: u32) -> (u32, u32) {
    (0x5200_2020, value)
}

#[test]
fn options_need_both_keys_and_a_wrong_one_locks_them() {
    let wanted = FACTORY_OPTIONS | LEVEL;
    let [first, second] = OPTION_KEYS;
    let wrong = (first.0, 0);
    let change = [options(wanted), OPTSTART];
    for (keys, is_open) in [
        (vec![], false),
        (vec![first], false),
        (vec![first, second], true),
        (vec![wrong, first, second], false),
        (vec![first, wrong, first, second], false),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let flash = folder.path().join("flash");
        let new = Contents::with_options(FACTORY_OPTIONS);
        new.save(&flash).unwrap();
        let writes = [&keys[..], &change, &pause()].concat();
        let (outcome, contents) = with_flash(&writes, &flash, None);
        let made = vec![Operation::Options { options: wanted }];
        let made = if is_open { made } else { vec![] };
        assert_eq!(outcome.report.flash_operations, made, "{keys:x?}");
        assert_eq!(contents.options == wanted, is_open, "{keys:x?}");
    }
}

#[test]
fn options_other_than_the_brown_out_level_end_the_run() {
    // Readout protection.
    let wanted = options(FACTORY_OPTIONS ^ 0xFF00 | LEVEL);
    let error = outcome(&[&OPTION_KEYS[..], &[wanted, OPTSTART]].concat()).unwrap_err();
    assert!(error.contains("other than BOR_LEV"), "{error}");
}

#[test]
fn a_word_that_is_programmed_twice_ends_the_run() {
    let word = program_word(1, BANK_2);
    let again: Vec<_> = word.iter().skip(3).copied().collect();
    let error = outcome(&[word, pause(), again].concat()).unwrap_err();
    assert!(
        error.contains("programmed twice") && error.contains("0x8100000"),
        "{error}"
    );
}

#[test]
fn the_bank_that_the_program_runs_from_is_not_written() {
    let error = outcome(&program_word(0, BANK_1 + 0x8_0000)).unwrap_err();
    assert!(error.contains("runs from"), "{error}");
}
