//! Raises the supply voltage below which the microcontroller resets itself, and reports it.
//!
//! # Design Chips are delivered without a level: the core runs on while camera and flash no longer
//! work. The level is an option byte, written once in a chip's life, at a start, before anything
//! else runs. The option bytes are in the program's bank, so the core waits. A reset or a power cut
//! meanwhile keeps the old options (RM0433, FLASH option bytes, "Option byte modification
//! sequence").
//!
//! # Limitations
//! The data sheet gives no time for it. Where it takes longer than the watchdog allows, the old
//! options stay, and a start by the watchdog does not try again.

use crate::faults;
use crate::flash::SecondBank;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_stm32::pac::flash::regs::OptsrPrg;
use embassy_stm32::pac::{FLASH, PWR};
use embassy_time::{Duration, Instant};
use hivtac_wire::health::{BrownOut, ResetReason};

/// Unlock the option bytes, one after the other (RM0433, FLASH_OPTKEYR).
const KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];
/// The level that is set, 3: 2.7 V.
const LEVEL: u8 = BrownOut::High as u8;
/// The bits of FLASH_OPTSR_CUR that are no options: OPT_BUSY, OPTCHANGEERR.
const FLAGS: u32 = 1 << 0 | 1 << 30;
/// RDP of a chip without readout protection.
const UNPROTECTED: u8 = 0xAA;
/// The supply is good if it was so for this time: longer than a plug bounces.
const STEADY: Duration = Duration::from_millis(250);
/// Longest time of the change.
const PATIENCE: Duration = Duration::from_secs(1);

/// True if the level could not be set at this start. Written at boot, read by the memory task.
static FAILED: AtomicBool = AtomicBool::new(false);

/// Returns the level of the brown-out reset in use (RM0433, FLASH_OPTSR_CUR).
pub fn brown_out() -> BrownOut {
    match FLASH.optsr_cur().read().bor_lev() {
        0 => BrownOut::Off,
        1 => BrownOut::Low,
        2 => BrownOut::Middle,
        _ => BrownOut::High,
    }
}

/// Returns whether the level could not be set at this start.
pub fn has_failed() -> bool {
    FAILED.load(Ordering::Relaxed)
}

/// Sets the level, unless it is set or this is no moment for it. Call once, at the start, before
/// any other task runs; blocks for [`STEADY`] and the change. Owning the bank proves that nobody
/// else uses the flash, and that the voltage detector is on.
pub fn raise_brown_out(_bank: &mut SecondBank) {
    if brown_out() == BrownOut::High || !may_change() || !is_steady() {
        return;
    }
    let is_set = change();
    FAILED.store(!is_set, Ordering::Relaxed);
    defmt::info!("brown-out level 3 set: {=bool}", is_set);
}

/// Returns whether the chip is not protected, and this start no sequel of a failure.
fn may_change() -> bool {
    let is_sequel = matches!(
        faults::reset_reason(),
        ResetReason::Watchdog | ResetReason::Software
    );
    !is_sequel && FLASH.optsr_cur().read().rdp() == UNPROTECTED
}

/// Waits; returns whether the supply stayed above the detector's level.
fn is_steady() -> bool {
    let end = Instant::now() + STEADY;
    while Instant::now() < end {
        if PWR.csr1().read().pvdo() {
            return false;
        }
    }
    true
}

/// Programs the level; returns whether it is in use now.
fn change() -> bool {
    // A third key would lock the options until the next reset.
    if FLASH.optcr().read().optlock() {
        for key in KEYS {
            FLASH.optkeyr().write_value(key);
        }
    }
    FLASH.optccr().write(|w| w.set_clr_optchangeerr(true));
    FLASH.optsr_prg().modify(|w| w.set_bor_lev(LEVEL));
    let is_whole = changes_level_alone();
    if is_whole {
        FLASH.optcr().modify(|w| w.set_optstart(true));
        cortex_m::asm::dsb();
        let end = Instant::now() + PATIENCE;
        while FLASH.optsr_cur().read().opt_busy() && Instant::now() < end {}
    }
    FLASH.optcr().modify(|w| w.set_optlock(true));
    let now = FLASH.optsr_cur().read();
    is_whole && !now.opt_busy() && !now.optchangeerr() && now.bor_lev() == LEVEL
}

/// Returns whether the options to be programmed are those in use, with another level.
fn changes_level_alone() -> bool {
    let mut wanted = OptsrPrg(FLASH.optsr_cur().read().0 & !FLAGS);
    wanted.set_bor_lev(LEVEL);
    let banks = [FLASH.bank(0), FLASH.bank(1)];
    FLASH.optsr_prg().read() == wanted
        && FLASH.boot_prgr().read().0 == FLASH.boot_curr().read().0
        && banks.iter().all(|bank| {
            bank.prar_prg().read().0 == bank.prar_cur().read().0
                && bank.scar_prg().read().0 == bank.scar_cur().read().0
                && bank.wpsn_prgr().read().0 == bank.wpsn_curr().read().0
        })
}
