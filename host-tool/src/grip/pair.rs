//! Pairs the samples of two fingers, whose cameras run on their own: at each frame of the first,
//! the second's force is taken between the two samples around that time.

use super::geometry::Geometry;
use super::matrix::mixed;
use super::{Cause, Felt, Grip, Held, Reading};
use hivtac_terms::status::Status;
use std::collections::VecDeque;

/// Longest time between two samples of a finger that is not silent, ns.
const SILENCE_NS: u64 = 100_000_000;

/// The samples of two fingers that wait for each other.
#[derive(Clone, Debug)]
pub struct Pair {
    geometry: Geometry,
    /// Those of the first finger that wait for the second.
    waiting: VecDeque<Reading>,
    /// The second finger's, for as long as the first one may be late.
    second: VecDeque<Reading>,
    /// When the first finger's last frame was exposed, or else the second's first one, ns.
    first_ns: Option<u64>,
}

impl Pair {
    /// Two fingers there.
    pub fn new(geometry: Geometry) -> Pair {
        Pair {
            geometry,
            waiting: VecDeque::new(),
            second: VecDeque::new(),
            first_ns: None,
        }
    }

    /// Takes the next sample of a finger, 0 or 1; returns the grips that are known then, in their
    /// order.
    pub fn push(&mut self, finger: usize, reading: Reading) -> Vec<Grip> {
        match finger {
            0 => self.push_first(reading),
            _ => self.push_second(reading),
        }
    }

    fn push_first(&mut self, reading: Reading) -> Vec<Grip> {
        self.first_ns = Some(reading.stamp_ns);
        keep(&mut self.waiting, reading);
        let mut grips = self.known();
        while let Some(oldest) = self.waiting.front()
            && reading.stamp_ns - oldest.stamp_ns > SILENCE_NS
        {
            grips.push(without(oldest, Cause::Silent(1)));
            self.waiting.pop_front();
        }
        grips
    }

    fn push_second(&mut self, reading: Reading) -> Vec<Grip> {
        keep(&mut self.second, reading);
        let is_over = |old: &Reading| reading.stamp_ns - old.stamp_ns > 2 * SILENCE_NS;
        while self.second.front().is_some_and(is_over) {
            self.second.pop_front();
        }
        let mut grips = self.known();
        let first_ns = *self.first_ns.get_or_insert(reading.stamp_ns);
        if reading.stamp_ns.saturating_sub(first_ns) > SILENCE_NS {
            grips.push(without(&reading, Cause::Silent(0)));
        }
        grips
    }

    /// The grips at the first finger's samples up to the second's last one.
    fn known(&mut self) -> Vec<Grip> {
        let mut grips = Vec::new();
        while let (Some(first), Some(last)) = (self.waiting.front().copied(), self.second.back())
            && first.stamp_ns <= last.stamp_ns
        {
            self.waiting.pop_front();
            let after = self
                .second
                .partition_point(|it| it.stamp_ns < first.stamp_ns);
            // Before the second finger's first sample there is no grip.
            if let Some(before) = after.checked_sub(1) {
                grips.push(self.grip(first, &self.second[before], &self.second[after]));
            }
        }
        grips
    }

    fn grip(&self, first: Reading, before: &Reading, after: &Reading) -> Grip {
        if after.stamp_ns - before.stamp_ns > SILENCE_NS {
            return without(&first, Cause::Silent(1));
        }
        let (status, second) = between(before, after, first.stamp_ns);
        let held = match (first.felt, second) {
            (None, _) => Err(Cause::NoForce(0)),
            (_, None) => Err(Cause::NoForce(1)),
            (Some(first), Some(second)) => Ok(Held::of(&self.geometry, [&first, &second])),
        };
        Grip {
            stamp_ns: first.stamp_ns,
            came_ns: first.came_ns,
            status: [first.status, status],
            held,
        }
    }
}

/// Keeps a finger's sample after those before it. One that is not later shows that the device or a
/// clock was set: those before say nothing then.
fn keep(readings: &mut VecDeque<Reading>, reading: Reading) {
    let is_later = |newest: &Reading| newest.stamp_ns < reading.stamp_ns;
    if !readings.back().is_none_or(is_later) {
        readings.clear();
    }
    readings.push_back(reading);
}

/// A time without a grip, by a finger's sample.
fn without(reading: &Reading, cause: Cause) -> Grip {
    let mut status = [Status::OK; 2];
    if let Cause::Silent(silent) = cause {
        status[1 - silent] = reading.status;
    }
    Grip {
        stamp_ns: reading.stamp_ns,
        came_ns: reading.came_ns,
        status,
        held: Err(cause),
    }
}

/// Status and force of a finger at a time between two of its samples. Uncertainties are mixed, too:
/// both samples may err alike.
fn between(before: &Reading, after: &Reading, at_ns: u64) -> (Status, Option<Felt>) {
    let whole_ns = (after.stamp_ns - before.stamp_ns) as f64;
    let part = (at_ns - before.stamp_ns) as f64 / whole_ns;
    let (a, b) = match (before.felt, after.felt) {
        (_, None) => return (after.status, None),
        (None, Some(_)) => return (before.status, None),
        (Some(a), Some(b)) => (a, b),
    };
    let mix = |a: f64, b: f64| a + part * (b - a);
    let place = a.place.zip(b.place);
    let place = place.map(|((a, sigma_a), (b, sigma_b))| {
        ([mix(a[0], b[0]), mix(a[1], b[1])], mix(sigma_a, sigma_b))
    });
    let felt = Felt {
        force: std::array::from_fn(|row| mix(a.force[row], b.force[row])),
        covariance: mixed(&a.covariance, 1.0 - part, &b.covariance, part),
        place,
    };
    (after.status, Some(felt))
}
