//! The stiffness matrix and its factors.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::ShellError;
use crate::cell::{CellStiffness, Row};
use crate::shell::LOCAL;
use crate::spline::SUPPORT;

/// Number of components of a displacement, and thus of unknowns per coefficient.
pub const COMPONENTS: usize = 3;
const REACH: usize = SUPPORT - 1;
/// The side of a rectangle of coefficients, without the separator, below which it is not halved.
const LEAF: usize = 4;
/// The index of each pair of components in a cell's stiffness.
const PAIR: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];

/// The pairs of unknowns of a grid of coefficients that share a term of the energy: lower triangle,
/// by columns.
///
/// Coefficient (i, j) has index j · columns + i, and its component c is unknown 3 · index + c. Two
/// coefficients form a pair if neither i nor j differ by more than 3.
pub struct Pattern {
    columns: usize,
    rows: usize,
    starts: Vec<usize>,
    entries: Vec<usize>,
}

impl Pattern {
    /// Returns the pattern of a grid of `columns` × `rows` coefficients.
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

    /// Returns the number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns the number of entries of the lower triangle.
    pub fn entries(&self) -> usize {
        self.entries.len()
    }

    /// Adds the stiffness of the cell whose first coefficient is at `origin`.
    #[inline(always)]
    pub fn add_cell(&self, values: &mut [f64], origin: [usize; 2], cell: &CellStiffness) {
        self.each_pair(origin, |column, row, starts, reach| {
            for d in 0..COMPONENTS {
                let own = if row == column { d } else { 0 };
                let start = starts[d] + reach;
                let start = if row == column { start } else { start - d };
                for c in own..COMPONENTS {
                    let part = if c <= d {
                        cell[PAIR[c][d]][row][column]
                    } else {
                        cell[PAIR[d][c]][column][row]
                    };
                    values[start + c - own] += part;
                }
            }
        });
    }

    /// Adds springs of the same stiffness in all directions.
    pub fn add_springs(&self, values: &mut [f64], origin: [usize; 2], cell: &[Row; LOCAL]) {
        self.each_pair(origin, |column, row, starts, reach| {
            for d in 0..COMPONENTS {
                values[starts[d] + reach] += cell[row][column];
            }
        });
    }

    /// Calls `each` with every pair of a cell's coefficients: (column, row ≥ column), the first
    /// entries of the column's unknowns, and the offset from the first of them to the row's
    /// unknowns.
    #[inline(always)]
    fn each_pair(
        &self,
        [i, j]: [usize; 2],
        mut call: impl FnMut(usize, usize, &[usize; COMPONENTS], usize),
    ) {
        for column in 0..LOCAL {
            let (k, l) = (i + column % SUPPORT, j + column / SUPPORT);
            let first = COMPONENTS * (l * self.columns + k);
            let starts = [0, 1, 2].map(|d| self.starts[first + d]);
            let (from, end) = self.neighbouring_columns(k);
            for row in column..LOCAL {
                let (m, n) = (i + row % SUPPORT, row / SUPPORT - column / SUPPORT);
                let reach = match n {
                    0 => m - k,
                    _ => (end - k) + (n - 1) * (end - from) + (m - from),
                };
                call(column, row, &starts, COMPONENTS * reach);
            }
        }
    }

    /// Returns the entries on the diagonal, in order.
    pub fn diagonal(&self) -> &[usize] {
        &self.starts[..self.unknowns()]
    }

    /// Iterates over (column, row, value) of each entry.
    #[cfg(test)]
    pub fn triplets<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = (usize, usize, f64)> {
        (0..self.unknowns()).flat_map(move |column| {
            let of_column = self.starts[column]..self.starts[column + 1];
            of_column.map(move |entry| (column, self.entries[entry], values[entry]))
        })
    }

    fn neighbouring_columns(&self, i: usize) -> (usize, usize) {
        (i.saturating_sub(REACH), (i + REACH + 1).min(self.columns))
    }

    /// Returns the unknowns of the neighbours after coefficient `index`.
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

    /// Orders the unknowns of the coefficients in a rectangle (from, end along each side). Two that
    /// are not a pair are separated by others that come after both.
    fn dissect(&self, [i, k]: [usize; 2], [j, l]: [usize; 2], order: &mut Vec<usize>) {
        let (wide, high) = (k - i, l - j);
        if wide.max(high) < 2 * REACH + LEAF {
            self.in_rows([i, k], [j, l], order);
        } else if wide >= high {
            let cut = i + (wide - REACH) / 2;
            self.dissect([i, cut], [j, l], order);
            self.dissect([cut + REACH, k], [j, l], order);
            self.in_rows([cut, cut + REACH], [j, l], order);
        } else {
            let cut = j + (high - REACH) / 2;
            self.dissect([i, k], [j, cut], order);
            self.dissect([i, k], [cut + REACH, l], order);
            self.in_rows([i, k], [cut, cut + REACH], order);
        }
    }

