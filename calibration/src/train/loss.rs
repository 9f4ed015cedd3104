//! The loss that training minimizes: the mean square of standardized errors. If directions count,
//! errors across the force are weighted by the change of direction that they cause.

use super::{DirectionWeight, Samples};
use crate::data::loads::norm;
use crate::network::OUTPUTS;

/// Weight of errors across each row's force; errors along it weigh the same in every row.
pub(super) struct Across {
    /// Unit vector along the force (0 without one), and the weight across it.
    rows: Vec<([f32; OUTPUTS], f32)>,
}

impl Across {
    /// Weights of `samples`, scaled so that their mean over `training` is that of `weight`.
    pub fn new(samples: &Samples, training: &Samples, weight: DirectionWeight) -> Self {
        let DirectionWeight { mean, floor_n } = weight;
        let raw = |force: &[f64; OUTPUTS]| {
            let size = norm(*force);
            1.0 / (size * size + floor_n * floor_n).sqrt()
        };
        let sum: f64 = training.forces_n.iter().map(raw).sum();
        let factor = mean * training.forces_n.len() as f64 / sum;
        let row = |force: &[f64; OUTPUTS]| {
            let size = norm(*force);
            let along = |part: f64| if size > 0.0 { part / size } else { 0.0 };
            let along = force.map(|part| along(part) as f32);
            (along, (raw(force) * factor) as f32)
        };
        Self {
            rows: samples.forces_n.iter().map(row).collect(),
        }
    }

    /// Half the gradient of a row's loss by its errors; the product of both is the loss.
    fn pull(&self, row: usize, off: [f32; OUTPUTS]) -> [f32; OUTPUTS] {
        let (along, weight) = &self.rows[row];
        let size: f32 = off.iter().zip(along).map(|(off, along)| off * along).sum();
        std::array::from_fn(|i| weight * off[i] + (1.0 - weight) * size * along[i])
    }
}

/// The mean loss of these rows, and its gradient by the outputs. Outputs and targets are stored
/// component by component, the force's first. Errors of a place weigh the same in each row.
pub(super) fn loss(
    outputs: &[f32],
    targets: &[f32],
    across: Option<&Across>,
    rows: &[usize],
) -> (f64, Vec<f32>) {
    let off: Vec<f32> = outputs.iter().zip(targets).map(|(y, t)| y - t).collect();
    let mut pull = off.clone();
    if let Some(across) = across {
        for (i, &row) in rows.iter().enumerate() {
            let own = across.pull(row, std::array::from_fn(|o| off[o * rows.len() + i]));
            for (o, own) in own.into_iter().enumerate() {
                pull[o * rows.len() + i] = own;
            }
        }
    }
    let products = off.iter().zip(&pull);
    let sum: f64 = products.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum();
    let scale = 2.0 / outputs.len() as f32;
    pull.iter_mut().for_each(|pull| *pull *= scale);
    (sum / outputs.len() as f64, pull)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEIGHT: DirectionWeight = DirectionWeight {
        mean: 3.0,
        floor_n: 0.01,
    };

    fn samples(forces_n: Vec<[f64; OUTPUTS]>) -> Samples {
        Samples {
            forces_n,
            ..Samples::default()
        }
    }

    /// Without weights the loss is the mean square.
    #[test]
    fn all_count_the_same_without_weights() {
        let (loss, gradient) = loss(&[1.0, 2.0, 3.0], &[0.0, 2.0, 5.0], None, &[0]);
        assert_eq!(loss, 5.0 / 3.0);
        assert_eq!(gradient, [2.0, 0.0, -4.0].map(|x: f32| x / 3.0));
    }

    /// Errors across a force of half the size weigh twice as much, errors along it the same.
    /// Without a force all directions are across.
    #[test]
    fn weak_forces_count_more_across_and_the_same_along() {
        let data = samples(vec![[0.0, 0.0, -0.1], [0.0, 0.0, -0.05], [0.0; 3]]);
        let across = Across::new(&data, &data, WEIGHT);
        let of = |row: usize, off: [f32; OUTPUTS]| loss(&off, &[0.0; 3], Some(&across), &[row]).0;
        let ratio = of(1, [0.3, 0.0, 0.0]) / of(0, [0.3, 0.0, 0.0]);
        let expected = ((0.01 + 1e-4_f64) / (0.0025 + 1e-4)).sqrt();
        assert!((ratio - expected).abs() < 1e-6, "{ratio} {expected}");
        for row in [0, 1] {
            assert!((of(row, [0.0, 0.0, 0.3]) - 0.03).abs() < 1e-6);
        }
        assert!((of(2, [0.3, 0.0, 0.0]) / of(2, [0.0, 0.0, 0.3]) - 1.0).abs() < 1e-6);
        let mean = (0..3).map(|row| of(row, [0.0, 0.3, 0.0])).sum::<f64>() / 3.0;
        assert!((mean - 3.0 * 0.03).abs() < 1e-6, "{mean}");
    }

    /// Outputs after the force's have no such weight.
    #[test]
    fn a_place_counts_the_same_whatever_the_force() {
        let data = samples(vec![[0.0, 0.0, -0.1], [0.0, 0.0, -0.01]]);
        let across = Across::new(&data, &data, WEIGHT);
        for row in [0, 1] {
            let off = [0.0, 0.0, 0.0, 0.5, -1.0];
            let (loss, gradient) = loss(&off, &[0.0; 5], Some(&across), &[row]);
            assert!((loss - 1.25 / 5.0).abs() < 1e-9);
            assert_eq!(gradient[3..], [0.2, -0.4]);
        }
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let data = samples(vec![[0.03, -0.02, -0.1], [0.0, 0.001, -0.004]]);
        let across = Across::new(&data, &data, WEIGHT);
        let of = |outputs: &[f32]| loss(outputs, &[0.1; 6], Some(&across), &[0, 1]);
        let outputs = [0.5, -0.25, 0.75, 1.0, -0.5, 0.125];
        let (_, gradient) = of(&outputs);
        for (i, expected) in gradient.into_iter().enumerate() {
            let moved = |by: f32| {
                let mut moved = outputs;
                moved[i] += by;
                of(&moved).0
            };
            let found = (moved(1.0 / 64.0) - moved(-1.0 / 64.0)) * 32.0;
            assert!(
                (found - f64::from(expected)).abs() < 1e-4,
                "{i}: {found} {expected}"
            );
        }
    }
}
