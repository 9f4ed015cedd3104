//! Takes Gauss–Newton steps from a first guess to the load that explains the markers best.

use super::covariance::{Covariance, Unknown};
use super::descent::{Descent, Storage};
use super::drift::Drift;
use super::mounting::Mounting;
use super::pose::{Pose, sine_over_angle_and_cosine};
use super::predict::Markers;
use super::residual;
use super::shapes::Pressing;
use super::solve::{Column, MOST_DOTS, Solved};
use super::torsion::{Arm, Turning};
use super::weight::Hanging;
use super::widths::Wide;
use super::{Forward, Strength};
use crate::markers::lost::Lost;
use hivtac_terms::list::List;

/// Most steps of a frame, more than the model's number: steps go on while the load does not explain
/// the markers. Little-known units begin far from the result.
pub const STEPS_AT_MOST: u8 = 8;

/// Where steps without a guess begin, as a fraction of the largest size.
const HALF: f32 = 0.5;
/// Variance of a lost marker's coordinates, focal lengths squared: so large that the marker has no
/// weight.
const LOST: f32 = 1e6;

/// Where steps begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Nothing is known of the load.
    Anywhere,
    /// At a guess. If the load found there does not explain the markers, also elsewhere.
    Near(Pose),
    /// At a guess, and nowhere else.
    At(Pose),
    /// Where the markers moved most, and nowhere else.
    WhereMost,
    /// At the nearest of a few presses, and nowhere else.
    Press,
}

/// How the markers' images moved since the rest position, and how well that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed<'a> {
    /// x and y of each marker, focal lengths along the film's axes.
    pub moved: Column,
    /// The noise of each marker: covariances xx, xy, yy, focal lengths squared; xx and yy > 0.
    pub noise: List<[f32; 3], MOST_DOTS>,
    /// Markers that are not seen; they have no weight.
    pub lost: Lost,
    /// How far the film may rest from the rest position, px; `None` if that is 0.
    pub drift: Option<(&'a Drift, &'a Markers)>,
    /// The effect of the film's own weight; `None` if the tables and the rest position include it.
    pub hanging: Option<&'a Hanging>,
    /// The contact's shape; `None` for the tables' tip.
    pub pressing: Option<Pressing<'a>>,
    /// The contact's shape, if its width is an unknown; otherwise `None`.
    pub wide: Option<Wide<'a>>,
    /// The torque of what presses; `None` if it is none, or its effect is unknown.
    pub turning: Option<Turning<'a>>,
}

impl Observed<'_> {
    /// The width where the first steps begin.
    pub(super) fn first_width(&self) -> f32 {
        self.wide.as_ref().map_or(0.0, Wide::first)
    }

    /// Number of coordinates that are seen.
    pub(super) fn coordinates(&self) -> usize {
        self.moved.len().saturating_sub(2 * self.lost.count())
    }

    /// Puts the noise of all markers, which is independent between markers, into `covariance`.
    pub(super) fn put_noise(&self, covariance: &mut Covariance) {
        covariance.reset(self.moved.len());
        self.add_noise(covariance);
    }

    /// Adds noise, and the covariance of the rest position.
    pub(super) fn add_to(&self, mounting: &Mounting, covariance: &mut Covariance) {
        self.add_noise(covariance);
        if let Some((drift, rest_px)) = self.drift {
            drift.add_to(mounting, rest_px, covariance);
        }
    }

    fn add_noise(&self, covariance: &mut Covariance) {
        for (dot, [xx, xy, yy]) in self.noise.iter().enumerate() {
            let (x, y) = (2 * dot, 2 * dot + 1);
            let [xx, xy, yy] = match self.lost.contains(dot) {
                true => [LOST, 0.0, LOST],
                false => [*xx, *xy, *yy],
            };
            covariance.add(x, x, xx);
            covariance.add(y, x, xy);
            covariance.add(y, y, yy);
        }
    }
}

/// A load and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The load.
    pub pose: Pose,
    /// The squared residual, relative to its covariance by noise and the unit's uncertainty.
    pub unexplained: f32,
    /// The residual that no load near this one explains, in units of noise alone. Its change from
    /// frame to frame is noise, whatever is unknown of the unit.
    pub left: Column,
    /// The solution of the markers' equations at this load; `None` if they do not determine all
    /// unknowns.
    pub solved: Option<Solved>,
    /// The torque over |F|, if it counted; otherwise `None`.
    pub(super) arm: Option<Arm>,
    /// Number of coordinates that were seen.
    pub coordinates: usize,
    /// How often the film was run forwards: once at the start, and once for each step.
    pub looks: u8,
}

