//! The global registers, by offset from the core's base.

use super::{Core, packet_status};

/// OTG_CID as silicon answers it. (ST's register description file has 0x1200, the value of an older
/// core.)
const CORE_ID: u32 = 0x0000_2300;
/// GRSTCTL: the AHB master is idle.
const AHB_IDLE: u32 = 1 << 31;

impl Core {
    /// Handles a read by the firmware.
    pub(super) fn read_global(&mut self, offset: u32) -> u32 {
        match offset {
            // The ID pin reads as B-device; the session follows the override.
            0x00 => self.gotgctl | 1 << 16 | u32::from(self.session_valid()) << 19,
            0x08 => self.gahbcfg,
            0x0C => self.gusbcfg,
            0x10 => AHB_IDLE,
            0x14 => self.gintsts(),
            0x18 => self.gintmsk,
            0x1C => self.received.front().map_or(0, |entry| entry.status),
            0x20 => self.pop_received(),
            0x24 => self.grxfsiz,
            0x28 => self.transmit_fifo[0],
            0x38 => self.gccfg,
            0x3C => CORE_ID,
            0x104..=0x120 => self.transmit_fifo[((offset - 0x100) / 4) as usize],
            _ => 0,
        }
    }

    /// Handles a write by the firmware.
    pub(super) fn write_global(&mut self, offset: u32, value: u32) {
        match offset {
            0x00 => self.gotgctl = value & 0xFF,
            0x08 => self.gahbcfg = value,
            0x0C => self.gusbcfg = value,
            0x10 => self.write_reset(value),
            0x14 => self.latched &= !value,
            0x18 => self.gintmsk = value,
            0x24 => self.grxfsiz = value,
            0x28 => self.transmit_fifo[0] = value,
            0x38 => self.gccfg = value,
            0x104..=0x120 => self.transmit_fifo[((offset - 0x100) / 4) as usize] = value,
            _ => {}
        }
    }

    /// Handles GRSTCTL: core reset, FIFO flushes. All finish at once.
    fn write_reset(&mut self, value: u32) {
        const CORE: u32 = 1;
        const RECEIVE: u32 = 1 << 4;
        const TRANSMIT: u32 = 1 << 5;
        const ALL: u32 = 16;
        if value & CORE != 0 {
            let kept = (self.gccfg, self.gotgctl);
            self.reset();
            (self.gccfg, self.gotgctl) = kept;
        }
        if value & RECEIVE != 0 {
            self.received.clear();
            self.reading.clear();
        }
        if value & TRANSMIT != 0 {
            let which = value >> 6 & 31;
            for (number, endpoint) in self.ins.iter_mut().enumerate() {
                if which == ALL || which == number as u32 {
                    endpoint.flush();
                }
            }
        }
    }

    /// Takes the oldest entry for GRXSTSP. Its data are then read from the FIFO.
    fn pop_received(&mut self) -> u32 {
        let Some(entry) = self.received.pop_front() else {
            return 0;
        };
        let endpoint = &mut self.outs[(entry.status & 15) as usize];
        match entry.status >> 17 & 15 {
            packet_status::SETUP_DONE => endpoint.setup_done(),
            packet_status::OUT_DONE => endpoint.transfer_done(),
            _ => self.reading = entry.words.into(),
        }
        entry.status
    }

    /// Reads the receive FIFO; zero if it is empty.
    pub(super) fn read_fifo(&mut self) -> u32 {
        self.reading.pop_front().unwrap_or(0)
    }

    /// Writes a word to an endpoint's transmit FIFO.
    pub(super) fn write_fifo(&mut self, endpoint: usize, word: u32) {
        let depth = self.transmit_fifo[endpoint] >> 16;
        if !self.ins[endpoint].push(word, depth) {
            self.lost_words += 1;
        }
    }
}
