//! The transfers of another program as host: it decides on them, and the rig's host makes the
//! transactions.
//!
//! Endpoints take turns, one transaction each; a transfer of an endpoint waits for those before it.
//! A transfer that the device does not acknowledge waits on.

use std::collections::VecDeque;

use super::control::{Failure, Progress, Transfer};
use super::descriptors::Outline;
use crate::peripherals::otg::{Answer, Core, Packet};

/// Linux' numbers for the ends of transfers.
pub mod status {
    /// The transfer is complete.
    pub const OK: i32 = 0;
    /// The request is no valid one.
    pub const INVALID: i32 = -22;
    /// The endpoint is stalled.
    pub const STALLED: i32 = -32;
    /// The device does not answer.
    pub const SILENT: i32 = -71;
    /// The device sent more than was asked.
    pub const TOO_LONG: i32 = -75;
    /// The transfer was taken back.
    pub const UNLINKED: i32 = -104;
    /// The device sent less than the host accepts.
    pub const TOO_SHORT: i32 = -121;
}

/// The longest control transfer, ns.
const CONTROL_TIMEOUT_NS: u64 = 5_000_000_000;
/// Transactions without any answer after which a transfer fails (USB 2.0, section 8.6.2).
const ATTEMPTS: u32 = 3;
/// The most transfers that wait.
const MOST: usize = 1024;
/// The most bytes that they move together.
const MOST_BYTES: usize = 1 << 24;
/// Linux' hub driver reads so much of the device descriptor, from address 0, right after it reset
/// the port. Nothing else in Linux asks for 64 bytes of it.
const FIRST_AFTER_RESET: [u8; 8] = [0x80, 6, 0, 1, 0, 0, 64, 0];

/// A transfer that a client asked for (in Linux a USB request block).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Urb {
    /// Its number.
    pub number: u32,
    /// The number of its isochronous packets, as the client gave it for no packets.
    pub packets: u32,
    /// Address of its endpoint; bit 7 is set towards the host.
    pub endpoint: u8,
    /// SETUP packet of a control transfer.
    pub setup: [u8; 8],
    /// Data towards the device.
    pub data: Vec<u8>,
    /// Number of bytes that the client wants or gives.
    pub length: usize,
    /// Period of an interrupt endpoint's polls, ms; 0 for other endpoints.
    pub interval_ms: u32,
    /// Whether fewer bytes than asked for are an error.
    pub refuses_short: bool,
    /// Whether an empty packet follows data that end with a full one.
    pub ends_with_empty: bool,
}

/// The end of a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Done {
    /// Its number.
    pub number: u32,
    /// As the client gave it.
    pub packets: u32,
    /// One of [`status`].
    pub status: i32,
    /// Number of bytes that were moved.
    pub length: usize,
    /// Bytes of the device.
    pub data: Vec<u8>,
}

/// A client's request to the port itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// The transaction, if any, is over; these are the bytes that came from and went to the device.
    Over([usize; 2]),
    /// The client has reset the port.
    PortReset,
}

/// The result of a transaction: nothing if the device was not ready.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Moved {
    bytes: usize,
    /// Whether the device sent the packet again.
    is_repeated: bool,
    /// The status of the transfer, if it has ended.
    status: Option<i32>,
}

impl Moved {
    fn ended(status: i32) -> Self {
        Self {
            status: Some(status),
            ..Self::default()
        }
    }
}

/// The transfers of one endpoint in one direction.
#[derive(Debug, Default)]
struct Queue {
    waiting: VecDeque<Urb>,
    /// Bytes that the first one has moved.
    moved: Vec<u8>,
    sent: usize,
    /// Whether the next packet is DATA1.
    data1: bool,
    silent: u32,
    /// Time of the next poll, ns.
    due_ns: u64,
}

/// The transfers of a client.
#[derive(Debug, Default)]
pub struct Urbs {
    control: VecDeque<Urb>,
    /// The control transfer under way.
    transfer: Option<Transfer>,
    /// Whether the port was reset for the first control transfer.
    was_reset: bool,
    /// Bulk and interrupt endpoints: those towards the host from 16 on.
    queues: [Queue; 32],
    turn: usize,
    /// The ends of transfers that the client does not know yet.
    pub done: VecDeque<Done>,
    /// Packets that were dropped for their toggle.
    pub repeated: u64,
}