impl Forward<'_> {
    /// As [`Self::estimate_with`]. Where no load explains the markers, a torque may.
    #[inline(never)]
    pub fn estimate(
        &self,
        observed: &Observed<'_>,
        mounting: &Mounting,
        unknown: Unknown<'_>,
        start: Start,
    ) -> Estimate {
        let turning = observed.turning.as_ref();
        let always = turning.filter(|turning| !turning.is_last_resort);
        let found = self.estimate_with(observed, mounting, (unknown, always), start);
        if turning.is_none() || always.is_some() || found.is_explained() {
            return found;
        }
        self.under_a_torque(found, observed, mounting, unknown)
    }

    /// Takes steps from a guess, or without one from where the markers moved most. If they get
    /// stuck, or end at a load that does not explain the markers, it starts again: where the
    /// markers moved most, or from the nearest of a few presses, unless the start forbids it. These
    /// succeed where the first steps began badly. Returns the better load. Compiled once, because
    /// the near memory is scarce.
    #[inline(never)]
    pub(super) fn estimate_with(
        &self,
        observed: &Observed<'_>,
        mounting: &Mounting,
        by: (Unknown<'_>, Option<&Turning<'_>>),
        start: Start,
    ) -> Estimate {
        let mut storage = Storage::new();
        let mut descend = |guess| {
            let storage = &mut storage;
            self.descend(Descent::new(self, observed, mounting, by, guess, storage))
        };
        let where_most = |size| Pose {
            size,
            place_mm: self.rest_image.where_most(&observed.moved),
            width: observed.first_width(),
            ..Pose::default()
        };
        let (found, is_done) = descend(match start {
            Start::Anywhere | Start::WhereMost => where_most(HALF * self.limits.size),
            Start::Near(guess) | Start::At(guess) => guess,
            Start::Press => self.nearest_press(observed, &mounting.beside_mm),
        });
        let (other, _) = descend(match start {
            _ if is_done => return found,
            Start::At(_) | Start::WhereMost | Start::Press => return found,
            Start::Near(guess) => where_most(guess.size),
            Start::Anywhere => {
                let wide = observed.wide.as_ref();
                match wide.and_then(|wide| wide.second(found.pose.width)) {
                    Some(width) => Pose {
                        width,
                        ..found.pose
                    },
                    None => self.nearest_press(observed, &mounting.beside_mm),
                }
            }
        });
        let looks = found.looks + other.looks;
        let nearer = if other.unexplained < found.unexplained {
            other
        } else {
            found
        };
        Estimate { looks, ..nearer }
    }

    /// Takes as many steps as the model asks for, and more if these do not explain the markers.
    /// Also returns whether the descent came to an end.
    fn descend(&self, mut descent: Descent<'_>) -> (Estimate, bool) {
        for step in 0..STEPS_AT_MOST {
            if step >= self.steps && descent.is_over() {
                break;
            }
            if !descent.step() {
                break;
            }
        }
        let is_done = descent.is_done();
        (descent.estimate(), is_done)
    }
}

/// Standard uncertainties of a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigma {
    /// Uncertainty of the direction, both axes across it together, rad.
    pub direction: f32,
    /// Uncertainty of |F|, N.
    pub magnitude_n: f32,
    /// The part of `magnitude_n` that noise leaves in the size alone, N.
    pub by_noise_n: f32,
    /// Uncertainty of each coordinate of the place, mm: the root of half their covariance's trace.
    pub place_mm: f32,
}

impl Estimate {
    /// Returns whether the load explains the markers; false if the residual is NaN.
    pub fn is_explained(&self) -> bool {
        (0.0..=residual::unexplained(self.coordinates)).contains(&self.unexplained)
    }

    /// The factor by which the residual exceeds the markers' stated noise, at least 1.
    pub(super) fn noisier(&self) -> f32 {
        let usual = residual::usual(self.coordinates);
        libm::sqrtf(1.0 + (self.unexplained - usual).max(0.0) / usual)
    }

    /// Returns the standard uncertainties; `None` if the markers do not determine all unknowns.
    /// They are widened if the residual is larger than usual.
    pub fn sigma(&self, strength: &Strength) -> Option<Sigma> {
        let solved = self.solved.as_ref()?;
        let covariance = |(a, b): (usize, usize)| solved.covariance(a, b);
        let tilt = [(1, 1), (1, 2), (2, 2)].map(covariance);
        let place = [(3, 3), (3, 4), (4, 4)].map(covariance);
        let noisier = self.noisier();
        let place_mm = noisier * stated(place) * core::f32::consts::FRAC_1_SQRT_2;
        let size = noisier * libm::sqrtf(covariance((0, 0)));
        Some(Sigma {
            direction: noisier * stated(across(&self.pose, tilt)),
            magnitude_n: strength.sigma_n(self.pose.size, size),
            by_noise_n: strength.stiffness.per_size_n(self.pose.size) * size,
            place_mm,
        })
    }
}

