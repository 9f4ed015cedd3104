//! Finds the two contacts that explain the markers, where one does not.
//!
//! Two contacts have ten unknowns, eight markers sixteen coordinates. The motion under both is a
//! mean of two single ones, plus a small network's correction (`interaction`). It is valid for
//! needles only.
//!
//! | file | subject |
//! |---|---|
//! | `interaction` | a network's correction of the mean of single contacts |
//! | `network` | the network |
//! | `film` | the positions of all images, with slopes |
//! | `descent` | steps of falling residual from a start |
//! | `search` | where steps begin; both in parts, for a device with little time |

mod descent;
mod film;
mod interaction;
mod network;
mod search;

pub use descent::Problem;
pub use film::{Both, PairPrediction};
pub use interaction::{INPUTS as PAIR_UNKNOWNS, Interaction};
pub use search::{Found, Search, Work, follow};

use super::covariance::Unknown;
use super::estimate::{Observed, Sigma, stated};
use super::mounting::Mounting;
use super::pose::Pose;
use super::solve::{Solved, square};
use super::{Forward, Strength};
use crate::force::kernels::sqrt;
use crate::markers::lost::Lost;
use core::f32::consts::FRAC_1_SQRT_2;

/// Two contacts.
pub type Pair = [Pose; 2];

/// χ² of six degrees of freedom that 1 of 2,000, and 1 of 6 undisturbed frames exceed.
const UNEXPLAINED: f32 = 24.1;
const USUAL: f32 = 9.1;
/// Where steps begin: so far apart, mm, with this part of the force in the first, along these unit
/// vectors of half a turn.
const APART_MM: [f32; 4] = [1.5, 3.0, 5.0, 8.0];
const PARTS: [f32; 3] = [0.5, 0.3, 0.7];
const ALONG: [[f32; 2]; 8] = [
    [1.0, 0.0],
    [0.924, 0.383],
    [FRAC_1_SQRT_2, FRAC_1_SQRT_2],
    [0.383, 0.924],
    [0.0, 1.0],
    [-0.383, 0.924],
    [-FRAC_1_SQRT_2, FRAC_1_SQRT_2],
    [-0.924, 0.383],
];
/// Number of the nearest starts from which steps are taken.
const DESCENTS: usize = 4;
/// Two contacts count as resolved if their distance is at least this many times the uncertainty of
/// each place along an axis.
const APART_SIGMAS: f32 = 4.0;
/// Nearer contacts are not resolved, mm: the motion is not linear within their uncertainty.
const LEAST_APART_MM: f32 = 1.8;
/// Other contacts are a rival if the residual is greater by at most this, and a place differs by
/// more than this, mm.
const RIVAL: f32 = 9.0;
const ANOTHER_MM: f32 = 0.8;
/// Step of the tilt for slopes of the direction, rad.
const STEP: f32 = 1e-2;

/// Two contacts and how well they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairEstimate {
    /// The contacts.
    pub pair: Pair,
    /// The size of both together.
    pub size: f32,
    /// The squared residual, relative to its covariance.
    pub unexplained: f32,
    /// Whether no other two contacts were found that explain the markers nearly as well.
    pub is_only: bool,
    /// The solution of the markers' equations, in the order of [`Both::inputs`] with the sizes of
    /// both first; `None` if they do not determine all unknowns.
    pub solved: Option<Solved<PAIR_UNKNOWNS>>,
}

/// A force of a pair, or the sum of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The force, N.
    pub force_n: [f32; 3],
    /// Its place, mm; of the sum, the mean of both places by the forces' sizes.
    pub place_mm: [f32; 2],
    /// Its standard uncertainties; `None` if the markers do not determine them.
    pub sigma: Option<Sigma>,
}

