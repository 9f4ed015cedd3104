//! Tables of how the images of a layout's markers move, at knots of the place where the film is
//! pressed: polynomials in the load's size and in a second variable.
//!
//! Film and markers are symmetric, so that places along +x and +y tell all others.

use super::Column;
use super::covariance::between;
use super::pose::Pose;
use super::terms::Limits;

/// Most groups of columns.
pub const MOST_GROUPS: usize = 6;
/// Most columns of a table.
const MOST_COLUMNS: usize = 32;
/// Largest power of each variable.
const MOST_POWER: usize = 4;
/// Largest step of the motions, focal lengths.
const LARGEST_STEP: f32 = 1e-3;
/// Bytes before the columns, and of a column.
const HEAD: usize = 8;
const COLUMN: usize = 8;
/// Allowed number of knots along an axis.
const KNOTS: core::ops::RangeInclusive<u8> = 2..=32;

/// The motions at knots of the place, borrowed from a table: the number of knots along an axis, of
/// coordinates and of columns, a zero, and the largest place, mm (f32). For each column its group,
/// its powers of size and of the second variable, a zero, and its step (f32). For each knot, in
/// lines of places from 0 to the largest, for each column, entries of i16 by coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motions<'a> {
    knots: usize,
    pub coordinates: usize,
    end_mm: f32,
    columns: &'a [[u8; COLUMN]],
    entries: &'a [[u8; 2]],
}

/// A column of the table.
#[derive(Clone, Copy)]
pub struct Term {
    pub group: usize,
    pub of_size: usize,
    pub of_second: usize,
    pub step: f32,
}

impl Term {
    fn of([group, of_size, of_second, _, a, b, c, d]: [u8; COLUMN]) -> Term {
        Term {
            group: group.into(),
            of_size: of_size.into(),
            of_second: of_second.into(),
            step: f32::from_le_bytes([a, b, c, d]),
        }
    }

    fn is_sound(&self) -> bool {
        self.group < MOST_GROUPS
            && (1..=MOST_POWER).contains(&self.of_size)
            && (1..=MOST_POWER).contains(&self.of_second)
            && (0.0..=LARGEST_STEP).contains(&self.step)
    }
}

/// A variable's powers from 0 on, and their slopes.
pub struct Powers([[f32; 2]; MOST_POWER + 1]);

impl Powers {
    pub fn of(value: f32) -> Powers {
        let mut powers = [[1.0, 0.0]; MOST_POWER + 1];
        for k in 1..=MOST_POWER {
            let [before, _] = powers[k - 1];
            powers[k] = [before * value, k as f32 * before];
        }
        Powers(powers)
    }

    pub fn at(&self, power: usize) -> [f32; 2] {
        self.0.get(power).copied().unwrap_or_default()
    }
}

impl<'a> Motions<'a> {
    /// Takes a table; `None` if a number is out of its range.
    pub fn new(bytes: &'a [u8]) -> Option<Motions<'a>> {
        let ([knots, coordinates, columns, _, end @ ..], rest) =
            bytes.split_first_chunk::<HEAD>()?;
        let end_mm = f32::from_le_bytes(*end);
        let (heads, rest) = rest.split_at_checked(COLUMN * usize::from(*columns))?;
        let (entries, odd) = rest.as_chunks();
        let motions = Motions {
            knots: usize::from(*knots),
            coordinates: usize::from(*coordinates),
            end_mm,
            columns: heads.as_chunks().0,
            entries,
        };
        let count = motions.knots * motions.knots * motions.columns.len() * motions.coordinates;
        let sound = odd.is_empty()
            && KNOTS.contains(knots)
            && motions.columns.len() <= MOST_COLUMNS
            && (0.1..=100.0).contains(&end_mm)
            && motions.terms().all(|term| term.is_sound())
            && entries.len() == count;
        sound.then_some(motions)
    }

    pub fn terms(&self) -> impl Iterator<Item = Term> + use<'a> {
        self.columns.iter().map(|column| Term::of(*column))
    }

