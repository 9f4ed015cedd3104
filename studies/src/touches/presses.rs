//! The presses: one, two and three needles, and other objects.

use std::f64::consts::TAU;
use std::fmt;

use anyhow::Result;
use hivtac_calibration::forward::pairs::{Images, PairFilm};
use hivtac_shell::Patch;
use hivtac_twin::film::reduced::NOMINAL_RADIUS_MM;
use rand::Rng;

use crate::press::{ANGLE_DEG, seeded};

/// The largest coordinate of the middle of a press, and of each of its needles, mm.
const MIDDLE_MM: f64 = 4.0;
const REACH_MM: f64 = 6.0;
/// Distances of two needles, mm.
const APART_MM: [f64; 7] = [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0];
/// Their forces, mN.
const FORCES_MN: [[f64; 2]; 3] = [[50.0, 50.0], [100.0, 100.0], [80.0, 20.0]];
/// Distance of three needles from their middle, mm.
const THREE_MM: [f64; 2] = [1.5, 3.0];
/// Force of three needles together, of an edge and of a disc, mN.
const TOGETHER_MN: f64 = 120.0;
/// Forces of one needle, and of one ball, mN.
const ONE_MN: [f64; 2] = [20.0, 200.0];
/// Radii within which balls press, mm.
const BALLS_MM: [f64; 2] = [1.0, 2.0];
/// Length and half the width of an edge, and a disc's radius, mm.
const EDGE_MM: [f64; 2] = [6.0, 0.4];
const DISC_MM: f64 = 2.0;

/// The kind of press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// One needle.
    One,
    /// One soft ball, that presses within this radius, mm.
    Ball(f64),
    /// Two needles.
    Pair {
        /// Their distance, mm.
        apart_mm: f64,
        /// Their forces, mN.
        forces_mn: [f64; 2],
    },
    /// Three needles, so far from their middle, mm.
    Three(f64),
    /// An edge.
    Edge,
    /// A soft disc.
    Disc,
}

/// A press.
pub struct Press {
    /// Needles: places, mm, and forces, N; empty for other objects.
    pub needles: Vec<([f64; 2], [f64; 3])>,
    patches: Vec<(Patch, [f64; 3])>,
}

impl Kind {
    /// All rows' kinds.
    pub fn all() -> impl Iterator<Item = Kind> {
        let pairs = FORCES_MN.into_iter().flat_map(|forces_mn| {
            APART_MM.into_iter().map(move |apart_mm| Kind::Pair {
                apart_mm,
                forces_mn,
            })
        });
        let others = THREE_MM.map(Kind::Three).into_iter();
        let others = others.chain([Kind::Edge, Kind::Disc]);
        pairs
            .chain([Kind::One])
            .chain(BALLS_MM.map(Kind::Ball))
            .chain(others)
    }

    /// Whether it is one needle or ball, which get many presses.
    pub fn is_single(self) -> bool {
        matches!(self, Kind::One | Kind::Ball(_))
    }

