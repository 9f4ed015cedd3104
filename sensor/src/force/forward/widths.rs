//! Predicts how a contact of some width moves the images, compared with the tables' tip under the
//! same force at the same centre of pressure. Its width is an unknown of the equations.
//!
//! Enough markers show how wide a contact is. Width is given as a soft disc's radius; a rigid face
//! of 0.6 times that radius moves the images alike. A [table](super::motions) holds the motions as
//! polynomials in size and width. It also has standard deviations of the additional motion by
//! contacts that are longer than wide, lean, or press with their rim.

use super::Column;
use super::covariance::{Covariance, add_square};
use super::motions::{MOST_GROUPS, Mirror, Motions, Powers};
use super::mounting::RestImage;
use super::pose::{Pose, limited};
use super::predict::Prediction;
use super::solve::{Rows, Solved, UNKNOWNS, Unknowns, dot, norm, take};
use super::terms::Limits;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::layout::EIGHT_V;

/// Groups of columns: the motion by the width; then by contacts that are longer than wide, along x
/// and between x and y, that lean towards x and y, and whose middle bears more than the rim.
const GROUPS: usize = MOST_GROUPS;
/// Columns of the motion by the width are the first group.
const OF_WIDTH: usize = 0;
/// The last group.
const OF_RIM: usize = GROUPS - 1;
/// The radius, mm, of the soft disc that is as wide as the tables' tip: width 0. At width 1 it is
/// larger by `PER_WIDTH_MM`.
pub const TIP_MM: f32 = 0.42;
/// See [`TIP_MM`].
pub const PER_WIDTH_MM: f32 = 4.0;
/// The radius of the soft disc that is as wide as a face, in parts of the face's radius.
pub const OF_FACE: f32 = 1.65;
/// The least and the largest width.
pub const ENDS: [f32; 2] = [-0.1, 1.5];
/// Width and its standard deviation of unknown contacts.
const LIKELY: [f32; 2] = [0.5, 0.5];
/// Standard deviation of the width of a disc whose radius is set, and of a face.
const SET_DISC: [f32; 2] = [0.01, 0.02];
const SET_FACE: [f32; 2] = [0.02, 0.06];
/// Standard deviations of the groups of unknown contacts, of discs and of faces.
const UNKNOWN: [f32; GROUPS] = [0.0, 0.7, 0.7, 0.6, 0.6, 1.6];
const DISC: [f32; GROUPS] = [0.0, 0.05, 0.05, 0.05, 0.05, 0.3];
const FACE: [f32; GROUPS] = [0.0, 0.2, 0.2, 0.5, 0.5, 0.6];
/// Uncertainty of each coordinate, in parts of its marker's motion by the width. It, and the
/// standard deviations above, were chosen on presses of other seeds than those of
/// `docs/results/dots.md`.
const OF_ITSELF: f32 = 0.08;
/// Uncertainty due to the mesh of finite elements by which all contacts are known, in parts of the
/// motion: of each coordinate, and of all together. A finer mesh gives way differently.
const OF_MESH: [f32; 2] = [6e-4, 8e-4];
/// A tilted force moves the images under a wide contact as if the contact were farther along the
/// tilt: by this many mm for each radian, at width 1 and the largest size.
const ALONG_TILT_MM: f32 = 0.83;
/// The widths where the first steps for an unknown contact begin, and where the next ones begin if
/// these end narrow without success. Steps from a narrow contact to a wide one often do, near the
/// place and the force of the wide one.
const NARROW: f32 = 0.1;
const WIDE: f32 = 0.8;
/// The markers are this near to those of the layout, mm.
const NEAR_MM: f32 = 1.0;

/// The table of the nominal film with the layout `8v`, as the example `contact_widths` of
/// `calibration/` writes it.
const OF_EIGHT_V: &[u8] = include_bytes!("../../../data/contact-widths-8v.bin");

/// The motions by the width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Widths<'a>(Motions<'a>);

/// A contact whose width is an unknown, as the steps use it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wide<'a> {
    widths: Motions<'a>,
    /// The likely width, and its standard deviation.
    likely: [f32; 2],
    /// The part of the group of contacts that press with their rim, and all standard deviations.
    of_rim: f32,
    sigmas: [f32; GROUPS],
}

