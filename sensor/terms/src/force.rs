//! Defines the result of a frame: a force on the film, and where it touches.

use crate::list::List;
use crate::status::Status;
use crate::units::{
    MicroNewtons, Micrometres, MilliDegrees, NanoNewtonMetres, SignedMicrometres,
    UnsignedMicroNewtons, UnsignedMilliDegrees, UnsignedNanoNewtonMetres,
};

/// A force with its standard uncertainty. Film frame, right-handed: x right and y down in the
/// image, z = x × y out of the film, away from the camera. F = |F| · (sin α cos β, sin β, −cos α
/// cos β): a press has F_z < 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema),
    serde(default)
)]
pub struct Force {
    /// α.
    pub alpha: MilliDegrees,
    /// β.
    pub beta: MilliDegrees,
    /// |F| ≥ 0.
    pub magnitude: MicroNewtons,
    /// (Fx, Fy, Fz): |F| in the direction of α and β. If a model's angles are those of the pressing
    /// direction (`stick`, `slip`), the vector points along that.
    pub cartesian: [MicroNewtons; 3],
    /// Standard uncertainty of the direction, at most 180°: 95 of 100 true directions are within
    /// 1.731 times this angle of the one found.
    pub direction_sigma: UnsignedMilliDegrees,
    /// Standard uncertainty of |F|: 95 of 100 true values are within 1.960 times this.
    pub magnitude_sigma: UnsignedMicroNewtons,
    /// Where the tip touches the film; `None` if the model has no place outputs.
    pub place: Option<Place>,
    /// The torque about the film's normal; `None` if the frame does not show one: the contact
    /// explains the markers without it, or its effect on this layout is unknown.
    pub torque: Option<Torque>,
}

/// Most contacts that are resolved.
pub const MOST_CONTACTS: usize = 2;

/// The contacts that a frame's force is the sum of, if there are several.
pub type ContactList = List<Force, MOST_CONTACTS>;

/// Returns each contact of a frame with this status, each with its force and place. Two are the
/// `parts` of the frame's force, one is that force itself. The result is empty without a force or a
/// contact, or if two contacts are not resolved.
pub fn contacts<'a>(
    status: Status,
    force: Option<&'a Force>,
    parts: &'a ContactList,
) -> &'a [Force] {
    if !status.contains(Status::CONTACT) {
        return &[];
    }
    match status.contains(Status::TWO_CONTACTS) {
        true => parts,
        false => force.map_or(&[], core::slice::from_ref),
    }
}

/// The point of the film under the tip, named by its position at rest in the film frame; (0, 0) is
/// the film's middle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Place {
    /// Coordinate to the right in the image.
    pub x: SignedMicrometres,
    /// Coordinate down in the image.
    pub y: SignedMicrometres,
    /// Standard uncertainty of each coordinate: the root of half the trace of their 2×2 covariance.
    /// If the covariance is the same in all directions, 95 of 100 true places are within 2.448
    /// times this distance of the one found.
    pub sigma: Micrometres,
}

/// A torque about the place, along the film's normal there, as friction under a turning contact
/// brings it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Torque {
    /// Its component along z: positive from x towards y.
    pub z: NanoNewtonMetres,
    /// Standard uncertainty of that: 95 of 100 true values are within 1.960 times this.
    pub sigma: UnsignedNanoNewtonMetres,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_contact_is_named_once() {
        let [sum, a, b] = [5, 2, 3].map(|size| Force {
            magnitude: MicroNewtons(size),
            ..Force::default()
        });
        let (none, both) = (ContactList::default(), ContactList::from([a, b]));
        let two = Status::CONTACT | Status::TWO_CONTACTS;
        assert_eq!(contacts(Status::CONTACT, Some(&sum), &none), [sum]);
        assert_eq!(contacts(Status::OK, Some(&sum), &none), []);
        assert_eq!(contacts(Status::CONTACT, None, &none), []);
        assert_eq!(contacts(two, Some(&sum), &both), [a, b]);
        assert_eq!(contacts(two, Some(&sum), &none), []);
    }
}
