//! Subtracts from each force the film's creep by its earlier loads.
//!
//! A linear viscoelastic film responds like an elastic one to F + Σ part · q. Each q follows the
//! load F with its own time constant (a Prony series of two terms: Park and Schapery, *Int. J.
//! Solids Struct.* 36, 1999). A frame shows such a sum; subtracting the q of the earlier forces
//! leaves F.
//!
//! A model's forces are right for loads that were held for a second, because a calibration reads
//! them then. So only the difference between each q and its value after that second counts. This
//! difference times the part's standard uncertainty is uncertain; for a load held as in the
//! calibration it is 0.
//!
//! The load's moment about the film's middle lags as its components do. So the remembered force
//! acts where the loads were.

use super::filter::both;
use crate::force::{CONTACT_SIGMAS, Force, Place, Polar};
use hivtac_terms::temporal::Creep;
use hivtac_terms::units::{
    MicroNewtons, Micrometres, Milliseconds, SignedMicrometres, UnsignedMicroNewtons,
    UnsignedMilliDegrees,
};

/// F_x, F_y, F_z, µN, and F_z·x, F_z·y, µN·mm.
type Resultant = [f32; 5];

/// Time between applying a load and reading it in a calibration, ms.
const READ_MS: f32 = 1_000.0;
/// That time is divided into 2⁶ steps.
const HALVINGS: i32 = 6;
/// If frames have no force, the last force counts as held for this time, µs, then as 0.
const HELD_US: u64 = 100_000;
/// Largest distance of a place from the film's middle: the film ends there, µm.
const FARTHEST_UM: f32 = 20_000.0;
/// m° per radian.
const MDEG: f32 = 57_295.78;

/// The film's memory of its loads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    lagging: [Resultant; 2],
    /// The newest force, and its time, µs.
    force: Resultant,
    force_us: u64,
    newest_us: Option<u64>,
}

/// A frame's force after correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Undone {
    /// The force without the film's memory.
    pub force: Force,
    /// The uncertainty of |F| by the memory alone.
    pub sigma: UnsignedMicroNewtons,
}

impl Undone {
    /// Returns whether the force may be only the film's memory.
    pub fn is_remembered(&self) -> bool {
        let sigmas = u64::from(self.sigma.0) * u64::from(CONTACT_SIGMAS);
        u64::from(self.force.magnitude.0.unsigned_abs()) < sigmas
    }
}

impl Memory {
    /// No load so far.
    pub const NONE: Memory = Memory {
        lagging: [[0.0; 5]; 2],
        force: [0.0; 5],
        force_us: 0,
        newest_us: None,
    };

    /// Takes a frame's own force and returns the corrected one.
    pub fn follow(&mut self, creep: &Creep, time_us: u64, own: Option<&Force>) -> Option<Undone> {
        let before_us = self.newest_us.replace(time_us).unwrap_or(time_us);
        let beside = own.map(|own| self.beside(&resultant(own)));
        if let Some((own, beside)) = own.zip(beside) {
            let mut force = resultant(own);
            for (beside, part) in beside.iter().zip(creep.parts) {
                for (sum, beside) in force.iter_mut().zip(beside) {
                    *sum -= thousandths(part.0) * beside;
                }
            }
            // A film is either pressed or not; it is never pulled.
            self.force = if force[2] < 0.0 { force } else { [0.0; 5] };
            self.force_us = time_us;
        } else if time_us.saturating_sub(self.force_us) > HELD_US {
            self.force = [0.0; 5];
        }
        self.pass(time_us.saturating_sub(before_us));
        let (own, beside) = own.zip(beside)?;
        Some(self.undone(creep, own, &beside))
    }

    /// Difference between each q and its value for a load that is read as in a calibration.
    fn beside(&self, seen: &Resultant) -> [Resultant; 2] {
        let mut beside = self.lagging;
        for (beside, time) in beside.iter_mut().zip(Creep::TIMES) {
            let read = grown(time);
            for (beside, seen) in beside.iter_mut().zip(seen) {
                *beside -= read * seen;
            }
        }
        beside
    }

    /// Advances by this many µs, by the implicit Euler rule.
    fn pass(&mut self, after_us: u64) {
        let after_ms = after_us as f32 * 1e-3;
        for (lagging, time) in self.lagging.iter_mut().zip(Creep::TIMES) {
            let follows = after_ms / (time.0 as f32 + after_ms);
            for (lagging, force) in lagging.iter_mut().zip(&self.force) {
                *lagging += follows * (force - *lagging);
            }
        }
    }