impl<'a> Widths<'a> {
    /// That of the nominal film, used for all films with its markers; `None` for other markers.
    pub fn nominal(rest_image: &RestImage) -> Option<Widths<'static>> {
        rest_image
            .is_layout(&EIGHT_V, NEAR_MM)
            .then(|| Motions::new(OF_EIGHT_V))
            .flatten()
            .map(Widths)
    }

    /// Returns the prior of a shape's width; `None` for the tables' tip.
    pub fn pressing(&self, shape: ContactShape) -> Option<Wide<'a>> {
        let radius_mm = shape.radius().map_or(0.0, |radius| 1e-3 * radius.0 as f32);
        let of_disc = |disc_mm: f32| (disc_mm - TIP_MM) / PER_WIDTH_MM;
        let set = |width: f32, [least, more]: [f32; 2]| [width, least + more * width.max(0.0)];
        let (likely, of_rim, sigmas) = match shape {
            ContactShape::Needle => return None,
            ContactShape::Unknown => (LIKELY, 0.0, UNKNOWN),
            ContactShape::Round(_) => (set(of_disc(radius_mm), SET_DISC), 1.0, DISC),
            ContactShape::Flat(_) => (set(of_disc(OF_FACE * radius_mm), SET_FACE), -1.0, FACE),
        };
        Some(Wide {
            widths: self.0,
            likely,
            of_rim,
            sigmas,
        })
    }
}

impl Wide<'_> {
    /// The width where the first steps begin.
    pub fn first(&self) -> f32 {
        self.near(NARROW)
    }

    /// The width where steps begin after others ended at `width` without success; `None` if they
    /// did not end narrow.
    pub fn second(&self, width: f32) -> Option<f32> {
        (width < NARROW).then(|| self.near(WIDE))
    }

    /// The nearest width within a standard deviation from the likely one.
    fn near(&self, width: f32) -> f32 {
        let [likely, sigma] = self.likely;
        limited(width, likely - sigma, likely + sigma)
    }

    /// The distance of a width from the likely one, in standard deviations, and how many of these
    /// a width of 1 is.
    pub fn unlikely(&self, width: f32) -> [f32; 2] {
        let [likely, sigma] = self.likely;
        [(likely - width) / sigma, 1.0 / sigma]
    }

    /// The part of a group in the motion.
    fn part(&self, group: usize) -> f32 {
        match group {
            OF_WIDTH => 1.0,
            OF_RIM => self.of_rim,
            _ => 0.0,
        }
    }

    /// Adds the motion of a width, and its slopes, to a prediction.
    #[inline(never)]
    pub fn add_to(&self, pose: &Pose, limits: &Limits, prediction: &mut Prediction) {
        let widths = &self.widths;
        let mirror = Mirror::of(pose.place_mm);
        let corners = widths.corners(pose.place_mm.map(f32::abs));
        let sizes = Powers::of(pose.size / limits.size);
        let powers = Powers::of(pose.width);
        // The motion, then its slopes by size, width, and place along x and y.
        let mut sums = [Column::defaults(widths.coordinates); 5];
        for (number, term) in widths.terms().enumerate() {
            let part = term.step * self.part(term.group);
            if part == 0.0 {
                continue;
            }
            let ([s, ds], [w, dw]) = (sizes.at(term.of_size), powers.at(term.of_second));
            let [value, by_size, by_width] =
                [s * w, ds * w / limits.size, s * dw].map(|f| part * f);
            for (begins, [weight, along_x, along_y]) in corners {
                let factors = [
                    weight * value,
                    weight * by_size,
                    weight * by_width,
                    along_x * value,
                    along_y * value,
                ];
                for (k, entry) in widths.column(begins, number).enumerate() {
                    for (sum, factor) in sums.iter_mut().zip(factors) {
                        if let Some(sum) = sum.get_mut(k) {
                            *sum += factor * entry;
                        }
                    }
                }
            }
        }
        let [value, by_size, by_width, by_x, by_y] = sums.map(|sum| mirror.column(&sum));
        let [size, _, _, x, y] = &mut prediction.slopes;
        let [sign_x, sign_y] = mirror.signs;
        let sums = [
            (&mut prediction.moved, &value, 1.0),
            (size, &by_size, 1.0),
            (x, &by_x, sign_x),
            (y, &by_y, sign_y),
        ];
        for (sums, parts, sign) in sums {
            for (sum, part) in sums.iter_mut().zip(parts.iter()) {
                *sum += sign * part;
            }
        }
        prediction.by_width = by_width;
    }

    /// Adds the uncertainty of that motion to a covariance, and the mesh's error for the whole
    /// motion `moved`.
    #[inline(never)]
    pub fn add_uncertainty(
        &self,
        pose: &Pose,
        limits: &Limits,
        moved: &Column,
        covariance: &mut Covariance,
    ) {
        let of_group = |group| self.widths.of_group(group, (pose, limits), pose.width);
        for (group, sigma) in self.sigmas.into_iter().enumerate() {
            if group != OF_WIDTH {
                add_square(covariance, &of_group(group), sigma);
            }
        }
        add_of_markers(covariance, &of_group(OF_WIDTH), OF_ITSELF);
        let [of_each, of_all] = OF_MESH;
        add_of_markers(covariance, moved, of_each);
        add_square(covariance, moved, of_all);
    }
}

