//! Contains deliberate bugs, behind the cargo feature `seeded-bugs`, which is off by default.
//!
//! They prove that the tests on the emulated microcontroller detect such mistakes. One program has
//! all of them, and the last word of flash chooses one. Without the feature every function here
//! returns its correct value as a constant, and the program is the same as without this file.

use embassy_time::Instant;

/// A bug, by the number in the last word of flash; any other number chooses none.
#[derive(Clone, Copy)]
enum Bug {
    DmamuxRequest = 1,
    Polarities = 2,
    CameraRegister = 3,
    HalfBands = 4,
    UsbClock = 5,
    FaultAtStart = 6,
    HangAtStart = 7,
    BusFault = 8,
    Panic = 9,
    StackOverflow = 10,
    Hang = 11,
    FaultLate = 12,
    CacheableBuffers = 13,
    ExternalMemory = 14,
    FlashErrors = 15,
    VsyncPriority = 16,
    KeptToggles = 17,
    UndrainedEnd = 18,
}

#[cfg(not(feature = "seeded-bugs"))]
const fn is_chosen(_: Bug) -> bool {
    false
}

#[cfg(feature = "seeded-bugs")]
fn is_chosen(bug: Bug) -> bool {
    /// In a sector of the second bank that nothing else uses.
    const CHOICE: *const u32 = 0x081F_FFFC as *const u32;
    // SAFETY: an aligned word of flash that no program writes.
    unsafe { CHOICE.read_volatile() == bug as u32 }
}

/// DMAMUX1 request line of DCMI (RM0433, table "DMAMUX1: assignment of multiplexer inputs"), or its
/// neighbour's.
pub fn dcmi_dma_request() -> u8 {
    if is_chosen(Bug::DmamuxRequest) {
        76
    } else {
        75
    }
}

/// True if DCMI samples on the edge on which the camera changes its data, and takes blanking for
/// data.
pub fn inverts_polarities() -> bool {
    is_chosen(Bug::Polarities)
}

/// True if the camera's format register is wrong: an OV7725 left at YUV, an MT9V034 that does not
/// bin.
pub fn camera_register() -> bool {
    is_chosen(Bug::CameraRegister)
}

/// The DMA transfers one part in this many of a band.
pub fn band_divisor() -> u16 {
    if is_chosen(Bug::HalfBands) { 2 } else { 1 }
}

/// True if USB is clocked by an untrimmed oscillator.
pub fn usb_from_hsi48() -> bool {
    is_chosen(Bug::UsbClock)
}

/// True if the DMA's buffers stay cacheable, as all SRAM is without their region.
pub fn caches_dma_buffers() -> bool {
    is_chosen(Bug::CacheableBuffers)
}

/// True if the region that forbids external memory is missing.
pub fn allows_external_memory() -> bool {
    is_chosen(Bug::ExternalMemory)
}

/// True if errors of flash operations are ignored.
pub fn ignores_flash_errors() -> bool {
    is_chosen(Bug::FlashErrors)
}

/// True if USB's handler may delay the stamp of a VSYNC edge.
pub fn lowers_vsync() -> bool {
    is_chosen(Bug::VsyncPriority)
}

/// True if endpoints keep their data toggles when a host configures the device anew.
pub fn keeps_toggles() -> bool {
    is_chosen(Bug::KeptToggles)
}

/// True if a frame's end does not wait for its last words.
pub fn leaves_last_words() -> bool {
    is_chosen(Bug::UndrainedEnd)
}

/// The number of the first frame that the program does not survive: about 0.26 s after the start.
const FATAL_FRAME: u32 = 30;

/// Fails before USB and the camera are set up. The watchdog runs.
#[inline(always)]
pub fn fail_at_start() {
    if is_chosen(Bug::FaultAtStart) {
        access_nothing();
    }
    if is_chosen(Bug::HangAtStart) {
        hang();
    }
}

/// Fails in thread mode at a frame, and at each later one.
#[inline(always)]
pub fn fail_at(frame: u32) {
    if frame < FATAL_FRAME {
        return;
    }
    if is_chosen(Bug::BusFault) {
        access_nothing();
    }
    if is_chosen(Bug::Panic) {
        panic!("seeded");
    }
    if is_chosen(Bug::StackOverflow) {
        overflow(frame);
    }
    if is_chosen(Bug::Hang) {
        hang();
    }
}

/// Fails after 6 s.
#[inline(always)]
pub fn fail_late() {
    if is_chosen(Bug::FaultLate) && Instant::now() > Instant::from_secs(6) {
        access_nothing();
    }
}

fn hang() {
    loop {
        core::hint::spin_loop();
    }
}

/// Reads an address behind the SRAM, at which nothing answers.
#[inline(never)]
fn access_nothing() {
    const NOTHING: *const u32 = 0x2600_0000 as *const u32;
    // SAFETY: it is a bus error, as wanted.
    unsafe { NOTHING.read_volatile() };
}

#[expect(unconditional_recursion, reason = "the stack ends it")]
#[inline(never)]
fn overflow(depth: u32) -> u32 {
    let used = core::hint::black_box([depth; 256]);
    overflow(depth + 1).wrapping_add(used.iter().sum::<u32>())
}
