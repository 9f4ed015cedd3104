//! Solves linear equations for a contact's five unknowns, or for those of two contacts, by least
//! squares.
//!
//! Modified Gram–Schmidt, with the right side as one more column, is as stable as Householder's
//! reflections for least squares (Björck 1967), and avoids the squared condition of normal
//! equations.

use super::widths::OfWidth;
use crate::force::kernels::sqrt;
use hivtac_terms::list::List;
use hivtac_terms::marker::MOST_MARKERS;

/// Unknowns: size, tilt along x and y, place along x and y.
pub const UNKNOWNS: usize = 5;
/// Most markers.
pub const MOST_DOTS: usize = MOST_MARKERS;
/// Most equations of the markers: x and y of each.
pub const MOST_EQUATIONS: usize = 2 * MOST_DOTS;
/// Equations of the prior that follow those of the markers. One more may follow: of the width.
pub const PRIOR: usize = 4;
/// A column whose remainder after Gram–Schmidt is below this fraction of the whole column cannot be
/// distinguished from those before it. The tables' slopes are exact to some 10⁻³ of the largest.
const LEAST_OWN: f32 = 1e-3;

/// A column of the markers' equations: x and y of each marker.
pub type Column = List<f32, MOST_EQUATIONS>;
/// A column of the markers' equations and of the prior.
pub type Rows = List<f32, { MOST_EQUATIONS + PRIOR + 1 }>;
/// Size, tilt along x and y, place along x and y, or their changes.
pub type Unknowns = [f32; UNKNOWNS];

/// The sum of the squares of these parts.
pub(crate) fn square(parts: &[f32]) -> f32 {
    parts.iter().fold(0.0, |sum, part| sum + part * part)
}

/// The solution of the equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved<const COUNT: usize = UNKNOWNS> {
    /// The unknowns.
    pub unknowns: [f32; COUNT],
    /// The squared part of the right side that no unknowns explain.
    pub left_over: f32,
    /// The squared part that they explain.
    pub explained: f32,
    /// One row for each unknown. Products of rows are the unknowns' covariances if those of the
    /// equations are the unit matrix.
    pub spread: [[f32; COUNT]; COUNT],
    /// The step of the contact's width, if that was unknown.
    pub width: OfWidth,
}

impl<const COUNT: usize> Solved<COUNT> {
    /// The covariance of two unknowns. Compiled once, because the near memory is scarce.
    #[inline(never)]
    pub fn covariance(&self, a: usize, b: usize) -> f32 {
        let [Some(a), Some(b)] = [a, b].map(|unknown| self.spread.get(unknown)) else {
            return 0.0;
        };
        let pairs = a.iter().zip(b);
        pairs.fold(0.0, |sum, (a, b)| sum + a * b)
    }
}

impl Solved {
    /// Returns the unknowns nearest to `unknowns`, weighted by the equations, whose entries at
    /// `first` and after it are smaller by `less` along the unit vector `along`.
    pub fn held_back(
        &self,
        unknowns: Unknowns,
        first: usize,
        along: [f32; 2],
        less: f32,
    ) -> Unknowns {
        let with = |unknown: usize| {
            let [a, b] = [first, first + 1].map(|k| self.covariance(unknown, k));
            a * along[0] + b * along[1]
        };
        let variance = with(first) * along[0] + with(first + 1) * along[1];
        let mut held = unknowns;
        for (k, held) in held.iter_mut().enumerate() {
            *held -= less * with(k) / variance;
        }
        held
    }
}

/// Returns the unknowns whose combination of `columns` is nearest to `side`. Leaves the residual in
/// `side`, and orthogonal unit columns in `columns`. Returns `None` if the columns do not determine
/// the unknowns, or a number is not finite.
pub fn solve<const MOST: usize, const COUNT: usize>(
    columns: &mut [List<f32, MOST>; COUNT],
    side: &mut [f32],
) -> Option<Solved<COUNT>> {
    solve_here(columns, side)
}

/// [`solve`] as a part of its caller: on the chip it lies in the caller's memory.
#[inline(always)]
pub(super) fn solve_here<const MOST: usize, const COUNT: usize>(
    columns: &mut [List<f32, MOST>; COUNT],
    side: &mut [f32],
) -> Option<Solved<COUNT>> {
    let whole = columns.each_ref().map(|column| norm(column));
    let mut upper = [[0.0; COUNT]; COUNT];
    let mut along = [0.0; COUNT];
    for k in 0..COUNT {
        let own = norm(&columns[k]);
        // Up to rounding, at most the whole column's norm; NaN is outside the range.
        if !(f32::MIN_POSITIVE.max(LEAST_OWN * whole[k])..2.0 * whole[k]).contains(&own) {
            return None;
        }
        upper[k][k] = own;
        let per_own = 1.0 / own;
        let (unit, others) = columns.get_mut(k..)?.split_first_mut()?;
        for part in unit.iter_mut() {
            *part *= per_own;
        }
        for (other, upper) in others.iter_mut().zip(&mut upper[k][k + 1..]) {
            *upper = dot(unit, other);
            take(other, unit, *upper);
        }
        along[k] = dot(unit, side);
        take(side, unit, along[k]);
    }
    let left_over = dot(side, side);
    let inverse = inverse(&upper);
    let mut solved = Solved {
        unknowns: [0.0; COUNT],
        left_over,
        explained: square(&along),
        spread: inverse,
        width: OfWidth::KNOWN,
    };
    for (row, unknown) in solved.unknowns.iter_mut().enumerate() {
        for k in row..COUNT {
            *unknown += inverse[row][k] * along[k];
        }
    }
    let sound = left_over.is_finite() && solved.unknowns.iter().all(|part| part.is_finite());
    sound.then_some(solved)
}

