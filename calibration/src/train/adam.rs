//! The optimizer: Adam (Kingma and Ba 2014), with the constants of its paper.

use super::mlp::{Dense, Mlp};

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Moving averages of every parameter's gradient and of its square.
pub(super) struct Adam {
    averages: Vec<[Averages; 2]>,
    /// β₁ᵗ and β₂ᵗ after t steps.
    powers: [f64; 2],
}

#[derive(Clone, Default)]
struct Averages {
    gradient: Vec<f32>,
    square: Vec<f32>,
}

impl Averages {
    fn of(length: usize) -> Self {
        Self {
            gradient: vec![0.0; length],
            square: vec![0.0; length],
        }
    }

    /// `rate` and `epsilon` already contain the corrections of the averages' initial bias.
    #[inline(always)]
    fn step(&mut self, parameters: &mut [f32], gradients: &[f32], rate: f32, epsilon: f32) {
        let averages = self.gradient.iter_mut().zip(&mut self.square);
        for ((p, &g), (m, v)) in parameters.iter_mut().zip(gradients).zip(averages) {
            *m = BETA_1 * *m + (1.0 - BETA_1) * g;
            *v = BETA_2 * *v + (1.0 - BETA_2) * (g * g);
            *p -= rate * *m / (v.sqrt() + epsilon);
        }
    }
}

impl Adam {
    pub fn new(mlp: &Mlp) -> Self {
        let averages = |layer: &Dense| {
            [
                Averages::of(layer.weights.len()),
                Averages::of(layer.bias.len()),
            ]
        };
        Self {
            averages: mlp.layers.iter().map(averages).collect(),
            powers: [1.0; 2],
        }
    }

    /// One step down the gradient.
    pub fn step(&mut self, mlp: &mut Mlp, gradients: &[Dense], rate: f64) {
        self.powers[0] *= f64::from(BETA_1);
        self.powers[1] *= f64::from(BETA_2);
        let root = (1.0 - self.powers[1]).sqrt();
        let rate = (rate * root / (1.0 - self.powers[0])) as f32;
        let epsilon = (f64::from(EPSILON) * root) as f32;
        let arch = pulp::Arch::new();
        for ((layer, gradient), [weights, bias]) in
            mlp.layers.iter_mut().zip(gradients).zip(&mut self.averages)
        {
            arch.dispatch(|| weights.step(&mut layer.weights, &gradient.weights, rate, epsilon));
            bias.step(&mut layer.bias, &gradient.bias, rate, epsilon);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first step equals the rate for any gradient; later ones follow the paper's algorithm.
    #[test]
    fn steps_are_those_of_the_paper() {
        let mut mlp = Mlp {
            layers: vec![Dense {
                weights: vec![1.0, 2.0],
                bias: vec![0.5],
            }],
        };
        let mut adam = Adam::new(&mlp);
        let gradient = vec![Dense {
            weights: vec![100.0, -0.01],
            bias: vec![0.0],
        }];
        adam.step(&mut mlp, &gradient, 0.1);
        assert!((mlp.layers[0].weights[0] - 0.9).abs() < 1e-6);
        assert!((mlp.layers[0].weights[1] - 2.1).abs() < 1e-6);
        assert_eq!(mlp.layers[0].bias, [0.5]);

        let other = vec![Dense {
            weights: vec![-100.0, -0.01],
            bias: vec![0.0],
        }];
        adam.step(&mut mlp, &other, 0.1);
        let m = (0.9 * 10.0 - 0.1 * 100.0) / (1.0 - 0.81);
        let v: f64 = (0.999 * 10.0 + 0.001 * 1e4) / (1.0 - 0.999_f64.powi(2));
        let expected = 0.9 - 0.1 * m / v.sqrt();
        assert!((f64::from(mlp.layers[0].weights[0]) - expected).abs() < 1e-5);
    }
}