    fn in_rows(&self, [i, k]: [usize; 2], [j, l]: [usize; 2], order: &mut Vec<usize>) {
        let indices = (j..l).flat_map(|row| (i..k).map(move |at| row * self.columns + at));
        order.extend(indices.flat_map(|at| (0..COMPONENTS).map(move |c| COMPONENTS * at + c)));
    }

    fn symbolic(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.unknowns();
        SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.entries)
    }
}

/// Factors matrices of one pattern.
pub struct Solver {
    symbolic: Arc<SymbolicCholesky<usize>>,
}

impl Solver {
    /// Finds the elimination order: the grid is halved again and again, and the separator between
    /// the halves comes last.
    ///
    /// # Errors
    /// If memory runs out.
    pub fn new(pattern: &Pattern) -> Result<Solver, ShellError> {
        let refused = |error: FaerError| ShellError::Solver(error.to_string());
        let mut order = Vec::with_capacity(pattern.unknowns());
        pattern.dissect([0, pattern.columns], [0, pattern.rows], &mut order);
        let mut back = vec![0; order.len()];
        for (place, &unknown) in order.iter().enumerate() {
            back[unknown] = place;
        }
        let order = PermRef::new_checked(&order, &back, order.len());
        let symbolic = factorize_symbolic_cholesky(
            pattern.symbolic(),
            Side::Lower,
            SymmetricOrdering::Custom(order),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..CholeskySymbolicParams::default()
            },
        );
        Ok(Solver {
            symbolic: Arc::new(symbolic.map_err(refused)?),
        })
    }

    /// Returns Cholesky's factors of the matrix with these entries. Returns `None` if it is not
    /// positive definite, or memory runs out.
    pub fn factor(&self, pattern: &Pattern, values: &[f64]) -> Option<Factors> {
        let matrix = SparseColMatRef::new(pattern.symbolic(), values);
        let mut factors = vec![0.0; self.symbolic.len_val()];
        let scratch = self
            .symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        self.symbolic
            .factorize_numeric_llt(
                &mut factors,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::try_new(scratch).ok()?),
                Default::default(),
            )
            .ok()?;
        Some(Factors {
            symbolic: Arc::clone(&self.symbolic),
            factors,
        })
    }
}

/// A factored matrix.
pub struct Factors {
    symbolic: Arc<SymbolicCholesky<usize>>,
    factors: Vec<f64>,
}

impl Factors {
    /// Replaces each right-hand side (one after the other in `sides`) by its solution.
    pub fn solve(&self, sides: &mut [f64], count: usize) {
        let unknowns = sides.len() / count;
        let sides = MatMut::from_column_major_slice_mut(sides, unknowns, count);
        let scratch = self.symbolic.solve_in_place_scratch::<f64>(count, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        LltRef::new(&self.symbolic, &self.factors).solve_in_place_with_conj(
            Conj::No,
            sides,
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a matrix with entries in every cell and a dominant diagonal, also in full.
    fn filled(pattern: &Pattern) -> (Vec<f64>, Vec<Vec<f64>>) {
        let n = pattern.unknowns();
        let (mut values, mut full) = (vec![0.0; pattern.entries()], vec![vec![0.0; n]; n]);
        let cells =
            (0..pattern.rows - 3).flat_map(|j| (0..pattern.columns - 3).map(move |i| [i, j]));
        for [i, j] in cells {
            let part = |p: usize, a: usize, b: usize| {
                let dominant = if p < 3 && a == b { 500.0 } else { 0.0 };
                let (a, b) = if p < 3 { (a.max(b), a.min(b)) } else { (a, b) };
                ((a * 7 + b * 3 + p + i + 2 * j) % 5) as f64 + dominant
            };
            let cell: CellStiffness = std::array::from_fn(|p| {
                std::array::from_fn(|a| std::array::from_fn(|b| part(p, a, b)))
            });
            pattern.add_cell(&mut values, [i, j], &cell);
            let index = |a: usize| (j + a / 4) * pattern.columns + i + a % 4;
            for a in 0..LOCAL {
                for b in 0..LOCAL {
                    for c in 0..3 {
                        for e in 0..3 {
                            full[3 * index(a) + c][3 * index(b) + e] += match c <= e {
                                true => part(PAIR[c][e], a, b),
                                false => part(PAIR[e][c], b, a),
                            };
                        }
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
        for (column, row, value) in pattern.triplets(&values) {
            assert_eq!(value, full[row][column]);
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
