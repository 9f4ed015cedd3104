//! One endpoint's registers: DIEPCTLn, DIEPINTn, DIEPTSIZn and the transmit FIFO, or DOEPCTLn,
//! DOEPINTn, DOEPTSIZn.

use std::collections::VecDeque;

/// Control register bits.
mod bit {
    pub const ACTIVE: u32 = 1 << 15;
    pub const NAK_STATUS: u32 = 1 << 17;
    pub const STALL: u32 = 1 << 21;
    pub const CLEAR_NAK: u32 = 1 << 26;
    pub const SET_NAK: u32 = 1 << 27;
    pub const NEXT_IS_DATA0: u32 = 1 << 28;
    pub const NEXT_IS_DATA1: u32 = 1 << 29;
    pub const DISABLE: u32 = 1 << 30;
    pub const ENABLE: u32 = 1 << 31;
}

/// Interrupt register bits.
mod event {
    pub const TRANSFER_DONE: u32 = 1 << 0;
    pub const DISABLED: u32 = 1 << 1;
    pub const SETUP_DONE: u32 = 1 << 3;
    pub const NAK_EFFECTIVE: u32 = 1 << 6;
}

/// Returns the control bits after a write: commands act and do not stay.
fn controlled(old: u32, written: u32) -> u32 {
    let toggles = bit::NEXT_IS_DATA0 | bit::NEXT_IS_DATA1;
    let commands = bit::CLEAR_NAK | bit::SET_NAK | toggles | bit::DISABLE;
    let mut now = written & !(commands | bit::NAK_STATUS) | old & (bit::NAK_STATUS | bit::ENABLE);
    if disables(old, written) {
        now &= !bit::ENABLE;
    }
    if written & bit::CLEAR_NAK != 0 {
        now &= !bit::NAK_STATUS;
    }
    if written & bit::SET_NAK != 0 {
        now |= bit::NAK_STATUS;
    }
    now
}

/// Returns whether a write ends a transfer. The core disables an endpoint only once its NAK is in
/// effect, so one write cannot set both.
fn disables(old: u32, written: u32) -> bool {
    written & bit::DISABLE != 0
        && old & (bit::ENABLE | bit::NAK_STATUS) == bit::ENABLE | bit::NAK_STATUS
}

/// Returns the data toggle (whether the next packet is DATA1) after a write of the control
/// register. A bus reset leaves it: drivers set it. The core manages the toggle of endpoint 0
/// itself.
fn toggled(data1: bool, written: u32) -> bool {
    (data1 || written & bit::NEXT_IS_DATA1 != 0) && written & bit::NEXT_IS_DATA0 == 0
}

/// An IN endpoint: device to host.
#[derive(Clone, Debug, Default)]
pub struct In {
    control: u32,
    /// DIEPINT without the FIFO-empty bit.
    pub interrupts: u32,
    /// DIEPTSIZ.
    pub size: u32,
    data1: bool,
    fifo: VecDeque<u32>,
}

impl In {
    /// Returns DIEPCTL as the firmware reads it; endpoint 0 is always active.
    pub fn control(&self, number: usize) -> u32 {
        self.control | if number == 0 { bit::ACTIVE } else { 0 }
    }

    /// Handles a write of DIEPCTL.
    pub fn write_control(&mut self, value: u32) {
        if disables(self.control, value) {
            self.interrupts |= event::DISABLED;
        }
        self.control = controlled(self.control, value);
        self.data1 = toggled(self.data1, value);
        if value & bit::SET_NAK != 0 {
            self.interrupts |= event::NAK_EFFECTIVE;
        }
    }

    /// Puts one word into the FIFO. Returns false if it is full.
    pub fn push(&mut self, word: u32, depth: u32) -> bool {
        let room = self.room(depth) > 0;
        if room {
            self.fifo.push_back(word);
        }
        room
    }

    /// Returns the free words of a FIFO of this depth.
    pub fn room(&self, depth: u32) -> u32 {
        depth.saturating_sub(self.fifo.len() as u32)
    }

    /// Returns whether the FIFO is empty.
    pub fn fifo_empty(&self) -> bool {
        self.fifo.is_empty()
    }

    /// Empties the FIFO.
    pub fn flush(&mut self) {
        self.fifo.clear();
    }

