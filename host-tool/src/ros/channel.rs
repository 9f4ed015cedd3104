//! Converts a sample to messages of ROS 2: the channels of a sensor, and the message of each.

use super::{Definition, bool, contacts, number, point, polygon, string, wrench, wrench_of};
use crate::grip::{Grip, lines};
use hivtac_terms::status::Status;
use hivtac_wire::message::Sample;

/// A channel of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Force and torque.
    Wrench,
    /// The place where the tip touches.
    Place,
    /// Each contact, with its force and place.
    Contacts,
    /// The markers.
    Markers,
    /// Whether something touches the film.
    Contact,
    /// Whether the contact slips.
    Slip,
    /// Names of the status bits that are set.
    Status,
}

impl Channel {
    /// All channels, in the order of their numbers.
    pub const ALL: [Channel; 7] = [
        Channel::Wrench,
        Channel::Place,
        Channel::Contacts,
        Channel::Markers,
        Channel::Contact,
        Channel::Slip,
        Channel::Status,
    ];

    /// Its name below the sensor's.
    pub fn name(self) -> &'static str {
        match self {
            Channel::Wrench => "wrench",
            Channel::Place => "place",
            Channel::Contacts => "contacts",
            Channel::Markers => "markers",
            Channel::Contact => "contact",
            Channel::Slip => "slip",
            Channel::Status => "status",
        }
    }

    /// The definition of its messages.
    pub fn definition(self) -> &'static Definition {
        match self {
            Channel::Wrench => &super::WRENCH,
            Channel::Place => &super::POINT,
            Channel::Contacts => &super::CONTACTS,
            Channel::Markers => &super::POLYGON,
            Channel::Contact | Channel::Slip => &super::BOOL,
            Channel::Status => &super::STRING,
        }
    }
}

/// A channel of a grip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GripChannel {
    /// Common force and torque.
    Wrench,
    /// The force that squeezes, N.
    Force,
    /// Its standard uncertainty, N.
    ForceSigma,
    /// How much more pull there may be, N.
    Margin,
    /// Its standard uncertainty, N.
    MarginSigma,
    /// Why there is no grip, else the status of both fingers.
    Status,
}

impl GripChannel {
    /// All channels, in the order of their numbers.
    pub const ALL: [GripChannel; 6] = [
        GripChannel::Wrench,
        GripChannel::Force,
        GripChannel::ForceSigma,
        GripChannel::Margin,
        GripChannel::MarginSigma,
        GripChannel::Status,
    ];

    /// Its name below the grip's.
    pub fn name(self) -> &'static str {
        match self {
            GripChannel::Wrench => "wrench",
            GripChannel::Force => "force",
            GripChannel::ForceSigma => "force_sigma",
            GripChannel::Margin => "margin",
            GripChannel::MarginSigma => "margin_sigma",
            GripChannel::Status => "status",
        }
    }

    /// The definition of its messages.
    pub fn definition(self) -> &'static Definition {
        match self {
            GripChannel::Wrench => &super::WRENCH,
            GripChannel::Status => &super::STRING,
            _ => &super::FLOAT64,
        }
    }
}

/// The messages of a grip, each as CDR: one for each channel, in their order. Unknown numbers are
/// NaN. `frame` is the grip's.
pub fn grip_messages(grip: &Grip, frame: &str, names: &[String; 2]) -> Vec<(GripChannel, Vec<u8>)> {
    let held = grip.held.as_ref().ok();
    let vectors = [
        held.map(|held| held.common),
        held.and_then(|held| held.torque.map(|(torque, _)| torque)),
    ];
    let [force, torque] = vectors.map(|vector| vector.unwrap_or([f64::NAN; 3]));
    let numbers = held.map(|it| [it.force, it.force_sigma, it.margin, it.margin_sigma]);
    let [size, size_sigma, margin, margin_sigma] = numbers.unwrap_or([f64::NAN; 4]).map(number);
    let status = lines::cause(grip, names).unwrap_or_else(|| lines::status(grip, names));
    let bodies = [
        wrench_of(grip.stamp_ns, frame, force, torque),
        size,
        size_sigma,
        margin,
        margin_sigma,
        string(&status),
    ];
    GripChannel::ALL.into_iter().zip(bodies).collect()
}

/// The beginning of the topics of a grip, in recordings and for Foxglove.
pub const GRIP_TOPIC: &str = "/hivtac/grip";

/// The beginning of the topics of a sensor with this serial number, in recordings and for Foxglove.
pub fn topic_of(unit: &str) -> String {
    format!("/hivtac/unit_{unit}")
}

/// The coordinate frames of a sensor.
#[derive(Clone, Debug)]
pub struct Frames {
    /// Frame of forces and places: x to the right in the image, y down; a press has z < 0.
    film: String,
    /// Frame of the markers.
    image: String,
}

impl Frames {
    /// The frame of forces and places.
    #[cfg(feature = "ros2")]
    pub fn film(&self) -> &str {
        &self.film
    }

    /// The frames `NAME_film` and `NAME_image`.
    pub fn of(name: &str) -> Frames {
        Frames {
            film: format!("{name}_film"),
            image: format!("{name}_image"),
        }
    }
}

/// The messages of a sample, each as CDR. `stamp_ns` is the time of the frame's exposure, ns since
/// 1970. Wrench, contacts, contact and slip need a force; place and markers must be known.
pub fn messages(sample: &Sample, stamp_ns: u64, frames: &Frames) -> Vec<(Channel, Vec<u8>)> {
    let Sample { force, status, .. } = sample;
    let mut messages = Vec::with_capacity(Channel::ALL.len());
    if let Some(force) = force {
        let wrench = wrench(stamp_ns, &frames.film, force, sample.each_contact());
        messages.push((Channel::Wrench, wrench));
        let place = point(stamp_ns, &frames.film, force);
        messages.extend(place.map(|place| (Channel::Place, place)));
        let each = contacts(stamp_ns, &frames.film, sample.each_contact());
        messages.push((Channel::Contacts, each));
        for (channel, bit) in [
            (Channel::Contact, Status::CONTACT),
            (Channel::Slip, Status::SLIP),
        ] {
            messages.push((channel, bool(status.contains(bit))));
        }
    }
    if let Some(markers) = sample.found() {
        messages.push((Channel::Markers, polygon(stamp_ns, &frames.image, markers)));
    }
    let names: Vec<_> = status.names().collect();
    messages.push((Channel::Status, string(&names.join(" "))));
    messages
}