    /// The four knots around a place along +x and +y: where their entries begin, their weights, and
    /// how these change along x and y, 1/mm.
    pub fn corners(&self, place_mm: [f32; 2]) -> [(usize, [f32; 3]); 4] {
        let last = self.knots.saturating_sub(1).max(1);
        let per_mm = last as f32 / self.end_mm;
        let [x, y] = place_mm.map(|part| {
            let inside = (0.0..self.end_mm).contains(&part);
            let slope = if inside { per_mm } else { 0.0 };
            let [(first, a), (second, b)] = between(part / self.end_mm, last + 1);
            [(first, a, -slope), (second, b, slope)]
        });
        let corner = |i: usize, j: usize| {
            let ((line, of_y, slope_y), (place, of_x, slope_x)) = (y[i], x[j]);
            let begins = (line * self.knots + place) * self.columns.len() * self.coordinates;
            (begins, [of_y * of_x, of_y * slope_x, slope_y * of_x])
        };
        [corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)]
    }

    /// The entries of a column at a knot that begins there.
    pub fn column(&self, begins: usize, number: usize) -> impl Iterator<Item = f32> {
        let from = begins + number * self.coordinates;
        let entries = self.entries.get(from..from + self.coordinates);
        let entries = entries.unwrap_or_default().iter();
        entries.map(|bytes| f32::from(i16::from_le_bytes(*bytes)))
    }

    /// The motion of a group of columns under a load, whose second variable is `second`, at its
    /// place.
    pub fn of_group(&self, group: usize, (pose, limits): (&Pose, &Limits), second: f32) -> Column {
        let corners = self.corners(pose.place_mm.map(f32::abs));
        let (sizes, powers) = (Powers::of(pose.size / limits.size), Powers::of(second));
        let mut sum = Column::defaults(self.coordinates);
        let terms = self.terms().enumerate();
        for (number, term) in terms.filter(|(_, term)| term.group == group) {
            let ([s, _], [w, _]) = (sizes.at(term.of_size), powers.at(term.of_second));
            for (begins, [weight, ..]) in corners {
                let factor = term.step * s * w * weight;
                for (sum, entry) in sum.iter_mut().zip(self.column(begins, number)) {
                    *sum += factor * entry;
                }
            }
        }
        Mirror::of(pose.place_mm).column(&sum)
    }
}

/// The mirror image of the film in which a place is along +x and +y.
#[derive(Clone, Copy)]
pub struct Mirror {
    /// Along x and along y: −1 if mirrored, 1 if not.
    pub signs: [f32; 2],
}

impl Mirror {
    pub fn of(place_mm: [f32; 2]) -> Mirror {
        Mirror {
            signs: place_mm.map(|part| if part < 0.0 { -1.0 } else { 1.0 }),
        }
    }

    /// The mirror image of a marker of `8v`. Of the corners, left and right are 0 and 1, 3 and 2;
    /// above and below are 0 and 3, 1 and 2. On the axes, 4 and 6 are left and right, 5 and 7 above
    /// and below.
    fn of_marker(&self, number: usize) -> usize {
        let [mirrors_x, mirrors_y] = self.signs.map(|sign| sign < 0.0);
        match number {
            0..4 => number ^ usize::from(mirrors_x) ^ (3 * usize::from(mirrors_y)),
            4 | 6 if mirrors_x => number ^ 2,
            5 | 7 if mirrors_y => number ^ 2,
            _ => number,
        }
    }

    pub fn column(&self, column: &Column) -> Column {
        Column::from_fn(column.len(), |k| {
            let sign = self.signs.get(k % 2).copied().unwrap_or_default();
            sign * column.at(2 * self.of_marker(k / 2) + k % 2)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_mirrored_place_mirrors_the_motion() {
        let column = Column::from_fn(16, |k| k as f32);
        let at = |place_mm| Mirror::of(place_mm).column(&column);
        assert_eq!(at([1.0, 2.0]), column);
        let [left, above] = [at([-1.0, 2.0]), at([1.0, -2.0])];
        assert_eq!(left[..4], [-2.0, 3.0, -0.0, 1.0]);
        assert_eq!(
            left[8..],
            [-12.0, 13.0, -10.0, 11.0, -8.0, 9.0, -14.0, 15.0]
        );
        assert_eq!(above[..4], [6.0, -7.0, 4.0, -5.0]);
        assert_eq!(
            above[8..],
            [8.0, -9.0, 14.0, -15.0, 12.0, -13.0, 10.0, -11.0]
        );
    }

    #[test]
    fn nonsense_is_refused() {
        let sound: Vec<u8> = include_bytes!("../../../data/contact-widths-8v.bin").to_vec();
        assert!(Motions::new(&sound).is_some());
        assert_eq!(Motions::new(&sound[..sound.len() - 2]), None);
        assert_eq!(Motions::new(&sound[..5]), None);
        // Knots, columns, the largest place, a group, a power of the size, and a step.
        for (at, part) in [(0, 1), (2, 33), (7, 0x7f), (8, 6), (9, 0), (15, 0x7f)] {
            let mut bytes = sound.clone();
            bytes[at] = part;
            assert_eq!(Motions::new(&bytes), None, "{at}");
        }
    }
}