/// Adds independent uncertainties of the coordinates, each this part of its marker's motion.
fn add_of_markers(covariance: &mut Covariance, moved: &Column, part: f32) {
    for (dot, [x, y]) in moved.as_chunks::<2>().0.iter().enumerate() {
        let square = part * part * (x * x + y * y);
        covariance.add(2 * dot, 2 * dot, square);
        covariance.add(2 * dot + 1, 2 * dot + 1, square);
    }
}

/// The step of the width, as the equations have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OfWidth {
    pub(super) step: f32,
    /// The column of the width: its norm, and the parts of the other columns along it. Zeros if the
    /// width is known.
    own: f32,
    along: [f32; UNKNOWNS],
}

/// The column of the width, taken out of all others.
pub struct Taken {
    own: f32,
    along: [f32; UNKNOWNS],
    of_side: f32,
}

/// Projects the column of the width out of all equations. The rest determines the other unknowns,
/// with their covariance, for any width (Frisch and Waugh 1933).
#[inline(never)]
pub fn take_out(width: &mut Rows, columns: &mut [Rows; UNKNOWNS], side: &mut Rows) -> Taken {
    let own = norm(width);
    for part in width.iter_mut() {
        *part /= own;
    }
    let mut without = |column: &mut Rows| {
        let along = dot(width, column);
        take(column, width, along);
        along
    };
    Taken {
        own,
        along: columns.each_mut().map(&mut without),
        of_side: without(side),
    }
}

impl Taken {
    /// Adds the width to the solution of the other unknowns.
    #[inline(never)]
    pub fn put_into(&self, solved: Solved) -> Solved {
        let by_others = self.along.iter().zip(solved.unknowns);
        let by_others = by_others.fold(0.0, |sum, (along, unknown)| sum + along * unknown);
        Solved {
            explained: solved.explained + self.of_side * self.of_side,
            width: OfWidth {
                step: (self.of_side - by_others) / self.own,
                own: self.own,
                along: self.along,
            },
            ..solved
        }
    }
}

impl OfWidth {
    /// Of a width that is no unknown.
    pub const KNOWN: OfWidth = OfWidth {
        step: 0.0,
        own: 0.0,
        along: [0.0; UNKNOWNS],
    };

    /// Whether the width was an unknown.
    pub fn is_unknown(&self) -> bool {
        self.own > 0.0
    }
}

impl Solved {
    /// The width after a step as far as the table reaches. Where it ends, the width is held back
    /// and the other unknowns follow it.
    #[inline(never)]
    pub(super) fn step_of_width(&self, width: f32, wanted: f32, step: &mut Unknowns) -> f32 {
        let OfWidth { own, along, .. } = self.width;
        let there = width + wanted;
        let held = limited(there, ENDS[0], ENDS[1]);
        if held == there {
            return there;
        }
        // The covariances of the width with the other unknowns, and its variance, times `own`.
        let with: [f32; UNKNOWNS] = core::array::from_fn(|k| {
            let pairs = along.iter().enumerate();
            pairs.fold(0.0, |sum, (other, along)| {
                sum - along * self.covariance(k, other)
            })
        });
        let variance = with
            .iter()
            .zip(along)
            .fold(1.0, |sum, (with, along)| sum - along * with);
        for (step, with) in step.iter_mut().zip(with) {
            *step -= (there - held) * own * with / variance;
        }
        held
    }
}

