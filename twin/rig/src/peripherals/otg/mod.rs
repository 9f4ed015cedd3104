//! The full-speed USB OTG core (OTG2 at 0x4008_0000) as a device: registers, FIFOs, interrupts.
//!
//! RM0433 rev 7 chapter 60, FIFO mode (no internal DMA). The host on the other end of the cable
//! calls [`Core::setup`], [`Core::receive`] and [`Core::transmit`]; all other accesses are reads
//! and writes of the firmware. Bytes leave the device only through its transmit FIFOs.
//!
//! Simulated: soft connect, bus reset, enumeration at full speed, suspend, resume, address, stall,
//! NAK, FIFO depths, data toggles. Not simulated: isochronous transfers, remote wake-up, host mode,
//! and timing below a transaction. A bus reset leaves an IN endpoint's transfer and the device's
//! address as they are: the firmware has to clear them. An OUT endpoint counts as armed if it is
//! active, its NAK status is clear and its packet count is not zero. EPENA must have been set once
//! since it became active. Drivers for this core rely on that.

mod blocks;
mod device_registers;
mod endpoint;
mod global_registers;

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub use blocks::{Block, Blocks};
use endpoint::{In, Out};

use crate::busy_bus::InterruptLine;
use crate::faults::Faults;

/// Number of endpoints in each direction.
pub const ENDPOINTS: usize = 9;

/// GINTSTS bits.
pub mod interrupt {
    /// Receive FIFO not empty.
    pub const RXFLVL: u32 = 1 << 4;
    /// Start of frame.
    pub const SOF: u32 = 1 << 3;
    /// Non-periodic transmit FIFO empty.
    pub const NPTXFE: u32 = 1 << 5;
    /// Early suspend.
    pub const ESUSP: u32 = 1 << 10;
    /// Suspend.
    pub const USBSUSP: u32 = 1 << 11;
    /// Bus reset.
    pub const USBRST: u32 = 1 << 12;
    /// Enumeration done.
    pub const ENUMDNE: u32 = 1 << 13;
    /// IN endpoint.
    pub const IEPINT: u32 = 1 << 18;
    /// OUT endpoint.
    pub const OEPINT: u32 = 1 << 19;
    /// Resume.
    pub const WKUPINT: u32 = 1 << 31;
}

/// Packet status in GRXSTSP bits 20:17.
mod packet_status {
    pub const OUT_DATA: u32 = 2;
    pub const OUT_DONE: u32 = 3;
    pub const SETUP_DONE: u32 = 4;
    pub const SETUP_DATA: u32 = 6;
}

/// The end of a transaction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer<T> {
    /// The device acknowledged.
    Ack(T),
    /// The device is not ready.
    Nak,
    /// The endpoint is stalled.
    Stall,
    /// No device has this address.
    Silence,
}

/// A packet of data.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Packet {
    /// Its data.
    pub bytes: Vec<u8>,
    /// Whether it is DATA1. Without meaning on endpoint 0, whose toggles the core manages.
    pub data1: bool,
}

/// An entry of the receive FIFO: its status word and its data.
#[derive(Clone, Debug)]
struct Received {
    status: u32,
    words: Vec<u32>,
}

/// The core.
#[derive(Debug)]
pub struct Core {
    gotgctl: u32,
    gahbcfg: u32,
    gusbcfg: u32,
    gintmsk: u32,
    latched: u32,
    grxfsiz: u32,
    gccfg: u32,
    transmit_fifo: [u32; ENDPOINTS],
    dcfg: u32,
    dctl: u32,
    diepmsk: u32,
    doepmsk: u32,
    daintmsk: u32,
    diepempmsk: u32,
    ins: [In; ENDPOINTS],
    outs: [Out; ENDPOINTS],
    received: VecDeque<Received>,
    reading: VecDeque<u32>,
    suspended: bool,
    address: u32,
    /// No packet leaves, whatever is done to the endpoints, until the device disconnects.
    stuck: bool,
    /// The clock of the transceiver, Hz.
    pub clock_hz: u64,
    /// The transceiver has its supply and its pins.
    pub wired: bool,
    /// Words written into a full transmit FIFO, which are lost.
    pub lost_words: u64,
}

/// The core, shared by its register blocks and the host.
#[derive(Clone, Debug)]
pub struct SharedCore {
    core: Arc<Mutex<Core>>,
    line: Arc<Mutex<InterruptLine>>,
}

