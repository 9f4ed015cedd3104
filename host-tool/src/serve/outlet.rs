//! Where messages go: what ROS 2 and Foxglove have in common.

use super::sensor::{TareOrder, Told};
use crate::ros::channel::{Channel, Frames};
use hivtac_wire::message::DeviceHello;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc::SyncSender;

/// Where messages go.
pub trait Outlet {
    /// Where it is: a word and its value, for the line that says so.
    fn told(&self) -> Vec<(&'static str, String)>;

    /// Publishes a device's message, CDR, that came at a time, ns since 1970; false when it could
    /// not.
    fn publish(&mut self, sensor: usize, channel: Channel, data: &[u8], came_ns: u64) -> bool;

    /// Publishes how a device stands.
    fn diagnostics(&mut self, data: &[u8], came_ns: u64);

    /// Does what there is to do besides.
    fn turn(&mut self) {}
}

/// A device, for the outlets.
pub struct Served {
    /// As the device said it first.
    pub hello: DeviceHello,
    /// Its own part of names, when it is one of several.
    pub name: Option<String>,
    /// The frames of its coordinates.
    pub frames: Frames,
    /// Where its orders go.
    pub orders: SyncSender<TareOrder>,
    /// Which way it is held, when it was told.
    pub down: Told,
    /// Samples that an outlet did not take.
    pub not_published: Arc<AtomicU64>,
}