/// The centre of pressure of a load that the steps found, mm.
#[inline(never)]
pub fn centre_mm(pose: &Pose, limits: &Limits) -> [f32; 2] {
    let along = ALONG_TILT_MM * pose.width * (pose.size / limits.size);
    [0, 1].map(|way| pose.place_mm[way] - along * pose.tilt[way])
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::force::forward::Markers;
    use crate::force::forward::solve::solve;
    use hivtac_terms::units::{Micrometres, SignedMicrometres};
    use proptest::prelude::*;

    pub const LIMITS: Limits = Limits {
        size: 0.6288,
        tilt: 0.67,
    };

    pub fn image(places_mm: &[[f32; 2]]) -> RestImage {
        RestImage {
            at: Markers::of(places_mm.iter().map(|place| place.map(|part| part / 10.0))),
            film_mm: Markers::filled(places_mm.len(), [10.0; 2]),
        }
    }

    /// The places of a layout, mm.
    pub fn places_mm<const N: usize>(layout: [[SignedMicrometres; 2]; N]) -> [[f32; 2]; N] {
        layout.map(|place| place.map(|part| 1e-3 * part.0 as f32))
    }

    fn nominal() -> Widths<'static> {
        Widths::nominal(&image(&places_mm(EIGHT_V))).unwrap()
    }

    fn moved(wide: &Wide<'_>, pose: &Pose) -> Prediction {
        let mut prediction = Prediction::zeros(16);
        wide.add_to(pose, &LIMITS, &mut prediction);
        prediction
    }

    #[test]
    fn there_is_a_table_for_the_dots_of_8v_alone() {
        let mut swapped_mm = places_mm(EIGHT_V);
        swapped_mm.swap(4, 5);
        assert_eq!(Widths::nominal(&image(&swapped_mm)), None);
        assert_eq!(Widths::nominal(&image(&[[3.7; 2]; 4])), None);
        assert_eq!(nominal().pressing(ContactShape::Needle), None);
    }

    /// A contact as wide as the tip moves nothing in addition; a wider one, on a dot, more.
    #[test]
    fn wider_contacts_move_more() {
        let wide = nominal().pressing(ContactShape::Unknown).unwrap();
        let at = |width| {
            let pose = Pose {
                size: 0.4,
                place_mm: [2.5, 0.3],
                width,
                ..Pose::default()
            };
            norm(&moved(&wide, &pose).moved)
        };
        assert_eq!(at(0.0), 0.0);
        assert!(at(0.2) > 1e-4 && at(0.8) > 2.0 * at(0.2));
    }

    /// A shape that is set has its width.
    #[test]
    fn a_disc_is_as_wide_as_a_smaller_face() {
        let likely = |shape| nominal().pressing(shape).unwrap().likely[0];
        let disc = likely(ContactShape::Round(Micrometres(3_300)));
        let face = likely(ContactShape::Flat(Micrometres(2_000)));
        assert!((disc - face).abs() < 1e-6 && disc > 0.0, "{disc} {face}");
    }

    proptest! {
        #[test]
        fn slopes_are_those_of_the_motion(
            size in 0.1f32..0.6,
            place_mm in prop::array::uniform2(-5.0f32..5.0),
            width in 0.0f32..1.4,
            way in 0usize..4,
        ) {
            let step = 2e-3;
            // Not across a knot, where the slope changes.
            let per_mm = 10.0 / 5.5;
            prop_assume!(place_mm.iter().all(|part| {
                let at = (part * per_mm).rem_euclid(1.0);
                (0.01..0.99).contains(&at)
            }));
            let wide = nominal().pressing(ContactShape::Unknown).unwrap();
            let pose = Pose { size, place_mm, width, ..Pose::default() };
            let at = |off: f32| {
                let mut there = pose;
                let [x, y] = &mut there.place_mm;
                *[&mut there.size, &mut there.width, x, y][way] += off;
                moved(&wide, &there).moved
            };
            let here = moved(&wide, &pose);
            let [by_size, _, _, by_x, by_y] = &here.slopes;
            let slope = [by_size, &here.by_width, by_x, by_y][way];
            let (after, before) = (at(step), at(-step));
            for k in 0..16 {
                let found = (after[k] - before[k]) / (2.0 * step);
                let off = (found - slope[k]).abs();
                prop_assert!(off < 1e-3 + 0.02 * norm(slope), "{k} {found} {}", slope[k]);
            }
        }

        /// Six unknowns, one of them taken out first, come back, with their covariance.
        #[test]
        fn a_width_that_was_taken_out_comes_back(
            parts in prop::array::uniform(-1.0f32..1.0),
            unknowns in prop::array::uniform5(-1.0f32..1.0),
            width in -1.0f32..1.0,
        ) {
            let parts: [f32; 60] = parts;
            let column = |k: usize| Rows::from_fn(10, |i| parts[10 * k + i]);
            let mut columns: [Rows; UNKNOWNS] = core::array::from_fn(column);
            let mut of_width = column(5);
            let mut side = Rows::defaults(10);
            take(&mut side, &of_width, -width);
            for (column, unknown) in columns.iter().zip(unknowns) {
                take(&mut side, column, -unknown);
            }
            let whole = dot(&side, &side);
            let taken = take_out(&mut of_width, &mut columns, &mut side);
            let Some(solved) = solve(&mut columns, &mut side) else {
                return Ok(());
            };
            let solved = taken.put_into(solved);
            let spread: f32 = (0..UNKNOWNS).map(|k| solved.covariance(k, k)).sum();
            prop_assume!(spread < 1e3);
            for (found, unknown) in solved.unknowns.iter().zip(unknowns) {
                prop_assert!((found - unknown).abs() < 1e-2, "{found} {unknown}");
            }
            prop_assert!((solved.width.step - width).abs() < 2e-2);
            prop_assert!((solved.explained - whole).abs() < 1e-3 * whole);
            // Held at its end, the width takes the other unknowns with it.
            let mut step = solved.unknowns;
            let held = solved.step_of_width(ENDS[1], solved.width.step, &mut step);
            prop_assert!(held <= ENDS[1]);
            prop_assert_eq!(step == solved.unknowns, solved.width.step <= 0.0);
        }
    }
}
