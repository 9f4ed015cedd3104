//! A USB host with one full-speed port: enumerates a CDC-ACM device and moves its bytes.
//!
//! It makes one transaction every 1/19 ms, the rate of 64-byte bulk packets on a full-speed bus.
//! Times are those of USB 2.0 chapters 7 and 9: 100 ms debounce, 10 ms reset, 10 ms recovery,
//! suspend after 3 ms without activity.

mod control;
mod descriptors;
mod remote;
pub mod urbs;

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::arrivals::Arrivals;
use crate::faults::{Faults, Kind};
use crate::peripherals::otg::{Answer, Core, Packet};
use control::{Begins, Progress, Transfer};
use descriptors::Function;
use remote::Remote;
pub use remote::{Description, Presence};

/// Duration of one transaction, ns.
const TRANSACTION_NS: u64 = 1_000_000 / 19;
/// Period at which an empty port is checked, ns.
const IDLE_NS: u64 = 500_000;
const DEBOUNCE_NS: u64 = 100_000_000;
const RESET_NS: u64 = 10_000_000;
const RECOVERY_NS: u64 = 10_000_000;
const SUSPEND_NS: u64 = 3_000_000;
/// Longest duration of a control transfer.
const CONTROL_TIMEOUT_NS: u64 = 500_000_000;
/// Number of port resets after which the host gives up a device.
const ATTEMPTS: u32 = 3;
/// Largest bulk packet.
const PACKET: usize = 64;
/// Bytes that wait for a client above which the host stops asking for more.
const BACKLOG: usize = 1 << 16;

/// The state of the port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// No device pulls D+ up.
    Empty,
    /// A device appeared; the host waits until its plug sits.
    Debounce(u64),
    /// The bus is in reset.
    Reset(u64),
    /// The device has time to recover.
    Recovery(u64),
    /// Control transfers run.
    Enumerating,
    /// The serial port exists, or a client's transfers run.
    Configured,
    /// A client has no transfer: the bus is idle.
    Quiet(u64),
    /// The bus has been idle for long enough.
    Suspended,
    /// The bus resumes for a client's transfer.
    Resuming(u64),
    /// The host gave up the device.
    Failed,
}

/// Counters for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Bytes from the device.
    pub bytes_in: u64,
    /// Bulk packets from the device.
    pub packets_in: u64,
    /// Bytes to the device.
    pub bytes_out: u64,
    /// Times the device was configured.
    pub enumerations: u64,
    /// Control transfers that timed out or stalled.
    pub failed_transfers: u64,
    /// Bulk packets from the device that were dropped for their toggle: it marks them as packets
    /// that the host already has.
    pub repeated_packets: u64,
    /// Resets of the port that a client made.
    pub port_resets: u64,
    /// Suspends of a client's port.
    pub suspends: u64,
}

/// The host.
#[derive(Debug)]
pub struct Host {
    port: Port,
    faults: Faults,
    cable: bool,
    reset_wanted: bool,
    /// The device was made to send no packet any more.
    stuck: bool,
    idle_since: Option<u64>,
    attempts: u32,
    address: u8,
    transfer: Option<Transfer>,
    queue: VecDeque<Transfer>,
    function: Option<Function>,
    /// The port of a client that makes all transfers itself.
    remote: Option<Remote>,
    /// Whether a program has the serial port open.
    open: bool,
    /// Whether the device knows that it is open.
    announced_open: bool,
    /// Whether the program reads.
    reading: bool,
    bulk_turn_in: bool,
    /// Whether the next bulk packet is DATA1: from the device, and to it.
    data1: [bool; 2],
    next_frame_ns: u64,
    /// Bytes from the device.
    pub from_device: VecDeque<u8>,
    /// Bytes for the device.
    pub to_device: VecDeque<u8>,
    counters: Counters,
    arrivals: Arrivals,
    log: Vec<String>,
}

/// The host, shared by the bus and the run.
#[derive(Clone, Debug)]
pub struct SharedHost(Arc<Mutex<Host>>);

impl SharedHost {
    /// Shares a host.
    pub fn new(host: Host) -> Self {
        Self(Arc::new(Mutex::new(host)))
    }

    /// Locks the host. One thread runs the whole rig, therefore the lock never waits.
    pub fn lock(&self) -> MutexGuard<'_, Host> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Host {
    /// Returns a host with the cable plugged in and no program on the port.
    pub fn new(faults: Faults, arrivals: Arrivals) -> Self {
        Self {
            port: Port::Empty,
            faults,
            cable: true,
            reset_wanted: false,
            stuck: false,
            idle_since: None,
            attempts: 0,
            address: 0,
            transfer: None,
            queue: VecDeque::new(),
            function: None,
            remote: None,
            open: false,
            announced_open: false,
            reading: true,
            bulk_turn_in: true,
            data1: [false; 2],
            next_frame_ns: 0,
            from_device: VecDeque::new(),
            to_device: VecDeque::new(),
            counters: Counters::default(),
            arrivals,
            log: Vec::new(),
        }
    }

