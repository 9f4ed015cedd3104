//! Predicts how a contact of another shape moves the images, compared with the tables' tip under
//! the same force at the same centre of pressure.
//!
//! A wide contact moves the images as a slightly larger force does, and off the middle to one side.
//! A table holds this motion at knots of size and place: its mean over all shapes, its covariance
//! over them, and its dependence on the radius of a round or flat contact. Film and markers are
//! symmetric, so places along +x and +y give all others.

use super::Column;
use super::covariance::{Covariance, CovarianceGrid, add_square};
use super::pose::Pose;
use super::predict::Prediction;
use super::terms::Limits;
use hivtac_terms::contact_shape::ContactShape;

/// Number of motions that each knot holds: the mean over all shapes, then, of a round contact and
/// of a flat one, the parts in proportion to the [radius](span) and to its square.
pub const SHIFTS: usize = 5;
/// Coordinates of a layout of four markers at a square's corners. The table is theirs.
pub const COORDINATES: usize = 8;
/// Bytes of a knot's motions: a step, then entries of i16 by motion and coordinate.
pub const SHIFT_KNOT: usize = 4 + 2 * SHIFTS * COORDINATES;
/// Largest step of the motions, focal lengths.
const LARGEST_STEP: f32 = 1e-3;
/// Radius, mm, of the tables' tip, and the largest of a shape.
const TIP_MM: f32 = 0.5;
const LARGEST_MM: f32 = 4.0;
/// Uncertainty of a contact whose shape and radius are set: of its own motion, in parts of that;
/// and of any motion, in parts of the covariance over all shapes, at radius 0 and more per mm. A
/// flat face is less certain, as it may be tilted.
const OF_OWN: f32 = 0.4;
const OF_ALL: [f32; 2] = [0.15, 0.1];
const OF_ALL_FLAT: [f32; 2] = [0.4, 0.15];

/// Those of the nominal film, as the example `contact_shapes` of `calibration/` writes them: the
/// number of knots along size, y and x, a zero, the largest place, the knots of the covariance, and
/// those of the motions.
const NOMINAL: &[u8] = include_bytes!("../../../data/contact-shapes.bin");
/// Bytes before the knots.
const HEAD: usize = 8;

/// The motions of all shapes at knots of size and place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shapes<'a> {
    covariance: CovarianceGrid<'a>,
    /// The motions at each knot of the covariance.
    shifts: &'a [[u8; SHIFT_KNOT]],
}

/// The contact's shape, as the steps use it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressing<'a> {
    shapes: Shapes<'a>,
    /// The parts of the table's motions in this one's.
    parts: [f32; SHIFTS],
    /// Standard uncertainty relative to the motion itself, and to the covariance over all shapes.
    of_own: f32,
    of_all: f32,
}

impl Shapes<'static> {
    /// Those of the nominal film, which stand for all films with its markers.
    pub fn nominal() -> Option<Shapes<'static>> {
        let ([sizes, lines, places, _, end @ ..], knots) = NOMINAL.split_first_chunk::<HEAD>()?;
        let (counts, end_mm) = ([*sizes, *lines, *places], f32::from_le_bytes(*end));
        let length = CovarianceGrid::length(COORDINATES, counts);
        let (covariance, shifts) = knots.split_at_checked(length)?;
        let covariance = CovarianceGrid::new(COORDINATES, counts, end_mm, covariance)?;
        Shapes::new(covariance, shifts)
    }
}

impl<'a> Shapes<'a> {
    /// Takes the covariance over all shapes, and bytes of the motions at its knots. Returns `None`
    /// if it is not of [`COORDINATES`], their number is wrong, or a step is not between 0 and
    /// 0.001.
    pub fn new(covariance: CovarianceGrid<'a>, bytes: &'a [u8]) -> Option<Shapes<'a>> {
        let (shifts, rest) = bytes.as_chunks();
        let sound = rest.is_empty()
            && covariance.coordinates() == COORDINATES
            && shifts.len() == covariance.knots()
            && shifts
                .iter()
                .all(|knot| (0.0..=LARGEST_STEP).contains(&step(knot)));
        sound.then_some(Shapes { covariance, shifts })
    }

    /// A load whose place is mirrored to +x and +y, as the knots' axes need it: they run from 0 to
    /// their end.
    fn folded(&self, pose: &Pose) -> Pose {
        let end_mm = self.covariance.end_mm();
        Pose {
            place_mm: pose.place_mm.map(|part| 2.0 * part.abs() - end_mm),
            ..*pose
        }
    }

    /// Returns the effect of a shape; `None` for the tables' tip.
    pub fn pressing(&self, shape: ContactShape) -> Option<Pressing<'a>> {
        let radius_mm = shape.radius().map_or(0.0, |radius| 1e-3 * radius.0 as f32);
        let part = span(shape, radius_mm);
        let square = part * part;
        let parts = match shape {
            ContactShape::Needle => return None,
            ContactShape::Unknown => [1.0, 0.0, 0.0, 0.0, 0.0],
            ContactShape::Round(_) => [0.0, part, square, 0.0, 0.0],
            ContactShape::Flat(_) => [0.0, 0.0, 0.0, part, square],
        };
        let of_all = |[least, more]: [f32; 2]| least + more * radius_mm;
        let (of_own, of_all) = match shape {
            ContactShape::Flat(_) => (OF_OWN, of_all(OF_ALL_FLAT)),
            ContactShape::Round(_) => (OF_OWN, of_all(OF_ALL)),
            ContactShape::Needle | ContactShape::Unknown => (0.0, 1.0),
        };
        Some(Pressing {
            shapes: *self,
            parts,
            of_own,
            of_all,
        })
    }
}