impl Urbs {
    /// Adds a transfer.
    ///
    /// # Errors
    /// If too many wait, or they move too many bytes.
    pub fn submit(&mut self, urb: Urb) -> anyhow::Result<()> {
        anyhow::ensure!(self.waiting() < MOST, "more than {MOST} transfers wait");
        let bytes = self.waiting_bytes() + urb.length;
        anyhow::ensure!(
            bytes <= MOST_BYTES,
            "transfers of {bytes} bytes wait; at most {MOST_BYTES} are possible"
        );
        if urb.endpoint & 0x7F == 0 {
            self.control.push_back(urb);
        } else {
            self.queues[place(urb.endpoint)].waiting.push_back(urb);
        }
        Ok(())
    }

    /// Takes a transfer back. Returns its status: 0 if it has ended before.
    pub fn unlink(&mut self, number: u32) -> i32 {
        if let Some(at) = self.control.iter().position(|urb| urb.number == number) {
            if at == 0 {
                self.transfer = None;
                self.was_reset = false;
            }
            self.control.remove(at);
            return status::UNLINKED;
        }
        for queue in &mut self.queues {
            if let Some(at) = (queue.waiting.iter()).position(|urb| urb.number == number) {
                if at == 0 {
                    queue.begin();
                }
                queue.waiting.remove(at);
                return status::UNLINKED;
            }
        }
        status::OK
    }

    /// Returns the number of transfers that wait.
    pub fn waiting(&self) -> usize {
        let of_queues: usize = self.queues.iter().map(|queue| queue.waiting.len()).sum();
        self.control.len() + of_queues
    }

    /// Returns the number of bytes that the transfers that wait move.
    fn waiting_bytes(&self) -> usize {
        let of_queues = self.queues.iter().flat_map(|queue| &queue.waiting);
        let waiting = self.control.iter().chain(of_queues);
        waiting.map(|urb| urb.length).sum()
    }

    /// Makes the next packet of every endpoint DATA0, as a bus reset does.
    pub fn restart(&mut self) {
        self.transfer = None;
        for queue in &mut self.queues {
            queue.data1 = false;
            queue.begin();
        }
    }

    /// Carries out one transaction; control transfers come first.
    pub fn step(&mut self, now: u64, address: u8, outline: &Outline, device: &mut Core) -> Turn {
        if let Some(urb) = self.control.front() {
            if urb.setup == FIRST_AFTER_RESET && !std::mem::replace(&mut self.was_reset, true) {
                return Turn::PortReset;
            }
            self.control(now, address, outline, device);
            return Turn::Over([0; 2]);
        }
        for _ in 0..self.queues.len() {
            self.turn = (self.turn + 1) % self.queues.len();
            let queue = &mut self.queues[self.turn];
            let (number, is_in) = (self.turn % 16, self.turn >= 16);
            if queue.waiting.is_empty() || now < queue.due_ns {
                continue;
            }
            let size = outline.packet_size(number as u8 | if is_in { 0x80 } else { 0 });
            let moved = match (size, is_in) {
                (None, _) => Moved::ended(status::SILENT),
                (Some(size), true) => queue.take(now, address, number, size, device),
                (Some(size), false) => queue.send(address, number, size, device),
            };
            self.repeated += u64::from(moved.is_repeated);
            (self.done).extend(moved.status.and_then(|status| queue.end(status)));
            if moved != Moved::default() {
                let bytes = moved.bytes;
                return Turn::Over(if is_in { [bytes, 0] } else { [0, bytes] });
            }
        }
        Turn::Over([0; 2])
    }

    fn control(&mut self, now: u64, address: u8, outline: &Outline, device: &mut Core) {
        let Some(urb) = self.control.front() else {
            return;
        };
        if self.transfer.is_none() {
            self.transfer = Transfer::of_client(urb.setup, &urb.data);
            if let Some(transfer) = &mut self.transfer {
                transfer.begin(now + CONTROL_TIMEOUT_NS);
            }
        }
        let Some(transfer) = &mut self.transfer else {
            return self.end_control(status::INVALID, Vec::new());
        };
        match transfer.step(now, address, device) {
            Progress::Going => {}
            Progress::Done(data) => {
                let anew = outline.begun_anew(transfer.begins_anew());
                for endpoint in anew {
                    self.queues[place(endpoint)].data1 = false;
                }
                self.end_control(status::OK, data);
            }
            Progress::Failed(Failure::Stalled) => self.end_control(status::STALLED, Vec::new()),
            Progress::Failed(Failure::TimedOut) => self.end_control(status::SILENT, Vec::new()),
        }
    }