impl SharedCore {
    /// Returns a core out of reset; `seed` decides the effect of a busy bus on its interrupt line.
    pub fn new(faults: Faults, seed: u64) -> Self {
        Self {
            core: Arc::default(),
            line: Arc::new(Mutex::new(InterruptLine::new(faults, seed))),
        }
    }

    /// Locks the core. One thread runs the whole rig, therefore the lock never waits.
    pub fn lock(&self) -> MutexGuard<'_, Core> {
        self.core.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Locks its interrupt line; this lock never waits either.
    pub fn line(&self) -> MutexGuard<'_, InterruptLine> {
        self.line.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Default for Core {
    fn default() -> Self {
        Self {
            gotgctl: 0,
            gahbcfg: 0,
            gusbcfg: 0x0000_1400,
            gintmsk: 0,
            latched: 0,
            grxfsiz: 0x200,
            gccfg: 0,
            transmit_fifo: [0x0200_0200; ENDPOINTS],
            dcfg: 0x0220_0000,
            dctl: device_registers::SOFT_DISCONNECT,
            diepmsk: 0,
            doepmsk: 0,
            daintmsk: 0,
            diepempmsk: 0,
            ins: Default::default(),
            outs: Default::default(),
            received: VecDeque::new(),
            reading: VecDeque::new(),
            suspended: false,
            address: 0,
            stuck: false,
            clock_hz: 0,
            wired: false,
            lost_words: 0,
        }
    }
}

impl Core {
    /// Sets every register to its reset value; clock and wiring stay.
    pub fn reset(&mut self) {
        *self = Core {
            clock_hz: self.clock_hz,
            wired: self.wired,
            lost_words: self.lost_words,
            ..Core::default()
        };
    }

    /// Returns whether the device pulls D+ up: transceiver on and clocked, device mode, session
    /// valid, not soft-disconnected.
    pub fn attached(&self) -> bool {
        const TRANSCEIVER_ON: u32 = 1 << 16;
        const DEVICE_MODE: u32 = 1 << 30;
        self.wired
            && self.clock_hz != 0
            && self.gccfg & TRANSCEIVER_ON != 0
            && self.gusbcfg & DEVICE_MODE != 0
            && self.session_valid()
            && self.dctl & device_registers::SOFT_DISCONNECT == 0
    }

    /// Returns whether the B-session is valid, overridden by GOTGCTL. VBUS itself is not wired to
    /// PA9 on this board.
    fn session_valid(&self) -> bool {
        const OVERRIDE: u32 = 1 << 6 | 1 << 7;
        const VBUS_DETECTION: u32 = 1 << 21;
        self.gccfg & VBUS_DETECTION == 0 && self.gotgctl & OVERRIDE == OVERRIDE
    }

    /// Returns the level of the core's interrupt line.
    pub fn interrupt(&self) -> bool {
        self.gahbcfg & 1 != 0 && self.gintsts() & self.gintmsk != 0
    }

    /// Handles a reset of the bus by the host.
    pub fn bus_reset(&mut self) {
        self.suspended = false;
        self.latched |= interrupt::USBRST;
        self.ins.iter_mut().for_each(In::stop);
        self.outs.iter_mut().for_each(Out::stop);
    }

    /// Handles the end of the reset: full speed.
    pub fn enumerated(&mut self) {
        self.latched |= interrupt::ENUMDNE;
    }

    /// Latches a suspend that is over, as a core does that is late.
    pub fn latch_stale_suspend(&mut self) {
        self.latched |= interrupt::ESUSP | interrupt::USBSUSP;
    }

    /// Stops all packets of bulk and interrupt endpoints until the device disconnects.
    pub fn get_stuck(&mut self) {
        self.stuck = true;
    }

    /// Handles three milliseconds without activity on the bus.
    pub fn suspend(&mut self) {
        if !self.suspended {
            self.suspended = true;
            self.latched |= interrupt::ESUSP | interrupt::USBSUSP;
        }
    }

    /// Handles a resume of the bus without a reset.
    pub fn resume(&mut self) {
        if self.suspended {
            self.suspended = false;
            self.latched |= interrupt::WKUPINT;
        }
    }

    /// Handles a start of frame.
    pub fn start_of_frame(&mut self) {
        self.latched |= interrupt::SOF;
    }