    /// Handles a bus reset: it is no longer active. A transfer, its size and its FIFO stay until
    /// the firmware takes them back.
    pub fn stop(&mut self) {
        self.control &= !(bit::STALL | bit::ACTIVE);
    }

    /// Handles a SETUP packet: ends a stall and sets NAK.
    pub fn setup_received(&mut self) {
        self.control = (self.control | bit::NAK_STATUS) & !bit::STALL;
    }

    /// Returns whether it answers STALL.
    pub fn stalled(&self) -> bool {
        self.control & bit::STALL != 0
    }

    /// Returns the packet that is ready, and whether it is DATA1. Returns `None` if no packet is
    /// wholly in the FIFO.
    pub fn packet(&mut self, number: usize) -> Option<(Vec<u8>, bool)> {
        let ready = self.control(number) & (bit::ENABLE | bit::NAK_STATUS | bit::ACTIVE)
            == bit::ENABLE | bit::ACTIVE;
        let length = (self.size & if number == 0 { 0x7F } else { 0x7_FFFF }) as usize;
        if !ready || self.fifo.len() < length.div_ceil(4) {
            return None;
        }
        let words = self.fifo.drain(..length.div_ceil(4));
        let mut packet: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
        packet.truncate(length);
        self.control &= !bit::ENABLE;
        self.size = 0;
        self.interrupts |= event::TRANSFER_DONE;
        let data1 = self.data1;
        self.data1 = !data1;
        Some((packet, data1))
    }
}

/// An OUT endpoint: host to device.
#[derive(Clone, Debug, Default)]
pub struct Out {
    control: u32,
    /// DOEPINT.
    pub interrupts: u32,
    /// DOEPTSIZ.
    pub size: u32,
    data1: bool,
    was_enabled: bool,
}

impl Out {
    /// Returns DOEPCTL as the firmware reads it; endpoint 0 is always active.
    pub fn control(&self, number: usize) -> u32 {
        self.control | if number == 0 { bit::ACTIVE } else { 0 }
    }

    /// Handles a write of DOEPCTL.
    pub fn write_control(&mut self, value: u32) {
        if disables(self.control, value) {
            self.interrupts |= event::DISABLED;
        }
        self.control = controlled(self.control, value);
        self.data1 = toggled(self.data1, value);
        self.was_enabled =
            self.control & bit::ACTIVE != 0 && (self.was_enabled || value & bit::ENABLE != 0);
    }

    /// Handles a SETUP packet: ends a stall and sets NAK.
    pub fn setup_received(&mut self) {
        self.control = (self.control | bit::NAK_STATUS) & !bit::STALL;
    }

    /// Returns whether it answers STALL.
    pub fn stalled(&self) -> bool {
        self.control & bit::STALL != 0
    }

    /// Handles a bus reset: it takes no packets and is no longer active.
    pub fn stop(&mut self) {
        self.control = (self.control | bit::NAK_STATUS) & !(bit::ENABLE | bit::STALL | bit::ACTIVE);
        self.was_enabled = false;
    }

    /// Returns whether it takes a packet.
    pub fn armed(&self, number: usize) -> bool {
        let open = self.control & bit::NAK_STATUS == 0;
        let packets = self.size >> 19 & 0x3FF;
        open && (number == 0 || self.was_enabled && packets > 0)
    }

    /// Returns whether a packet is the next one. If not, the endpoint already has it, and the host
    /// takes the acknowledgement for that of the next packet.
    pub fn is_next(&mut self, data1: bool) -> bool {
        let next = self.data1 == data1;
        self.data1 ^= next;
        next
    }

    /// Handles a received packet: NAK until the firmware is ready for the next one.
    pub fn packet_received(&mut self, length: usize) {
        self.control |= bit::NAK_STATUS;
        let (packets, bytes) = (self.size >> 19 & 0x3FF, self.size & 0x7_FFFF);
        let rest = bytes.saturating_sub(length as u32);
        self.size = self.size & !(0x3FF << 19 | 0x7_FFFF) | packets.saturating_sub(1) << 19 | rest;
    }

    /// Handles the firmware's read of the entry that ends a transfer.
    pub fn transfer_done(&mut self) {
        self.interrupts |= event::TRANSFER_DONE;
    }