    /// Ends the control transfer under way.
    fn end_control(&mut self, status: i32, mut data: Vec<u8>) {
        (self.transfer, self.was_reset) = (None, false);
        let Some(urb) = self.control.pop_front() else {
            return;
        };
        data.truncate(urb.length);
        let is_in = urb.setup[0] & 0x80 != 0;
        let (status, length) = match (status, is_in) {
            (status::OK, true) => (short(&urb, data.len()), data.len()),
            (status::OK, false) => (status::OK, urb.data.len()),
            _ => (status, 0),
        };
        self.done.push_back(Done {
            number: urb.number,
            packets: urb.packets,
            status,
            length,
            data,
        });
    }
}

impl Queue {
    /// Resets the first transfer's progress, and the time until which it waits.
    fn begin(&mut self) {
        self.moved.clear();
        (self.sent, self.silent, self.due_ns) = (0, 0, 0);
    }

    /// Asks the device for a packet of at most `size` bytes.
    fn take(
        &mut self,
        now: u64,
        address: u8,
        number: usize,
        size: usize,
        device: &mut Core,
    ) -> Moved {
        let Some(urb) = self.waiting.front() else {
            return Moved::default();
        };
        let packet = match device.transmit(address, number) {
            Answer::Ack(packet) => packet,
            Answer::Nak => {
                self.due_ns = now + u64::from(urb.interval_ms) * 1_000_000;
                return Moved::default();
            }
            Answer::Stall => return Moved::ended(status::STALLED),
            Answer::Silence => return self.silence(),
        };
        self.silent = 0;
        if packet.data1 != self.data1 {
            return Moved {
                is_repeated: true,
                ..Moved::default()
            };
        }
        self.data1 = !self.data1;
        self.moved.extend(&packet.bytes);
        let bytes = packet.bytes.len();
        let status = match self.moved.len() {
            moved if moved > urb.length => Some(status::TOO_LONG),
            moved if moved == urb.length => Some(status::OK),
            moved => (bytes < size).then(|| short(urb, moved)),
        };
        Moved {
            bytes,
            status,
            is_repeated: false,
        }
    }

    /// Sends the device a packet of at most `size` bytes.
    fn send(&mut self, address: u8, number: usize, size: usize, device: &mut Core) -> Moved {
        let Some(urb) = self.waiting.front() else {
            return Moved::default();
        };
        let rest = &urb.data[self.sent..];
        let packet = Packet {
            bytes: rest[..rest.len().min(size)].to_vec(),
            data1: self.data1,
        };
        match device.receive(address, number, &packet) {
            Answer::Ack(()) => {}
            Answer::Nak => return Moved::default(),
            Answer::Stall => return Moved::ended(status::STALLED),
            Answer::Silence => return self.silence(),
        }
        (self.silent, self.data1) = (0, !self.data1);
        let bytes = packet.bytes.len();
        self.sent += bytes;
        let is_last = bytes < size || !urb.ends_with_empty && self.sent == urb.data.len();
        Moved {
            bytes,
            status: is_last.then_some(status::OK),
            is_repeated: false,
        }
    }

    fn silence(&mut self) -> Moved {
        self.silent += 1;
        match self.silent >= ATTEMPTS {
            true => Moved::ended(status::SILENT),
            false => Moved::default(),
        }
    }

    /// Ends the first transfer.
    fn end(&mut self, status: i32) -> Option<Done> {
        let urb = self.waiting.pop_front()?;
        let mut data = std::mem::take(&mut self.moved);
        data.truncate(urb.length);
        let length = match urb.endpoint & 0x80 {
            0 => self.sent,
            _ => data.len(),
        };
        self.begin();
        Some(Done {
            number: urb.number,
            packets: urb.packets,
            status,
            length,
            data,
        })
    }
}

/// Returns the status of a transfer of this many bytes.
fn short(urb: &Urb, moved: usize) -> i32 {
    match urb.refuses_short && moved < urb.length {
        true => status::TOO_SHORT,
        false => status::OK,
    }
}

