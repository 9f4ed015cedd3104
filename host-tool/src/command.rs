//! `hivtac tare` and `hivtac threshold`: one command each.

use crate::output::{note, print};
use hivtac_host::failure::Failure;
use hivtac_host::link::{Link, log_text};
use hivtac_host::port::Address;
use hivtac_wire::message::{DeviceMessage, HsvBox, Request};
use std::time::Duration;

/// Time a device may need for a frame at its slowest; an emulated one is slower than a real one.
const SLOWEST_FRAME: Duration = Duration::from_millis(500);
/// Time a tare may need besides.
const TARE_PATIENCE: Duration = Duration::from_secs(10);

/// Takes the mean of the next `frames` good frames (1–256) as the rest position.
pub fn tare(address: &Address, patience: Duration, frames: u16) -> Result<(), Failure> {
    let wait = TARE_PATIENCE + SLOWEST_FRAME * frames.into();
    send(address, patience, Request::Tare { frames }, wait)?;
    print(&format!("tare taken over {frames} frames")).map(|_| ())
}

/// Sets the threshold until the device restarts.
pub fn threshold(address: &Address, patience: Duration, threshold: HsvBox) -> Result<(), Failure> {
    send(
        address,
        patience,
        Request::SetThreshold(threshold),
        patience,
    )?;
    print("threshold set").map(|_| ())
}

fn send(
    address: &Address,
    patience: Duration,
    request: Request,
    wait: Duration,
) -> Result<(), Failure> {
    let (mut link, _) = Link::connect(address, patience)?;
    link.request(request, wait, |message| {
        if let DeviceMessage::Log(line) = message {
            note(&log_text(&line));
        }
    })
}
