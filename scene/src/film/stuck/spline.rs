//! Splines through values at given places of an axis, as sums of local base functions (B-splines): cubic, or straight
//! lines.

/// The base functions of an axis, of which `BASES` are not nothing at a place: 4 of cubics, 2 of straight lines. There are
/// as many as there are places; between cubics there is no border at the second place and the last but one ("not a
/// knot").
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Splines<const BASES: usize> {
    places: Vec<f64>,
    /// Where the second piece begins, and each after it.
    borders: Vec<f64>,
    pieces: Vec<Piece<BASES>>,
}

/// What is one polynomial for each base function.
#[derive(Clone, Debug, PartialEq)]
struct Piece<const BASES: usize> {
    begin: f64,
    /// Of each base function the polynomial in the distance from `begin`, from its constant.
    powers: [[f64; BASES]; BASES],
}

impl<const BASES: usize> Splines<BASES> {
    /// `places` rise, and are `BASES` or more.
    pub(super) fn new(places: Vec<f64>) -> Splines<BASES> {
        let inner = BASES / 2..places.len() - BASES / 2;
        let last = places.len() - 1;
        let mut knots = vec![places[0]; BASES];
        knots.extend(&places[inner.clone()]);
        knots.extend([places[last]; BASES]);
        let pieces = (BASES - 1..knots.len() - BASES).map(|k| Piece::new(&knots, k));
        Splines {
            pieces: pieces.collect(),
            borders: places[inner].to_vec(),
            places,
        }
    }

    pub(super) fn places(&self) -> &[f64] {
        &self.places
    }

    /// The base functions that are not nothing at a place: the first one's number and their values.
    pub(super) fn at(&self, place: f64) -> (usize, [f64; BASES]) {
        let number = self
            .borders
            .iter()
            .filter(|border| **border <= place)
            .count();
        let piece = &self.pieces[number];
        let x = place - piece.begin;
        let value =
            |powers: [f64; BASES]| powers.iter().rev().fold(0.0, |sum, part| sum * x + part);
        (number, piece.powers.map(value))
    }

    /// Turns values at the places into the coefficients of the base functions whose sum goes through them. Each place
    /// has a row of `width` values.
    pub(super) fn solve(&self, values: &mut [f64], width: usize) {
        let count = self.places.len();
        let mut matrix = vec![vec![0.0; count]; count];
        for (row, place) in matrix.iter_mut().zip(&self.places) {
            let (first, bases) = self.at(*place);
            row[first..first + BASES].copy_from_slice(&bases);
        }
        // Such a matrix is totally positive: no pivoting.
        for k in 0..count {
            for row in k + 1..count.min(k + BASES) {
                let factor = matrix[row][k] / matrix[k][k];
                if factor != 0.0 {
                    let above = matrix[k].clone();
                    subtract(&mut matrix[row], &above, factor);
                    let (from, to) = values.split_at_mut(row * width);
                    subtract(&mut to[..width], &from[k * width..][..width], factor);
                }
            }
        }
        for k in (0..count).rev() {
            let (solved, below) = values.split_at_mut((k + 1) * width);
            let own = &mut solved[k * width..];
            for (row, factor) in (k + 1..count).zip(&matrix[k][k + 1..]).take(BASES) {
                if *factor != 0.0 {
                    subtract(own, &below[(row - k - 1) * width..][..width], *factor);
                }
            }
            own.iter_mut().for_each(|value| *value /= matrix[k][k]);
        }
    }
}

fn subtract(row: &mut [f64], other: &[f64], factor: f64) {
    for (value, part) in row.iter_mut().zip(other) {
        *value -= factor * part;
    }
}