/// Returns the place of an endpoint's queue.
fn place(endpoint: u8) -> usize {
    usize::from(endpoint & 15) + if endpoint & 0x80 != 0 { 16 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn urb(number: u32, endpoint: u8, setup: [u8; 8]) -> Urb {
        Urb {
            number,
            packets: 0,
            endpoint,
            setup,
            data: Vec::new(),
            length: 8,
            interval_ms: 0,
            refuses_short: false,
            ends_with_empty: false,
        }
    }

    fn outline() -> Outline {
        Outline::of(&[9, 4, 0, 0, 1, 2, 2, 1, 0, 7, 5, 0x81, 3, 8, 0, 10])
    }

    /// Makes this many transactions with a core that is off; returns the ends: number and status.
    fn ends(urbs: &mut Urbs, steps: u64) -> Vec<(u32, i32)> {
        for now in 0..steps {
            urbs.step(now, 7, &outline(), &mut Core::default());
        }
        let done = urbs.done.drain(..);
        done.map(|done| (done.number, done.status)).collect()
    }

    #[test]
    fn what_cannot_be_carried_out_ends_with_its_reason() {
        let mut urbs = Urbs::default();
        // Seven bytes are announced and none given; there is no endpoint 2; none answers.
        let coding = [0x21, 0x20, 0, 0, 0, 0, 7, 0];
        for (number, endpoint, setup) in [(1, 0, coding), (2, 0x82, [0; 8]), (3, 0x81, [0; 8])] {
            urbs.submit(urb(number, endpoint, setup)).unwrap();
        }
        let expected = [
            (1, status::INVALID),
            (2, status::SILENT),
            (3, status::SILENT),
        ];
        let mut found = ends(&mut urbs, 10);
        found.sort_unstable();
        assert_eq!(found, expected);
        assert_eq!(urbs.waiting(), 0);
    }

    #[test]
    fn a_transfer_is_taken_back_once() {
        let mut urbs = Urbs::default();
        for number in 1..=3 {
            urbs.submit(urb(number, 0x81, [0; 8])).unwrap();
        }
        urbs.submit(urb(4, 0x80, [0x80, 0, 0, 0, 0, 0, 2, 0]))
            .unwrap();
        for number in [4, 2] {
            assert_eq!(urbs.unlink(number), status::UNLINKED);
            assert_eq!(urbs.unlink(number), status::OK);
        }
        assert_eq!(ends(&mut urbs, 20).len(), 2);
        let many = (0..=MOST as u32).map(|number| urbs.submit(urb(number, 0x81, [0; 8])));
        assert_eq!(many.filter(Result::is_err).count(), 1);
    }

    #[test]
    fn the_bytes_of_waiting_transfers_are_bounded() {
        let mut urbs = Urbs::default();
        let half = |number, endpoint| Urb {
            length: MOST_BYTES / 2,
            ..urb(number, endpoint, [0; 8])
        };
        urbs.submit(half(1, 1)).unwrap();
        urbs.submit(half(2, 0)).unwrap();
        let why = urbs.submit(urb(3, 0x81, [0; 8])).unwrap_err().to_string();
        assert!(why.contains("16777224 bytes"), "{why}");
        urbs.unlink(1);
        urbs.submit(half(4, 0x81)).unwrap();
    }

    /// A long period counts for the transfer that gave it, not for those after it.
    #[test]
    fn a_poll_that_is_put_off_does_not_outlive_its_transfer() {
        let off: [fn(&mut Urbs); 2] = [|urbs| assert_ne!(urbs.unlink(1), 0), Urbs::restart];
        for off in off {
            let mut urbs = Urbs::default();
            urbs.submit(urb(1, 0x81, [0; 8])).unwrap();
            urbs.queues[place(0x81)].due_ns = u64::MAX;
            assert_eq!(ends(&mut urbs, 10), []);
            off(&mut urbs);
            urbs.submit(urb(2, 0x81, [0; 8])).unwrap();
            let found = ends(&mut urbs, 10);
            assert_eq!(found.last(), Some(&(2, status::SILENT)));
        }
    }

    #[test]
    fn the_first_request_after_a_reset_of_the_port_resets_it() {
        let mut urbs = Urbs::default();
        let step = |urbs: &mut Urbs| urbs.step(0, 0, &outline(), &mut Core::default());
        urbs.submit(urb(1, 0x80, FIRST_AFTER_RESET)).unwrap();
        assert_eq!(step(&mut urbs), Turn::PortReset);
        urbs.restart();
        assert_eq!(step(&mut urbs), Turn::Over([0; 2]));
        urbs.unlink(1);
        // Any other length is a question like any other.
        urbs.submit(urb(2, 0x80, [0x80, 6, 0, 1, 0, 0, 18, 0]))
            .unwrap();
        assert_eq!(step(&mut urbs), Turn::Over([0; 2]));
        urbs.unlink(2);
        urbs.submit(urb(3, 0x80, FIRST_AFTER_RESET)).unwrap();
        assert_eq!(step(&mut urbs), Turn::PortReset);
    }
}