/// The variable in which motions are polynomials: 0 for the tables' tip or a face without extent, 1
/// for the largest radius.
pub fn span(shape: ContactShape, radius_mm: f32) -> f32 {
    match shape {
        ContactShape::Round(_) => (radius_mm - TIP_MM) / (LARGEST_MM - TIP_MM),
        _ => radius_mm / LARGEST_MM,
    }
}

impl Pressing<'_> {
    /// Adds the shape's motion under a load to a prediction.
    #[inline(never)]
    pub fn add_to(&self, pose: &Pose, limits: &Limits, prediction: &mut Prediction) {
        let shift = self.shift(pose, limits);
        for (sum, part) in prediction.moved.iter_mut().zip(shift.iter()) {
            *sum += part;
        }
    }

    /// Adds the uncertainty of that motion to a covariance.
    #[inline(never)]
    pub fn add_uncertainty(&self, pose: &Pose, limits: &Limits, covariance: &mut Covariance) {
        add_square(covariance, &self.shift(pose, limits), self.of_own);
        let mirror = Mirror::of(pose.place_mm);
        let mut of_all = Covariance::EMPTY;
        let pose = &self.shapes.folded(pose);
        self.shapes.covariance.put(pose, limits, &mut of_all);
        let square = self.of_all * self.of_all;
        for (i, row) in covariance.rows_mut().enumerate() {
            for (j, sum) in row.iter_mut().enumerate() {
                *sum += square * mirror.entry(&of_all, i, j);
            }
        }
    }

    /// The motion under a load.
    fn shift(&self, pose: &Pose, limits: &Limits) -> Column {
        let mirror = Mirror::of(pose.place_mm);
        let pose = &self.shapes.folded(pose);
        let mut sum = Column::defaults(COORDINATES);
        for (knot, part) in self.shapes.covariance.corners(pose, limits) {
            let Some(knot) = self.shapes.shifts.get(knot) else {
                continue;
            };
            let part = part * step(knot);
            let motions = knot.as_chunks::<2>().0[2..].as_chunks::<COORDINATES>().0;
            for (motion, of_motion) in motions.iter().zip(self.parts) {
                for (sum, bytes) in sum.iter_mut().zip(motion) {
                    *sum += part * of_motion * f32::from(i16::from_le_bytes(*bytes));
                }
            }
        }
        mirror.column(&sum)
    }
}

/// The mirror image of the film in which a place is along +x and +y.
#[derive(Clone, Copy)]
struct Mirror {
    /// Along x and along y: −1 if mirrored, 1 if not.
    signs: [f32; 2],
    /// XOR of a marker's number with that of its mirror image.
    exchanged: usize,
}

impl Mirror {
    fn of([x, y]: [f32; 2]) -> Mirror {
        let sign = |part: f32| if part < 0.0 { -1.0 } else { 1.0 };
        // Left and right are 0 and 1, 3 and 2; above and below are 0 and 3, 1 and 2.
        let exchanged = usize::from(x < 0.0) ^ (3 * usize::from(y < 0.0));
        Mirror {
            signs: [sign(x), sign(y)],
            exchanged,
        }
    }

    /// The mirror image of a coordinate's number, and its sign.
    fn of_coordinate(&self, number: usize) -> (usize, f32) {
        let [along_x, along_y] = self.signs;
        let is_x = number.is_multiple_of(2);
        let sign = if is_x { along_x } else { along_y };
        (number ^ (2 * self.exchanged), sign)
    }

    fn column(&self, column: &Column) -> Column {
        Column::from_fn(column.len(), |i| {
            let (other, sign) = self.of_coordinate(i);
            sign * column.get(other).copied().unwrap_or_default()
        })
    }

    fn entry(&self, covariance: &Covariance, i: usize, j: usize) -> f32 {
        let ((i, sign), (j, other)) = (self.of_coordinate(i), self.of_coordinate(j));
        sign * other * covariance.entry(i, j)
    }
}

