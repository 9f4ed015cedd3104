//! The covariance of the images' coordinates by which a model may be wrong. It interpolates between
//! sizes and places of the load, and whitens: in white coordinates the covariance is the unit
//! matrix.

use super::pose::{Pose, limited};
use super::solve::{Column, MOST_EQUATIONS, square};
use super::terms::Limits;
use crate::force::kernels::sqrt;
use heapless::Vec;

/// Allowed number of knots along the size and along each axis of places.
pub const KNOTS: core::ops::RangeInclusive<u8> = 2..=16;
/// Largest step of a factor's entries, focal lengths.
pub const LARGEST_STEP: f32 = 1e-3;
/// Most entries of a lower triangle.
const TRIANGLE: usize = triangle(MOST_EQUATIONS);
/// Standard uncertainty as a fraction of the motion, for a unit whose only known picture is at rest
/// known, if the file has no grid for it. `OF_ITSELF` is that of each coordinate of a marker,
/// `OF_ALL` that of all coordinates together.
const OF_ITSELF: f32 = 0.03;
const OF_ALL: f32 = 0.1;

/// A covariance of x and y of all images, in focal lengths squared, or a lower factor of one: rows
/// up to the diagonal.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    entries: Vec<f32, TRIANGLE>,
}

/// Number of entries of a lower triangle with this number of rows.
pub(super) const fn triangle(rows: usize) -> usize {
    rows * (rows + 1) / 2
}

/// Bytes of a knot: a step and the entries of the factor.
const fn knot_length(coordinates: usize) -> usize {
    4 + 2 * triangle(coordinates)
}

impl Covariance {
    /// Storage without coordinates.
    pub const EMPTY: Covariance = Covariance {
        entries: Vec::new(),
    };

    /// No uncertainty of this number of coordinates.
    pub fn zeros(coordinates: usize) -> Covariance {
        let mut covariance = Covariance::EMPTY;
        covariance.reset(coordinates);
        covariance
    }

    /// Makes this no uncertainty of this number of coordinates.
    pub fn reset(&mut self, coordinates: usize) {
        self.entries.clear();
        // More coordinates than the largest layout has are left out.
        let count = triangle(coordinates.min(MOST_EQUATIONS));
        let _ = self.entries.resize(count, 0.0);
    }

    /// The rows, each up to the diagonal.
    pub fn rows(&self) -> impl Iterator<Item = &[f32]> {
        let mut rest = &*self.entries;
        (1..).map_while(move |length| {
            let (row, below) = rest.split_at_checked(length)?;
            rest = below;
            Some(row)
        })
    }

    /// The rows, each up to the diagonal.
    pub fn rows_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let mut rest = &mut *self.entries;
        (1..).map_while(move |length| {
            let (row, below) = core::mem::take(&mut rest).split_at_mut_checked(length)?;
            rest = below;
            Some(row)
        })
    }

    /// Adds to the entry of two coordinates.
    pub fn add(&mut self, one: usize, other: usize, part: f32) {
        let place = triangle(one.max(other)) + one.min(other);
        if let Some(sum) = self.entries.get_mut(place) {
            *sum += part;
        }
    }

    /// The entry of two coordinates.
    pub fn entry(&self, one: usize, other: usize) -> f32 {
        let place = triangle(one.max(other)) + one.min(other);
        self.entries.get(place).copied().unwrap_or_default()
    }

    /// Makes the covariance of a lower factor out of that factor. From the last entry on, because
    /// an entry needs only those before it.
    fn square(&mut self) {
        let coordinates = self.rows().count();
        for i in (0..coordinates).rev() {
            let Some((mut above, rest)) = self.entries.split_at_mut_checked(triangle(i)) else {
                return;
            };
            let Some(row) = rest.get_mut(..=i) else {
                return;
            };
            // Zeros before the first entry need no work: factors are often diagonal.
            let first = row.iter().take_while(|part| **part == 0.0).count();
            let own = square(row.get(first..).unwrap_or_default());
            for j in (first.min(i)..i).rev() {
                let Some((before, other)) = above.split_at_mut_checked(triangle(j)) else {
                    return;
                };
                let products = other.iter().zip(&*row).skip(first);
                let sum = products.fold(0.0, |sum, (a, b)| sum + b * a);
                above = before;
                if let Some(entry) = row.get_mut(j) {
                    *entry = sum;
                }
            }
            if let Some(entry) = row.get_mut(i) {
                *entry = own;
            }
        }
    }
}

