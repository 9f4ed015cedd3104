//! Evaluates cubic splines along one axis of the film.

use hivtac_terms::fixed::Q;

/// Number of coefficients that make a spline's value at a point.
pub const SPAN: usize = 4;
/// Allowed number of nodes.
pub const NODES: core::ops::RangeInclusive<usize> = 6..=20;
/// The sum of a value's weights, in steps of 2⁻¹⁵: the largest i16, as 2¹⁵ itself does not fit.
pub const ONE: f32 = 32_767.0;
/// 3·2²². A number added to it is rounded to an integer, because f32 has no smaller steps there.
/// Numbers of 16 bits are then the low half of its bits.
const WHOLE: f32 = 12_582_912.0;

/// The nodes of cubic splines, borrowed from a file. A spline is a sum of B-splines, one for each
/// node, and smooth over the second and the last but one node (not-a-knot).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis<'a> {
    /// f32 each, mm.
    nodes: &'a [[u8; 4]],
    /// Unit of the slopes' weights, 1/mm.
    slope_unit: f32,
}

/// The weights of four successive coefficients in the value and the slope at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// The first coefficient.
    pub first: usize,
    /// Weights of the value, [`ONE`] in sum. Their absolute values add up to at most [`ONE`] and
    /// four roundings.
    pub values: [Q<15, i16>; SPAN],
    /// Weights of the slope in units of [`Axis::slope_unit`], with the same limit.
    pub slopes: [Q<15, i16>; SPAN],
}

