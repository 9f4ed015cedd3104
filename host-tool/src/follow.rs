//! Follows a device through as many connections as necessary.

use crate::output::note;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::stop;
use hivtac_wire::decoder::Rejected;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Request};
use std::time::{Duration, Instant};

/// Time between two calls of [`Follower::turn`] while there is no device.
const TURN_EVERY: Duration = Duration::from_millis(20);
/// Time between two attempts to connect again.
pub const RETRY_EVERY: Duration = Duration::from_millis(500);
/// Silence after which the device is asked whether the conversation still exists.
pub const SILENCE: Duration = Duration::from_secs(5);

/// Receives everything that happens with a device.
pub trait Follower {
    /// A message of the device arrived.
    fn message(&mut self, message: DeviceMessage);

    /// The connection was lost, with the counts of its decoder's rejects.
    fn lost(&mut self, failure: Failure, rejected: Rejected);

    /// The device is connected again.
    fn connected_again(&mut self, hello: DeviceHello);

    /// Samples are missing although the connection stands; `why` is the reason.
    fn trouble(&mut self, why: String);

    /// Does the follower's own work, with the device while it is connected. True if the device
    /// answered a request.
    ///
    /// # Errors
    /// When the connection was lost.
    fn turn(&mut self, link: Option<&mut Link>) -> Result<bool, Failure>;
}

/// Follows a connected device until the program is interrupted.
pub fn follow(address: &Address, patience: Duration, link: Link, follower: &mut impl Follower) {
    let mut connected = Some(link);
    while !stop::requested() {
        let Some(mut link) = connected.take() else {
            // Long enough for a person to notice the loss.
            wait(follower);
            connected = connect(address, patience, follower);
            continue;
        };
        if let Err(failure) = converse(&mut link, patience, follower) {
            follower.lost(failure, link.rejected());
        }
    }
}

/// Prints that a device is connected again, and how long it was away.
pub fn note_connected_again(port: &str, lost: Instant) {
    let seconds = lost.elapsed().as_secs_f32();
    note(&format!(
        "hivtac: connected again to {port} after {seconds:.1} s"
    ));
}

/// Waits [`RETRY_EVERY`] without a device.
fn wait(follower: &mut impl Follower) {
    let end = Instant::now() + RETRY_EVERY;
    while !stop::requested() && Instant::now() < end {
        // Without a connection there is no loss to report.
        let _ = follower.turn(None);
        std::thread::sleep(TURN_EVERY);
    }
}

fn connect(address: &Address, patience: Duration, follower: &mut impl Follower) -> Option<Link> {
    match Link::connect(address, patience) {
        Ok((link, hello)) => {
            follower.connected_again(hello);
            Some(link)
        }
        // The loss was reported already; a changed version of the firmware was not.
        Err(failure) if failure.kind == Kind::Version => {
            follower.trouble(failure.to_string());
            None
        }
        Err(_) => None,
    }
}

/// One connection, from its start of samples to its loss.
fn converse(
    link: &mut Link,
    patience: Duration,
    follower: &mut impl Follower,
) -> Result<(), Failure> {
    for request in [Request::GetInfo, Request::StartWithMarkers] {
        link.request(request, patience, |message| follower.message(message))?;
    }
    let mut heard = Instant::now();
    loop {
        if let Some(message) = link.receive(Instant::now() + TURN_EVERY)? {
            if matches!(message, DeviceMessage::Sample(_)) {
                heard = Instant::now();
            }
            follower.message(message);
        }
        if follower.turn(Some(link))? {
            heard = Instant::now();
        }
        if heard.elapsed() >= SILENCE {
            probe(link, patience, follower)?;
            heard = Instant::now();
        }
    }
}

/// Checks whether a silent device still takes part in this conversation.
fn probe(link: &mut Link, patience: Duration, follower: &mut impl Follower) -> Result<(), Failure> {
    if link.probe(patience, |message| follower.message(message))? {
        let why = "the device answers, but sends no samples: does its camera run?";
        follower.trouble(why.to_owned());
    }
    Ok(())
}