/// Covariances by the load's size and place, borrowed from a model file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CovarianceGrid<'a> {
    /// Number of coordinates.
    coordinates: usize,
    /// Knots along the size, along y and along x.
    counts: [u8; 3],
    /// Places range from −`end_mm` to `end_mm` along each axis.
    end_mm: f32,
    /// Indexed by size, place along y, place along x. Each knot is an f32 step and a lower triangle
    /// of i16, row by row, in units of the step. The factor times its transpose is the covariance.
    knots: &'a [u8],
}

/// The uncertainty of a model about a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unknown<'a> {
    /// Negligible compared with noise.
    Nothing,
    /// The covariance grid of the model file.
    Grid(CovarianceGrid<'a>),
    /// As much as may differ between units, relative to the motion.
    Unit,
}

impl<'a> CovarianceGrid<'a> {
    /// Takes the number of coordinates, of knots ([`KNOTS`]) along the size, y and x, and the
    /// largest place `end_mm` (0.1 to 100). Returns `None` if a number of knots, `end_mm` or the
    /// number of bytes ([`CovarianceGrid::length`]) is wrong, or a step is not between 0 and
    /// [`LARGEST_STEP`].
    pub fn new(
        coordinates: usize,
        counts: [u8; 3],
        end_mm: f32,
        knots: &'a [u8],
    ) -> Option<CovarianceGrid<'a>> {
        let grid = CovarianceGrid {
            coordinates,
            counts,
            end_mm,
            knots,
        };
        let sound = counts.iter().all(|count| KNOTS.contains(count))
            && (0.1..=100.0).contains(&end_mm)
            && knots.len() == CovarianceGrid::length(coordinates, counts)
            && knots
                .chunks(knot_length(coordinates).max(1))
                .all(|knot| (0.0..=LARGEST_STEP).contains(&step(knot)));
        sound.then_some(grid)
    }

    /// Bytes of all knots.
    pub fn length(coordinates: usize, counts: [u8; 3]) -> usize {
        counts.into_iter().map(usize::from).product::<usize>() * knot_length(coordinates)
    }

    /// Puts the covariance at a load into `covariance`; beyond the last size or place, the
    /// covariance there. Knot k of n+1 is at (k/n)² of the largest size. Factors, not covariances,
    /// are interpolated: any sum of factors is the factor of a covariance.
    pub fn put(&self, pose: &Pose, limits: &Limits, covariance: &mut Covariance) {
        covariance.reset(self.coordinates);
        let length = knot_length(self.coordinates);
        for (knot, part) in self.corners(pose, limits) {
            let knots = self.knots.get(knot.saturating_mul(length)..);
            add(covariance, knots.unwrap_or_default(), part);
        }
        covariance.square();
    }

    /// The number and the weight of every knot around a load. Compiled once, because the near
    /// memory is scarce.
    #[inline(never)]
    pub(super) fn corners(&self, pose: &Pose, limits: &Limits) -> [(usize, f32); 8] {
        let mut corners = [(0, 0.0); 8];
        let mut free = corners.iter_mut();
        let [sizes, lines, places] = self.counts.map(usize::from);
        let along = |at_mm: f32| 0.5 + 0.5 * at_mm / self.end_mm;
        let [x, y] = pose.place_mm.map(along);
        let size = sqrt(limited(pose.size / limits.size, 0.0, 1.0));
        for (i, of_size) in between(size, sizes) {
            for (j, of_y) in between(y, lines) {
                for (k, of_x) in between(x, places) {
                    if let Some(corner) = free.next() {
                        *corner = ((i * lines + j) * places + k, of_size * of_y * of_x);
                    }
                }
            }
        }
        corners
    }

    /// The largest place, mm.
    pub(super) fn end_mm(&self) -> f32 {
        self.end_mm
    }

    /// Number of knots.
    pub(super) fn knots(&self) -> usize {
        self.knots.len() / knot_length(self.coordinates).max(1)
    }

    /// Number of coordinates.
    pub(super) fn coordinates(&self) -> usize {
        self.coordinates
    }
}

impl Unknown<'_> {
    /// Puts the covariance under a load that moves the images by `moved` into `covariance`.
    pub fn put(&self, pose: &Pose, limits: &Limits, moved: &Column, covariance: &mut Covariance) {
        match self {
            Unknown::Nothing => covariance.reset(moved.len()),
            Unknown::Grid(grid) => grid.put(pose, limits, covariance),
            Unknown::Unit => put_of_motion(moved, covariance),
        }
    }
}