impl<'a> Axis<'a> {
    /// Takes rising nodes, f32 each. Returns `None` if their number is not in [`NODES`], one is
    /// beyond ±100 mm, or two are less than 0.01 mm apart.
    pub fn new(nodes: &'a [[u8; 4]]) -> Option<Axis<'a>> {
        let mm = |node: &[u8; 4]| f32::from_le_bytes(*node);
        let grow = nodes
            .windows(2)
            .all(|pair| mm(&pair[1]) - mm(&pair[0]) >= 0.01);
        let near = nodes.iter().all(|node| mm(node).abs() <= 100.0);
        if !NODES.contains(&nodes.len()) || !grow || !near {
            return None;
        }
        let mut axis = Axis {
            nodes,
            slope_unit: 0.0,
        };
        // Weights of quadratic B-splines add up to one. The slope's weights are differences of
        // three times these, over at least the narrowest span: at most six over that span.
        let spans = (SPAN - 1..nodes.len()).map(|span| axis.knot_mm(span + 1) - axis.knot_mm(span));
        axis.slope_unit = 6.0 / spans.fold(f32::INFINITY, f32::min);
        Some(axis)
    }

    /// Nodes that [`Axis::new`] has taken before, and the unit that it found.
    pub(super) fn taken(nodes: &'a [[u8; 4]], slope_unit: f32) -> Axis<'a> {
        Axis { nodes, slope_unit }
    }

    fn node_mm(&self, nth: usize) -> f32 {
        f32::from_le_bytes(self.nodes.get(nth).copied().unwrap_or_default())
    }

    /// Knots: four times the first node, the nodes but the outer two at each end, four times the
    /// last node.
    fn knot_mm(&self, nth: usize) -> f32 {
        self.node_mm(match nth {
            0..SPAN => 0,
            _ if nth >= self.count() => self.count() - 1,
            _ => nth - 2,
        })
    }

    /// Number of nodes.
    pub fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Its first and last node, mm.
    pub fn ends_mm(&self) -> [f32; 2] {
        [self.node_mm(0), self.node_mm(self.count() - 1)]
    }

    /// Unit of the slopes' weights, 1/mm.
    pub fn slope_unit(&self) -> f32 {
        self.slope_unit
    }

    /// Returns the weights of the value and the slope at x; beyond an end, those at the end.
    pub fn at(&self, x_mm: f32) -> Weights {
        let [from, to] = self.ends_mm();
        // NaN counts as the first node.
        let x = if x_mm > from { x_mm.min(to) } else { from };
        let inner = SPAN..self.count();
        let first = inner.take_while(|knot| self.knot_mm(*knot) <= x).count();
        let [a, b, c, d, e, f] = core::array::from_fn(|k| self.knot_mm(first + 1 + k));
        // Cox and de Boor's recurrence, for the span from c to d; the slopes are made of quadratic
        // splines.
        let [c_x, d_x] = [x - c, d - x];
        let part = 1.0 / (d - c);
        let [linear_c, linear_d] = [d_x * part, c_x * part];
        let [b_x, e_x] = [x - b, e - x];
        let [part_b, part_c] = [linear_c / (d - b), linear_d / (e - c)];
        let squares = [d_x * part_b, b_x * part_b + e_x * part_c, c_x * part_c];
        let parts = [
            squares[0] / (d - a),
            squares[1] / (e - b),
            squares[2] / (f - c),
        ];
        let [a_x, f_x] = [x - a, f - x];
        let values = [
            d_x * parts[0],
            a_x * parts[0] + e_x * parts[1],
            b_x * parts[1] + f_x * parts[2],
            c_x * parts[2],
        ];
        let three = 3.0 * ONE / self.slope_unit;
        let slopes = [
            -parts[0],
            parts[0] - parts[1],
            parts[1] - parts[2],
            parts[2],
        ];
        Weights {
            first,
            values: values.map(|part| rounded(ONE * part)),
            slopes: slopes.map(|part| rounded(three * part)),
        }
    }
}

/// Rounds to the nearest step of 2⁻¹⁵; at most 2¹⁵ steps.
fn rounded(steps: f32) -> Q<15, i16> {
    Q::from_bits((steps + WHOLE).to_bits() as i16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const NODES_MM: [f32; 8] = [-5.0, -2.0, 0.0, 1.0, 2.5, 3.0, 4.0, 5.0];

    fn bytes(nodes_mm: &[f32]) -> Vec<[u8; 4]> {
        nodes_mm.iter().map(|node| node.to_le_bytes()).collect()
    }

    fn value(parts: &[Q<15, i16>; SPAN], coefficients: &[f64]) -> f64 {
        let pairs = parts.iter().zip(coefficients);
        pairs
            .map(|(part, c)| f64::from(part.bits()) * c)
            .sum::<f64>()
            / f64::from(ONE)
    }

    /// Greville's points are the coefficients of x itself, whose slope is 1.
    #[test]
    fn a_line_is_a_spline() {
        let nodes = bytes(&NODES_MM);
        let axis = Axis::new(&nodes).unwrap();
        let knot = |k: usize| f64::from(axis.knot_mm(k));
        let greville = |j: usize| (knot(j + 1) + knot(j + 2) + knot(j + 3)) / 3.0;
        let own: Vec<f64> = (0..8).map(greville).collect();
        for step in 0..=200 {
            let x = -5.0 + 0.05 * step as f32;
            let at = axis.at(x);
            let own = &own[at.first..];
            assert!((value(&at.values, own) - f64::from(x)).abs() < 4e-4, "{x}");
            let slope = value(&at.slopes, own) * f64::from(axis.slope_unit());
            assert!((slope - 1.0).abs() < 6e-3, "{x} {slope}");
        }
    }

    #[test]
    fn beyond_an_end_it_is_as_at_the_end() {
        let nodes = bytes(&NODES_MM);
        let axis = Axis::new(&nodes).unwrap();
        for far in [f32::NEG_INFINITY, -7.0, f32::NAN] {
            assert_eq!(axis.at(far), axis.at(-5.0));
        }
        assert_eq!(axis.at(f32::INFINITY), axis.at(5.0));
        assert_eq!(axis.at(5.0).first, 4);
    }

    #[test]
    fn nodes_that_make_no_axis_are_refused() {
        assert!(Axis::new(&bytes(&NODES_MM[..5])).is_none());
        assert!(Axis::new(&bytes(&[0.0; 17])).is_none());
        for wrong in [f32::NAN, 0.0, 0.005, 101.0] {
            let mut nodes = NODES_MM;
            nodes[3] = wrong;
            assert!(Axis::new(&bytes(&nodes)).is_none(), "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn parts_add_up_to_at_most_one(
            steps in prop::collection::vec(0.011f32..3.0, 6..=20),
            x in 0.0f32..1.0,
        ) {
            let mut at = -20.0;
            let nodes: Vec<f32> = steps.iter().map(|step| { at += step; at }).collect();
            let nodes = bytes(&nodes);
            let axis = Axis::new(&nodes).unwrap();
            let [from, to] = axis.ends_mm();
            let weights = axis.at(from + x * (to - from));
            prop_assert!(weights.first + SPAN <= axis.count());
            for parts in [weights.values, weights.slopes] {
                let sum: i32 = parts.iter().map(|part| i32::from(part.bits()).abs()).sum();
                prop_assert!(sum <= 32_767 + 4, "{parts:?}");
            }
        }
    }
}
