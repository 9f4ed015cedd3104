//! The stiffness matrix and its factors.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{MatMut, Side};

use crate::ShellError;
use crate::spline::SUPPORT;

/// Components of a displacement, and so unknowns of a coefficient.
pub const COMPONENTS: usize = 3;
const REACH: usize = SUPPORT - 1;

/// Which unknowns of a grid of coefficients meet in the energy: lower triangle, by columns.
///
/// Coefficient (i, j) has index j · columns + i, and its component c the unknown 3 · index + c. Two
/// coefficients meet when neither i nor j differ by more than 3.
pub struct Pattern {
    columns: usize,
    rows: usize,
    starts: Vec<usize>,
    entries: Vec<usize>,
}

impl Pattern {
    /// The pattern of a grid of `columns` × `rows` coefficients.
    pub fn new(columns: usize, rows: usize) -> Pattern {
        let mut pattern = Pattern {
            columns,
            rows,
            starts: vec![0],
            entries: Vec::new(),
        };
        for index in 0..columns * rows {
            let later = pattern.later_neighbours(index);
            for component in 0..COMPONENTS {
                let own = (component..COMPONENTS).map(|c| COMPONENTS * index + c);
                pattern.entries.extend(own);
                pattern.entries.extend(&later);
                pattern.starts.push(pattern.entries.len());
            }
        }
        pattern
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of entries of the lower triangle.
    pub fn entries(&self) -> usize {
        self.entries.len()
    }

    /// Adds a 3×3 block where coefficient `row` meets `column` ≤ `row`.
    #[inline]
    pub fn add_block(
        &self,
        values: &mut [f64],
        row: usize,
        column: usize,
        block: &[[f64; 3]; COMPONENTS],
    ) {
        if row == column {
            for d in 0..COMPONENTS {
                let start = self.starts[COMPONENTS * column + d];
                for c in d..COMPONENTS {
                    values[start + c - d] += block[c][d];
                }
            }
            return;
        }
        let before = COMPONENTS * self.between(row, column);
        for d in 0..COMPONENTS {
            let start = self.starts[COMPONENTS * column + d] + (COMPONENTS - d) + before;
            for (c, part) in block.iter().enumerate() {
                values[start + c] += part[d];
            }
        }
    }

    /// The entries on the diagonal, in order.
    pub fn diagonal(&self) -> &[usize] {
        &self.starts[..self.unknowns()]
    }

    /// (column, row, value) of each entry.
    #[cfg(test)]
    pub fn triplets<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = (usize, usize, f64)> {
        (0..self.unknowns()).flat_map(move |column| {
            let of_column = self.starts[column]..self.starts[column + 1];
            of_column.map(move |entry| (column, self.entries[entry], values[entry]))
        })
    }

    /// How many neighbours of `column` come after it and before `row`.
    #[inline]
    fn between(&self, row: usize, column: usize) -> usize {
        let (i, j) = (column % self.columns, column / self.columns);
        let (k, l) = (row % self.columns, row / self.columns);
        if l == j {
            return k - i - 1;
        }
        let (first, end) = self.neighbouring_columns(i);
        (end - 1 - i) + (l - j - 1) * (end - first) + (k - first)
    }

    fn neighbouring_columns(&self, i: usize) -> (usize, usize) {
        (i.saturating_sub(REACH), (i + REACH + 1).min(self.columns))
    }

    /// The unknowns of the neighbours after coefficient `index`.
    fn later_neighbours(&self, index: usize) -> Vec<usize> {
        let (i, j) = (index % self.columns, index / self.columns);
        let (first, end) = self.neighbouring_columns(i);
        let below = (j + 1)..(j + REACH + 1).min(self.rows);
        let same_row = (i + 1..end).map(|k| j * self.columns + k);
        let others = below.flat_map(|l| (first..end).map(move |k| l * self.columns + k));
        same_row
            .chain(others)
            .flat_map(|k| (0..COMPONENTS).map(move |c| COMPONENTS * k + c))
            .collect()
    }

    fn symbolic(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.unknowns();
        SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.entries)
    }
}