    /// Returns the corrected force with its uncertainty.
    fn undone(&self, creep: &Creep, own: &Force, beside: &[Resultant; 2]) -> Undone {
        let vector = [self.force[0], self.force[1], self.force[2]];
        let mut force = match creep.is_measured() {
            true => moved(own, &self.force),
            false => *own,
        };
        let size = length(&vector);
        let [mut along, mut across, mut far] = [0.0; 3];
        for [x, y, z, right, down] in beside {
            let square = x * x + y * y + z * z;
            let dot = x * vector[0] + y * vector[1] + z * vector[2];
            let part = if size > 0.0 {
                dot * dot / (size * size)
            } else {
                square
            };
            along += part;
            across += (square - part).max(0.0);
            far += place_mm(own, [*right, *down], *z);
        }
        let uncertain = thousandths(creep.uncertain().0);
        let sigma = (uncertain * root(along)) as u32;
        let turned = uncertain * MDEG * root(across) / size.max(1.0);
        // µm from mm; each coordinate has half of the squared distance.
        let far_um = 1e3 * uncertain * root(far / 2.0) / -vector[2].min(-1.0);
        let far_um = far_um.min(FARTHEST_UM);
        force.magnitude_sigma = UnsignedMicroNewtons(both(own.magnitude_sigma.0, sigma));
        let direction = both(own.direction_sigma.0, turned as u32).min(180_000);
        force.direction_sigma = UnsignedMilliDegrees(direction);
        force.place = force.place.map(|place| Place {
            sigma: Micrometres(both(place.sigma.0, far_um as u32)),
            ..place
        });
        Undone {
            force,
            sigma: UnsignedMicroNewtons(sigma),
        }
    }
}

/// The squared part of the moment, µN·mm, that is not due to the force acting at its place.
fn place_mm(own: &Force, [right, down]: [f32; 2], z: f32) -> f32 {
    let [x, y] = own.place.map_or([0.0; 2], |place| mm(&place));
    let (right, down) = (right - z * x, down - z * y);
    right * right + down * down
}

/// The frame's own force, replaced by this resultant.
fn moved(own: &Force, resultant: &Resultant) -> Force {
    let [x, y, z, right, down] = *resultant;
    let cartesian = [x, y, z].map(|part| MicroNewtons(nearest(part)));
    let Polar {
        alpha,
        beta,
        magnitude,
    } = Polar::of_vector(cartesian);
    // A negligible force keeps its place.
    let place = own.place.map(|place| match z < -1.0 {
        true => Place {
            x: SignedMicrometres(nearest(1e3 * right / z)),
            y: SignedMicrometres(nearest(1e3 * down / z)),
            ..place
        },
        false => place,
    });
    Force {
        alpha,
        beta,
        magnitude,
        cartesian,
        place,
        ..*own
    }
}

fn resultant(force: &Force) -> Resultant {
    let [x, y, z] = force.cartesian.map(|part| part.0 as f32);
    let [right, down] = force.place.map_or([0.0; 2], |place| mm(&place));
    [x, y, z, z * right, z * down]
}

fn mm(place: &Place) -> [f32; 2] {
    [place.x, place.y].map(|part| part.0 as f32 * 1e-3)
}

/// The fraction of a load that its q has reached when the load is read.
fn grown(time: Milliseconds) -> f32 {
    let time_ms = (time.0 as f32).max(1.0);
    let mut left = time_ms / (time_ms + READ_MS / (1 << HALVINGS) as f32);
    for _ in 0..HALVINGS {
        left *= left;
    }
    1.0 - left
}

fn thousandths(number: u8) -> f32 {
    f32::from(number) * 1e-3
}

fn nearest(number: f32) -> i32 {
    let half = if number < 0.0 { -0.5 } else { 0.5 };
    (number + half) as i32
}

fn length([x, y, z]: &[f32; 3]) -> f32 {
    root(x * x + y * y + z * z)
}

