//! Computes the only matrix product of training, fast and with the same bits on every machine.
//!
//! Every element is summed separately, in the order of the inner index. Vector instructions only
//! process several elements at a time; sums are not fused or reassociated. So the machine's
//! instruction set and number of threads do not matter.

use std::ops::{AddAssign, Mul};

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

/// Rows and columns of the result that are summed at a time.
const TILE_ROWS: usize = 4;
const TILE_COLUMNS: usize = 16;
/// From this number of multiplications on, all cores share the rows.
const WORTH_SHARING: usize = 1 << 21;

/// `f32` for training in floats, `f64` for the chip's integers, which it holds exactly.
pub(super) trait Number:
    Copy + Default + Mul<Output = Self> + AddAssign + Send + Sync
{
}
impl Number for f32 {}
impl Number for f64 {}

/// A·B, with A of m × k, B of k × n, all row by row; `shape` is \[m, k, n\].
pub(super) fn product<T: Number>(a: &[T], b: &[T], [m, k, n]: [usize; 3]) -> Vec<T> {
    debug_assert!(a.len() == m * k && b.len() == k * n);
    let mut c = vec![T::default(); m * n];
    if k == 0 || n == 0 {
        return c;
    }
    let arch = Arch::new();
    let rows = |(a, c): (&[T], &mut [T])| arch.dispatch(Block { a, b, c, k, n });
    let blocks = (TILE_ROWS * k, TILE_ROWS * n);
    if m * k * n < WORTH_SHARING {
        a.chunks(blocks.0)
            .zip(c.chunks_mut(blocks.1))
            .for_each(rows);
    } else {
        let shared = a.par_chunks(blocks.0).zip(c.par_chunks_mut(blocks.1));
        shared.with_min_len(8).for_each(rows);
    }
    c
}

/// Up to four rows of the result. A type rather than a closure, which would not be compiled for the
/// vector instructions that are dispatched.
struct Block<'a, T> {
    a: &'a [T],
    b: &'a [T],
    c: &'a mut [T],
    k: usize,
    n: usize,
}

impl<T: Number> NullaryFnOnce for Block<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { a, b, c, k, n } = self;
        if c.len() == TILE_ROWS * n {
            columns::<T, TILE_ROWS>(a, b, c, k, n);
        } else {
            for (a, c) in a.chunks(k).zip(c.chunks_mut(n)) {
                columns::<T, 1>(a, b, c, k, n);
            }
        }
    }
}

#[inline(always)]
fn columns<T: Number, const R: usize>(a: &[T], b: &[T], c: &mut [T], k: usize, n: usize) {
    let a: [&[T]; R] = std::array::from_fn(|r| &a[r * k..(r + 1) * k]);
    for first in (0..n).step_by(TILE_COLUMNS) {
        let width = TILE_COLUMNS.min(n - first);
        let mut sums = [[T::default(); TILE_COLUMNS]; R];
        if width == TILE_COLUMNS {
            for (i, row) in b.chunks_exact(n).enumerate() {
                let row: &[T; TILE_COLUMNS] = row[first..].first_chunk().expect("a whole tile");
                add_outer(&mut sums, a.map(|a| a[i]), row);
            }
        } else {
            let mut padded = [T::default(); TILE_COLUMNS];
            for (i, row) in b.chunks_exact(n).enumerate() {
                padded[..width].copy_from_slice(&row[first..first + width]);
                add_outer(&mut sums, a.map(|a| a[i]), &padded);
            }
        }
        for (r, sums) in sums.iter().enumerate() {
            c[r * n + first..][..width].copy_from_slice(&sums[..width]);
        }
    }
}

#[inline(always)]
fn add_outer<T: Number, const R: usize>(
    sums: &mut [[T; TILE_COLUMNS]; R],
    factors: [T; R],
    row: &[T; TILE_COLUMNS],
) {
    for r in 0..R {
        for c in 0..TILE_COLUMNS {
            sums[r][c] += factors[r] * row[c];
        }
    }
}

/// The transpose of a matrix of `rows` × `columns`.
pub(super) fn transposed<T: Number>(a: &[T], rows: usize, columns: usize) -> Vec<T> {
    debug_assert_eq!(a.len(), rows * columns);
    let mut t = vec![T::default(); a.len()];
    // In square tiles: whole columns of a wide matrix would touch a new cache line for every
    // element.
    for top in (0..rows).step_by(TILE_COLUMNS) {
        for left in (0..columns).step_by(TILE_COLUMNS) {
            for r in top..rows.min(top + TILE_COLUMNS) {
                for c in left..columns.min(left + TILE_COLUMNS) {
                    t[c * rows + r] = a[r * columns + c];
                }
            }
        }
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn plain(a: &[f32], b: &[f32], [m, k, n]: [usize; 3]) -> Vec<f32> {
        let element = |e: usize| {
            let (r, c) = (e / n, e % n);
            (0..k).fold(0.0, |sum, i| sum + a[r * k + i] * b[i * n + c])
        };
        (0..m * n).map(element).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn it_is_the_plain_sum_to_the_bit(
            m in 1_usize..12,
            k in 1_usize..40,
            n in 1_usize..40,
            seed: u32,
        ) {
            let mut state = seed | 1;
            let mut next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / 1e6 - 8.0
            };
            let a: Vec<f32> = (0..m * k).map(|_| next()).collect();
            let b: Vec<f32> = (0..k * n).map(|_| next()).collect();
            prop_assert_eq!(product(&a, &b, [m, k, n]), plain(&a, &b, [m, k, n]));
            prop_assert_eq!(transposed(&transposed(&a, m, k), k, m), a);
        }
    }

    #[test]
    fn shared_rows_are_the_same_rows() {
        let shape = [130, 130, 130];
        let a: Vec<f32> = (0..130 * 130).map(|i| (i % 977) as f32 / 31.0).collect();
        assert!(130_usize.pow(3) > WORTH_SHARING);
        assert_eq!(product(&a, &a, shape), plain(&a, &a, shape));
    }
}
