//! The functions of the load that suffice for all places and all points of the film.

use faer::Side;
use faer::prelude::*;
use hivtac_twin::film::reduced::{LARGEST_SIZE, LARGEST_TILT, Pose};
use hivtac_twin::film::whole::{LoadFunctions, Mirrored};

use crate::ShellError;
use crate::path::halton;

/// Number of loads over which functions are compared.
const LOADS: usize = 4000;
/// Added to the products of terms so that none is nearly zero, in parts of the largest.
const LEAST: f64 = 1e-12;

/// Terms that are even or odd alike in the tilts along x and y.
struct Class {
    odd: [bool; 2],
    /// Indices of its terms.
    terms: Vec<usize>,
}

/// A direction among terms, and how much of the film's motion it has.
struct Direction {
    odd: [bool; 2],
    /// By term, all of them.
    coefficients: Vec<f64>,
    part: f64,
}

/// Returns the `count` functions that leave least of the motions, or one less where two belong
/// together. `columns` are the coefficients of motions by term, with the motions' weights.
///
/// # Errors
/// If the numbers are not finite.
pub fn functions(columns: &[(Vec<f64>, f64)], count: usize) -> Result<LoadFunctions, ShellError> {
    let products = products();
    let mut directions = Vec::new();
    for odd in [[false, false], [true, false], [true, true]] {
        directions.extend(of_class(&class(odd), &products, columns)?);
    }
    directions.sort_by(|a, b| b.part.total_cmp(&a.part));
    let (mut coefficients, mut mirrored) = (Vec::new(), Vec::new());
    for Direction {
        odd,
        coefficients: own,
        ..
    } in directions
    {
        let (k, other) = (mirrored.len(), swapped(&own));
        let pair = odd == [true, false];
        if k + if pair { 2 } else { 1 } > count {
            break;
        }
        let minus = !pair && dot(&own, &other) < 0.0;
        let one = |odd, swapped: usize| Mirrored {
            odd,
            swapped: swapped as u8,
            minus,
        };
        mirrored.push(one(odd, if pair { k + 1 } else { k }));
        coefficients.extend(own);
        if pair {
            mirrored.push(one([false, true], k));
            coefficients.extend(other);
        }
    }
    Ok(LoadFunctions::new(coefficients, mirrored))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn class(odd: [bool; 2]) -> Class {
    let terms = LoadFunctions::terms();
    let powers = terms.powers().iter().enumerate();
    let of_class = powers.filter(|(_, [_, x, y])| [x % 2 == 1, y % 2 == 1] == odd);
    Class {
        odd,
        terms: of_class.map(|(term, _)| term).collect(),
    }
}

/// Returns the coefficients of a function whose tilts along x and y are exchanged.
pub fn swapped(coefficients: &[f64]) -> Vec<f64> {
    let terms = LoadFunctions::terms();
    let powers = terms.powers();
    let of = |[size, x, y]: &[u8; 3]| {
        let other = powers.iter().position(|one| one == &[*size, *y, *x]);
        other.map_or(0.0, |other| coefficients[other])
    };
    powers.iter().map(of).collect()
}

/// Returns the mean products of pairs of terms over all loads and the mirrored ones: nothing for
/// terms of different classes.
fn products() -> Mat<f64> {
    let terms = LoadFunctions::terms();
    let count = terms.count();
    let mut products = Mat::<f64>::zeros(count, count);
    for index in 0..LOADS {
        let part = |base| halton(index + 1, base);
        let (tilt, turn) = (
            LARGEST_TILT * part(3).sqrt(),
            std::f64::consts::TAU * part(5),
        );
        let row = terms.exact(&Pose {
            size: LARGEST_SIZE * part(2),
            tilt: [tilt * turn.cos(), tilt * turn.sin()],
            place_mm: [0.0; 2],
        });
        for seen in [swapped(&row), row] {
            for i in 0..count {
                for j in 0..count {
                    products[(i, j)] += seen[i] * seen[j] / (2 * LOADS) as f64;
                }
            }
        }
    }
    let odd = |k: usize| terms.powers()[k].map(|power| power % 2);
    let alike = |i: usize, j: usize| odd(i)[1..] == odd(j)[1..];
    Mat::from_fn(count, count, |i, j| {
        if alike(i, j) { products[(i, j)] } else { 0.0 }
    })
}

/// Returns the directions among the terms of a class, ordered by their share of the motions.
/// Motions of the mirrored film count, too.
fn of_class(
    class: &Class,
    products: &Mat<f64>,
    columns: &[(Vec<f64>, f64)],
) -> Result<Vec<Direction>, ShellError> {
    let count = class.terms.len();
    let term = |k: usize| class.terms[k];
    let mut own = Mat::from_fn(count, count, |i, j| products[(term(i), term(j))]);
    let largest = (0..count).fold(0.0, |most: f64, k| most.max(own[(k, k)]));
    for k in 0..count {
        own[(k, k)] += LEAST * largest;
    }
    let failed = || ShellError::Solver("the motions' coefficients are not finite".into());
    let lower = own.llt(Side::Lower).map_err(|_| failed())?.L().to_owned();
    let mut motions = Mat::<f64>::zeros(count, count);
    for (column, weight) in columns {
        for seen in [column.clone(), swapped(column)] {
            let part = |k: usize| seen[term(k)];
            let scaled: Vec<f64> = (0..count)
                .map(|k| (k..count).map(|i| lower[(i, k)] * part(i)).sum())
                .collect();
            for i in 0..count {
                for j in 0..count {
                    motions[(i, j)] += weight * scaled[i] * scaled[j];
                }
            }
        }
    }
    let eigen = motions
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| failed())?;
    let found = (0..count).map(|k| {
        // The rows of the inverse of the products' root, transposed.
        let mut along: Vec<f64> = (0..count).map(|i| eigen.U()[(i, k)]).collect();
        for i in (0..count).rev() {
            for j in i + 1..count {
                along[i] -= lower[(j, i)] * along[j];
            }
            along[i] /= lower[(i, i)];
        }
        let mut coefficients = vec![0.0; products.nrows()];
        for (slot, part) in class.terms.iter().zip(along) {
            coefficients[*slot] = part;
        }
        Direction {
            odd: class.odd,
            coefficients,
            part: eigen.S()[k],
        }
    });
    Ok(found.collect())
}

