//! Cubic splines along one axis of the film.

/// Number of coefficients that make up a spline's value at a point.
pub const SPAN: usize = 4;

/// The nodes of cubic splines and the B-splines that the splines are sums of. There is one B-spline
/// for each node, smooth over the second node and the last but one (not-a-knot).
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    nodes: Vec<f64>,
    knots: Vec<f64>,
}

/// The weights of the coefficients in a value at a point, from the first coefficient on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Index of the first coefficient.
    pub first: usize,
    /// Weight of each coefficient.
    pub values: [f64; SPAN],
}

impl Axis {
    /// Returns the axis of at least six nodes, in increasing order, mm.
    pub fn new(nodes: &[f64]) -> Axis {
        let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
        let inner = &nodes[2..nodes.len() - 2];
        let knots = [&[first; SPAN], inner, &[last; SPAN]].concat();
        Axis {
            nodes: nodes.to_vec(),
            knots,
        }
    }

    /// Returns the nodes, mm.
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Returns the weights of the value at x. Beyond the last node they are those of the last node.
    pub fn at(&self, x: f64) -> Weights {
        let knots = &self.knots;
        let x = x.clamp(knots[0], knots[knots.len() - 1]);
        let inner = &knots[SPAN..knots.len() - SPAN];
        let first = inner.iter().filter(|knot| **knot <= x).count();
        let span = first + SPAN - 1;
        let mut values = [1.0, 0.0, 0.0, 0.0];
        // Cox and de Boor's recurrence.
        for degree in 1..SPAN {
            let mut saved = 0.0;
            for r in 0..degree {
                let right = knots[span + r + 1];
                let left = knots[span + 1 + r - degree];
                let part = values[r] / (right - left);
                values[r] = saved + (right - x) * part;
                saved = (x - left) * part;
            }
            values[degree] = saved;
        }
        Weights { first, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [f64; 8] = [-5.0, -2.0, 0.0, 1.0, 2.5, 3.0, 4.0, 5.0];

    #[test]
    fn weights_are_parts_of_one() {
        let axis = Axis::new(&NODES);
        for step in 0..=120 {
            let weights = axis.at(-6.0 + 0.1 * f64::from(step));
            assert!((weights.values.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(weights.values.iter().all(|part| *part >= 0.0));
            assert!(weights.first + SPAN <= NODES.len());
        }
    }

    /// Greville's points are the coefficients of x itself.
    #[test]
    fn a_line_is_a_spline() {
        let axis = Axis::new(&NODES);
        let own = |j: usize| axis.knots[j + 1..j + SPAN].iter().sum::<f64>() / 3.0;
        for x in [-5.0, -3.3, 0.0, 0.7, 2.5, 4.9, 5.0] {
            let Weights { first, values } = axis.at(x);
            let sum: f64 = (0..SPAN).map(|k| values[k] * own(first + k)).sum();
            assert!((sum - x).abs() < 1e-12, "{sum} {x}");
        }
    }
}