/// Calls `of` with the markers that two needles may explain. Returns `None` if this layout has no
/// network, a marker is lost, the film's weight needs a correction, or the contact is no needle.
pub fn find<T>(
    forward: &Forward<'_>,
    observed: &Observed<'_>,
    mounting: &Mounting,
    unknown: Unknown<'_>,
    of: impl FnOnce(&Problem<'_>) -> T,
) -> Option<T> {
    let is_known =
        observed.lost == Lost::NONE && observed.hanging.is_none() && observed.pressing.is_none();
    let interaction = Interaction::of_layout(&forward.rest_image).filter(|_| is_known)?;
    Some(of(&Problem {
        forward,
        interaction: &interaction,
        observed,
        mounting,
        unknown,
    }))
}

impl Forward<'_> {
    /// Two contacts with the force and the middle of one.
    fn around(&self, one: &Pose, along: [f32; 2], apart_mm: f32, part: f32) -> Pair {
        let all_n = self.stiffness.magnitude_n(one.size);
        [(part, 1.0 - part), (1.0 - part, -part)].map(|(part, way)| Pose {
            size: self.stiffness.size_of(part * all_n, self.limits.size),
            tilt: one.tilt,
            place_mm: [0, 1].map(|i| one.place_mm[i] + way * apart_mm * along[i]),
            width: 0.0,
        })
    }
}

impl PairEstimate {
    /// Returns whether the contacts explain the markers; false if the residual is NaN.
    pub fn is_explained(&self) -> bool {
        is_explained(self.unexplained)
    }

    /// Returns whether each contact is known: no other two explain the markers nearly as well, and
    /// they are further apart than their places are uncertain.
    pub fn are_apart(&self, strength: &Strength) -> bool {
        let [first, second] = self.pair.each_ref();
        let apart_mm = far_mm(first, second);
        let sigmas = self.contacts(strength).map(|own| own.sigma);
        let is_apart = |sigma: Option<Sigma>| {
            sigma.is_some_and(|sigma| APART_SIGMAS * sigma.place_mm < apart_mm)
        };
        self.is_only && apart_mm > LEAST_APART_MM && sigmas.into_iter().all(is_apart)
    }

    /// Each contact.
    pub fn contacts(&self, strength: &Strength) -> [Part; 2] {
        [[1.0, 0.0], [0.0, 1.0]].map(|counts| self.part(strength, counts))
    }

    /// The sum of both.
    pub fn sum(&self, strength: &Strength) -> Part {
        self.part(strength, [1.0; 2])
    }

    /// The sum of the contacts, each counted so often.
    fn part(&self, strength: &Strength, counts: [f32; 2]) -> Part {
        let stiffness = &strength.stiffness;
        let sizes_n = self.pair.map(|pose| stiffness.magnitude_n(pose.size));
        let all_n = counts[0] * sizes_n[0] + counts[1] * sizes_n[1];
        let (mut force_n, mut place_mm) = ([0.0; 3], [0.0; 2]);
        let mut by = [[0.0; PAIR_UNKNOWNS]; 5];
        for (number, (pose, count)) in self.pair.iter().zip(counts).enumerate() {
            let size_n = count * sizes_n[number];
            let per_size_n = count * stiffness.per_size_n(pose.size);
            let direction = pose.direction();
            let other = self.pair[1 - number];
            for i in 0..3 {
                force_n[i] += size_n * direction[i];
                by[i][number] = per_size_n * direction[i];
            }
            for way in 0..2 {
                let slope = slope_of_direction(pose, way);
                for i in 0..3 {
                    by[i][2 + 2 * number + way] = size_n * slope[i];
                }
                place_mm[way] += size_n / all_n * pose.place_mm[way];
                by[3 + way][6 + 2 * number + way] = size_n / all_n;
                let apart_mm = pose.place_mm[way] - other.place_mm[way];
                let of_other = counts[1 - number] * sizes_n[1 - number] / all_n;
                by[3 + way][number] = per_size_n / all_n * of_other * apart_mm;
            }
        }
        // The uncertainty of a unit's strength is common to all of its forces.
        let of_unit_n = strength.sigma_n(self.size, 0.0) * all_n
            / (sizes_n[0] + sizes_n[1]).max(f32::MIN_POSITIVE);
        Part {
            force_n,
            place_mm,
            sigma: self.sigma(force_n, &by, of_unit_n),
        }
    }

