//! The interface that ROS 2 and Foxglove share for samples and states.

use super::sensor::{NextDown, TareOrder};
use hivtac_host::ros::channel::{Channel, Frames, GripChannel};
use hivtac_wire::message::DeviceHello;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc::SyncSender;

/// An outlet for messages.
pub trait Outlet {
    /// Its addresses: a word and its value each, for the line that begins with `ready`.
    fn addresses(&self) -> Vec<(&'static str, String)>;

    /// Publishes a device's message, as CDR, that was received at `came_ns`, ns since 1970. False
    /// if it could not be published.
    fn publish(&mut self, sensor: usize, channel: Channel, data: &[u8], came_ns: u64) -> bool;

    /// Publishes a message of the grip, as CDR, that was known at `came_ns`, ns since 1970. False
    /// if it could not be published.
    fn publish_grip(&mut self, channel: GripChannel, data: &[u8], came_ns: u64) -> bool;

    /// Publishes the state of devices.
    fn diagnostics(&mut self, data: &[u8], came_ns: u64);

    /// Does the outlet's own work.
    fn turn(&mut self) {}
}

/// A device, for the outlets.
pub struct Served {
    /// The device's first hello.
    pub hello: DeviceHello,
    /// Its part of names; `None` for a single device.
    pub name: Option<String>,
    /// Its coordinate frames.
    pub frames: Frames,
    /// The queue of its orders.
    pub orders: SyncSender<TareOrder>,
    /// The last direction of gravity that was not passed on yet.
    pub down: NextDown,
    /// Number of samples that an outlet did not take.
    pub not_published: Arc<AtomicU64>,
}
