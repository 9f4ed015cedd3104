//! Rigid and soft bodies that press the film from outside, with the contact's own pressure.
//!
//! A body touches the film's outer side. Points of the middle surface therefore keep half the flat
//! film's thickness from it. A point that is nearer is pressed back by its penetration times the
//! body's stiffness, along the body's normal and over the mounted film's area. A rigid body's
//! stiffness is large enough not to matter.
//!
//! The contact sticks as a whole. The body moves along x and y as the mean of the points that bear
//! it, weighted by their pressure. The rest of the force along x and y, which the normal pressure
//! does not bear, is spread over them in proportion to it, on the middle surface. The body does not
//! turn.

mod newton;
mod points;
mod shape;

use std::sync::Arc;

use crate::film::{Touched, mean};
use crate::newton::Solution;
use crate::point::{V3, cross};
use crate::{Equilibrium, Film, Patch, ShellError};

use newton::{LOOSE_N, Pressing, State, TOLERANCE_N};
use points::{Bearing, Points};

pub use shape::{Ends, Shape};

/// The stiffness that stands for a rigid body, N/mm³.
pub const RIGID_N_PER_MM3: f64 = 400.0;
/// The radii of a finger's pad, mm, and its stiffness, N/mm³.
const PAD_MM: [f64; 2] = [10.0, 6.0];
const PAD_N_PER_MM3: f64 = 0.05;
/// The largest tilt of a body, degrees.
const MOST_TILT_DEG: f64 = 45.0;
/// How often the pressure is taken for the shares by which it holds the body.
const MOST_ROUNDS: usize = 12;
/// The part of these shares that may lie elsewhere at the end.
const SAME_SHARES: f64 = 2e-3;
/// A stiff body is first a soft one, of this stiffness, N/mm³.
const SOFT_N_PER_MM3: f64 = 20.0;

/// A body over the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Its shape.
    pub shape: Shape,
    /// The point of the mounted film, mm, that its foot is over as it comes down.
    pub place_mm: [f64; 2],
    /// The direction of its first axis, degrees from x towards y.
    pub turned_deg: f64,
    /// By how much its first axis rises from the film, degrees within ±45. A face then presses
    /// with the other side of its rim.
    pub tilt_deg: f64,
    /// Its pressure per penetration, N/mm³, > 0.
    pub stiffness_n_per_mm3: f64,
}

/// A film that a body presses.
#[derive(Clone, Debug)]
pub struct Touch {
    /// The film. Its patch is the contact's, with the parts of the pressure.
    pub state: Equilibrium,
    /// The points of the mounted film that bear the body, with their parts of the normal force.
    /// Their centre is the centre of pressure.
    pub patch: Patch,
    /// The area of the mounted film that touches, mm².
    pub area_mm2: f64,
    /// How far the contact reaches from the foot along the body's first and second axis, mm.
    pub reach_mm: [f64; 2],
    /// The body's foot, mm, film frame.
    pub foot_mm: [f64; 3],
    /// The force by which the film sticks to the body along x and y, N.
    pub held_n: [f64; 2],
    /// The largest penetration, mm.
    pub deep_mm: f64,
}

impl Body {
    /// Returns an upright rigid body over a point of the mounted film, mm.
    pub fn rigid(shape: Shape, place_mm: [f64; 2]) -> Body {
        Body {
            shape,
            place_mm,
            turned_deg: 0.0,
            tilt_deg: 0.0,
            stiffness_n_per_mm3: RIGID_N_PER_MM3,
        }
    }

    /// Returns a finger's pad over a point of the mounted film, mm, with its longer axis at an
    /// angle, degrees from x towards y. Pressed with 100 mN it touches an ellipse with semi-axes of
    /// about 4 and 2.5 mm.
    pub fn pad(place_mm: [f64; 2], turned_deg: f64) -> Body {
        Body {
            turned_deg,
            stiffness_n_per_mm3: PAD_N_PER_MM3,
            ..Body::rigid(Shape::Pad { radii_mm: PAD_MM }, place_mm)
        }
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ShellError> {
        self.shape.check()?;
        let finite = |value: f64| value.is_finite();
        let good = self.place_mm.into_iter().all(finite)
            && self.turned_deg.is_finite()
            && self.tilt_deg.abs() <= MOST_TILT_DEG
            && self.stiffness_n_per_mm3.is_finite()
            && self.stiffness_n_per_mm3 > 0.0;
        match good {
            true => Ok(()),
            false => Err(ShellError::Contact(format!(
                "{self:?}: use finite numbers, a tilt within ±{MOST_TILT_DEG}°, and a stiffness \
                 of more than 0"
            ))),
        }
    }

    /// Returns its axes in the film's frame. The third points away from the film.
    pub(crate) fn axes(&self) -> [V3; 3] {
        let (sin, cos) = self.turned_deg.to_radians().sin_cos();
        let (rise, level) = self.tilt_deg.to_radians().sin_cos();
        let first = [cos * level, sin * level, rise];
        let second = [-sin, cos, 0.0];
        [first, second, cross(&first, &second)]
    }

    /// Returns about where it presses: a start.
    fn footprint(&self) -> Result<Patch, ShellError> {
        let place = self.place_mm;
        match self.shape {
            Shape::Sphere { radius_mm } => Patch::disc(place, 0.45 * radius_mm.sqrt()),
            Shape::Cylinder { length_mm, .. } => {
                Patch::line(place, length_mm, 0.4, self.turned_deg)
            }
            Shape::Face { radius_mm } => Patch::rim(place, radius_mm, 0.1 * radius_mm),
            Shape::Pad { radii_mm } => {
                let axes = radii_mm.map(|radius| 0.45 * radius.sqrt());
                Patch::ellipse(place, axes, self.turned_deg)
            }
        }
    }
}

impl Film {
    /// Returns the film under a body on which a force acts, N, with F_z < 0. It is found from the
    /// state `start`, or from rest if that fails.
    ///
    /// # Errors
    /// If the body or the force is impossible, no equilibrium is found, the contact reaches too
    /// far, or the start belongs to another mesh.
    pub fn press_body(
        &self,
        body: &Body,
        force_n: [f64; 3],
        start: &Equilibrium,
    ) -> Result<Touch, ShellError> {
        body.check()?;
        if force_n[2].is_nan() || force_n[2] >= 0.0 {
            return Err(ShellError::Contact(format!(
                "force is {force_n:?} N: a body presses towards the camera, which is z < 0"
            )));
        }
        let footprint = body.footprint()?;
        let start = self.press_patch(&footprint, force_n, start)?;
        let grid = self.shell().grid();
        let pressing = Pressing {
            shell: self.shell(),
            solver: self.solver(),
            points: Points::new(self, body),
            place_mm: body.place_mm,
            shares: Touched::Patch(Arc::new(footprint)).shares(grid),
            force_n,
        };
        self.settle(body, pressing, start)
    }