/// Returns how much of each function is in a motion with these coefficients: its mean products with
/// the functions, which are independent of each other and of size 1.
pub struct Parts {
    /// By function and term.
    rows: Vec<Vec<f64>>,
}

impl Parts {
    /// Prepares functions with these coefficients, by function and term.
    pub fn of(functions: &[f64]) -> Parts {
        let products = products();
        let count = products.nrows();
        let row = |own: &[f64]| {
            (0..count)
                .map(|j| (0..count).map(|i| own[i] * products[(i, j)]).sum())
                .collect()
        };
        Parts {
            rows: functions.chunks(count).map(row).collect(),
        }
    }

    /// Returns how much of each function is in a motion with these coefficients.
    pub fn in_motion(&self, coefficients: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| dot(row, coefficients)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_of_few_functions_need_no_more() {
        let count = LoadFunctions::terms().count();
        let own = |seed: usize| {
            let part = |k: usize| ((seed * 7 + k) as f64 * 1.3).sin();
            class([seed % 2 == 1, false])
                .terms
                .iter()
                .fold(vec![0.0; count], |mut sum, k| {
                    sum[*k] = part(*k);
                    sum
                })
        };
        // Two even motions, which are four with the mirrored ones, and one that is odd along x.
        let columns: Vec<(Vec<f64>, f64)> = [0, 2, 1].map(|seed| (own(seed), 1.0)).to_vec();
        let found = functions(&columns, 6).unwrap();
        assert_eq!(found.count(), 6);
        let pose = Pose {
            size: 0.5,
            tilt: [0.2, -0.4],
            place_mm: [0.0; 2],
        };
        let parts = Parts::of(found.coefficients());
        for (column, _) in &columns {
            let whole = dot(column, &LoadFunctions::terms().exact(&pose));
            let reported = dot(&parts.in_motion(column), &found.values(&pose));
            assert!((whole - reported).abs() < 1e-6, "{whole} {reported}");
        }
    }
}
