//! The host as another program's port: the device is introduced to it, its transfers are carried
//! out, and the port is reset, suspended and resumed for it.

use super::control::{self, Transfer};
use super::descriptors::Outline;
use super::urbs::{Done, Turn, Urb, Urbs};
use super::{Host, IDLE_NS, Port, SUSPEND_NS, TRANSACTION_NS};
use crate::peripherals::otg::Core;

/// Time without a transfer after which the port is suspended, ns. A client does not report a
/// suspend of its port, but has no transfer then.
const QUIET_NS: u64 = 50_000_000;
/// Duration of a resume and of the recovery after it, ns (USB 2.0, section 7.1.7.7).
const RESUME_NS: u64 = 30_000_000;

/// The port of a client.
#[derive(Debug, Default)]
pub struct Remote {
    urbs: Urbs,
    outline: Outline,
    device: [u8; 18],
    /// Whether the descriptors are those of the device that is there.
    is_known: bool,
    /// Whether the cable was pulled since the last look at the port.
    was_pulled: bool,
    /// Time of the last transfer, ns.
    busy_at: u64,
}

/// The state of a client's port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Presence {
    /// No device yet.
    None,
    /// A device that is ready for transfers.
    Ready(Description),
    /// A device that did not answer as one.
    Failed,
}

/// A device's description for a client.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// The device descriptor, 18 bytes.
    pub device: [u8; 18],
    /// Number of the configuration.
    pub configuration: u8,
    /// Class, subclass and protocol of each interface.
    pub interfaces: Vec<[u8; 3]>,
}

impl Remote {
    /// Returns the host's requests after a reset of the port.
    pub(super) fn requests(&self) -> Vec<Transfer> {
        match self.is_known {
            true => vec![control::set_address()],
            false => control::introduction(),
        }
    }

    /// Keeps the data that one of these requests has read.
    pub(super) fn has_read(&mut self, name: &str, data: &[u8]) {
        match (name, data.try_into()) {
            (control::DEVICE, Ok(device)) => self.device = device,
            (control::CONFIGURATION, _) => {
                (self.outline, self.is_known) = (Outline::of(data), true)
            }
            _ => {}
        }
    }

    /// The port begins to work.
    pub(super) fn begin(&mut self, now: u64) {
        self.busy_at = now;
        self.urbs.restart();
    }

    /// The device is gone.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }
}

impl Host {
    /// Leaves everything but the port itself to a client; no cable is plugged in.
    #[must_use]
    pub fn of_client(self) -> Self {
        Self {
            remote: Some(Remote::default()),
            cable: false,
            ..self
        }
    }

    /// Plugs the cable in for a client, or pulls it, with the transfers that wait.
    pub fn set_client(&mut self, there: bool) {
        self.cable = there;
        if let (false, Some(remote)) = (there, &mut self.remote) {
            remote.forget();
            remote.was_pulled = true;
        }
    }

    /// Returns whether a client's cable was pulled since the last look, even if one is plugged in
    /// again.
    pub(super) fn was_pulled(&mut self) -> bool {
        let remote = self.remote.as_mut();
        remote.is_some_and(|remote| std::mem::take(&mut remote.was_pulled))
    }

    /// Returns the state of a client's port.
    pub fn presence(&self) -> Presence {
        let works = matches!(
            self.port,
            Port::Configured | Port::Quiet(_) | Port::Suspended | Port::Resuming(_)
        );
        match &self.remote {
            _ if self.port == Port::Failed => Presence::Failed,
            Some(remote) if works && remote.is_known => Presence::Ready(Description {
                device: remote.device,
                configuration: remote.outline.configuration,
                interfaces: remote.outline.interfaces.clone(),
            }),
            _ => Presence::None,
        }
    }

    /// Returns whether a client's device has left, or was given up.
    pub fn has_lost_device(&self) -> bool {
        let is_known = self.remote.as_ref().is_some_and(|remote| remote.is_known);
        !is_known || self.port == Port::Failed
    }

    /// Adds a client's transfer.
    ///
    /// # Errors
    /// If too many wait.
    pub fn submit(&mut self, urb: Urb) -> anyhow::Result<()> {
        self.remote
            .as_mut()
            .map_or(Ok(()), |remote| remote.urbs.submit(urb))
    }

    /// Takes a client's transfer back; returns its status, 0 if it has ended before.
    pub fn unlink(&mut self, number: u32) -> i32 {
        let remote = self.remote.as_mut();
        remote.map_or(0, |remote| remote.urbs.unlink(number))
    }

    /// Returns the next end of a transfer.
    pub fn next_done(&mut self) -> Option<Done> {
        self.remote.as_mut()?.urbs.done.pop_front()
    }

    /// Carries out a transaction of a client, and suspends the port when it has none.
    pub(super) fn serve_client(&mut self, now: u64, device: &mut Core) {
        let Some(remote) = &mut self.remote else {
            return;
        };
        if remote.urbs.waiting() == 0 {
            if now >= remote.busy_at + QUIET_NS {
                self.port = Port::Quiet(now + SUSPEND_NS);
            }
            return;
        }
        remote.busy_at = now;
        match remote.urbs.step(now, self.address, &remote.outline, device) {
            Turn::Over([bytes_in, bytes_out]) => {
                self.counters.bytes_in += bytes_in as u64;
                self.counters.packets_in += u64::from(bytes_in > 0);
                self.counters.bytes_out += bytes_out as u64;
                self.counters.repeated_packets = remote.urbs.repeated;
            }
            Turn::PortReset => {
                self.note(now, "port reset");
                self.counters.port_resets += 1;
                self.attempts = 0;
                self.reset_bus(now, device);
            }
        }
    }

    /// Suspends a quiet port in time, and resumes it for the next transfer. Returns the time of the
    /// next call, ns.
    pub(super) fn rest(&mut self, now: u64, device: &mut Core) -> u64 {
        let waiting = (self.remote.as_ref()).map_or(0, |remote| remote.urbs.waiting());
        match self.port {
            Port::Quiet(_) if waiting > 0 => self.work_again(now),
            Port::Quiet(until) if now >= until => {
                device.suspend();
                self.note(now, "port suspended");
                self.counters.suspends += 1;
                self.port = Port::Suspended;
            }
            Port::Suspended if waiting > 0 => {
                device.resume();
                self.note(now, "port resumed");
                self.port = Port::Resuming(now + RESUME_NS);
            }
            Port::Resuming(until) if now >= until => self.work_again(now),
            _ => return now + IDLE_NS,
        }
        now + TRANSACTION_NS
    }

    fn work_again(&mut self, now: u64) {
        self.port = Port::Configured;
        if let Some(remote) = &mut self.remote {
            remote.busy_at = now;
        }
    }
}
