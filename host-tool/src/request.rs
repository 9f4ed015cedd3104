//! Sends commands to a device and shows its log lines meanwhile.

use crate::output::note;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_host::reply::{CAMERA_PATIENCE, KEEP_PATIENCE, log_text};
use hivtac_terms::camera::CameraSettings;
use hivtac_wire::message::{DeviceMessage, Request};
use hivtac_wire::settings::Selection;
use std::time::Duration;

/// Keeps the selected settings through restarts.
///
/// # Errors
/// When the device refuses or does not answer.
pub fn keep(link: &mut Link, selection: Selection) -> Result<(), Failure> {
    send(link, Request::Keep(selection), KEEP_PATIENCE)
}

/// Sets the camera; waits at least as long as its search for exposure takes.
///
/// # Errors
/// When the device refuses or does not answer.
pub fn set_camera(
    link: &mut Link,
    settings: CameraSettings,
    patience: Duration,
) -> Result<(), Failure> {
    let patience = patience.max(CAMERA_PATIENCE);
    send(link, Request::SetCamera(settings), patience)
}

/// Sends a command and waits at most `wait` for its reply.
pub fn send(link: &mut Link, request: Request, wait: Duration) -> Result<(), Failure> {
    link.request(request, wait, show_log)
}

/// Shows a log line of the device; ignores other messages.
pub fn show_log(message: DeviceMessage) {
    if let DeviceMessage::Log(line) = message {
        note(&log_text(&line));
    }
}