/// The covariance of the differences between units whose images move by `moved`.
fn put_of_motion(moved: &Column, covariance: &mut Covariance) {
    covariance.reset(moved.len());
    for (row, a) in covariance.rows_mut().zip(moved.iter()) {
        for (entry, b) in row.iter_mut().zip(moved.iter()) {
            *entry = OF_ALL * OF_ALL * a * b;
        }
    }
    for (dot, [x, y]) in moved.as_chunks::<2>().0.iter().enumerate() {
        let square = OF_ITSELF * OF_ITSELF * (x * x + y * y);
        for k in [2 * dot, 2 * dot + 1] {
            covariance.add(k, k, square);
        }
    }
}

fn step(knot: &[u8]) -> f32 {
    let step = knot.first_chunk().copied();
    f32::from_le_bytes(step.unwrap_or_default())
}

/// Adds `part` times the factor of a knot, which these bytes begin with.
fn add(factor: &mut Covariance, knot: &[u8], part: f32) {
    let part = part * step(knot);
    let steps = knot.as_chunks::<2>().0.iter().skip(2);
    for (entry, bytes) in factor.entries.iter_mut().zip(steps) {
        *entry += part * f32::from(i16::from_le_bytes(*bytes));
    }
}

/// Adds the covariance of a motion along a column with a standard uncertainty.
pub(super) fn add_square(covariance: &mut Covariance, along: &[f32], sigma: f32) {
    for (row, own) in covariance.rows_mut().zip(along) {
        for (sum, part) in row.iter_mut().zip(along) {
            *sum += sigma * own * (sigma * part);
        }
    }
}

/// Returns the two of `count` evenly spaced knots from 0 to 1 around a value, each with its weight.
pub fn between(value: f32, count: usize) -> [(usize, f32); 2] {
    let last = count - 1;
    let at = limited(value, 0.0, 1.0) * last as f32;
    let first = (at as usize).min(last - 1);
    let second = at - first as f32;
    [(first, 1.0 - second), (first + 1, second)]
}

/// Coordinates in which a covariance is the unit matrix.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// The covariance's lower factor, with the reciprocals of its diagonal on the diagonal.
    factor: Covariance,
    /// The number of zeros that each row begins with. They need no work: noise alone is
    /// independent between markers.
    zeros: [u8; MOST_EQUATIONS],
}

impl Whitening {
    /// Storage without coordinates.
    pub(super) const EMPTY: Whitening = Whitening {
        factor: Covariance::EMPTY,
        zeros: [0; MOST_EQUATIONS],
    };

    /// Sets the covariance, which `put` leaves in its argument. Returns `None` if it is singular,
    /// or an entry is not a finite number.
    pub(super) fn set(&mut self, put: impl FnOnce(&mut Covariance)) -> Option<()> {
        put(&mut self.factor);
        self.factorize()
    }

    /// Cholesky's factor out of the covariance, in place.
    #[inline(never)]
    fn factorize(&mut self) -> Option<()> {
        let Whitening { factor, zeros } = self;
        let mut above = 0;
        for length in 1.. {
            let (finished, rest) = factor.entries.split_at_mut_checked(above)?;
            let Some(row) = rest.get_mut(..length) else {
                break;
            };
            let own_zeros = row.iter().take_while(|part| **part == 0.0).count();
            *zeros.get_mut(length - 1)? = own_zeros as u8;
            let first = own_zeros.min(length - 1);
            let mut before = finished.get(triangle(first)..)?;
            for j in first + 1..length {
                let (other, below) = before.split_at_checked(j)?;
                before = below;
                let (own, [entry, ..]) = row.split_at_mut_checked(j - 1)? else {
                    return None;
                };
                let (reciprocal, other) = other.split_last()?;
                *entry = less(*entry, own.get(first..)?, other.get(first..)?) * reciprocal;
            }
            let (diagonal, own) = row.split_last_mut()?;
            let own = own.get(first..)?;
            let left = less(*diagonal, own, own);
            if !(f32::MIN_POSITIVE..f32::MAX).contains(&left) {
                return None;
            }
            *diagonal = 1.0 / sqrt(left);
            above += length;
        }
        Some(())
    }