    /// Returns the state of the port.
    pub fn port(&self) -> Port {
        self.port
    }

    /// Returns the present counters.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Returns the reason why the log of arrivals is incomplete; `None` if it is complete.
    pub fn arrivals_failure(&self) -> Option<&str> {
        self.arrivals.failure()
    }

    /// Returns the events on the port, a line each.
    pub fn log(&self) -> &[String] {
        &self.log
    }

    /// Opens or closes the serial port for a program: sets or clears DTR and RTS.
    pub fn set_open(&mut self, open: bool) {
        self.open = open;
        if !open {
            self.to_device.clear();
            self.from_device.clear();
        }
    }

    /// Sets whether the program reads.
    pub fn set_reading(&mut self, reading: bool) {
        self.reading = reading;
    }

    /// Queues a control transfer; it runs once the device is configured.
    pub fn request(&mut self, setup: [u8; 8]) {
        self.queue.push_back(Transfer::any(setup));
    }

    /// Gives the control transfer up that is under way, wherever it is, and those that wait.
    pub fn cancel(&mut self) {
        self.transfer = None;
        self.queue.clear();
    }

    /// Resets the bus of a device that is plugged in, and enumerates it again.
    pub fn reset(&mut self) {
        self.reset_wanted = true;
    }

    /// Plugs the cable in, or pulls it.
    pub fn set_cable(&mut self, plugged: bool) {
        self.cable = plugged;
    }

    /// Carries out the next transaction, or the port's next state change. Returns the time of the
    /// next call, ns.
    pub fn tick(&mut self, now: u64, device: &mut Core) -> u64 {
        let is_pulled = !self.cable || self.was_pulled() || self.faults.on(Kind::CablePulled, now);
        if is_pulled || !device.attached() {
            return self.disconnected(now, device);
        }
        self.idle_since = None;
        if std::mem::take(&mut self.reset_wanted) {
            self.note(now, "port reset");
            self.forget_device();
            self.attempts = 0;
            self.reset_bus(now, device);
        }
        self.start_of_frame(now, device);
        if self.faults.on(Kind::UsbStuck, now) && !std::mem::replace(&mut self.stuck, true) {
            device.get_stuck();
        }
        match self.port {
            Port::Empty => self.wait(now, "device attached", Port::Debounce(now + DEBOUNCE_NS)),
            Port::Debounce(until) if now >= until => self.reset_bus(now, device),
            Port::Reset(until) if now >= until => {
                device.enumerated();
                if self.faults.on(Kind::UsbStaleSuspend, now) {
                    device.latch_stale_suspend();
                }
                self.port = Port::Recovery(now + RECOVERY_NS);
            }
            Port::Recovery(until) if now >= until => self.enumerate(now),
            Port::Enumerating => self.control(now, device),
            Port::Configured => self.work(now, device),
            _ => {}
        }
        match self.port {
            Port::Enumerating | Port::Configured => now + TRANSACTION_NS,
            Port::Quiet(_) | Port::Suspended | Port::Resuming(_) => self.rest(now, device),
            _ => now + IDLE_NS,
        }
    }

    fn wait(&mut self, now: u64, what: &str, port: Port) {
        self.note(now, what);
        self.attempts = 0;
        self.port = port;
    }

    /// Handles a missing device or cable. A device on a cut cable sees the bus go idle.
    fn disconnected(&mut self, now: u64, device: &mut Core) -> u64 {
        if self.port != Port::Empty {
            self.note(now, "device gone");
            self.forget_device();
        }
        let since = *self.idle_since.get_or_insert(now);
        if device.attached() && now >= since + SUSPEND_NS {
            device.suspend();
        }
        now + IDLE_NS
    }

    fn forget_device(&mut self) {
        self.port = Port::Empty;
        self.transfer = None;
        self.queue.clear();
        self.function = None;
        self.announced_open = false;
        self.to_device.clear();
        if let Some(remote) = &mut self.remote {
            remote.forget();
        }
    }

    fn start_of_frame(&mut self, now: u64, device: &mut Core) {
        if matches!(self.port, Port::Enumerating | Port::Configured) && now >= self.next_frame_ns {
            self.next_frame_ns = now - now % 1_000_000 + 1_000_000;
            device.start_of_frame();
        }
    }

    fn reset_bus(&mut self, now: u64, device: &mut Core) {
        device.bus_reset();
        self.address = 0;
        self.attempts += 1;
        self.port = Port::Reset(now + RESET_NS);
    }

    fn enumerate(&mut self, now: u64) {
        let requests = self.remote.as_ref().map(Remote::requests);
        self.queue = requests.unwrap_or_else(control::enumeration).into();
        self.transfer = None;
        self.port = Port::Enumerating;
        self.next_transfer(now);
    }

    fn next_transfer(&mut self, now: u64) {
        self.transfer = self.queue.pop_front().map(|mut transfer| {
            transfer.begin(now + CONTROL_TIMEOUT_NS);
            transfer
        });
    }

