//! A device that is followed through as many connections as it takes.

use crate::output::note;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::stop;
use hivtac_wire::decoder::Rejected;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Request};
use std::time::{Duration, Instant};

/// Time between two turns of the follower.
const TURN_EVERY: Duration = Duration::from_millis(20);
/// Time between two attempts to connect again.
pub const RETRY_EVERY: Duration = Duration::from_millis(500);
/// Silence after which the device is asked whether it is still there.
pub const SILENCE: Duration = Duration::from_secs(5);

/// Whom everything about a device is told.
pub trait Follower {
    /// The device said something.
    fn message(&mut self, message: DeviceMessage);

    /// The connection was lost; what its decoder threw away.
    fn lost(&mut self, failure: Failure, rejected: Rejected);

    /// The device is there again.
    fn connected_again(&mut self, hello: DeviceHello);

    /// No samples come though nothing is lost, and why.
    fn trouble(&mut self, why: String);

    /// Does what there is to do besides, with the device while it is there. True when the device
    /// was asked something, and answered.
    ///
    /// # Errors
    /// That the connection was lost.
    fn turn(&mut self, link: Option<&mut Link>) -> Result<bool, Failure>;
}

/// Follows a device that is connected already, until the program is interrupted.
pub fn follow(address: &Address, patience: Duration, link: Link, follower: &mut impl Follower) {
    let mut connected = Some(link);
    while !stop::requested() {
        let Some(mut link) = connected.take() else {
            // Long enough for a person to see that it was lost.
            wait(follower);
            connected = connect(address, patience, follower);
            continue;
        };
        if let Err(failure) = converse(&mut link, patience, follower) {
            follower.lost(failure, link.rejected());
        }
    }
}

/// Says that a device is there again, since when it was lost.
pub fn note_connected_again(port: &str, lost: Instant) {
    let seconds = lost.elapsed().as_secs_f32();
    note(&format!(
        "hivtac: connected again to {port} after {seconds:.1} s"
    ));
}

/// Time without a device.
fn wait(follower: &mut impl Follower) {
    let end = Instant::now() + RETRY_EVERY;
    while !stop::requested() && Instant::now() < end {
        // There is no connection that could be lost.
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
        // What was lost is told already; another release of the firmware is news.
        Err(failure) if failure.kind == Kind::Version => {
            follower.trouble(failure.to_string());
            None
        }
        Err(_) => None,
    }
}

/// One connection, from the start of samples to its loss.
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

/// Finds out whether a silent device still knows of this conversation.
fn probe(link: &mut Link, patience: Duration, follower: &mut impl Follower) -> Result<(), Failure> {
    let asked = link.request(Request::GetInfo, patience, |message| {
        follower.message(message)
    });
    match asked {
        Err(failure) if failure.kind == Kind::Refused => {
            Err(link.lost("the device sends nothing and does not answer"))
        }
        Err(failure) => Err(failure),
        Ok(()) => {
            let why = "the device answers, but sends no samples: does its camera run?";
            follower.trouble(why.to_owned());
            Ok(())
        }
    }
}