    /// Converts a column to these coordinates. Compiled once, because the near memory is scarce.
    #[inline(never)]
    pub fn whiten(&self, column: &mut [f32]) {
        for (row, zeros) in self.factor.rows().zip(self.zeros) {
            let zeros = usize::from(zeros);
            let head = column.get_mut(zeros..row.len());
            let head = head.and_then(<[f32]>::split_last_mut);
            let own = row.get(zeros..).and_then(<[f32]>::split_last);
            if let Some(((reciprocal, row), (here, before))) = own.zip(head) {
                *here = less(*here, row, before) * reciprocal;
            }
        }
    }
}

/// `whole` minus the sum of products.
fn less(whole: f32, parts: &[f32], others: &[f32]) -> f32 {
    let products = parts.iter().zip(others);
    products.fold(whole, |left, (part, other)| left - part * other)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    pub const LIMITS: Limits = Limits {
        size: 0.8,
        tilt: 0.67,
    };
    pub const COUNTS: [u8; 3] = [3, 2, 4];
    const COORDINATES: usize = 8;
    const KNOT: usize = knot_length(COORDINATES);

    pub fn pose(size: f32, place_mm: [f32; 2]) -> Pose {
        Pose {
            size,
            tilt: [0.1, -0.2],
            place_mm,
            ..Pose::default()
        }
    }

    fn at(grid: &CovarianceGrid<'_>, pose: &Pose) -> Covariance {
        let mut covariance = Covariance::EMPTY;
        grid.put(pose, &LIMITS, &mut covariance);
        covariance
    }

    fn whitening(covariance: &Covariance) -> Option<Whitening> {
        let mut whitening = Whitening::EMPTY;
        whitening.set(|own| *own = covariance.clone())?;
        Some(whitening)
    }

    /// Bytes of knots whose entries `entry(knot, index)` gives, in steps of 10⁻⁵.
    pub fn knots(entry: impl Fn(usize, usize) -> i16) -> Vec<u8> {
        let mut bytes = Vec::new();
        for knot in 0..COUNTS.map(usize::from).iter().product() {
            bytes.extend(1e-5f32.to_le_bytes());
            bytes.extend((0..triangle(COORDINATES)).flat_map(|k| entry(knot, k).to_le_bytes()));
        }
        bytes
    }

    /// The standard deviation of one coordinate is linear in each place axis and in the root of the
    /// size. It is reproduced at knots, between them, and beyond them as at the last one.
    #[test]
    fn planes_come_back() {
        let sigma = |size: f32, y: f32, x: f32| 1e3 * (1.0 + size + 2.0 * y + x);
        let entry = |knot: usize, k: usize| {
            let (x, line) = (knot % 4, knot / 4);
            let [size, y] = [line / 2, line % 2].map(|k| k as f32);
            match k {
                0 => sigma(size, y, x as f32) as i16,
                _ => 0,
            }
        };
        let bytes = knots(entry);
        let grid = CovarianceGrid::new(COORDINATES, COUNTS, 3.0, &bytes).unwrap();
        for (size, [x, y]) in [
            (0.0, [-3.0, -3.0]),
            (0.2, [1.0, -2.0]),
            (0.53, [0.3, 2.9]),
            (0.8, [3.0, 3.0]),
            (1.1, [9.0, -7.0]),
        ] {
            let found = at(&grid, &pose(size, [x, y]));
            let part = |at: f32| (at.clamp(-3.0, 3.0) + 3.0) / 6.0;
            let sizes = 2.0 * (size.min(0.8) / 0.8).sqrt();
            let expected = 1e-10 * sigma(sizes, part(y), 3.0 * part(x)).powi(2);
            let off = (found.entry(0, 0) - expected).abs();
            assert!(
                off < 2e-3 * expected,
                "{size} {x} {y}: {found:?} {expected}"
            );
            assert_eq!(found.entry(7, 7), 0.0);
        }
    }

    /// At a knot, the covariance is the knot's factor times its transpose.
    #[test]
    fn a_factor_is_squared() {
        let entry = |_, k: usize| ((k * k) % 29) as i16 - 14;
        let bytes = knots(entry);
        let grid = CovarianceGrid::new(COORDINATES, COUNTS, 3.0, &bytes).unwrap();
        let found = at(&grid, &pose(0.8, [3.0, 3.0]));
        let factor = |i: usize, k: usize| match k <= i {
            true => 1e-5 * f32::from(entry(0, triangle(i) + k)),
            false => 0.0,
        };
        for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
            let expected: f32 = (0..8).map(|k| factor(i, k) * factor(j, k)).sum();
            let off = (found.entry(i, j) - expected).abs();
            assert!(off < 1e-12, "{i} {j}: {} {expected}", found.entry(i, j));
        }
    }

    #[test]
    fn white_coordinates_have_the_unit_matrix() {
        let wave = |i: usize, j: usize| ((5 * i + 3 * j) as f32).sin();
        let product = |i: usize, j: usize| (0..8).map(|k| wave(i, k) * wave(j, k)).sum::<f32>();
        let mut covariance = Covariance::zeros(8);
        for (i, row) in covariance.rows_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = product(i, j);
            }
            row[i] += 0.5;
        }
        let whitening = whitening(&covariance).unwrap();
        // Columns of the whitening matrix.
        let inverse: [Column; 8] = core::array::from_fn(|k| {
            let mut unit = Column::defaults(8);
            unit[k] = 1.0;
            whitening.whiten(&mut unit);
            unit
        });
        for a in 0..8 {
            for b in 0..8 {
                let row = |k: usize| -> Column { Column::from_fn(8, |i| inverse[i][k]) };
                let (row_a, row_b) = (row(a), row(b));
                let mut sum = 0.0;
                for i in 0..8 {
                    for j in 0..8 {
                        sum += row_a[i] * covariance.entry(i, j) * row_b[j];
                    }
                }
                let expected = f32::from(u8::from(a == b));
                assert!((sum - expected).abs() < 1e-4, "{a} {b}: {sum}");
            }
        }
    }

    #[test]
    fn what_is_no_covariance_whitens_nothing() {
        assert!(whitening(&Covariance::zeros(8)).is_none());
        for wrong in [f32::NAN, f32::INFINITY, -1.0] {
            let mut covariance = Covariance::zeros(8);
            for row in covariance.rows_mut() {
                *row.last_mut().unwrap() = 1.0;
            }
            assert!(whitening(&covariance).is_some());
            covariance.add(5, 5, wrong - 1.0);
            assert!(whitening(&covariance).is_none(), "{wrong}");
        }
    }

    proptest! {
        /// With noise added, every file and every load gives a covariance.
        #[test]
        fn with_noise_it_is_always_a_covariance(
            seed in any::<u64>(),
            size in prop_oneof![-1.0f32..2.0, any::<f32>()],
            x in prop_oneof![-6.0f32..6.0, any::<f32>()],
            noise in 1e-5f32..1e-2,
        ) {
            let entry = |knot: usize, k: usize| {
                let mixed = (knot * triangle(COORDINATES) + k) as u64 ^ seed;
                (mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 48) as i16
            };
            let bytes = knots(entry);
            let grid = CovarianceGrid::new(COORDINATES, COUNTS, 4.0, &bytes).unwrap();
            let mut covariance = at(&grid, &pose(size, [x, 0.5]));
            for k in 0..COORDINATES {
                covariance.add(k, k, noise * noise);
            }
            let no_number = size.is_nan() || x.is_nan();
            prop_assert!(no_number || whitening(&covariance).is_some(), "{covariance:?}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let bytes = knots(|_, _| 3);
        let is_sound = |counts, end_mm, bytes: &[u8]| {
            CovarianceGrid::new(COORDINATES, counts, end_mm, bytes).is_some()
        };
        assert!(is_sound(COUNTS, 4.0, &bytes[..]));
        assert!(!is_sound(COUNTS, 4.0, &bytes[1..]) && !is_sound(COUNTS, 4.0, &bytes[KNOT..]));
        assert!(!is_sound([1, 6, 4], 4.0, &bytes[..]) && !is_sound([0, 2, 4], 4.0, &[]));
        for end_mm in [0.0, -4.0, 101.0, f32::NAN] {
            assert!(!is_sound(COUNTS, end_mm, &bytes[..]), "{end_mm}");
        }
        for step in [-1e-4, 1.1e-3, f32::NAN, f32::INFINITY] {
            let mut bytes = bytes.clone();
            bytes[KNOT..KNOT + 4].copy_from_slice(&step.to_le_bytes());
            assert!(!is_sound(COUNTS, 4.0, &bytes[..]), "{step}");
        }
    }
}