/// Factors matrices of one pattern.
pub struct Solver {
    order: SymbolicLlt<usize>,
}

impl Solver {
    /// Finds the elimination order.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn new(pattern: &Pattern) -> Result<Solver, ShellError> {
        let order = SymbolicLlt::try_new(pattern.symbolic(), Side::Lower)
            .map_err(|error| ShellError::Solver(error.to_string()))?;
        Ok(Solver { order })
    }

    /// Cholesky's factors of the matrix with these entries; `None` when it is not positive
    /// definite.
    pub fn factor(&self, pattern: &Pattern, values: &[f64]) -> Option<Factors> {
        let matrix = SparseColMatRef::new(pattern.symbolic(), values);
        let factors = Llt::try_new_with_symbolic(self.order.clone(), matrix, Side::Lower).ok()?;
        Some(Factors { factors })
    }
}

/// A factored matrix.
pub struct Factors {
    factors: Llt<usize, f64>,
}

impl Factors {
    /// Replaces each right-hand side (one after the other in `sides`) by its solution.
    pub fn solve(&self, sides: &mut [f64], count: usize) {
        let unknowns = sides.len() / count;
        let sides = MatMut::from_column_major_slice_mut(sides, unknowns, count);
        self.factors.solve_in_place(sides);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pair of coefficients that meet, filled as a diagonally dominant matrix; also in full.
    fn filled(pattern: &Pattern) -> (Vec<f64>, Vec<Vec<f64>>) {
        let n = pattern.unknowns();
        let (mut values, mut full) = (vec![0.0; pattern.entries()], vec![vec![0.0; n]; n]);
        for row in 0..n / 3 {
            for column in 0..=row {
                let (i, k) = (row % pattern.columns, column % pattern.columns);
                let (j, l) = (row / pattern.columns, column / pattern.columns);
                if i.abs_diff(k) > 3 || j.abs_diff(l) > 3 {
                    continue;
                }
                let dominant = if row == column { 500.0 } else { 0.0 };
                let block: [[f64; 3]; 3] = std::array::from_fn(|c| {
                    std::array::from_fn(|d| {
                        let symmetric = if row == column { c * d } else { c + 2 * d };
                        let part = ((row * 7 + column * 3 + symmetric) % 5) as f64;
                        part + if c == d { dominant } else { 0.0 }
                    })
                });
                pattern.add_block(&mut values, row, column, &block);
                for c in 0..3 {
                    for d in 0..3 {
                        full[3 * row + c][3 * column + d] = block[c][d];
                        full[3 * column + d][3 * row + c] = block[c][d];
                    }
                }
            }
        }
        (values, full)
    }

    #[test]
    fn blocks_land_where_they_belong_and_are_solved_for() {
        let pattern = Pattern::new(9, 6);
        let (values, full) = filled(&pattern);
        let expected: Vec<f64> = (0..2 * pattern.unknowns())
            .map(|i| (i % 11) as f64)
            .collect();
        let mut sides: Vec<f64> = expected
            .chunks(pattern.unknowns())
            .flat_map(|x| {
                full.iter()
                    .map(move |row| row.iter().zip(x).map(|(a, b)| a * b).sum())
            })
            .collect();
        let factors = Solver::new(&pattern).unwrap().factor(&pattern, &values);
        factors.unwrap().solve(&mut sides, 2);
        for (found, expected) in sides.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-10);
        }
        for (k, &entry) in pattern.diagonal().iter().enumerate() {
            assert_eq!(values[entry], full[k][k]);
        }
    }

    #[test]
    fn an_indefinite_matrix_has_no_factors() {
        let pattern = Pattern::new(4, 4);
        let (mut values, _) = filled(&pattern);
        values[pattern.diagonal()[7]] = -1.0;
        assert!(
            Solver::new(&pattern)
                .unwrap()
                .factor(&pattern, &values)
                .is_none()
        );
    }
}