    /// Handles the firmware's read of the entry that ends a SETUP stage.
    pub fn setup_done(&mut self) {
        self.interrupts |= event::SETUP_DONE;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packet_leaves_when_it_is_whole_and_the_endpoint_enabled() {
        let mut endpoint = In::default();
        endpoint.write_control(bit::ACTIVE | bit::SET_NAK);
        endpoint.size = 1 << 19 | 5;
        endpoint.write_control(bit::ACTIVE | bit::ENABLE | bit::CLEAR_NAK);
        assert!(endpoint.push(0x4433_2211, 16));
        assert_eq!(endpoint.packet(1), None);
        assert!(endpoint.push(0x55, 16));
        let bytes = vec![0x11, 0x22, 0x33, 0x44, 0x55];
        assert_eq!(endpoint.packet(1), Some((bytes, false)));
        assert_eq!(endpoint.packet(1), None);
        assert_eq!((endpoint.control(1) & bit::ENABLE, endpoint.size), (0, 0));
        assert_eq!(endpoint.interrupts & event::TRANSFER_DONE, 1);
    }

    #[test]
    fn toggles_alternate_and_begin_anew_where_they_are_set() {
        let mut endpoint = In::default();
        let mut sent = |command: u32| {
            endpoint.size = 1 << 19;
            endpoint.write_control(bit::ACTIVE | bit::ENABLE | bit::CLEAR_NAK | command);
            endpoint.packet(1).unwrap().1
        };
        let commands = [0, 0, 0, bit::NEXT_IS_DATA0, 0, bit::NEXT_IS_DATA0];
        let expected = [false, true, false, false, true, false];
        assert_eq!(commands.map(&mut sent), expected);
        let mut out = Out::default();
        assert!(out.is_next(false) && !out.is_next(false) && out.is_next(true));
        out.write_control(bit::NEXT_IS_DATA1);
        assert!(!out.is_next(false) && out.is_next(true));
    }

    #[test]
    fn a_packet_outlives_a_reset_until_it_is_disabled_under_nak() {
        let mut endpoint = In {
            size: 1 << 19 | 4,
            ..In::default()
        };
        endpoint.write_control(bit::ACTIVE | bit::ENABLE | bit::CLEAR_NAK);
        assert!(endpoint.push(1, 16));
        endpoint.stop();
        assert_eq!(endpoint.control(1) & bit::ENABLE, bit::ENABLE);
        assert_eq!((endpoint.size, endpoint.fifo_empty()), (1 << 19 | 4, false));
        endpoint.write_control(bit::SET_NAK | bit::DISABLE);
        assert_eq!(endpoint.control(1) & bit::ENABLE, bit::ENABLE, "too early");
        endpoint.write_control(bit::SET_NAK | bit::DISABLE);
        assert_eq!(endpoint.control(1) & bit::ENABLE, 0);
        assert_eq!(endpoint.interrupts & event::DISABLED, event::DISABLED);
    }

    #[test]
    fn a_fifo_has_its_depth() {
        let mut endpoint = In::default();
        assert!((0..16).all(|word| endpoint.push(word, 16)));
        assert!(!endpoint.push(16, 16));
        assert_eq!(endpoint.room(16), 0);
    }

    #[test]
    fn an_out_endpoint_takes_one_packet_per_arming() {
        let mut endpoint = Out {
            size: 1 << 19 | 64,
            ..Out::default()
        };
        endpoint.write_control(bit::ACTIVE | bit::CLEAR_NAK);
        assert!(!endpoint.armed(2), "never enabled");
        endpoint.write_control(bit::ACTIVE | bit::CLEAR_NAK | bit::ENABLE);
        assert!(endpoint.armed(2));
        endpoint.packet_received(10);
        assert!(!endpoint.armed(2));
        endpoint.size = 1 << 19 | 64;
        endpoint.write_control(bit::ACTIVE | bit::CLEAR_NAK);
        assert!(endpoint.armed(2));
        endpoint.write_control(0);
        endpoint.write_control(bit::ACTIVE | bit::CLEAR_NAK);
        assert!(!endpoint.armed(2), "inactive in between");
    }
}