/// The covariance (xx, xy, yy) of the direction. Away from the normal the tilt counts fully; across
/// that it counts by sin θ / θ, as the circle there is shorter than its angle.
fn across(pose: &Pose, [xx, xy, yy]: [f32; 3]) -> [f32; 3] {
    let [x, y] = pose.tilt;
    let square = x * x + y * y;
    if square <= f32::MIN_POSITIVE {
        return [xx, xy, yy];
    }
    let (sine, _) = sine_over_angle_and_cosine(square);
    let away = (x * x * xx + 2.0 * x * y * xy + y * y * yy) / square;
    let along = (y * y * xx - 2.0 * x * y * xy + x * x * yy) / square;
    let both = (x * y * (yy - xx) + (x * x - y * y) * xy) / square;
    [away, sine * both, sine * sine * along]
}

/// The σ that is stated for a covariance (xx, xy, yy): 95 of 100 errors are within 1.731 times it
/// (√(−ln 0.05)), whatever the shape of their ellipse. For a round ellipse σ is the root of the
/// trace; for a narrow one 95 of 100 errors are within 1.960 times that root.
pub fn stated([xx, xy, yy]: [f32; 3]) -> f32 {
    let trace = xx + yy;
    let apart = (xx - yy) * (xx - yy) + 4.0 * xy * xy;
    // Fits the quantiles of all ellipses to 0.7 %.
    let narrow = if trace > 0.0 {
        apart / (trace * trace)
    } else {
        0.0
    };
    libm::sqrtf(trace) * (1.0 + 0.132 * narrow)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::forward::widths::OfWidth;
    use crate::force::forward::{RELATIVE, Stiffness};
    use proptest::prelude::*;

    const STRENGTH: Strength = Strength {
        stiffness: Stiffness {
            linear_n: 0.2,
            cubic_n: 0.1,
        },
        relative: [0.0; RELATIVE],
        largest_size: 0.63,
    };

    /// An estimate with this residual.
    fn estimate(unexplained: f32) -> Estimate {
        let mut spread = [[0.0; 5]; 5];
        for (k, row) in spread.iter_mut().enumerate() {
            row[k] = 0.001 * (k + 1) as f32;
        }
        Estimate {
            pose: Pose {
                size: 0.5,
                tilt: [0.1, 0.05],
                place_mm: [1.0, -2.0],
                ..Pose::default()
            },
            unexplained,
            left: Column::defaults(8),
            coordinates: 8,
            solved: Some(Solved {
                unknowns: [0.0; 5],
                left_over: unexplained,
                explained: 0.0,
                spread,
                width: OfWidth::KNOWN,
            }),
            arm: None,
            looks: 1,
        }
    }

    /// Without the part of |F| that no residual widens.
    fn parts(unexplained: f32) -> [f32; 3] {
        let sigma = estimate(unexplained).sigma(&STRENGTH).unwrap();
        let least_n = STRENGTH.sigma_n(estimate(unexplained).pose.size, 0.0);
        let of_size = sigma.magnitude_n * sigma.magnitude_n - least_n * least_n;
        [sigma.direction, libm::sqrtf(of_size), sigma.place_mm]
    }

    /// Noise of n times the stated noise leaves an n² times larger residual, and widens σ n times.
    #[test]
    fn what_is_left_over_beyond_the_usual_widens_all_three() {
        let stated = parts(1.0);
        assert_eq!(parts(residual::usual(8)), stated);
        for times in [1.5f32, 1.8] {
            let wider = parts(residual::usual(8) * times * times);
            for (wider, stated) in wider.into_iter().zip(stated) {
                assert!((wider / stated - times).abs() < 1e-4, "{wider} {stated}");
            }
        }
    }

    /// The uncertainty of a unit's strength adds to that of the size in squares, and is
    /// interpolated between sizes.
    #[test]
    fn a_units_strength_is_uncertain_beside_its_size() {
        let unsure = Strength {
            relative: [0.5, 0.4, 0.3, 0.2, 0.1],
            ..STRENGTH
        };
        let force_n = STRENGTH.stiffness.magnitude_n(0.5);
        let sure = STRENGTH.sigma_n(0.5, 0.01);
        let both = unsure.sigma_n(0.5, 0.01);
        let relative = libm::sqrtf(both * both - sure * sure) / force_n;
        let at = 4.0 * libm::sqrtf(0.5 / 0.63);
        assert!((relative - (0.5 - 0.1 * at)).abs() < 1e-4, "{relative}");
        let part = unsure.sigma_n(2.0, 0.0) / STRENGTH.stiffness.magnitude_n(2.0);
        assert!((part - 0.1).abs() < 1e-5, "{part}");
    }

    proptest! {
        /// A larger residual never makes an uncertainty smaller.
        #[test]
        fn more_that_is_left_over_never_makes_a_force_surer(
            less in prop_oneof![0.0f32..100.0, any::<f32>()],
            more in prop_oneof![0.0f32..100.0, any::<f32>()],
        ) {
            let explained = [less, more].map(|part| estimate(part).is_explained());
            prop_assert!(!(explained[1] && less < more && less >= 0.0) || explained[0]);
            let [sure, unsure] = [less.min(more), less.max(more)].map(parts);
            for (less, more) in sure.into_iter().zip(unsure) {
                prop_assert!(more >= less, "{more} {less}");
            }
        }
    }
}
