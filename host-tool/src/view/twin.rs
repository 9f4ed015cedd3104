//! `hivtac view --twin`: a simulated sensor in this program, whose film the page presses.

use super::{Opened, ViewArguments, open};
use crate::twin::Inside;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::live::hand::Hand;
use hivtac_host::page::{Feed, Fingers, Press, Sensor};
use hivtac_host::port::Address;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_wire::message::Request;
use std::sync::Arc;

/// Number of frames of the first tare.
const TARE_FRAMES: u16 = 64;

/// Starts a simulated sensor and connects to it. It is set up as a user would: it knows its tip,
/// and has a tare if nothing presses yet.
///
/// # Errors
/// When the scene or a file cannot be used.
pub fn open_twin(arguments: &ViewArguments) -> Result<(Sensor, Opened), Failure> {
    let hand = Hand::default();
    let inside = Inside::start(&arguments.simulated, hand.clone())?;
    let address = Address::parse(&inside.port);
    let feed = Arc::new(Feed::default());
    let of_twin = feed.clone();
    std::thread::spawn(move || inside.run(|frame| of_twin.truth(frame.of_page())));
    let (mut link, hello) = Link::connect(&address, arguments.timeout)?;
    let mut ask = |request| link.request(request, arguments.timeout, |_| {});
    ask(Request::SetContactShape(ContactShape::Needle))?;
    let frames = TARE_FRAMES;
    match ask(Request::Tare { frames }) {
        // Something presses: the page says that there is no tare.
        Err(failure) if failure.kind != Kind::Refused => return Err(failure),
        _ => {}
    }
    let (mut sensor, opened) = open(&address, (link, hello), feed, arguments);
    sensor.hand = Some(Box::new(move |fingers: Fingers| {
        hand.set(fingers.map(|press| press.and_then(Press::in_range)));
    }));
    Ok((sensor, opened))
}