impl<const BASES: usize> Piece<BASES> {
    /// From knot `k` to the next, by de Boor's recursion on the polynomials themselves.
    fn new(knots: &[f64], k: usize) -> Piece<BASES> {
        let begin = knots[k];
        let mut powers = [[0.0; BASES]; BASES];
        powers[BASES - 1][0] = 1.0;
        for degree in 1..BASES {
            let before = powers;
            powers = [[0.0; BASES]; BASES];
            // Function `first + j` rises over knots first + j … and falls over the following ones.
            let first = k + 1 - BASES;
            for j in BASES - 1 - degree..BASES {
                let (from, to) = (knots[first + j], knots[first + j + degree + 1]);
                if before[j] != [0.0; BASES] {
                    let width = knots[first + j + degree] - from;
                    add_linear(&mut powers[j], &before[j], begin - from, 1.0, width);
                }
                if j + 1 < BASES && before[j + 1] != [0.0; BASES] {
                    let width = to - knots[first + j + 1];
                    add_linear(&mut powers[j], &before[j + 1], to - begin, -1.0, width);
                }
            }
        }
        Piece { begin, powers }
    }
}

/// Adds polynomial · (constant + slope · x) / width.
fn add_linear<const BASES: usize>(
    sum: &mut [f64; BASES],
    polynomial: &[f64; BASES],
    constant: f64,
    slope: f64,
    width: f64,
) {
    for power in 0..BASES {
        sum[power] += polynomial[power] * constant / width;
        if power > 0 {
            sum[power] += polynomial[power - 1] * slope / width;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven() -> Splines<4> {
        Splines::new(vec![-0.3, 0.0, 0.1, 0.35, 0.5, 0.9, 1.0])
    }

    fn value(splines: &Splines<4>, coefficients: &[f64], place: f64) -> f64 {
        let (first, bases) = splines.at(place);
        let parts = bases.iter().zip(&coefficients[first..]);
        parts.map(|(a, b)| a * b).sum()
    }

    #[test]
    fn base_functions_are_no_less_than_nothing_and_add_up_to_one() {
        let splines = uneven();
        for k in 0..=130 {
            let (_, bases) = splines.at(f64::from(k) / 100.0 - 0.3);
            assert!((bases.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(bases.iter().all(|base| *base > -1e-12), "{bases:?}");
        }
    }

    #[test]
    fn cubics_come_back_and_values_are_met() {
        let splines = uneven();
        let cubic = |x: f64| 0.3 - x + 2.0 * x * x + 1.5 * x * x * x;
        let other = |x: f64| libm::sin(9.0 * x);
        let rows = splines.places.iter().flat_map(|x| [cubic(*x), other(*x)]);
        let mut rows: Vec<f64> = rows.collect();
        splines.solve(&mut rows, 2);
        let column = |k: usize| rows.iter().skip(k).step_by(2).copied().collect::<Vec<_>>();
        for k in 0..=130 {
            let x = f64::from(k) / 100.0 - 0.3;
            assert!((value(&splines, &column(0), x) - cubic(x)).abs() < 1e-12);
        }
        for x in &splines.places {
            assert!((value(&splines, &column(1), *x) - other(*x)).abs() < 1e-12);
        }
    }

    #[test]
    fn straight_lines_join_values() {
        let splines = Splines::<2>::new(vec![0.0, 0.5, 2.0]);
        let mut values = [1.0, 3.0, -3.0];
        splines.solve(&mut values, 1);
        for (place, expected) in [(0.25, 2.0), (0.5, 3.0), (1.25, 0.0), (2.0, -3.0)] {
            let (first, bases) = splines.at(place);
            let found = bases[0] * values[first] + bases[1] * values[first + 1];
            assert!((found - expected).abs() < 1e-12, "{place}: {found}");
        }
    }

    #[test]
    fn pieces_meet_with_slope_and_curvature() {
        let splines = uneven();
        let coefficients = [1.0, -2.0, 0.5, 3.0, -1.0, 0.7, 0.2];
        let f = |x: f64| value(&splines, &coefficients, x);
        const H: f64 = 1e-4;
        let slope = |x: f64| (f(x + H) - f(x - H)) / (2.0 * H);
        for border in [0.1, 0.35, 0.5] {
            assert!((f(border - 1e-9) - f(border + 1e-9)).abs() < 1e-6);
            assert!((slope(border - 2.0 * H) - slope(border + 2.0 * H)).abs() < 0.1);
        }
    }
}
