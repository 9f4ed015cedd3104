//! Finds the load that three markers show while the fourth one is lost.
//!
//! The lost marker stays among the equations, with so much noise that it does not count. So the
//! steps are those for four markers. The network cannot give the first guess; the steps begin at
//! the nearest of a few straight presses.

use super::estimate::{Estimate, Observed, Start};
use super::mounting::Mounting;
use super::pose::Pose;
use super::predict::Markers;
use super::solve::{Column, square};
use super::{Forward, Unknown};
use crate::markers::lost::Lost;

/// Largest residual, relative to its variance, of a contact that explains three markers. χ² of one
/// degree of freedom exceeds it in 1 of 2,000 undisturbed frames.
const UNEXPLAINED: f32 = 12.1;
/// A contact this near to the lost marker moves the other three so little that several loads
/// explain them, mm.
const NEAR_MM: f32 = 2.2;
/// Where the steps may begin: along each axis, as parts of the tables' last place; and the size, as
/// a part of the largest.
const PLACES: [f32; 3] = [-0.6, 0.0, 0.6];
const SIZE: f32 = 0.5;

impl Estimate {
    /// Returns whether the load explains the three markers; false if the residual is NaN. A load
    /// that is no contact explains hardly any of their noise, so more may be left over.
    pub fn is_explained_by_three(&self, is_contact: bool) -> bool {
        self.is_explained() && !(is_contact && self.unexplained > UNEXPLAINED)
    }
}

impl Forward<'_> {
    /// Returns whether three markers determine a contact: it is not near the marker `lost` (0–3).
    pub fn is_far_from(&self, lost: usize, estimate: &Estimate) -> bool {
        let place_mm = estimate.pose.place_mm;
        let mut distances = self.rest_image.squared_distances_mm(place_mm).skip(lost);
        distances
            .next()
            .is_some_and(|square| square >= NEAR_MM * NEAR_MM)
    }

    /// Returns the load that explains the markers without `lost` (0–3) best, and the lost marker's
    /// motion from rest under it, focal lengths.
    #[inline(never)]
    pub fn estimate_of_three(
        &self,
        mut observed: Observed<'_>,
        lost: usize,
        mounting: &Mounting,
        unknown: Unknown<'_>,
    ) -> (Estimate, [f32; 2]) {
        observed.lost = Lost::only(lost);
        observed.lost.clear(&mut observed.moved);
        // It would explain the only redundant coordinate.
        observed.turning = None;
        let guess = self.nearest_press(&observed, &mounting.beside_mm);
        let estimate = self.estimate(&observed, mounting, unknown, Start::Near(guess));
        let moved = self.moved(&estimate.pose, &mounting.beside_mm);
        let [lost_x, lost_y] = [2 * lost, 2 * lost + 1].map(|k| moved.get(k).copied());
        let at = lost_x.zip(lost_y).unwrap_or_default();
        (estimate, at.into())
    }

    /// The straight press that moves the markers that are seen most nearly as they moved.
    #[inline(never)]
    pub(super) fn nearest_press(&self, observed: &Observed<'_>, beside_mm: &Markers) -> Pose {
        let (moved, lost) = (&observed.moved, observed.lost);
        let (mut nearest, mut least) = (Pose::default(), f32::INFINITY);
        let [_, end] = self.tables.ends_mm();
        let size = SIZE * self.limits.size;
        for place in PLACES.map(|y| PLACES.map(|x| [x, y])).as_flattened() {
            let press = Pose {
                size,
                place_mm: place.map(|part| part * end),
                width: observed.first_width(),
                ..Pose::default()
            };
            let mut pressed = self.moved(&press, beside_mm);
            lost.clear(&mut pressed);
            // Motion is nearly proportional to the size.
            let times = product(moved, &pressed) / square(&pressed).max(f32::MIN_POSITIVE);
            let pairs = moved.iter().zip(pressed.iter());
            let left = pairs.fold(0.0, |sum, (moved, pressed)| {
                let left = moved - times * pressed;
                sum + left * left
            });
            if left < least {
                let size = times * size;
                (nearest, least) = (Pose { size, ..press }, left);
            }
        }
        nearest
    }

    /// How far a load moves the markers, focal lengths.
    #[inline(never)]
    fn moved(&self, pose: &Pose, beside_mm: &Markers) -> Column {
        self.tables.predict(pose, &self.limits, beside_mm).moved
    }
}

fn product(a: &Column, b: &Column) -> f32 {
    a.iter().zip(b.iter()).fold(0.0, |sum, (a, b)| sum + a * b)
}
