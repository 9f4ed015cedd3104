//! Cubic splines along one axis of the film.

/// How many coefficients a spline's value at a point is made of.
pub const SPAN: usize = 4;
/// The least and the most nodes of an axis.
pub const NODES: core::ops::RangeInclusive<usize> = 6..=16;
/// Parts of one that weights are kept in: Q15.
const ONE: f32 = 32_768.0;

/// The nodes of cubic splines, which are sums of B-splines: one for each node, smooth over the
/// second node and the last but one (not-a-knot).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    nodes_mm: [f32; *NODES.end()],
    count: usize,
    /// What slopes' weights are in parts of, 1/mm.
    slope_unit: f32,
}

/// What the value and the slope at a point are made of: so much of each coefficient from the first
/// on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// The first coefficient.
    pub first: usize,
    /// Parts of the value, Q15; their sizes add up to at most one and four roundings.
    pub values: [i16; SPAN],
    /// Parts of the slope in units of [`Axis::slope_unit`], Q15; likewise.
    pub slopes: [i16; SPAN],
}

impl Axis {
    /// Of growing nodes between ±100 mm, at least 0.01 mm apart; `None` of others, or of too few or
    /// too many.
    pub fn new(nodes_mm: &[f32]) -> Option<Axis> {
        let count = nodes_mm.len();
        let grow = nodes_mm.windows(2).all(|pair| pair[1] - pair[0] >= 0.01);
        let near = nodes_mm.iter().all(|node| node.abs() <= 100.0);
        if !NODES.contains(&count) || !grow || !near {
            return None;
        }
        let mut axis = Axis {
            nodes_mm: [0.0; *NODES.end()],
            count,
            slope_unit: 0.0,
        };
        axis.nodes_mm[..count].copy_from_slice(nodes_mm);
        // Parts of B-splines of the second degree add up to one, over at least the narrowest span:
        // the slopes' parts, differences of three times these, add up to at most six over it.
        let spans = (SPAN - 1..count).map(|span| axis.knot(span + 1) - axis.knot(span));
        axis.slope_unit = 6.0 / spans.fold(f32::INFINITY, f32::min);
        Some(axis)
    }

    /// How many nodes it has.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Its first and last node, mm.
    pub fn ends_mm(&self) -> [f32; 2] {
        [self.node(0), self.node(self.count - 1)]
    }

    /// What slopes' weights are in parts of, 1/mm.
    pub fn slope_unit(&self) -> f32 {
        self.slope_unit
    }

    /// What the value and the slope at x are made of; beyond an end, those at the end.
    pub fn at(&self, x_mm: f32) -> Weights {
        let [from, to] = self.ends_mm();
        // A value that is no number is at the first node.
        let x = if x_mm > from { x_mm.min(to) } else { from };
        let inner = SPAN..self.count;
        let first = inner.filter(|&k| self.knot(k) <= x).count();
        let span = first + SPAN - 1;
        let mut values = [1.0, 0.0, 0.0, 0.0];
        let mut slopes = [0.0; SPAN];
        // Cox and de Boor's recurrence; the slopes are made of the splines of one degree less.
        for degree in 1..SPAN {
            let mut saved = 0.0;
            for r in 0..degree {
                let right = self.knot(span + r + 1);
                let left = self.knot(span + 1 + r - degree);
                let part = values[r] / (right - left);
                values[r] = saved + (right - x) * part;
                saved = (x - left) * part;
                if degree == SPAN - 1 {
                    slopes[r] -= 3.0 * part;
                    slopes[r + 1] += 3.0 * part;
                }
            }
            values[degree] = saved;
        }
        Weights {
            first,
            values: values.map(q15),
            slopes: slopes.map(|part| q15(part / self.slope_unit)),
        }
    }

    /// Four times the first node, the nodes but the outer two at each end, four times the last
    /// node.
    fn knot(&self, k: usize) -> f32 {
        let last = self.count - 1;
        self.node(match k {
            0..SPAN => 0,
            _ if k > last => last,
            _ => k - 2,
        })
    }

    /// There are as many as the axis counts.
    fn node(&self, k: usize) -> f32 {
        self.nodes_mm.get(k).copied().unwrap_or_default()
    }
}

/// Rounded to nearest; what is one becomes a step less.
fn q15(part: f32) -> i16 {
    (ONE * part + 0.5f32.copysign(part)) as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const NODES_MM: [f32; 8] = [-5.0, -2.0, 0.0, 1.0, 2.5, 3.0, 4.0, 5.0];

    fn value(parts: &[i16; SPAN], coefficients: &[f64]) -> f64 {
        let pairs = parts.iter().zip(coefficients);
        pairs.map(|(part, c)| f64::from(*part) * c).sum::<f64>() / f64::from(ONE)
    }

    /// Greville's points are the coefficients of x itself: its slope is one.
    #[test]
    fn a_line_is_a_spline() {
        let axis = Axis::new(&NODES_MM).unwrap();
        let greville =
            |j: usize| f64::from(axis.knot(j + 1) + axis.knot(j + 2) + axis.knot(j + 3)) / 3.0;
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
        let axis = Axis::new(&NODES_MM).unwrap();
        for far in [f32::NEG_INFINITY, -7.0, f32::NAN] {
            assert_eq!(axis.at(far), axis.at(-5.0));
        }
        assert_eq!(axis.at(f32::INFINITY), axis.at(5.0));
        assert_eq!(axis.at(5.0).first, 4);
    }

    #[test]
    fn nodes_that_make_no_axis_are_refused() {
        assert!(Axis::new(&NODES_MM[..5]).is_none());
        assert!(Axis::new(&[0.0; 17]).is_none());
        for wrong in [f32::NAN, 0.0, 0.005, 101.0] {
            let mut nodes = NODES_MM;
            nodes[3] = wrong;
            assert!(Axis::new(&nodes).is_none(), "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn parts_add_up_to_at_most_one(
            steps in prop::collection::vec(0.011f32..3.0, 6..=16),
            x in 0.0f32..1.0,
        ) {
            let mut at = -20.0;
            let nodes: Vec<f32> = steps.iter().map(|step| { at += step; at }).collect();
            let axis = Axis::new(&nodes).unwrap();
            let [from, to] = axis.ends_mm();
            let weights = axis.at(from + x * (to - from));
            prop_assert!(weights.first + SPAN <= axis.count());
            for parts in [weights.values, weights.slopes] {
                let sum: i32 = parts.iter().map(|part| i32::from(*part).abs()).sum();
                prop_assert!(sum <= 32_768 + 4, "{parts:?}");
            }
        }
    }
}