/// The inverse of an upper triangular matrix whose diagonal is not near zero.
#[inline(always)]
fn inverse<const COUNT: usize>(upper: &[[f32; COUNT]; COUNT]) -> [[f32; COUNT]; COUNT] {
    let mut inverse = [[0.0; COUNT]; COUNT];
    for column in 0..COUNT {
        inverse[column][column] = 1.0 / upper[column][column];
        for row in (0..column).rev() {
            let below = upper[row].iter().zip(&inverse).skip(row + 1);
            let below = below.take(column - row);
            let sum = below.fold(0.0, |sum, (own, inverse)| sum + own * inverse[column]);
            inverse[row][column] = -sum * inverse[row][row];
        }
    }
    inverse
}

pub(super) fn norm(column: &[f32]) -> f32 {
    sqrt(dot(column, column))
}

/// Four independent sums, so that none waits for another.
pub(super) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; 4];
    let ((a, more_a), (b, more_b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    for (sum, (a, b)) in sums.iter_mut().zip(more_a.iter().zip(more_b)) {
        *sum += a * b;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

pub(super) fn take(from: &mut [f32], unit: &[f32], part: f32) {
    for (from, unit) in from.iter_mut().zip(unit) {
        *from -= part * unit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn columns(parts: [f32; 40]) -> [Column; UNKNOWNS] {
        core::array::from_fn(|k| Column::from_fn(8, |i| parts[8 * k + i]))
    }

    fn applied(columns: &[Column; UNKNOWNS], unknowns: [f32; UNKNOWNS]) -> Column {
        let mut sum = Column::defaults(8);
        for (column, unknown) in columns.iter().zip(unknowns) {
            take(&mut sum, column, -unknown);
        }
        sum
    }

    proptest! {
        #[test]
        fn what_was_combined_comes_back(
            parts in prop::array::uniform(-1.0f32..1.0),
            unknowns in prop::array::uniform5(-1.0f32..1.0),
            scales in prop::array::uniform5(-20i32..20),
        ) {
            let mut columns = columns(parts);
            for (column, scale) in columns.iter_mut().zip(scales) {
                *column = column.map(|part| part * 2f32.powi(scale));
            }
            let side = applied(&columns, unknowns);
            let Some(solved) = solve(&mut columns.clone(), &mut side.clone()) else {
                return Ok(());
            };
            // How far a rounding of the equations may move an unknown.
            let side = norm(&side);
            for (k, unknown) in unknowns.iter().enumerate() {
                let spread = solved.covariance(k, k).sqrt();
                let error = (solved.unknowns[k] - unknown).abs();
                prop_assert!(error <= 1e-4 * spread * side + 1e-6, "{error} {spread} {side}");
            }
            prop_assert!(solved.left_over <= 1e-6 * side * side);
        }

        /// Compared with normal equations in f64: the solution is nearest, its residual orthogonal
        /// to every column.
        #[test]
        fn what_is_left_is_across_all_columns(
            parts in prop::array::uniform(-1.0f32..1.0),
            side in prop::array::uniform8(-1.0f32..1.0),
        ) {
            let columns = columns(parts);
            let side = Column::of(side);
            let mut over = side;
            let Some(solved) = solve(&mut columns.clone(), &mut over) else {
                return Ok(());
            };
            let mut left = side;
            for (column, unknown) in columns.iter().zip(solved.unknowns) {
                take(&mut left, column, unknown);
            }
            let largest = solved.unknowns.iter().fold(1.0f32, |most, part| most.max(part.abs()));
            for (left, over) in left.iter().zip(over.iter()) {
                prop_assert!((left - over).abs() < 1e-4 * largest);
            }
            for column in &columns {
                prop_assert!(dot(&left, column).abs() < 1e-4 * largest);
            }
            prop_assert!((dot(&left, &left) - solved.left_over).abs() < 1e-4 * largest);
            let all = solved.left_over + solved.explained;
            prop_assert!((all - dot(&side, &side)).abs() < 1e-4 * largest);
        }

        #[test]
        fn any_number_is_survived(
            parts in prop::array::uniform(any::<f32>()),
            side in prop::array::uniform8(any::<f32>()),
        ) {
            if let Some(solved) = solve(&mut columns(parts), &mut Column::of(side)) {
                prop_assert!(solved.unknowns.iter().all(|part| part.is_finite()));
            }
        }
    }

    #[test]
    fn columns_that_say_the_same_are_refused() {
        let mut parts = [0.0; 40];
        for (i, part) in parts.iter_mut().enumerate() {
            *part = ((i * i) as f32 * 1.7).sin();
        }
        let mut all = columns(parts);
        assert!(solve(&mut all.clone(), &mut Column::filled(8, 1.0)).is_some());
        all[4] = all[1].map(|part| -3.0 * part);
        assert!(solve(&mut all.clone(), &mut Column::filled(8, 1.0)).is_none());
        all[4] = Column::defaults(8);
        assert!(solve(&mut all.clone(), &mut Column::filled(8, 1.0)).is_none());
    }

    #[test]
    fn the_covariance_is_that_of_the_normal_equations() {
        // Orthogonal columns of lengths 1, 2, 3, 4 and 5.
        let mut all = [Column::defaults(8); 5];
        for (k, column) in all.iter_mut().enumerate() {
            column[k] = (k + 1) as f32;
        }
        let solved = solve(&mut all.clone(), &mut Column::filled(8, 1.0)).unwrap();
        for k in 0..5 {
            let expected = 1.0 / ((k + 1) as f32).powi(2);
            assert!((solved.covariance(k, k) - expected).abs() < 1e-6);
            assert_eq!(solved.covariance(k, (k + 1) % 5), 0.0);
        }
        assert_eq!((solved.left_over, solved.explained), (3.0, 5.0));
    }
}