/// The root of a number below 2⁶³, as an integer.
fn root(square: f32) -> f32 {
    hivtac_terms::root::root(square as u64) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::tests::{force_of, pressed};
    use hivtac_terms::units::SmallPermille;
    use proptest::prelude::*;
    use std::vec::Vec;

    const FRAME_US: u64 = 6_405;
    const KNOWN: Creep = Creep {
        parts: [SmallPermille(40), SmallPermille(100)],
    };

    /// A creeping film, calibrated with loads held for a second, and its sensor.
    struct Film {
        lagging: [f64; 2],
        memory: Memory,
        time_us: u64,
    }

    impl Film {
        fn new() -> Self {
            Self {
                lagging: [0.0; 2],
                memory: Memory::NONE,
                time_us: 0,
            }
        }

        /// Holds a force straight into the film, µN; returns the corrected force at the end and the
        /// force that was seen.
        fn hold(&mut self, creep: &Creep, force: f64, seconds: f64) -> (Undone, f64) {
            let mut last = None;
            for _ in 0..(seconds * 1e6) as u64 / FRAME_US {
                self.time_us += FRAME_US;
                let (mut seen, mut read) = (force, 1.0);
                for (k, part) in [0.04, 0.1].into_iter().enumerate() {
                    let time_s = f64::from(Creep::TIMES[k].0) * 1e-3;
                    let left = (-(FRAME_US as f64) * 1e-6 / time_s).exp();
                    self.lagging[k] = force + (self.lagging[k] - force) * left;
                    seen += part * self.lagging[k];
                    read += part * (1.0 - (-1.0 / time_s).exp());
                }
                let seen = seen / read;
                let mut own = pressed(seen.round() as i32, 0);
                own.place = own.place.map(|place| Place {
                    x: SignedMicrometres(2_000),
                    y: SignedMicrometres(-1_000),
                    ..place
                });
                let undone = self.memory.follow(creep, self.time_us, Some(&own));
                last = undone.zip(Some(seen));
            }
            last.unwrap()
        }
    }

    #[test]
    fn what_is_known_is_taken_off() {
        let mut film = Film::new();
        for (force, seconds) in [(1e5, 1.0), (1e5, 59.0), (0.0, 0.1), (0.0, 10.0), (5e4, 0.5)] {
            let (undone, seen) = film.hold(&KNOWN, force, seconds);
            let off = f64::from(undone.force.magnitude.0) - force;
            let before = (seen - force).abs();
            assert!(
                off.abs() < before.max(2_000.0) / 5.0,
                "{force}: {off} of {before} µN"
            );
            if force > 0.0 {
                let place = undone.force.place.unwrap();
                assert!((place.x.0 - 2_000).abs() < 20 && (place.y.0 + 1_000).abs() < 20);
            }
            assert!(undone.sigma.0 < 700, "{:?}", undone.sigma);
        }
    }

    /// A load held as in a calibration is as certain as without creep. One that is held for long,
    /// or was removed, is not, and the error is within its uncertainty.
    #[test]
    fn what_is_not_known_is_uncertain() {
        let mut film = Film::new();
        let (undone, seen) = film.hold(&Creep::USUAL, 1e5, 1.0);
        assert!(undone.sigma.0 < 100, "{:?}", undone.sigma);
        assert_eq!(undone.force.magnitude.0, seen.round() as i32, "as it is");
        for (force, seconds) in [(1e5, 59.0), (0.0, 0.1), (0.0, 10.0)] {
            let (undone, seen) = film.hold(&Creep::USUAL, force, seconds);
            let sigma = f64::from(undone.force.magnitude_sigma.0);
            assert!((seen - force).abs() < 3.0 * sigma, "{seen} ± {sigma} µN");
            assert!(sigma < 7_000.0, "{sigma} µN");
            assert_eq!(undone.is_remembered(), force == 0.0);
        }
    }

    #[test]
    fn a_lost_force_is_held_for_a_moment_and_then_gone() {
        for (after_us, expected) in [(HELD_US, true), (HELD_US + 1, false)] {
            let mut memory = Memory::NONE;
            memory.follow(&KNOWN, 0, Some(&pressed(100_000, 0)));
            memory.follow(&KNOWN, 10_000_000, Some(&pressed(100_000, 0)));
            assert_eq!(memory.follow(&KNOWN, 10_000_000 + after_us, None), None);
            assert_eq!(memory.force[2] < 0.0, expected);
        }
    }

    proptest! {
        /// For any forces at any times, a force never becomes more certain than the frame's own.
        #[test]
        fn no_force_becomes_more_certain(
            forces in proptest::collection::vec((any::<[i32; 3]>(), 0u64..u64::MAX / 32), 1..20),
            parts in [0u8..=150, 0u8..=150],
        ) {
            let creep = Creep {
                parts: parts.map(SmallPermille),
            };
            let (mut memory, mut time_us) = (Memory::NONE, 0);
            let all = forces.iter().map(|(vector, after)| (force_of(*vector), after));
            let all: Vec<_> = all.collect();
            for (own, after_us) in &all {
                time_us += *after_us;
                let Undone { force, .. } = memory.follow(&creep, time_us, Some(own)).unwrap();
                prop_assert!(force.magnitude_sigma >= own.magnitude_sigma);
                prop_assert!(force.direction_sigma >= own.direction_sigma);
                prop_assert!(force.place.unwrap().sigma >= own.place.unwrap().sigma);
                prop_assert!(force.magnitude.0 >= 0);
                prop_assert!(memory.lagging.iter().flatten().all(|part| part.is_finite()));
            }
        }
    }
}