fn step([a, b, c, d, ..]: &[u8; SHIFT_KNOT]) -> f32 {
    f32::from_le_bytes([*a, *b, *c, *d])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::forward::covariance::tests::{COUNTS, LIMITS, knots, pose};
    use hivtac_terms::units::Micrometres;
    use std::vec::Vec;

    /// Motions of knots, 10⁻⁵ focal lengths: (1 + motion) · 100 everywhere.
    fn shifts() -> Vec<u8> {
        let mut bytes = Vec::new();
        for _ in 0..COUNTS.map(usize::from).iter().product() {
            bytes.extend(1e-5f32.to_le_bytes());
            for motion in 0..SHIFTS {
                let entry = 100 * (1 + motion as i16);
                bytes.extend([entry; COORDINATES].map(i16::to_le_bytes).as_flattened());
            }
        }
        bytes
    }

    /// The motion and the standard deviation that a shape adds to the first coordinate.
    fn added(shape: ContactShape) -> Option<[f32; 2]> {
        let (covariance, shifts) = (knots(|_, k| i16::from(k == 0) * 1000), shifts());
        let grid = CovarianceGrid::new(COORDINATES, COUNTS, 3.0, &covariance).unwrap();
        let shapes = Shapes::new(grid, &shifts).unwrap();
        let mut prediction = Prediction::zeros(COORDINATES);
        let mut covariance = Covariance::zeros(COORDINATES);
        let pose = pose(0.3, [1.0, 2.0]);
        let pressing = shapes.pressing(shape)?;
        pressing.add_to(&pose, &LIMITS, &mut prediction);
        pressing.add_uncertainty(&pose, &LIMITS, &mut covariance);
        Some([prediction.moved[0], covariance.entry(0, 0).sqrt()])
    }

    #[test]
    fn each_shape_has_its_motion() {
        let near = |found: Option<[f32; 2]>, moved: f32, sigma: f32| {
            let [own, of_own] = found.unwrap();
            assert!((own / moved - 1.0).abs() < 1e-4, "{own} {moved}");
            assert!((of_own / sigma - 1.0).abs() < 1e-4, "{of_own} {sigma}");
        };
        assert_eq!(added(ContactShape::Needle), None);
        near(added(ContactShape::Unknown), 1e-3, 1e-2);
        let largest = Micrometres(4000);
        let root = |moved: f32, of_all: [f32; 2]| {
            (OF_OWN * moved).hypot((of_all[0] + 4.0 * of_all[1]) * 1e-2)
        };
        let [round, flat] = [ContactShape::Round(largest), ContactShape::Flat(largest)];
        near(added(round), 5e-3, root(5e-3, OF_ALL));
        near(added(flat), 9e-3, root(9e-3, OF_ALL_FLAT));
        let [tip, _] = added(ContactShape::Round(Micrometres(500))).unwrap();
        assert_eq!(tip, 0.0);
    }

    /// Left, right, above and below: a load at a mirrored place moves mirrored markers.
    #[test]
    fn a_mirrored_place_mirrors_the_motion() {
        let column = Column::from_fn(COORDINATES, |k| k as f32);
        let at = |place_mm| Mirror::of(place_mm).column(&column);
        assert_eq!(at([1.0, 2.0]), column);
        assert_eq!(
            at([-1.0, 2.0])[..],
            [-2.0, 3.0, -0.0, 1.0, -6.0, 7.0, -4.0, 5.0]
        );
        assert_eq!(
            at([1.0, -2.0])[..],
            [6.0, -7.0, 4.0, -5.0, 2.0, -3.0, 0.0, -1.0]
        );
        let both = Mirror::of([-1.0, -2.0]);
        let mut square = Covariance::zeros(COORDINATES);
        add_square(&mut square, &column, 1.0);
        let there = both.column(&column);
        for (i, j) in [(0, 0), (3, 1), (7, 2)] {
            assert_eq!(both.entry(&square, i, j), there[i] * there[j]);
        }
    }

    #[test]
    fn the_nominal_film_has_a_table() {
        assert!(Shapes::nominal().is_some());
    }

    #[test]
    fn nonsense_is_refused() {
        let (covariance, sound) = (knots(|_, _| 3), shifts());
        let grid = CovarianceGrid::new(COORDINATES, COUNTS, 3.0, &covariance).unwrap();
        assert!(Shapes::new(grid, &sound).is_some());
        assert!(Shapes::new(grid, &sound[1..]).is_none());
        assert!(Shapes::new(grid, &sound[SHIFT_KNOT..]).is_none());
        for step in [-1e-4, 1.1e-3, f32::NAN, f32::INFINITY] {
            let mut bytes = sound.clone();
            bytes[SHIFT_KNOT..SHIFT_KNOT + 4].copy_from_slice(&step.to_le_bytes());
            assert!(Shapes::new(grid, &bytes).is_none(), "{step}");
        }
    }
}