    /// The standard uncertainties of a force with a place, from the slopes of its components and of
    /// the place by the unknowns.
    fn sigma(
        &self,
        force_n: [f32; 3],
        by: &[[f32; PAIR_UNKNOWNS]; 5],
        of_unit_n: f32,
    ) -> Option<Sigma> {
        let solved = self.solved.as_ref()?;
        let spread = |by: &[f32; PAIR_UNKNOWNS]| {
            let mut sum = [0.0; PAIR_UNKNOWNS];
            for (part, row) in by.iter().zip(&solved.spread) {
                for (sum, entry) in sum.iter_mut().zip(row) {
                    *sum += part * entry;
                }
            }
            sum
        };
        let [x, y, z, right, below] = by.each_ref().map(spread);
        let size_n = sqrt(square(&force_n)).max(f32::MIN_POSITIVE);
        let along = force_n.map(|part| part / size_n);
        let [beside, across] = beside(along);
        let of = |way: [f32; 3]| -> [f32; PAIR_UNKNOWNS] {
            core::array::from_fn(|k| way[0] * x[k] + way[1] * y[k] + way[2] * z[k])
        };
        let [along, beside, across] = [along, beside, across].map(of);
        let noisier = sqrt(1.0 + (self.unexplained - USUAL).max(0.0) / USUAL);
        let by_noise_n = noisier * sqrt(square(&along));
        Some(Sigma {
            direction: noisier * stated(covariance(&beside, &across)) / size_n,
            magnitude_n: sqrt(by_noise_n * by_noise_n + of_unit_n * of_unit_n),
            by_noise_n,
            place_mm: noisier * stated(covariance(&right, &below)) * FRAC_1_SQRT_2,
        })
    }
}

fn is_explained(unexplained: f32) -> bool {
    (0.0..=UNEXPLAINED).contains(&unexplained)
}

/// Whether other contacts explain the markers nearly as well as the best, each with its residual.
fn has_rival((best, pair): (f32, &Pair), (unexplained, other): (f32, &Pair)) -> bool {
    let ([a, b], [c, d]) = (other, pair);
    let same_order = far_mm(a, c).max(far_mm(b, d));
    let other_order = far_mm(a, d).max(far_mm(b, c));
    is_explained(unexplained)
        && unexplained - best < RIVAL
        && same_order.min(other_order) > ANOTHER_MM
}

/// The distance of two contacts, mm.
fn far_mm(one: &Pose, other: &Pose) -> f32 {
    let [x, y] = [0, 1].map(|way| one.place_mm[way] - other.place_mm[way]);
    sqrt(x * x + y * y)
}

/// The slope of a direction by the tilt along x or y.
fn slope_of_direction(pose: &Pose, way: usize) -> [f32; 3] {
    let [back, forth] = [-STEP, STEP].map(|step| {
        let mut there = *pose;
        if let Some(tilt) = there.tilt.get_mut(way) {
            *tilt += step;
        }
        there.direction()
    });
    core::array::from_fn(|i| (forth[i] - back[i]) / (2.0 * STEP))
}

/// Two unit vectors across one that is not along y.
fn beside([x, y, z]: [f32; 3]) -> [[f32; 3]; 2] {
    let flat = sqrt(x * x + z * z).max(f32::MIN_POSITIVE);
    let [a, c] = [-z / flat, x / flat];
    [[a, 0.0, c], [y * c, z * a - x * c, -y * a]]
}

