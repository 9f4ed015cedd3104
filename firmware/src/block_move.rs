//! Moves one block of memory to another place by MDMA, on software request. Only the MDMA reaches
//! DTCM.
//!
//! # Note
//! Coherence: AXI SRAM and the flash's second bank are not cached (`caches`), and DTCM never is. A
//! barrier on each side keeps the core's accesses to the blocks between the end of one move and the
//! start of the next.

use embassy_stm32::pac::mdma::{Ch, regs, vals};
use embassy_stm32::pac::{MDMA, RCC};

/// Most bytes that the MDMA reads and then writes at once: its whole buffer. The size and address
/// of every block are multiples of it, or of half or a quarter of it.
pub const BUFFER_BYTES: u32 = 128;
/// Core cycles between two checks of an active move. A band takes twenty times as long, and checks
/// without a pause would only keep the bus busy.
const PAUSE_CYCLES: u32 = 128;
/// Number of checks before a move counts as failed: a few milliseconds.
const PATIENCE: u32 = 10_000;
/// The flags TEIF to TCIF of IFCR.
const ALL_FLAGS: u32 = 0x1F;

/// One end of a move: the address of its first byte.
#[derive(Clone, Copy)]
pub enum End {
    /// An address on the AXI bus, such as AXI SRAM and flash: words of 8 bytes.
    Axi(u32),
    /// An address in DTCM: words of 4 bytes, because larger ones are not allowed there (RM0433,
    /// MDMA_CxTCR).
    Tcm(u32),
}

/// One channel of the controller; among active channels, the lower number has priority.
pub struct BlockMove<const CHANNEL: usize>;

impl<const CHANNEL: usize> BlockMove<CHANNEL> {
    /// A mover for the owner of this channel's peripheral.
    pub fn new() -> Self {
        RCC.ahb3enr().modify(|w| w.set_mdmaen(true));
        Self
    }

    /// Begins to move `bytes` bytes, at most 65,536. An active move is aborted.
    pub fn start(&mut self, source: End, destination: End, bytes: usize) {
        let channel = self.registers();
        channel.cr().write_value(regs::Cr(0));
        while channel.cr().read().en() {}
        channel.ifcr().write_value(regs::Ifcr(ALL_FLAGS));
        let at_once = BUFFER_BYTES.min(bytes as u32);
        channel
            .tcr()
            .write(|w| set_up(w, source, destination, at_once));
        channel.bndtr().write(|w| w.set_bndt(bytes as u32));
        channel.sar().write_value(regs::Sar(source.address()));
        channel.dar().write_value(regs::Dar(destination.address()));
        channel.tbr().write(|w| {
            w.set_sbus(source.bus());
            w.set_dbus(destination.bus());
        });
        channel.mar().write_value(regs::Mar(0));
        // The core's last reads of the destination must come before the MDMA's writes.
        cortex_m::asm::dmb();
        channel.cr().write(|w| w.set_en(true));
        channel.cr().write(|w| {
            w.set_en(true);
            w.set_swrq(true);
        });
    }

    /// Waits for the end of the move; returns whether it succeeded.
    pub fn wait(&self) -> bool {
        for _ in 0..PATIENCE {
            let state = self.registers().isr().read();
            if state.teif() {
                return false;
            }
            if state.ctcif() {
                cortex_m::asm::dmb();
                return true;
            }
            cortex_m::asm::delay(PAUSE_CYCLES);
        }
        false
    }

    fn registers(&self) -> Ch {
        MDMA.ch(CHANNEL)
    }
}

impl End {
    fn address(self) -> u32 {
        match self {
            End::Axi(address) | End::Tcm(address) => address,
        }
    }

    fn word(self) -> vals::Wordsize {
        match self {
            End::Axi(_) => vals::Wordsize::DOUBLE_WORD,
            End::Tcm(_) => vals::Wordsize::WORD,
        }
    }

    fn word_bytes(self) -> u32 {
        match self {
            End::Axi(_) => 8,
            End::Tcm(_) => 4,
        }
    }

    fn bus(self) -> vals::Bus {
        match self {
            End::Axi(_) => vals::Bus::SYSTEM,
            End::Tcm(_) => vals::Bus::AHB,
        }
    }
}

/// `words` words at once: one burst or several whole bursts fill or empty the buffer.
fn burst(words: u32) -> vals::Burst {
    match words {
        16.. => vals::Burst::INCR16,
        8.. => vals::Burst::INCR8,
        4.. => vals::Burst::INCR4,
        _ => vals::Burst::SINGLE,
    }
}

/// One software request moves one block, `at_once` bytes at a time.
fn set_up(w: &mut regs::Tcr, source: End, destination: End, at_once: u32) {
    w.set_sinc(vals::Incmode::INCREMENT);
    w.set_ssize(source.word());
    w.set_sincos(source.word());
    w.set_sburst(burst(at_once / source.word_bytes()));
    w.set_dinc(vals::Incmode::INCREMENT);
    w.set_dsize(destination.word());
    w.set_dincos(destination.word());
    w.set_dburst(burst(at_once / destination.word_bytes()));
    w.set_tlen((at_once - 1) as u8);
    w.set_pke(true);
    w.set_trgm(vals::Trgm::BLOCK);
    w.set_swrm(true);
}