    /// The press with this number of a seed: the same for the same numbers.
    ///
    /// # Errors
    /// Never, as long as the sizes are those of patches.
    pub fn press(self, seed: u32, number: u32) -> Result<Press> {
        let first = if self.is_single() { 50_000 } else { 1_000 };
        let mut random = seeded(100_000 * u64::from(seed) + first + u64::from(number));
        let single_mn = match self.is_single() {
            true => random.random_range(ONE_MN[0]..ONE_MN[1]),
            false => TOGETHER_MN,
        };
        let mut between = |[from, to]: [f64; 2]| random.random_range(from..to);
        let mut force_n = |size_mn: f64| {
            let [x, y] = [(); 2].map(|()| between([-ANGLE_DEG, ANGLE_DEG]).to_radians().tan());
            let whole = (x * x + y * y + 1.0).sqrt();
            [x, y, -1.0].map(|part| 1e-3 * size_mn * part / whole)
        };
        let forces_n: Vec<[f64; 3]> = match self {
            Kind::Pair { forces_mn, .. } => forces_mn.map(&mut force_n).to_vec(),
            Kind::Three(_) => [(); 3].map(|()| force_n(TOGETHER_MN / 3.0)).to_vec(),
            _ => vec![force_n(single_mn)],
        };
        let around = |middle_mm: [f64; 2], far_mm: f64, turn: f64| {
            [
                middle_mm[0] + far_mm * turn.cos(),
                middle_mm[1] + far_mm * turn.sin(),
            ]
        };
        loop {
            let middle_mm = [(); 2].map(|()| between([-MIDDLE_MM, MIDDLE_MM]));
            let turn = between([0.0, TAU]);
            let places_mm: Vec<[f64; 2]> = match self {
                Kind::Pair { apart_mm, .. } => [0.0, 0.5]
                    .map(|part| around(middle_mm, 0.5 * apart_mm, turn + part * TAU))
                    .to_vec(),
                Kind::Three(far_mm) => [0.0, 1.0, 2.0]
                    .map(|part| around(middle_mm, far_mm, turn + part * TAU / 3.0))
                    .to_vec(),
                _ => vec![middle_mm],
            };
            if places_mm.iter().flatten().any(|part| part.abs() > REACH_MM) {
                continue;
            }
            let needles: Vec<_> = places_mm.into_iter().zip(forces_n).collect();
            return self.patches(needles, turn);
        }
    }

    fn patches(self, needles: Vec<([f64; 2], [f64; 3])>, turn: f64) -> Result<Press> {
        let patch = |place_mm: [f64; 2]| match self {
            Kind::Edge => Patch::line(place_mm, EDGE_MM[0], EDGE_MM[1], turn.to_degrees()),
            Kind::Disc => Patch::disc(place_mm, DISC_MM),
            Kind::Ball(radius_mm) => Patch::disc(place_mm, radius_mm),
            _ => Patch::tip(place_mm, NOMINAL_RADIUS_MM),
        };
        let patches = needles
            .iter()
            .map(|(place, force)| Ok((patch(*place)?, *force)));
        let patches = patches.collect::<Result<_>>()?;
        Ok(Press { needles, patches })
    }
}

impl Press {
    /// How the images of the dots move, focal lengths.
    ///
    /// # Errors
    /// If the film finds no equilibrium.
    pub fn moved(&self, film: &PairFilm) -> Result<Images> {
        film.pressed(&self.patches)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Kind::One => write!(f, "one needle, {} to {} mN", ONE_MN[0], ONE_MN[1]),
            Kind::Ball(radius_mm) => write!(
                f,
                "one ball, within {radius_mm} mm, {} to {} mN",
                ONE_MN[0], ONE_MN[1]
            ),
            Kind::Pair {
                apart_mm,
                forces_mn: [a, b],
            } => write!(f, "{a} + {b} mN | {apart_mm} mm"),
            Kind::Three(far_mm) => write!(
                f,
                "three needles of {} mN, {:.1} mm apart",
                TOGETHER_MN / 3.0,
                far_mm * 3f64.sqrt()
            ),
            Kind::Edge => write!(f, "edge of {} mm, {TOGETHER_MN} mN", EDGE_MM[0]),
            Kind::Disc => write!(f, "soft disc of {DISC_MM} mm radius, {TOGETHER_MN} mN"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presses_are_what_their_kind_says() {
        for kind in Kind::all() {
            for number in 0..20 {
                let press = kind.press(0, number).unwrap();
                assert_eq!(press.needles, kind.press(0, number).unwrap().needles);
                let mut reach = press.needles.iter().flat_map(|(place, _)| place);
                assert!(reach.all(|part| part.abs() <= REACH_MM), "{kind}");
                if let Kind::Pair { apart_mm, .. } = kind {
                    let [(a, _), (b, _)] = press.needles[..] else {
                        panic!("{kind}");
                    };
                    let far_mm = (a[0] - b[0]).hypot(a[1] - b[1]);
                    assert!((far_mm - apart_mm).abs() < 1e-9, "{kind}");
                }
            }
        }
    }
}