/// The covariance (xx, xy, yy) of two quantities with these rows.
fn covariance(one: &[f32; PAIR_UNKNOWNS], other: &[f32; PAIR_UNKNOWNS]) -> [f32; 3] {
    let pairs = one.iter().zip(other);
    [
        square(one),
        pairs.fold(0.0, |sum, (a, b)| sum + a * b),
        square(other),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::forward::{Column, Markers};
    use crate::force::model::Model;
    use hivtac_terms::list::List;

    const MODEL: &[u8] = include_bytes!("../../../../../calibration/models/8v/default.hvtm");
    /// 0.011 px, focal lengths.
    const NOISE: f32 = 0.011 / 175.0;

    fn forward() -> Forward<'static> {
        Model::parse(MODEL).unwrap().forward.unwrap()
    }

    fn mounting(forward: &Forward<'_>) -> Mounting {
        Mounting {
            per_px: forward.per_px.unwrap(),
            beside_mm: Markers::defaults(8),
        }
    }

    fn observed(moved: Column) -> Observed<'static> {
        Observed {
            moved,
            noise: List::filled(8, [NOISE * NOISE, 0.0, NOISE * NOISE]),
            lost: Lost::NONE,
            drift: None,
            hanging: None,
            pressing: None,
            wide: None,
            turning: None,
        }
    }

    fn moved(forward: &Forward<'_>, pair: Pair) -> Column {
        let interaction = Interaction::of_layout(&forward.rest_image).unwrap();
        let mut prediction = PairPrediction::default();
        let beside_mm = Markers::defaults(8);
        prediction.put(&Both::new(pair, forward), forward, &interaction, &beside_mm);
        prediction.moved
    }

    fn found(forward: &Forward<'_>, observed: &Observed<'_>) -> Option<PairEstimate> {
        let (mounting, unknown) = (mounting(forward), Unknown::Nothing);
        let start = super::super::Start::Anywhere;
        let one = forward.estimate(observed, &mounting, unknown, start);
        assert!(!one.is_explained());
        find(forward, observed, &mounting, unknown, |problem| {
            let mut search = Search::new(one.pose);
            assert!(search.go_on(problem, &mut Work(u32::MAX)));
            search.best(problem)
        })?
    }

    const PAIR: Pair = [
        Pose {
            size: 0.33,
            tilt: [0.05, -0.08],
            place_mm: [2.0, 1.0],
            width: 0.0,
        },
        Pose {
            size: 0.28,
            tilt: [-0.02, 0.06],
            place_mm: [-1.5, -0.5],
            width: 0.0,
        },
    ];

    /// Without noise the very contacts are found, and σ contains them.
    #[test]
    fn a_pair_comes_back() {
        let forward = forward();
        let strength = forward.strength(true);
        let found = found(&forward, &observed(moved(&forward, PAIR))).unwrap();
        assert!(
            found.is_explained() && found.are_apart(&strength),
            "{found:?}"
        );
        let mut parts = found.contacts(&strength);
        if far_mm(&found.pair[0], &PAIR[0]) > 1.0 {
            parts.reverse();
        }
        let mut sum_n = [0.0; 3];
        for (part, pose) in parts.iter().zip(&PAIR) {
            let sigma = part.sigma.unwrap();
            let size_n = forward.stiffness.magnitude_n(pose.size);
            let force_n = pose.direction().map(|along| size_n * along);
            for k in 0..3 {
                assert!((part.force_n[k] - force_n[k]).abs() < 1e-3, "{part:?}");
                sum_n[k] += force_n[k];
            }
            for k in 0..2 {
                assert!(
                    (part.place_mm[k] - pose.place_mm[k]).abs() < 0.05,
                    "{part:?}"
                );
            }
            assert!((1e-4..5e-3).contains(&sigma.magnitude_n), "{sigma:?}");
            assert!((1e-3..0.2).contains(&sigma.place_mm), "{sigma:?}");
        }
        let sum = found.sum(&strength);
        let sigma = sum.sigma.unwrap();
        for (found, force_n) in sum.force_n.iter().zip(sum_n) {
            assert!((found - force_n).abs() < 3e-4, "{sum:?}");
        }
        // The sum is known far better than its parts.
        assert!(
            2.0 * sigma.direction < parts[0].sigma.unwrap().direction,
            "{sigma:?}"
        );
    }

    /// Steps from the nearest starts lead to contacts that explain the markers. So they do where
    /// slopes by both are nearly the same, or all starts are far off.
    #[test]
    fn steps_do_not_end_on_the_way() {
        let forward = forward();
        let pose = |size, place_mm| Pose {
            size,
            place_mm,
            ..Pose::default()
        };
        for pair in [
            [pose(0.36, [-1.65, 2.45]), pose(0.36, [4.35, 2.16])],
            [pose(0.36, [3.09, 3.31]), pose(0.36, [-2.88, 2.75])],
            [pose(0.42, [3.67, 2.95]), pose(0.26, [0.2, 0.96])],
            [pose(0.36, [3.55, -3.06]), pose(0.36, [3.85, -4.02])],
        ] {
            let found = found(&forward, &observed(moved(&forward, pair))).unwrap();
            assert!(found.is_explained(), "{pair:?} {found:?}");
        }
    }

    /// In parts a search finds what it finds at once. Then contacts that move are followed with one
    /// step a frame, and explain the next frame without one.
    #[test]
    fn a_pair_is_found_in_parts_and_followed() {
        let forward = forward();
        let still = observed(moved(&forward, PAIR));
        let at_once = found(&forward, &still).unwrap();
        let (mounting, unknown) = (mounting(&forward), Unknown::Nothing);
        let one = forward.estimate(&still, &mounting, unknown, super::super::Start::Anywhere);
        let mut search = Search::new(one.pose);
        let go_on = |problem: &Problem<'_>| {
            let parts = (1..).find(|_| search.go_on(problem, &mut Work(1)));
            (parts.unwrap(), search.best(problem))
        };
        let (parts, in_parts) = find(&forward, &still, &mounting, unknown, go_on).unwrap();
        assert_eq!(in_parts, Some(at_once));
        assert!((28..80).contains(&parts), "{parts}");
        let mut known = at_once;
        let order = usize::from(far_mm(&known.pair[0], &PAIR[0]) > 1.0);
        let mut pair = PAIR;
        for _ in 0..50 {
            pair[0].place_mm[0] += 0.02;
            pair[1].size *= 1.01;
            let frame = observed(moved(&forward, pair));
            let next = |problem: &Problem<'_>| follow(&known, problem, &mut Work(1));
            let next = find(&forward, &frame, &mounting, unknown, next).unwrap();
            assert!(next.is_explained() && next.is_only, "{next:?}");
            let hold = |problem: &Problem<'_>| follow(&next, problem, &mut Work(0));
            let held = find(&forward, &frame, &mounting, unknown, hold).unwrap();
            let off = (held.unexplained - next.unexplained).abs();
            assert!(held.pair == next.pair && off < 0.5, "{held:?}");
            known = next;
            assert!(far_mm(&next.pair[order], &pair[0]) < 0.05, "{next:?}");
        }
    }

    #[test]
    fn what_is_not_known_is_no_pair() {
        let forward = forward();
        let moved = moved(&forward, PAIR);
        let mut lost = observed(moved);
        lost.lost = Lost::only(0);
        lost.lost.clear(&mut lost.moved);
        assert_eq!(found(&forward, &lost), None);
        // Motion of no contact at all.
        let wild = Column::from_fn(16, |k| 0.02 * ((k * k) as f32).sin());
        assert_eq!(found(&forward, &observed(wild)), None);
    }

    /// How a soft ball moves the dots, focal lengths: 136 mN within 1 mm of (2.51, 1.41) mm, by
    /// finite elements.
    const BALL: [f32; 16] = [
        -0.106_537, -0.072_623, 0.149_932, -0.091_83, 0.173_869, 0.112_143, -0.113_086, 0.082_561,
        -0.125_68, 0.003_107, 0.009_982, -0.137_048, 0.215_753, -0.006_678, 0.008_03, 0.173_558,
    ];

    /// Two near needles explain it, and one wide contact does as well.
    #[test]
    fn a_ball_is_not_two_needles() {
        let forward = forward();
        let ball = observed(Column::of(BALL));
        assert_eq!(found(&forward, &ball), None);
        let of_needles = Forward {
            widths: None,
            ..forward
        };
        let two = found(&of_needles, &ball).unwrap();
        assert!(two.is_explained(), "{two:?}");
        assert!(
            far_mm(&two.pair[0], &two.pair[1]) < LEAST_APART_MM,
            "{two:?}"
        );
    }

    #[test]
    fn unit_vectors_are_across() {
        let along = [0.6, 0.48, -0.64];
        let [a, b] = beside(along);
        let product = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        for (one, other, wanted) in [(a, a, 1.0), (b, b, 1.0), (a, b, 0.0), (a, along, 0.0)] {
            assert!((product(one, other) - wanted).abs() < 1e-6);
        }
        assert!(product(b, along).abs() < 1e-6);
    }
}