    /// Finds the contact whose shares are those of its own pressure.
    fn settle(
        &self,
        body: &Body,
        mut pressing: Pressing<'_>,
        start: Equilibrium,
    ) -> Result<Touch, ShellError> {
        let mut steps = start.steps;
        pressing.points.stiffness = body.stiffness_n_per_mm3.min(SOFT_N_PER_MM3);
        let mut state = pressing.seated(start.unknowns);
        for _ in 0..MOST_ROUNDS {
            let taken;
            (state, taken) = pressing.solve(state, LOOSE_N)?;
            steps += taken;
            let contact = Contact::of(&pressing.bearing(&state))?;
            let touched = Touched::Patch(Arc::new(contact.patch));
            let shares = touched.shares(self.shell().grid());
            let pairs = pressing.shares.iter().zip(&shares);
            let moved: f64 = pairs.map(|(a, b)| (a - b).abs()).sum();
            let hard = pressing.points.stiffness == body.stiffness_n_per_mm3;
            if hard && moved < 2.0 * SAME_SHARES {
                let (state, taken) = pressing.solve(state, TOLERANCE_N)?;
                return self.touch(body, &pressing, (state, steps + taken));
            }
            pressing.points.stiffness = body.stiffness_n_per_mm3;
            pressing.shares = shares;
        }
        Err(ShellError::Solver("the contact does not settle".into()))
    }

    fn touch(
        &self,
        body: &Body,
        pressing: &Pressing<'_>,
        (state, steps): (State, usize),
    ) -> Result<Touch, ShellError> {
        let contact = Contact::of(&pressing.bearing(&state))?;
        let [x, y] = body.place_mm;
        let points = contact.patch.points().iter();
        let far = points
            .map(|([px, py], _)| (px - x).hypot(py - y))
            .fold(0.0, f64::max);
        if far > body.shape.reach_mm() - 2.0 * body.shape.spacing_mm() {
            return Err(ShellError::Contact(format!(
                "{body:?} touches the film {far:.1} mm from its foot: press less, or with \
                 another body"
            )));
        }
        let touched = Touched::Patch(Arc::new(contact.patch.clone()));
        let tip_mm = mean(&touched.shares(self.shell().grid()), &state.unknowns);
        let held_n = pressing.held(&state);
        let solution = Solution {
            unknowns: state.unknowns,
            guide_n: Vec::new(),
            steps,
        };
        Ok(Touch {
            state: self.equilibrium(solution, pressing.force_n, &[], (touched, tip_mm)),
            patch: contact.patch,
            area_mm2: contact.area_mm2,
            reach_mm: contact.reach_mm,
            foot_mm: state.foot,
            held_n,
            deep_mm: contact.deep_mm,
        })
    }
}

/// A contact by its bearing points.
struct Contact {
    patch: Patch,
    area_mm2: f64,
    reach_mm: [f64; 2],
    deep_mm: f64,
}

impl Contact {
    fn of(bearing: &[Bearing]) -> Result<Contact, ShellError> {
        let most = |of: &dyn Fn(&Bearing) -> f64| bearing.iter().map(of).fold(0.0, f64::max);
        let points = bearing.iter().map(|point| (point.at, point.normal_n));
        Ok(Contact {
            patch: Patch::new(points.collect())?,
            area_mm2: bearing.iter().map(|point| point.area).sum(),
            reach_mm: [0, 1].map(|way| most(&|point| point.on_body[way].abs())),
            deep_mm: most(&|point| point.deep),
        })
    }
}

#[cfg(test)]
mod tests;
