//! A sample as C reads it.

use hivtac_host::force_fields::{FORCE, place_si, torque_nm, torque_si};
use hivtac_host::grip::matrix::covariance;
use hivtac_host::reader::Arrived;
use hivtac_terms::force::{Force, MOST_CONTACTS};
use hivtac_terms::status::Status;

/// `hivtac_contact` of `include/hivtac.h`, field by field.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CContact {
    force_n: [f64; 3],
    magnitude_n: f64,
    magnitude_sigma_n: f64,
    direction_sigma_rad: f64,
    place_m: [f64; 2],
    place_sigma_m: f64,
}

/// `hivtac_sample` of `include/hivtac.h`, field by field.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CSample {
    time_us: u64,
    arrived_ns: u64,
    exposed_ns: u64,
    sequence: u32,
    frame: u32,
    status: u32,
    has_force: u8,
    has_place: u8,
    contact: u8,
    slip: u8,
    force_n: [f64; 3],
    torque_nm: [f64; 3],
    torque_z_nm: f64,
    torque_sigma_nm: f64,
    magnitude_n: f64,
    magnitude_sigma_n: f64,
    direction_sigma_rad: f64,
    force_covariance: [f64; 9],
    place_m: [f64; 2],
    place_sigma_m: f64,
    contact_count: u64,
    contacts: [CContact; MOST_CONTACTS],
}

impl From<&Arrived> for CSample {
    fn from(arrived: &Arrived) -> CSample {
        let sample = &arrived.sample;
        let status = sample.status;
        let mut numbers = CSample {
            time_us: sample.time_us,
            arrived_ns: arrived.came_ns,
            exposed_ns: arrived.exposed_ns,
            sequence: sample.sequence,
            frame: sample.frame,
            status: status.0,
            contact: status.contains(Status::CONTACT).into(),
            slip: status.contains(Status::SLIP).into(),
            ..UNKNOWN
        };
        let contacts = sample.each_contact();
        if let Some(force) = &sample.force {
            numbers.set(force);
            numbers.torque_nm = torque_nm(force, contacts);
            [numbers.torque_z_nm, numbers.torque_sigma_nm] = torque_si(force);
        }
        numbers.contact_count = contacts.len() as u64;
        for (place, contact) in numbers.contacts.iter_mut().zip(contacts) {
            *place = CContact::from(contact);
        }
        numbers
    }
}

/// Without a force.
const UNKNOWN: CSample = CSample {
    time_us: 0,
    arrived_ns: 0,
    exposed_ns: 0,
    sequence: 0,
    frame: 0,
    status: 0,
    has_force: 0,
    has_place: 0,
    contact: 0,
    slip: 0,
    force_n: [f64::NAN; 3],
    torque_nm: [f64::NAN; 3],
    torque_z_nm: f64::NAN,
    torque_sigma_nm: f64::NAN,
    magnitude_n: f64::NAN,
    magnitude_sigma_n: f64::NAN,
    direction_sigma_rad: f64::NAN,
    force_covariance: [f64::NAN; 9],
    place_m: [f64::NAN; 2],
    place_sigma_m: f64::NAN,
    contact_count: 0,
    contacts: [CContact {
        force_n: [f64::NAN; 3],
        magnitude_n: f64::NAN,
        magnitude_sigma_n: f64::NAN,
        direction_sigma_rad: f64::NAN,
        place_m: [f64::NAN; 2],
        place_sigma_m: f64::NAN,
    }; MOST_CONTACTS],
};

impl From<&Force> for CContact {
    fn from(force: &Force) -> CContact {
        let [_, _, size, x, y, z, angle_sigma, size_sigma] = FORCE.map(|it| it.si(force));
        let [right, down, sigma] = place_si(force);
        CContact {
            force_n: [x, y, z],
            magnitude_n: size,
            magnitude_sigma_n: size_sigma,
            direction_sigma_rad: angle_sigma,
            place_m: [right, down],
            place_sigma_m: sigma,
        }
    }
}

impl CSample {
    fn set(&mut self, force: &Force) {
        let of_one = CContact::from(force);
        let (size_sigma, angle_sigma) = (of_one.magnitude_sigma_n, of_one.direction_sigma_rad);
        let covariance = covariance(of_one.force_n, size_sigma, angle_sigma);
        self.has_force = 1;
        self.has_place = force.place.is_some().into();
        self.force_n = of_one.force_n;
        self.magnitude_n = of_one.magnitude_n;
        self.magnitude_sigma_n = size_sigma;
        self.direction_sigma_rad = angle_sigma;
        self.force_covariance = std::array::from_fn(|index| covariance[index / 3][index % 3]);
        self.place_m = of_one.place_m;
        self.place_sigma_m = of_one.place_sigma_m;
    }
}
