//! Predicts the motion of the markers' images under two contacts, with its slopes.

use super::far_mm;
use super::interaction::{INPUTS, Interaction};
use crate::force::forward::Forward;
use crate::force::forward::pose::Pose;
use crate::force::forward::predict::{Markers, Prediction};
use crate::force::forward::solve::Column;

/// Least force of both together, N. With less, their parts would mean nothing.
const LEAST_N: f32 = 1e-6;

/// Two contacts, as the film sees them together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Both {
    /// The contacts.
    pub poses: [Pose; 2],
    /// The size of a force as large as both forces' sizes together.
    pub size: f32,
    /// The part of the first one in that force.
    part: f32,
    /// The slopes of `size` and of `part` by each contact's size.
    by_sizes: [[f32; 2]; 2],
}

/// The motion of the images under two contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairPrediction {
    /// x and y of the markers, focal lengths.
    pub moved: Column,
    /// Slopes by the unknowns: the sizes of both, then as [`Both::inputs`].
    pub slopes: [Column; INPUTS],
}

impl Both {
    /// Two contacts on a film.
    pub fn new(poses: [Pose; 2], forward: &Forward<'_>) -> Both {
        let stiffness = &forward.stiffness;
        let [first_n, second_n] = poses.map(|pose| stiffness.magnitude_n(pose.size));
        let all_n = (first_n + second_n).max(LEAST_N);
        let (size, part) = (
            stiffness.size_of(all_n, forward.limits.size),
            first_n / all_n,
        );
        let [first, second] = poses.map(|pose| stiffness.per_size_n(pose.size));
        let per_n = 1.0 / stiffness.per_size_n(size);
        Both {
            poses,
            size,
            part,
            by_sizes: [
                [first * per_n, first * (1.0 - part) / all_n],
                [second * per_n, -second * part / all_n],
            ],
        }
    }

    /// The size of both, the first one's part, the tilts along x and y of both (rad), and the
    /// places along x and y of both (mm).
    pub fn inputs(&self) -> [f32; INPUTS] {
        let [first, second] = &self.poses;
        let ([a, b], [c, d]) = (first.tilt, second.tilt);
        let ([x, y], [z, w]) = (first.place_mm, second.place_mm);
        [self.size, self.part, a, b, c, d, x, y, z, w]
    }

    /// How the variance of the model's error grows with both contacts, relative to that of a size
    /// of 1 at one place. It also grows with the distance; chosen on other pairs than the
    /// network's.
    pub fn left(&self) -> f32 {
        let square = self.size * self.size;
        let [first, second] = &self.poses;
        square * square * self.size * (1.0 + far_mm(first, second))
    }

    /// The part of each contact, and the contact with the size of both.
    pub fn alone(&self) -> [(f32, Pose); 2] {
        let [first, second] = self.poses.map(|pose| Pose {
            size: self.size,
            ..pose
        });
        [(self.part, first), (1.0 - self.part, second)]
    }
}

impl PairPrediction {
    /// Makes this the motion under two contacts.
    #[inline(never)]
    pub fn put(
        &mut self,
        both: &Both,
        forward: &Forward<'_>,
        interaction: &Interaction<'_>,
        beside_mm: &Markers,
    ) {
        let coordinates = 2 * forward.tables.dots();
        self.moved.reset(coordinates, 0.0);
        for slope in &mut self.slopes {
            slope.reset(coordinates, 0.0);
        }
        for (number, (part, pose)) in both.alone().into_iter().enumerate() {
            let alone = forward.tables.predict(&pose, &forward.limits, beside_mm);
            self.add(number, part, &alone);
        }
        interaction.add_to(both, &mut self.moved, &mut self.slopes);
        self.by_sizes(both);
    }

    /// Adds the part of a contact.
    fn add(&mut self, number: usize, part: f32, alone: &Prediction) {
        let [by_size, by_part, others @ ..] = &mut self.slopes;
        let [of_size, others_alone @ ..] = &alone.slopes;
        let way = if number == 0 { 1.0 } else { -1.0 };
        let pairs = [
            (&mut self.moved, &alone.moved, part),
            (by_size, of_size, part),
            (by_part, &alone.moved, way),
        ];
        // The tilts of both come before the places of both.
        let own = [0, 1, 4, 5].map(|first| first + 2 * number);
        let slopes = others.iter_mut().enumerate();
        let mut own = slopes.filter(|(nth, _)| own.contains(nth));
        let others = others_alone
            .iter()
            .map_while(|of| own.next().map(|(_, sum)| (sum, of, part)));
        for (sum, of, part) in pairs.into_iter().chain(others) {
            for (sum, of) in sum.iter_mut().zip(of.iter()) {
                *sum += part * of;
            }
        }
    }

    /// Replaces the slopes by the size and the part with those by the contacts' sizes.
    fn by_sizes(&mut self, both: &Both) {
        let [[first_size, first_part], [second_size, second_part]] = both.by_sizes;
        let [by_size, by_part, ..] = &mut self.slopes;
        for (size, part) in by_size.iter_mut().zip(by_part.iter_mut()) {
            (*size, *part) = (
                first_size * *size + first_part * *part,
                second_size * *size + second_part * *part,
            );
        }
    }
}