    /// Handles a SETUP transaction. A device cannot refuse it, but it may have no room.
    pub fn setup(&mut self, address: u8, packet: [u8; 8]) -> Answer<()> {
        if !self.answers(address) {
            return Answer::Silence;
        }
        if self.receive_room() < 4 {
            return Answer::Nak;
        }
        self.ins[0].setup_received();
        self.outs[0].setup_received();
        self.push(packet_status::SETUP_DATA, 0, &packet);
        self.push(packet_status::SETUP_DONE, 0, &[]);
        Answer::Ack(())
    }

    /// Handles an OUT transaction. A packet whose toggle is not that of the next one is
    /// acknowledged and dropped.
    pub fn receive(&mut self, address: u8, endpoint: usize, packet: &Packet) -> Answer<()> {
        let room = self.receive_room();
        if !self.answers(address) {
            return Answer::Silence;
        }
        let out = &mut self.outs[endpoint];
        if out.stalled() {
            return Answer::Stall;
        }
        let bytes = &packet.bytes;
        if !out.armed(endpoint) || room < bytes.len().div_ceil(4) + 2 {
            return Answer::Nak;
        }
        if endpoint != 0 && !out.is_next(packet.data1) {
            return Answer::Ack(());
        }
        out.packet_received(bytes.len());
        self.push(packet_status::OUT_DATA, endpoint, bytes);
        self.push(packet_status::OUT_DONE, endpoint, &[]);
        Answer::Ack(())
    }

    /// Handles an IN transaction.
    pub fn transmit(&mut self, address: u8, endpoint: usize) -> Answer<Packet> {
        if !self.answers(address) {
            return Answer::Silence;
        }
        let sender = &mut self.ins[endpoint];
        if sender.stalled() {
            return Answer::Stall;
        }
        if self.stuck && endpoint != 0 {
            return Answer::Nak;
        }
        let packet = sender.packet(endpoint);
        if endpoint == 0 && packet.is_some() {
            // A new address takes effect at the end of the transfer that sets it, though the
            // register is written before.
            self.address = self.dcfg_address();
        }
        match packet {
            Some((bytes, data1)) => Answer::Ack(Packet { bytes, data1 }),
            None => Answer::Nak,
        }
    }

    fn dcfg_address(&self) -> u32 {
        self.dcfg >> 4 & 0x7F
    }

    fn answers(&self, address: u8) -> bool {
        self.attached() && self.in_step() && !self.suspended && self.address == u32::from(address)
    }

    /// Returns whether the clock is good enough for host and device to communicate: full speed
    /// allows 48 MHz ± 0.25 % (USB 2.0, section 7.1.11).
    fn in_step(&self) -> bool {
        self.clock_hz.abs_diff(48_000_000) <= 120_000
    }

    /// Returns the free words of the receive FIFO.
    fn receive_room(&self) -> usize {
        let used: usize = self
            .received
            .iter()
            .map(|entry| 1 + entry.words.len())
            .sum();
        (self.grxfsiz & 0xFFFF) as usize
            - (used + self.reading.len()).min((self.grxfsiz & 0xFFFF) as usize)
    }

    fn push(&mut self, status: u32, endpoint: usize, data: &[u8]) {
        let word = |chunk: &[u8]| {
            let mut bytes = [0; 4];
            bytes[..chunk.len()].copy_from_slice(chunk);
            u32::from_le_bytes(bytes)
        };
        self.received.push_back(Received {
            status: status << 17 | (data.len() as u32) << 4 | endpoint as u32,
            words: data.chunks(4).map(word).collect(),
        });
    }

    fn endpoint_interrupts(&self) -> u32 {
        let bit = |condition: bool, bit: usize| u32::from(condition) << bit;
        (0..ENDPOINTS)
            .map(|n| {
                let empty = self.diepempmsk >> n & 1 != 0 && self.ins[n].fifo_empty();
                bit(empty || self.ins[n].interrupts & self.diepmsk != 0, n)
                    | bit(self.outs[n].interrupts & self.doepmsk != 0, n + 16)
            })
            .sum()
    }

    fn gintsts(&self) -> u32 {
        let endpoints = self.endpoint_interrupts() & self.daintmsk;
        let flag = |condition: bool, bit: u32| if condition { bit } else { 0 };
        self.latched
            | interrupt::NPTXFE
            | flag(!self.received.is_empty(), interrupt::RXFLVL)
            | flag(endpoints & 0xFFFF != 0, interrupt::IEPINT)
            | flag(endpoints >> 16 != 0, interrupt::OEPINT)
    }
}
