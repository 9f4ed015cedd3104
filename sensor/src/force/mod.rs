//! Turns four markers into a force: in integers, and in single precision in [`forward`].
//!
//! ```text
//! 4 markers → 11 features → quantized MLP → (α, β, |F|) → force + status
//!                              └→ first guess → forward model → force, place + status
//! ```
//!
//! | module | subject |
//! |---|---|
//! | `features`, `rest` | the paper's eleven numbers, and those of the untouched film |
//! | `model`, `layer`, `packing` | the model file |
//! | `network`, `rescale` | the quantized network |
//! | `forward` | the forward model of the film, and Gauss–Newton steps on it |
//! | `contact`, `explained`, `noise`, `misfit`, `place` | the answer: force, uncertainty, status |
//! | `kernels` | the hottest loops, in assembly for Cortex-M4 and M7 |
//!
//! Film frame, right-handed: x right and y down in the image, z = x × y out of the film, away from
//! the camera.
//!
//! F = |F| · (sin α cos β, sin β, −cos α cos β): the stage of β carries that of α. A press has F_z
//! < 0. Inversely, α = atan2(Fx, −Fz), −180° < α ≤ 180°, and β = atan2(Fy, √(Fx² + Fz²)), −90° ≤ β
//! ≤ 90°. α is 0 if β = ±90° or F = 0; β is 0 if F = 0.
//!
//! Largest errors of the conversions, which the tests assert. Vector to angles: angles 0.51 m°, |F|
//! 0.5 µN. Angles to vector, each component: 0.6 µN up to 10 N, 9 µN at 2,147 N.

pub mod features;
pub mod forward;
pub mod layer;
pub mod model;
pub mod network;
pub mod packing;
pub mod rest;

mod contact;
mod explained;
mod kernels;
mod misfit;
mod noise;
#[cfg(test)]
mod numerics;
mod place;
mod rescale;
#[cfg(test)]
mod tests;
mod two;

pub use contact::{CONTACT_SIGMAS, LEAST_CONTACT, is_contact, is_force};
pub use explained::Resting;
pub use hivtac_terms::force::{Force, Place};
pub use noise::{FrameNoise, NoiseLevel};
pub use two::{Means, Pairs, TwoContacts};

use crate::force::model::{CalibratedRange, Model, OutputKind};
use crate::force::network::Output;
use hivtac_terms::angle::atan2;
use hivtac_terms::cordic::sin_cos;
use hivtac_terms::fixed::Q;
use hivtac_terms::root::rounded_root;
use hivtac_terms::status::Status;
use hivtac_terms::units::{
    MicroNewtons, Micrometres, MilliDegrees, SignedMicrometres, UnsignedMicroNewtons,
    UnsignedMilliDegrees,
};

/// A direction with a larger standard uncertainty counts as unreliable. The limit is half the
/// paper's range of ±10° (Section 4): beyond it little more than the sign of α is known.
pub const UNRELIABLE_DIRECTION: UnsignedMilliDegrees = UnsignedMilliDegrees(5_000);
/// How far beyond the calibrated range a force still counts as inside: one part in this many of
/// |F|. The largest forces of a training set come out slightly larger or smaller than they were.
pub const RANGE_MARGIN: i32 = 20;
/// The same margin for angles.
pub const ANGLE_MARGIN: MilliDegrees = MilliDegrees(1_000);

/// The same margin for each coordinate of the place.
pub const PLACE_MARGIN: Micrometres = Micrometres(250);

/// Direction and size of a force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Polar {
    /// α.
    pub alpha: MilliDegrees,
    /// β.
    pub beta: MilliDegrees,
    /// |F|, 0 to 2,147 N.
    pub magnitude: MicroNewtons,
}

impl Polar {
    /// The angles and size of a vector (Fx, Fy, Fz). |F| saturates at 2,147.483647 N.
    pub fn of_vector(vector: [MicroNewtons; 3]) -> Polar {
        let [x, y, z] = vector.map(|component| i64::from(component.0));
        let magnitude = rounded_root(vector.map(square).iter().sum());
        // Shifted until the largest component fills 31 bits, so that a small force keeps its
        // direction.
        let shift = (x.unsigned_abs() | y.unsigned_abs() | z.unsigned_abs()).leading_zeros();
        let [x, y, z] = [x, y, z].map(|component| component << shift.saturating_sub(33));
        let sideways = rounded_root(x.unsigned_abs().pow(2) + z.unsigned_abs().pow(2));
        Polar {
            alpha: atan2(x, -z),
            beta: atan2(y, sideways as i64),
            magnitude: MicroNewtons(i32::try_from(magnitude).unwrap_or(i32::MAX)),
        }
    }

