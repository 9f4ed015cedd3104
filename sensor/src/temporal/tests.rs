//! Provides forces for the tests of this folder.

use crate::force::{Force, Place, Polar};
use hivtac_terms::units::{
    MicroNewtons, Micrometres, SignedMicrometres, UnsignedMicroNewtons, UnsignedMilliDegrees,
};

/// A force by its vector, µN.
pub fn force_of(vector: [i32; 3]) -> Force {
    let cartesian = vector.map(MicroNewtons);
    let Polar {
        alpha,
        beta,
        magnitude,
    } = Polar::of_vector(cartesian);
    Force {
        alpha,
        beta,
        magnitude,
        cartesian,
        direction_sigma: UnsignedMilliDegrees(300),
        magnitude_sigma: UnsignedMicroNewtons(100),
        place: Some(Place {
            x: SignedMicrometres(0),
            y: SignedMicrometres(0),
            sigma: Micrometres(5),
        }),
        torque: None,
    }
}

/// A force straight into the film with its standard uncertainty, µN.
pub fn pressed(magnitude: i32, sigma: u32) -> Force {
    Force {
        magnitude_sigma: UnsignedMicroNewtons(sigma),
        ..force_of([0, 0, magnitude.saturating_neg()])
    }
}

use super::{Moment, Temporal};
use crate::force::features::Features;
use crate::force::rest::Rest;
use crate::markers::lost::Lost;
use crate::pipeline::Measurement;
use hivtac_terms::force::ContactList;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{Filter, TemporalError, TemporalSettings};
use hivtac_terms::units::{Milliseconds, Px};

/// A frame with a force, whose markers are shifted to the right by `right`.
pub fn frame(force: Option<Force>, right: Px) -> Measurement {
    let markers = rest(right).markers();
    Measurement {
        status: Status::NOT_CALIBRATED | Status::SLIP,
        markers: Some(markers),
        lost: Lost::NONE,
        features: Some(Features::of_markers(&markers)),
        force,
        contacts: ContactList::default(),
    }
}

/// A rest position shifted to the right by `right`.
pub fn rest(right: Px) -> Rest {
    let markers = [(100, 60), (210, 60), (210, 170), (100, 170)].map(|(x, y)| Marker {
        x: Px::from_int(x) + right,
        y: Px::from_int(y),
        area: 130,
    });
    Rest::of_markers(&markers)
}

/// The moment of a frame at 156 frames a second.
fn moment(frame: u32) -> Moment {
    Moment {
        frame,
        time_us: u64::from(frame) * 6_405,
    }
}

#[test]
fn contact_and_slip_do_not_know_of_the_filter() {
    let low_pass = TemporalSettings {
        filter: Filter::LowPass {
            time_constant: Milliseconds(500),
        },
        ..TemporalSettings::default()
    };
    let (mut unfiltered, mut filtered) = (Temporal::new(), Temporal::new());
    filtered.set(low_pass).unwrap();
    for number in 0..60 {
        let moved = 30 * (number as i32 - 30).max(0);
        let mut force = force_of([20_000, 0, -3_000 * number.min(30) as i32]);
        force.place = force.place.map(|place| Place {
            x: SignedMicrometres(moved),
            ..place
        });
        let seen = frame(Some(force), Px(0));
        let [a, b] = [&mut unfiltered, &mut filtered].map(|t| t.follow(moment(number), &seen));
        assert_eq!(a.status, b.status);
        assert_eq!(a.force.unwrap().cartesian, force.cartesian);
        if number == 59 {
            assert!(a.status.contains(Status::CONTACT | Status::SLIP));
            assert_ne!(b.force.unwrap().cartesian, force.cartesian);
        }
    }
}

#[test]
fn a_frame_without_a_force_has_neither_contact_nor_slip() {
    let mut temporal = Temporal::new();
    let pressed = frame(Some(pressed(50_000, 100)), Px(0));
    let followed = temporal.follow(moment(1), &pressed);
    assert!(followed.status.contains(Status::CONTACT));
    let followed = temporal.follow(moment(2), &frame(None, Px(0)));
    assert_eq!(followed.status, Status::NOT_CALIBRATED);
    assert_eq!(followed.force, None);
}

#[test]
fn settings_that_are_none_change_nothing_and_others_begin_anew() {
    let mut temporal = Temporal::new();
    let between = frame(Some(pressed(1_500, 100)), Px(0));
    temporal.follow(moment(1), &frame(Some(pressed(50_000, 100)), Px(0)));
    let mut bad = TemporalSettings::default();
    bad.contact.ends.0 = 0;
    assert_eq!(temporal.set(bad), Err(TemporalError::ContactEnds));
    let followed = temporal.follow(moment(2), &between);
    assert!(followed.status.contains(Status::CONTACT), "as before");
    temporal.set(TemporalSettings::default()).unwrap();
    let followed = temporal.follow(moment(3), &between);
    assert!(!followed.status.contains(Status::CONTACT), "by its own |F|");
}

/// After a minute at 100 mN, a film of unknown memory may show millinewtons that do not exist. They
/// are not a contact until they exceed the possible memory.
#[test]
fn what_a_film_may_remember_is_no_contact() {
    let mut temporal = Temporal::new();
    let mut reported = |number: u32, force: i32| {
        let mut seen = frame(Some(pressed(force, 100)), Px(0));
        seen.status |= Status::CONTACT;
        let followed = temporal.follow(moment(number), &seen);
        followed.status.contains(Status::CONTACT)
    };
    assert!((0..9_400).all(|number| reported(number, 100_000)));
    assert!(!reported(9_400, 4_000));
    assert!(reported(9_401, 30_000));
}

/// The mean place of two contacts moves with their forces, though neither does.
#[test]
fn a_sum_of_two_contacts_does_not_slip() {
    let mut temporal = Temporal::new();
    let mut slips = |number: u32, status: Status| {
        let mut force = force_of([20_000, 0, -60_000]);
        let moved_um = 40 * i32::try_from(number).unwrap();
        force.place = force.place.map(|place| Place {
            x: SignedMicrometres(moved_um),
            ..place
        });
        let mut measurement = frame(Some(force), Px(0));
        measurement.status |= status;
        let followed = temporal.follow(moment(number), &measurement);
        followed.status.contains(Status::SLIP)
    };
    assert!((0..20).any(|number| slips(number, Status::OK)), "one does");
    assert!(!(20..60).any(|number| slips(number, Status::TWO_CONTACTS)));
}
