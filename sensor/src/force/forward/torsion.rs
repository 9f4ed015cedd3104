//! Finds the torque about the film's normal that friction under a turning contact brings.
//!
//! The images' motion by a torque is small, so it is linear in the torque. The steps do not have it
//! as an unknown: its covariance is added to that of the markers, and where the steps end the
//! residual gives the torque (best linear unbiased prediction: Henderson 1975). That is the
//! least-squares solution for all unknowns at once.
//!
//! Friction limits a torque to |F| times an arm. So the arm is computed, torque = |F| · arm, and a
//! stiffer film under a larger force has the same motion.

use super::covariance::{Covariance, Unknown, Whitening, add_square};
use super::estimate::{Estimate, Observed, Start};
use super::motions::Motions;
use super::mounting::{Mounting, RestImage};
use super::pose::Pose;
use super::residual;
use super::solve::{Rows, UNKNOWNS, dot};
use super::terms::Limits;
use super::{Column, Forward};
use crate::force::explained::rounded;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::force::Torque;
use hivtac_terms::layout::{EIGHT_V, SQUARE};
use hivtac_terms::units::{NanoNewtonMetres, UnsignedNanoNewtonMetres};

/// The markers are this near to those of the layout, mm.
const NEAR_MM: f32 = 1.0;
/// Standard deviation of the arm, mm, of a needle, and of any other contact: at a coefficient of
/// friction of 1, two thirds of the contact's radius are the most.
const NEEDLE_MM: f32 = 0.5;
const OTHER_MM: f32 = 1.0;
/// Coordinates of four markers.
const FEW: usize = 8;
/// The largest arm that counts as a last resort, mm.
const MOST_MM: f32 = 0.7;

/// The tables of nominal films, as the example `torques` of `calibration/` writes them.
const OF_SQUARE: &[u8] = include_bytes!("../../../data/torques-4.bin");
const OF_EIGHT_V: &[u8] = include_bytes!("../../../data/torques-8v.bin");

/// The motions by the arm, per mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torques<'a>(Motions<'a>);

/// A contact that may turn, as the steps use it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning<'a> {
    torques: Motions<'a>,
    /// Standard deviation of the arm, mm.
    sigma_mm: f32,
    /// Whether it counts only if the contact does not explain the markers without it.
    pub is_last_resort: bool,
}

/// The arm of a torque, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Arm {
    /// The likeliest arm.
    pub mm: f32,
    /// Its standard uncertainty, at most that of an unknown one.
    pub sigma_mm: f32,
}

impl Torques<'_> {
    /// Those of the nominal film, used for all films with its markers; `None` for other markers.
    pub fn nominal(rest_image: &RestImage) -> Option<Torques<'static>> {
        let tables: [(&[_], _); 2] = [(&SQUARE, OF_SQUARE), (&EIGHT_V, OF_EIGHT_V)];
        let is_near = |layout: &[_]| rest_image.is_layout(layout, NEAR_MM);
        let own = tables.into_iter().find(|(layout, _)| is_near(layout));
        own.and_then(|(_, table)| Motions::new(table)).map(Torques)
    }
}

impl<'a> Torques<'a> {
    /// Returns the prior of a shape's torque. It always counts if more than four markers also show
    /// the contact's width; else only where no contact without a torque explains the markers.
    pub fn of(&self, shape: ContactShape) -> Turning<'a> {
        let is_needle = shape == ContactShape::Needle;
        Turning {
            torques: self.0,
            sigma_mm: if is_needle { NEEDLE_MM } else { OTHER_MM },
            is_last_resort: is_needle || self.0.coordinates <= FEW,
        }
    }
}

impl Forward<'_> {
    /// Returns the load that explains the markers with a torque; `found` if none does.
    #[inline(never)]
    pub(super) fn under_a_torque(
        &self,
        found: Estimate,
        observed: &Observed<'_>,
        mounting: &Mounting,
        unknown: Unknown<'_>,
    ) -> Estimate {
        let by = (unknown, observed.turning.as_ref());
        let turned = self.estimate_with(observed, mounting, by, Start::At(found.pose));
        let looks = found.looks + turned.looks;
        let better = if turned.is_explained_by_a_torque() {
            turned
        } else {
            found
        };
        Estimate { looks, ..better }
    }
}