    /// The vector (Fx, Fy, Fz).
    pub fn to_vector(self) -> [MicroNewtons; 3] {
        let (sin_alpha, cos_alpha) = sin_cos(self.alpha);
        let (sin_beta, cos_beta) = sin_cos(self.beta);
        let unit = [
            product(sin_alpha, cos_beta),
            sin_beta,
            -product(cos_alpha, cos_beta),
        ];
        unit.map(|part| {
            let component: Q<30, i64> =
                Q::from_bits(i64::from(part.bits()) * i64::from(self.magnitude.0));
            // A sine may exceed 1 in its last digit.
            let limits = (i64::from(-i32::MAX), i64::from(i32::MAX));
            MicroNewtons(component.rounded().clamp(limits.0, limits.1) as i32)
        })
    }
}

/// Returns the force that a model's outputs mean, and its status bits:
/// [`Status::MAGNITUDE_OUT_OF_RANGE`], [`Status::DIRECTION_OUT_OF_RANGE`],
/// [`Status::DIRECTION_UNRELIABLE`], [`Status::PLACE_OUT_OF_RANGE`] and [`Status::CONTACT`]. A
/// negative |F| from a model becomes 0.
pub fn of_outputs(model: &Model<'_>, output: &Output) -> (Force, Status) {
    let outputs = output.values;
    let (polar, vector) = match model.output {
        OutputKind::ForceVector | OutputKind::ForceAndPlace => {
            let vector = outputs.map(MicroNewtons);
            (Polar::of_vector(vector), vector)
        }
        OutputKind::AnglesMagnitude => {
            let polar = of_angles(outputs);
            (polar, polar.to_vector())
        }
    };
    let (direction_sigma, magnitude_sigma) = model.uncertainty.at(polar.magnitude);
    let force = Force {
        alpha: polar.alpha,
        beta: polar.beta,
        magnitude: polar.magnitude,
        cartesian: vector,
        direction_sigma,
        magnitude_sigma,
        place: place_of(model, output.place, polar.magnitude),
        torque: None,
    };
    let status = trust(&force, magnitude_sigma, &model.range);
    (force, status)
}

/// Returns the status bits of range, reliability and contact. `by_noise` is the standard
/// uncertainty of |F| by noise. The range of angles is checked only if the direction is reliable.
fn trust(force: &Force, by_noise: UnsignedMicroNewtons, range: &CalibratedRange) -> Status {
    let largest = range
        .magnitude
        .0
        .saturating_add(range.magnitude.0 / RANGE_MARGIN);
    let outside = |angle: MilliDegrees, limit: MilliDegrees| {
        angle.0.unsigned_abs() > (limit.0 + ANGLE_MARGIN.0).unsigned_abs()
    };
    let mut status = Status::OK;
    if force.direction_sigma > UNRELIABLE_DIRECTION {
        status |= Status::DIRECTION_UNRELIABLE;
    } else if outside(force.alpha, range.alpha) || outside(force.beta, range.beta) {
        status |= Status::DIRECTION_OUT_OF_RANGE;
    }
    if force.magnitude.0 > largest {
        status |= Status::MAGNITUDE_OUT_OF_RANGE;
    }
    if is_contact(force.magnitude, by_noise) {
        status |= Status::CONTACT;
        if (force.place).is_some_and(|place| place::is_beyond(&place, range.place)) {
            status |= Status::PLACE_OUT_OF_RANGE;
        }
    }
    status
}

/// The place at this |F|; `None` if the model has no place outputs.
fn place_of(model: &Model<'_>, [x, y]: [i32; 2], magnitude: MicroNewtons) -> Option<Place> {
    model.output.tells_place().then(|| Place {
        x: SignedMicrometres(x),
        y: SignedMicrometres(y),
        sigma: model.uncertainty.place_at(magnitude),
    })
}

/// α and β from the model's outputs, wrapped or limited to their ranges.
fn of_angles([alpha, beta, magnitude]: [i32; 3]) -> Polar {
    let turned = i64::from(alpha).rem_euclid(360_000) as i32;
    Polar {
        alpha: MilliDegrees(if turned > 180_000 {
            turned - 360_000
        } else {
            turned
        }),
        beta: MilliDegrees(beta.clamp(-90_000, 90_000)),
        magnitude: MicroNewtons(magnitude.max(0)),
    }
}

/// The product of two numbers within ±1 and a few steps of rounding.
fn product(a: Q<30>, b: Q<30>) -> Q<30> {
    let product: Q<60, i64> = Q::from_bits(i64::from(a.bits()) * i64::from(b.bits()));
    product.rounded_to().narrowed()
}

/// The square of a component: at most 2⁶², so that the sum of three fits 64 bits, unsigned.
fn square(value: MicroNewtons) -> u64 {
    u64::from(value.0.unsigned_abs()).pow(2)
}
