//! Commands to a device, and what it logs meanwhile.

use crate::output::note;
use hivtac_host::failure::Failure;
use hivtac_host::link::{Link, log_text};
use hivtac_wire::message::{DeviceMessage, Request};
use hivtac_wire::settings::Selection;
use std::time::Duration;

/// Longest time that keeping may take: an erased sector takes 1 to 2 s, and a worn one is tried
/// again.
pub const KEEP_PATIENCE: Duration = Duration::from_secs(20);

/// Keeps these of the settings in use through restarts.
///
/// # Errors
/// What the device refuses.
pub fn keep(link: &mut Link, selection: Selection) -> Result<(), Failure> {
    send(link, Request::Keep(selection), KEEP_PATIENCE)
}

/// Sends a command and waits for its reply.
pub fn send(link: &mut Link, request: Request, wait: Duration) -> Result<(), Failure> {
    link.request(request, wait, show_log)
}

/// Shows a line that the device logs; of other messages nothing.
pub fn show_log(message: DeviceMessage) {
    if let DeviceMessage::Log(line) = message {
        note(&log_text(&line));
    }
}
