//! Judges whether a force is right: within three of its stated standard uncertainties, or close
//! enough for practical use.

use std::format;
use std::string::String;
use std::vec::Vec;

use hivtac_sensor::force::Force;
use hivtac_sensor::pipeline::Measurement;
use hivtac_terms::status::Status;
use hivtac_twin::{Load, SceneError, Truth};

use crate::pictures::Random;

/// Largest error in standard uncertainties.
const SIGMAS: f64 = 3.0;
/// Errors up to these are never a fault, even beyond the stated uncertainty: of the direction,
/// degrees, of |F|, mN, and of the place, mm.
const NO_FAULT: [f64; 3] = [5.0, 5.0, 0.25];
/// Below this |F|, mN, there is no contact: direction and place have no meaning.
const LEAST_MN: f64 = 2.0;

/// The range of random contacts.
#[derive(Clone, Copy, Debug)]
pub struct Contacts {
    /// The smallest and the largest |F|, N.
    pub force_n: [f64; 2],
    /// The largest ratio of tangential to normal force.
    pub ratio: f64,
    /// The largest distance from the middle along x and y, mm.
    pub place_mm: f64,
}

impl Contacts {
    /// Returns a contact with uniform size, tilt, turn and place.
    ///
    /// # Errors
    /// If these ranges are impossible.
    pub fn draw(&self, random: &mut Random) -> Result<Load, SceneError> {
        let mut within = |from: f64, to: f64| {
            let part = random.between(0, 1 << 30) as f64 / f64::from(1 << 30);
            from + (to - from) * part
        };
        let size = within(self.force_n[0], self.force_n[1]);
        let ratio = within(0.0, self.ratio);
        let (sin, cos) = within(0.0, std::f64::consts::TAU).sin_cos();
        let normal = size / ratio.hypot(1.0);
        let vector = [normal * ratio * cos, normal * ratio * sin, -normal];
        let place = [0; 2].map(|_: u8| within(-self.place_mm, self.place_mm));
        Ok(Load::from_vector(vector)?.with_offset_mm(place)?)
    }
}

/// The judgement of a frame's result.
#[derive(Clone, Debug, PartialEq)]
pub enum Judged {
    /// The force is right.
    Right,
    /// There is no force, for this status's reasons.
    Refused(Status),
    /// The force is wrong; the text describes the error.
    Wrong(String),
}

impl Judged {
    /// Judges a measurement by the frame's ground truth.
    pub fn of(seen: &Measurement, truth: &Truth) -> Judged {
        let Some(force) = &seen.force else {
            return Judged::Refused(seen.status);
        };
        let errors = errors(force, truth);
        let allowed = [
            f64::from(force.direction_sigma.0) * 1e-3,
            f64::from(force.magnitude_sigma.0) * 1e-3,
            force
                .place
                .map_or(0.0, |place| f64::from(place.sigma.0) * 1e-3),
        ];
        let limits: [f64; 3] = std::array::from_fn(|k| NO_FAULT[k].max(SIGMAS * allowed[k]));
        match errors
            .iter()
            .zip(&limits)
            .all(|(error, limit)| error <= limit)
        {
            true => Judged::Right,
            false => Judged::Wrong(format!(
                "{:?} N at {:?} mm: off by {errors:.3?} (°, mN, mm), may be {limits:.3?}, {}",
                truth.on_film_n,
                truth.touches_mm,
                seen.status.names().collect::<Vec<_>>().join(" ")
            )),
        }
    }
}

/// Returns the errors of a force: of the direction, degrees, of |F|, mN, and of the place, mm.
pub fn errors(force: &Force, truth: &Truth) -> [f64; 3] {
    let found = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
    let [size, true_size] = [found, truth.on_film_n].map(length);
    let off_mn = 1e3 * (size - true_size).abs();
    let touches = 1e3 * size.min(true_size) >= LEAST_MN;
    let (true, Some([x, y]), Some(place)) = (touches, truth.touches_mm, force.place) else {
        return [0.0, off_mn, 0.0];
    };
    let dot: f64 = found.iter().zip(truth.on_film_n).map(|(a, b)| a * b).sum();
    let angle = (dot / (size * true_size)).clamp(-1.0, 1.0).acos();
    let far = [
        f64::from(place.x.0) * 1e-3 - x,
        f64::from(place.y.0) * 1e-3 - y,
    ];
    [angle.to_degrees(), off_mn, far[0].hypot(far[1])]
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}
