//! What two fingers feel together: grip force, common wrench and friction margin.
//!
//! With F₁, F₂ the forces on the films, turned into the grip's frame, c₁, c₂ the places where they
//! act, and e the direction from the first film's middle to the second's:
//!
//! - grip force: ½ (F₂ − F₁) · e, the part of the forces that squeezes;
//! - common wrench: F₁ + F₂ and c₁ × F₁ + c₂ × F₂, what the object does to both fingers. An object
//!   that is held still shows its weight;
//! - friction margin: the smaller one of μ N − T, of a finger pressed with N along its film's z and
//!   pulled with T across: the pull that is left before the object slips.
//!
//! Standard uncertainties come from those of both forces and places, to first order.

pub mod geometry;
pub mod lines;
pub mod matrix;
pub mod pair;

use crate::force_fields::{FORCE, PLACE};
use geometry::{Geometry, Pose};
use hivtac_terms::force::Force;
use hivtac_terms::status::Status;
use hivtac_wire::message::Sample;
use matrix::{
    Matrix, Vector, add, carried, covariance, cross, crossing, dot, mixed, sigmas, times,
};

/// A force on a film, in the film's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// N.
    pub force: Vector,
    /// Its covariance, N².
    pub covariance: Matrix,
    /// Where it acts, m from the film's middle, and the standard uncertainty of each coordinate, m.
    pub place: Option<([f64; 2], f64)>,
}

impl From<&Force> for Felt {
    fn from(force: &Force) -> Felt {
        let [_, _, _, x, y, z, angle_sigma, size_sigma] = FORCE.map(|it| it.si(force));
        Felt {
            force: [x, y, z],
            covariance: covariance([x, y, z], size_sigma, angle_sigma),
            place: force.place.as_ref().map(|place| {
                let [x, y, sigma] = PLACE.map(|it| it.si(place));
                ([x, y], sigma)
            }),
        }
    }
}

/// A finger's sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// When its frame was exposed, ns.
    pub stamp_ns: u64,
    /// When it arrived, ns.
    pub came_ns: u64,
    /// Its status.
    pub status: Status,
    /// Its force, if any.
    pub felt: Option<Felt>,
}

impl Reading {
    /// Of a sample that was exposed and arrived at these times, ns.
    pub fn of(sample: &Sample, stamp_ns: u64, came_ns: u64) -> Reading {
        Reading {
            stamp_ns,
            came_ns,
            status: sample.status,
            felt: sample.force.as_ref().map(Felt::from),
        }
    }
}

/// Why there is no grip: the finger, 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// It has no force; its status says why.
    NoForce(usize),
    /// Its samples do not come.
    Silent(usize),
}

/// The grip of two fingers at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// When, ns: the exposure of the first finger's frame.
    pub stamp_ns: u64,
    /// When that finger's sample arrived, ns.
    pub came_ns: u64,
    /// The status of each finger.
    pub status: [Status; 2],
    /// The grip, or why it is unknown.
    pub held: Result<Held, Cause>,
}

impl Grip {
    /// Whether something touches both fingers; `None` if that is not known.
    pub fn contact(&self) -> Option<bool> {
        let touches = self.status.map(|it| it.contains(Status::CONTACT));
        self.held.ok().map(|_| touches == [true, true])
    }
}

/// Numbers of a grip, each with its standard uncertainty, in the grip's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// The force that squeezes, N.
    pub force: f64,
    /// Its standard uncertainty, N.
    pub force_sigma: f64,
    /// The force on both fingers together, N.
    pub common: Vector,
    /// The standard uncertainty of each component, N.
    pub common_sigma: Vector,
    /// The torque on both about the origin, N·m, and the standard uncertainty of each component;
    /// `None` if a place is not known.
    pub torque: Option<(Vector, Vector)>,
    /// How much more pull there may be before a finger slips, N; negative beyond.
    pub margin: f64,
    /// Its standard uncertainty, N.
    pub margin_sigma: f64,
}

impl Held {
    /// The grip of two fingers with these forces.
    pub fn of(geometry: &Geometry, felt: [&Felt; 2]) -> Held {
        let [first, second] = [0, 1].map(|finger| {
            let sign = if finger == 0 { -0.5 } else { 0.5 };
            let axis = geometry.poses[finger].to_film(geometry.axis);
            let along = sign * dot(felt[finger].force, axis);
            (along, quadratic(&felt[finger].covariance, axis) / 4.0)
        });
        let turned = [0, 1].map(|finger| turned(&geometry.poses[finger], felt[finger]));
        let both = mixed(&turned[0].1, 1.0, &turned[1].1, 1.0);
        let margins = felt.map(|felt| margin(felt, geometry.friction));
        let least = match margins[0].0 <= margins[1].0 {
            true => margins[0],
            false => margins[1],
        };
        Held {
            force: first.0 + second.0,
            force_sigma: (first.1 + second.1).max(0.0).sqrt(),
            common: add(turned[0].0, turned[1].0),
            common_sigma: sigmas(&both),
            torque: torque(geometry, felt),
            margin: least.0,
            margin_sigma: least.1.max(0.0).sqrt(),
        }
    }
}

/// vᵀ C v.
fn quadratic(covariance: &Matrix, vector: Vector) -> f64 {
    dot(vector, times(covariance, vector))
}

/// A force and its covariance in the grip's frame.
fn turned(pose: &Pose, felt: &Felt) -> (Vector, Matrix) {
    (
        times(&pose.turn, felt.force),
        carried(&pose.turn, &felt.covariance),
    )
}

/// The torque of both forces about the origin, and its standard uncertainties.
fn torque(geometry: &Geometry, felt: [&Felt; 2]) -> Option<(Vector, Vector)> {
    let mut total = [0.0; 3];
    let mut uncertain = [[0.0; 3]; 3];
    for (pose, felt) in geometry.poses.iter().zip(felt) {
        let ([x, y], sigma) = felt.place?;
        let (force, covariance) = turned(pose, felt);
        let at = add(times(&pose.turn, [x, y, 0.0]), pose.middle);
        total = add(total, cross(at, force));
        let square = sigma * sigma;
        let of_place = [[square, 0.0, 0.0], [0.0, square, 0.0], [0.0; 3]];
        let by_place = carried(&crossing(force), &carried(&pose.turn, &of_place));
        let by_force = carried(&crossing(at), &covariance);
        uncertain = mixed(&uncertain, 1.0, &mixed(&by_force, 1.0, &by_place, 1.0), 1.0);
    }
    Some((total, sigmas(&uncertain)))
}

/// μ N − T of a finger, N, and its variance, N².
fn margin(felt: &Felt, friction: f64) -> (f64, f64) {
    let [x, y, z] = felt.force;
    let pull = x.hypot(y);
    let margin = -friction * z - pull;
    let variance = match pull > 0.0 {
        true => quadratic(&felt.covariance, [-x / pull, -y / pull, -friction]),
        // Without a direction the pull is uncertain every way.
        false => {
            let across = (felt.covariance[0][0] + felt.covariance[1][1]) / 2.0;
            across + friction * friction * felt.covariance[2][2]
        }
    };
    (margin, variance)
}

#[cfg(test)]
mod tests;