impl Estimate {
    /// Whether a torque counted.
    pub fn is_turned(&self) -> bool {
        self.arm.is_some()
    }

    /// Whether the load explains the markers with a torque that friction can bring. The limits are
    /// strict: a marker in a wrong place looks like a torque, too.
    fn is_explained_by_a_torque(&self) -> bool {
        let is_likely = self.arm.is_some_and(|arm| arm.mm.abs() <= MOST_MM);
        let most = match self.coordinates {
            ..=FEW => residual::usual(self.coordinates),
            _ => residual::stuck(self.coordinates),
        };
        is_likely && self.unexplained <= most
    }

    /// Returns the torque of a force of this size, µN; `None` if no torque counted. Its
    /// uncertainty is widened if the residual is larger than usual.
    #[inline(never)]
    pub fn torque(&self, micronewtons: f32) -> Option<Torque> {
        let Arm { mm, sigma_mm } = self.arm?;
        let sigma = rounded(micronewtons * self.noisier() * sigma_mm);
        Some(Torque {
            z: NanoNewtonMetres(rounded(micronewtons * mm)),
            sigma: UnsignedNanoNewtonMetres(sigma.max(1).unsigned_abs()),
        })
    }
}

impl Turning<'_> {
    /// Puts the motion by an arm of 1 mm into `motion`. Not inlined, so that its stack is released
    /// on return.
    #[inline(never)]
    pub fn put(&self, pose: &Pose, limits: &Limits, motion: &mut Column) {
        *motion = self.torques.of_group(0, (pose, limits), 1.0);
        // A mirror turns a torque over.
        let [over_x, over_y] = pose.place_mm.map(|part| part < 0.0);
        if over_x != over_y {
            motion.iter_mut().for_each(|part| *part = -*part);
        }
    }

    /// Adds the covariance of an unknown arm.
    #[inline(never)]
    pub fn add_to(&self, motion: &Column, covariance: &mut Covariance) {
        add_square(covariance, motion, self.sigma_mm);
    }

    /// Returns the arm that the residual `left` shows. `units` are the white equations' orthogonal
    /// columns, each of norm 1; the whitening includes [`Self::add_to`].
    #[inline(never)]
    pub fn arm(
        &self,
        (motion, whitening): (&Column, &Whitening),
        units: (&[Rows; UNKNOWNS], Option<&Rows>),
        left: &Rows,
    ) -> Arm {
        let mut white = *motion;
        whitening.whiten(&mut white);
        let (columns, width) = units;
        let own = columns
            .iter()
            .chain(width)
            .fold(dot(&white, &white), |own, unit| {
                let along = dot(&white, unit);
                own - along * along
            });
        let variance = self.sigma_mm * self.sigma_mm;
        Arm {
            mm: variance * dot(&white, left),
            sigma_mm: self.sigma_mm * libm::sqrtf((1.0 - variance * own).max(0.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::forward::solve::{norm, solve};
    use crate::force::forward::widths::tests::{LIMITS, image, places_mm};
    use hivtac_terms::units::Micrometres;
    use proptest::prelude::*;

    fn eight_v() -> Torques<'static> {
        Torques::nominal(&image(&places_mm(EIGHT_V))).unwrap()
    }

    fn square() -> Torques<'static> {
        Torques::nominal(&image(&places_mm(SQUARE))).unwrap()
    }

    fn motion(turning: &Turning<'_>, pose: &Pose) -> Column {
        let mut motion = Column::default();
        turning.put(pose, &LIMITS, &mut motion);
        motion
    }

    #[test]
    fn other_layouts_have_no_table() {
        assert_eq!(Torques::nominal(&image(&[[3.0, 1.0]; 6])), None);
    }

    #[test]
    fn few_markers_or_a_needle_need_a_reason() {
        assert!(square().of(ContactShape::Unknown).is_last_resort);
        assert!(eight_v().of(ContactShape::Needle).is_last_resort);
        assert!(
            !eight_v()
                .of(ContactShape::Round(Micrometres(1000)))
                .is_last_resort
        );
    }

    /// From x towards y: to the right of the place, images move down.
    #[test]
    fn a_positive_torque_turns_from_x_to_y() {
        for torques in [square(), eight_v()] {
            for place_mm in [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]] {
                let pose = Pose {
                    size: 0.4,
                    place_mm,
                    ..Pose::default()
                };
                let moved = motion(&torques.of(ContactShape::Needle), &pose);
                let turned = |dot: usize| -> f32 {
                    let at = match moved.len() {
                        8 => [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]][dot],
                        _ => [[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]][dot - 4],
                    };
                    at[0] * moved[2 * dot + 1] - at[1] * moved[2 * dot]
                };
                let first = moved.len() / 2 - 4;
                for dot in first..first + 4 {
                    assert!(turned(dot) > 1e-5, "{place_mm:?} {dot} {moved:?}");
                }
            }
        }
    }

    proptest! {
        /// As an unknown of its own with a prior, solved by least squares.
        #[test]
        fn the_arm_is_that_of_all_unknowns_at_once(
            parts in prop::array::uniform(-1.0f32..1.0),
            side in prop::array::uniform(-1.0f32..1.0),
            sigma_mm in 0.1f32..2.0,
        ) {
            const ROWS: usize = 10;
            let (parts, side): ([f32; 60], [f32; ROWS]) = (parts, side);
            let column = |k: usize| Column::of(parts[ROWS * k..ROWS * (k + 1)].iter().copied());
            let motion = column(5);
            let turning = Turning {
                torques: eight_v().0,
                sigma_mm,
                is_last_resort: false,
            };
            let mut whitening = Whitening::EMPTY;
            let set = whitening.set(|covariance| {
                covariance.reset(ROWS);
                (0..ROWS).for_each(|k| covariance.add(k, k, 1.0));
                turning.add_to(&motion, covariance);
            });
            prop_assume!(set.is_some());
            let white = |column: &Column| {
                let mut rows = Rows::of(column.iter().copied());
                whitening.whiten(&mut rows);
                rows
            };
            let mut columns: [Rows; UNKNOWNS] = core::array::from_fn(|k| white(&column(k)));
            let mut left = white(&Column::of(side));
            prop_assume!(solve(&mut columns, &mut left).is_some());
            let found = turning.arm((&motion, &whitening), (&columns, None), &left);

            // The arm in units of its σ is a sixth unknown, and its prior an eleventh equation.
            let more = |column: &Column, last: f32, by: f32| {
                let scaled = column.iter().map(|part| by * part);
                Rows::of(scaled.chain([last]))
            };
            let mut all: [Rows; UNKNOWNS + 1] = core::array::from_fn(|k| match k {
                UNKNOWNS => more(&motion, 1.0, sigma_mm),
                _ => more(&column(k), 0.0, 1.0),
            });
            let mut side = more(&Column::of(side), 0.0, 1.0);
            let Some(solved) = solve(&mut all, &mut side) else {
                return Ok(());
            };
            let spread: f32 = (0..=UNKNOWNS).map(|k| solved.covariance(k, k)).sum();
            prop_assume!(spread < 1e3);
            let mm = sigma_mm * solved.unknowns[UNKNOWNS];
            let sigma = sigma_mm * solved.covariance(UNKNOWNS, UNKNOWNS).sqrt();
            prop_assert!((found.mm - mm).abs() < 1e-2 * sigma_mm, "{} {mm}", found.mm);
            prop_assert!((found.sigma_mm - sigma).abs() < 1e-2 * sigma_mm);
        }
    }

    #[test]
    fn a_place_far_from_all_knots_has_a_motion() {
        let pose = Pose {
            size: 0.6,
            place_mm: [-8.0, 8.0],
            ..Pose::default()
        };
        let moved = motion(&eight_v().of(ContactShape::Unknown), &pose);
        assert!(norm(&moved) > 0.0 && norm(&moved) < 0.1);
    }
}