    /// Carries out one transaction of the present control transfer.
    fn control(&mut self, now: u64, device: &mut Core) {
        let Some(transfer) = &mut self.transfer else {
            return;
        };
        match transfer.step(now, self.address, device) {
            Progress::Going => {}
            Progress::Done(data) => {
                let (name, title, anew) = (transfer.name, transfer.title(), transfer.begins_anew());
                self.note(now, &format!("{title}: {} bytes", data.len()));
                self.begin_anew(anew);
                self.transferred(now, name, &data);
            }
            Progress::Failed(why) => {
                let message = format!("{}: {}", transfer.title(), why.name());
                self.note(now, &message);
                self.counters.failed_transfers += 1;
                self.transfer_failed(now, device);
            }
        }
    }

    fn begin_anew(&mut self, which: Begins) {
        let Some(function) = self.function else {
            return;
        };
        let endpoints = [function.bulk_in as u8 | 0x80, function.bulk_out as u8];
        for (data1, endpoint) in self.data1.iter_mut().zip(endpoints) {
            *data1 &= match which {
                Begins::None => true,
                Begins::Endpoint(number) => number != endpoint,
                Begins::Interface(number) => number != function.data_interface,
                Begins::All => false,
            };
        }
    }

    fn transferred(&mut self, now: u64, name: &str, data: &[u8]) {
        if let Some(remote) = &mut self.remote {
            remote.has_read(name, data);
        }
        match name {
            control::SET_ADDRESS => self.address = control::ADDRESS,
            control::CONFIGURATION if self.remote.is_none() => match Function::parse(data) {
                Ok(function) => self.function = Some(function),
                Err(why) => {
                    self.note(now, &format!("not a CDC-ACM device: {why}"));
                    self.port = Port::Failed;
                    return;
                }
            },
            _ => {}
        }
        self.next_transfer(now);
        if self.transfer.is_none() && self.port == Port::Enumerating {
            self.note(now, "configured");
            self.counters.enumerations += 1;
            self.port = Port::Configured;
            if let Some(remote) = &mut self.remote {
                remote.begin(now);
            }
        }
    }

    fn transfer_failed(&mut self, now: u64, device: &mut Core) {
        if self.port == Port::Configured {
            return self.next_transfer(now);
        }
        if self.attempts < ATTEMPTS {
            return self.reset_bus(now, device);
        }
        self.note(now, "gave up");
        self.port = Port::Failed;
    }

    /// Serves a configured device: control transfers first, then bulk data in turn.
    fn work(&mut self, now: u64, device: &mut Core) {
        if self.remote.is_some() {
            return self.serve_client(now, device);
        }
        if self.transfer.is_none() && self.open != self.announced_open {
            self.tell_open(now);
        }
        if self.transfer.is_none() {
            self.next_transfer(now);
        }
        if self.transfer.is_some() {
            return self.control(now, device);
        }
        self.bulk_turn_in = !self.bulk_turn_in;
        let moved = if self.bulk_turn_in {
            self.bulk_in(now, device)
        } else {
            self.bulk_out(device)
        };
        if !moved {
            if self.bulk_turn_in {
                self.bulk_out(device)
            } else {
                self.bulk_in(now, device)
            };
        }
    }

    fn tell_open(&mut self, now: u64) {
        let interface = self
            .function
            .map_or(0, |function| function.control_interface);
        self.announced_open = self.open;
        self.queue.extend(control::line(interface, self.open));
        self.next_transfer(now);
    }

    fn bulk_in(&mut self, now: u64, device: &mut Core) -> bool {
        let Some(function) = self.function else {
            return false;
        };
        let refused = !self.open || !self.reading || self.faults.on(Kind::HostNotReading, now);
        if refused || self.from_device.len() > BACKLOG {
            return false;
        }
        let Answer::Ack(packet) = device.transmit(self.address, function.bulk_in) else {
            return false;
        };
        if packet.data1 != self.data1[0] {
            self.counters.repeated_packets += 1;
            return true;
        }
        self.data1[0] = !self.data1[0];
        self.counters.bytes_in += packet.bytes.len() as u64;
        self.counters.packets_in += 1;
        self.arrivals.packet(&packet.bytes, now + TRANSACTION_NS);
        self.from_device.extend(packet.bytes);
        true
    }

    fn bulk_out(&mut self, device: &mut Core) -> bool {
        let Some(function) = self.function else {
            return false;
        };
        let packet = Packet {
            bytes: self.to_device.iter().take(PACKET).copied().collect(),
            data1: self.data1[1],
        };
        if packet.bytes.is_empty()
            || device.receive(self.address, function.bulk_out, &packet) != Answer::Ack(())
        {
            return false;
        }
        self.data1[1] = !self.data1[1];
        self.to_device.drain(..packet.bytes.len());
        self.counters.bytes_out += packet.bytes.len() as u64;
        true
    }

    fn note(&mut self, now: u64, what: &str) {
        self.log.push(format!(
            "{}.{:03} ms {what}",
            now / 1_000_000,
            now / 1000 % 1000
        ));
    }
}
