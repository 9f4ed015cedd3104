//! A sample as C reads it.

use hivtac_host::force_fields::{FORCE, PLACE};
use hivtac_host::reader::Arrived;
use hivtac_terms::force::Force;
use hivtac_terms::status::Status;

/// `hivtac_sample` of `include/hivtac.h`, field by field.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CSample {
    time_us: u64,
    arrived_ns: u64,
    sequence: u32,
    frame: u32,
    status: u32,
    has_force: u8,
    has_place: u8,
    contact: u8,
    slip: u8,
    force_n: [f64; 3],
    torque_nm: [f64; 3],
    magnitude_n: f64,
    magnitude_sigma_n: f64,
    direction_sigma_rad: f64,
    force_covariance: [f64; 9],
    place_m: [f64; 2],
    place_sigma_m: f64,
}

impl From<&Arrived> for CSample {
    fn from(arrived: &Arrived) -> CSample {
        let sample = &arrived.sample;
        let status = sample.status;
        let mut told = CSample {
            time_us: sample.time_us,
            arrived_ns: arrived.came_ns,
            sequence: sample.sequence,
            frame: sample.frame,
            status: status.0,
            contact: status.contains(Status::CONTACT).into(),
            slip: status.contains(Status::SLIP).into(),
            ..UNKNOWN
        };
        if let Some(force) = &sample.force {
            told.set(force);
        }
        told
    }
}

/// Without a force.
const UNKNOWN: CSample = CSample {
    time_us: 0,
    arrived_ns: 0,
    sequence: 0,
    frame: 0,
    status: 0,
    has_force: 0,
    has_place: 0,
    contact: 0,
    slip: 0,
    force_n: [f64::NAN; 3],
    torque_nm: [f64::NAN; 3],
    magnitude_n: f64::NAN,
    magnitude_sigma_n: f64::NAN,
    direction_sigma_rad: f64::NAN,
    force_covariance: [f64::NAN; 9],
    place_m: [f64::NAN; 2],
    place_sigma_m: f64::NAN,
};

impl CSample {
    fn set(&mut self, force: &Force) {
        let [_, _, size, x, y, z, angle_sigma, size_sigma] = FORCE.map(|it| it.si(force));
        self.has_force = 1;
        self.force_n = [x, y, z];
        self.torque_nm = [0.0; 3];
        self.magnitude_n = size;
        self.magnitude_sigma_n = size_sigma;
        self.direction_sigma_rad = angle_sigma;
        self.force_covariance = covariance([x, y, z], size_sigma, angle_sigma);
        if let Some(place) = &force.place {
            let [right, down, sigma] = PLACE.map(|it| it.si(place));
            self.has_place = 1;
            self.place_m = [right, down];
            self.place_sigma_m = sigma;
            self.torque_nm = [down * z, -right * z, right * y - down * x];
        }
    }
}

/// The covariance of a force, N², row by row. Along the force it is that of its size. Across it,
/// the direction's uncertainty has two equal parts, one for each way.
fn covariance(force: [f64; 3], size_sigma: f64, angle_sigma: f64) -> [f64; 9] {
    let square: f64 = force.iter().map(|part| part * part).sum();
    let across = square * angle_sigma.powi(2) / 2.0;
    std::array::from_fn(|index| {
        let (row, column) = (index / 3, index % 3);
        let same = if row == column { 1.0 } else { 0.0 };
        let along = match square > 0.0 {
            true => force[row] * force[column] / square,
            // Without a direction the size is uncertain every way.
            false => same,
        };
        along * size_sigma.powi(2) + (same - along) * across
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_covariance_is_that_of_size_along_and_direction_across() {
        let near = |found: [f64; 9], wanted: [f64; 9]| {
            let pairs = found.into_iter().zip(wanted);
            for (found, wanted) in pairs {
                assert!((found - wanted).abs() < 1e-15, "{found} {wanted}");
            }
        };
        let (size, angle) = (1e-3, 0.02);
        let across = (0.1 * angle) * (0.1 * angle) / 2.0;
        let wanted = [across, 0.0, 0.0, 0.0, across, 0.0, 0.0, 0.0, 1e-6];
        near(covariance([0.0, 0.0, -0.1], size, angle), wanted);
        // Turned into x and z by 45°.
        let part = 0.1 / f64::sqrt(2.0);
        let turned = covariance([part, 0.0, -part], size, angle);
        let (sum, less) = ((across + 1e-6) / 2.0, (across - 1e-6) / 2.0);
        near(turned, [sum, 0.0, less, 0.0, across, 0.0, less, 0.0, sum]);
        near(
            covariance([0.0; 3], size, angle),
            [1e-6, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-6],
        );
    }
}
