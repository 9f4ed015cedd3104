//! What a sample is in ROS 2: the channels of a sensor, and the message of each.

use super::{Definition, bool, point, polygon, string, wrench};
use hivtac_terms::status::Status;
use hivtac_wire::message::Sample;

/// A channel of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Force and torque.
    Wrench,
    /// Where the tip touches.
    Place,
    /// The four markers.
    Markers,
    /// Whether something touches the film.
    Contact,
    /// Whether what touches the film slips.
    Slip,
    /// Names of the status bits that are set.
    Status,
}

impl Channel {
    /// All, in the order of their numbers.
    pub const ALL: [Channel; 6] = [
        Channel::Wrench,
        Channel::Place,
        Channel::Markers,
        Channel::Contact,
        Channel::Slip,
        Channel::Status,
    ];

    /// Its name below that of the sensor.
    pub fn name(self) -> &'static str {
        match self {
            Channel::Wrench => "wrench",
            Channel::Place => "place",
            Channel::Markers => "markers",
            Channel::Contact => "contact",
            Channel::Slip => "slip",
            Channel::Status => "status",
        }
    }

    /// The kind of its messages.
    pub fn definition(self) -> &'static Definition {
        match self {
            Channel::Wrench => &super::WRENCH,
            Channel::Place => &super::POINT,
            Channel::Markers => &super::POLYGON,
            Channel::Contact | Channel::Slip => &super::BOOL,
            Channel::Status => &super::STRING,
        }
    }
}

/// What the topics of a sensor with this serial number begin with, in recordings and for Foxglove.
pub fn topic_of(unit: &str) -> String {
    format!("/hivtac/unit_{unit}")
}

/// The frames that coordinates of a sensor are in.
#[derive(Clone, Debug)]
pub struct Frames {
    /// Of forces and places: x to the right in the image, y down; a press has z < 0.
    film: String,
    /// Of the markers.
    image: String,
}

impl Frames {
    /// That of forces and places.
    #[cfg(feature = "ros2")]
    pub fn film(&self) -> &str {
        &self.film
    }

    /// `NAME_film` and `NAME_image`.
    pub fn of(name: &str) -> Frames {
        Frames {
            film: format!("{name}_film"),
            image: format!("{name}_image"),
        }
    }
}

/// The messages of a sample whose frame was exposed at a time since 1970, ns, each as CDR: wrench,
/// contact and slip where there is a force, and a place or markers where they are known.
pub fn messages(sample: &Sample, stamp_ns: u64, frames: &Frames) -> Vec<(Channel, Vec<u8>)> {
    let Sample {
        force,
        markers,
        status,
        ..
    } = sample;
    let mut messages = Vec::with_capacity(Channel::ALL.len());
    if let Some(force) = force {
        messages.push((Channel::Wrench, wrench(stamp_ns, &frames.film, force)));
        let place = point(stamp_ns, &frames.film, force);
        messages.extend(place.map(|place| (Channel::Place, place)));
        for (channel, bit) in [
            (Channel::Contact, Status::CONTACT),
            (Channel::Slip, Status::SLIP),
        ] {
            messages.push((channel, bool(status.contains(bit))));
        }
    }
    if let Some(markers) = markers {
        messages.push((Channel::Markers, polygon(stamp_ns, &frames.image, markers)));
    }
    let names: Vec<_> = status.names().collect();
    messages.push((Channel::Status, string(&names.join(" "))));
    messages
}
