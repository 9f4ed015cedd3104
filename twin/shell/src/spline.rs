//! Cubic B-splines along one side of the film.

/// Functions that are not zero on a span.
pub const SUPPORT: usize = 4;
const DEGREE: usize = SUPPORT - 1;

/// Values, first and second derivatives of the [`SUPPORT`] functions of a span at a point.
pub type Basis = [[f64; SUPPORT]; 3];

/// C²-continuous cubic B-splines over spans of any lengths.
///
/// The end knots are repeated, so that the first and last coefficients are the values at the ends.
/// `spans + 3` functions; span s carries functions s to s + 3.
#[derive(Clone, Debug)]
pub struct Axis {
    knots: Vec<f64>,
}

impl Axis {
    /// Returns splines over the spans between `breaks` (mm, increasing, at least two).
    pub fn new(breaks: &[f64]) -> Axis {
        let ends = |at: f64| std::iter::repeat_n(at, DEGREE);
        let (first, last) = (breaks[0], breaks[breaks.len() - 1]);
        let knots = ends(first).chain(breaks.iter().copied()).chain(ends(last));
        Axis {
            knots: knots.collect(),
        }
    }

    /// Returns the number of spans.
    pub fn spans(&self) -> usize {
        self.knots.len() - 2 * DEGREE - 1
    }

    /// Returns the number of functions, and thus of coefficients.
    pub fn functions(&self) -> usize {
        self.spans() + DEGREE
    }

    /// Returns the two ends of span `span`.
    pub fn ends(&self, span: usize) -> [f64; 2] {
        [self.knots[span + DEGREE], self.knots[span + DEGREE + 1]]
    }

    /// Returns the span that contains `x`. Points beyond the ends belong to the outermost spans.
    pub fn span_of(&self, x: f64) -> usize {
        let inner = &self.knots[DEGREE + 1..DEGREE + self.spans()];
        inner.partition_point(|&knot| knot <= x)
    }

    /// Returns the functions of span `span` at `x`, by de Boor's recurrence.
    pub fn basis(&self, span: usize, x: f64) -> Basis {
        let cubic = self.raise::<DEGREE>(span, x);
        let quadratic = self.raise::<2>(span, x);
        let linear = self.raise::<1>(span, x);
        let first = self.derivative(span, DEGREE, &quadratic);
        let slopes = self.derivative(span, DEGREE - 1, &linear);
        let second = self.derivative(span, DEGREE, &slopes);
        [cubic, first, second]
    }

    /// Iterates over the coefficients of f(x) = x (Greville's abscissae).
    #[cfg(test)]
    pub fn greville(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.functions())
            .map(|i| self.knots[i + 1..=i + DEGREE].iter().sum::<f64>() / DEGREE as f64)
    }

    /// Returns the `N` + 1 functions of degree `N` on `span`, at the front of the array.
    fn raise<const N: usize>(&self, span: usize, x: f64) -> [f64; SUPPORT] {
        let last = span + DEGREE;
        let mut values = [1.0, 0.0, 0.0, 0.0];
        for degree in 1..=N {
            let mut carried = 0.0;
            for (i, value) in values.iter_mut().take(degree).enumerate() {
                let (left, right) = (self.knots[last + 1 + i - degree], self.knots[last + 1 + i]);
                let share = *value / (right - left);
                *value = carried + (right - x) * share;
                carried = (x - left) * share;
            }
            values[degree] = carried;
        }
        values
    }

    /// Returns derivatives of the functions of `degree` from functions (or their derivatives) of
    /// one degree less.
    fn derivative(&self, span: usize, degree: usize, lower: &[f64; SUPPORT]) -> [f64; SUPPORT] {
        let first = span + DEGREE - degree;
        let mut values = [0.0; SUPPORT];
        for (i, below) in lower.iter().take(degree).enumerate() {
            let width = self.knots[first + 1 + i + degree] - self.knots[first + 1 + i];
            let slope = degree as f64 * below / width;
            values[i] -= slope;
            values[i + 1] += slope;
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BREAKS: [f64; 6] = [-2.0, -1.5, 0.0, 0.25, 1.0, 3.0];

    /// Returns coefficients that reproduce a cubic: its blossom at each function's three knots.
    fn cubic_coefficients(axis: &Axis) -> Vec<f64> {
        (0..axis.functions())
            .map(|i| {
                let [a, b, c] = [axis.knots[i + 1], axis.knots[i + 2], axis.knots[i + 3]];
                a * b * c - (a * b + b * c + c * a) / 3.0 + 0.5 * (a + b + c) / 3.0 + 2.0
            })
            .collect()
    }

    #[test]
    fn cubics_and_their_derivatives_are_exact() {
        let axis = Axis::new(&BREAKS);
        let coefficients = cubic_coefficients(&axis);
        for x in [-2.0, -1.9, -1.5, -0.2, 0.0, 0.1, 0.9, 1.0, 2.2, 3.0] {
            let span = axis.span_of(x);
            let basis = axis.basis(span, x);
            let sum = |d: usize| -> f64 {
                let terms = (0..SUPPORT).map(|i| basis[d][i] * coefficients[span + i]);
                terms.sum()
            };
            let expected = [
                x * x * x - x * x + 0.5 * x + 2.0,
                3.0 * x * x - 2.0 * x + 0.5,
                6.0 * x - 2.0,
            ];
            for d in 0..3 {
                assert!((sum(d) - expected[d]).abs() < 1e-12, "order {d} at {x}");
            }
        }
    }

    #[test]
    fn points_find_their_spans() {
        let axis = Axis::new(&BREAKS);
        assert_eq!((axis.spans(), axis.functions()), (5, 8));
        for (x, span) in [
            (-3.0, 0),
            (-2.0, 0),
            (-1.5, 1),
            (0.1, 2),
            (3.0, 4),
            (9.0, 4),
        ] {
            assert_eq!(axis.span_of(x), span, "{x}");
        }
        assert_eq!(axis.ends(1), [-1.5, 0.0]);
    }
}
