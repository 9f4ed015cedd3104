//! A small fully connected network in floats: the result of training and the input of quantization.

mod reach;

use crate::data::loads::{from_polar, polar};
use anyhow::{Result, ensure};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Number of input features (`force::features`).
pub const INPUTS: usize = 11;
/// Number of outputs that give a force ([`Meaning`]).
pub const OUTPUTS: usize = hivtac_sensor::force::model::OUTPUTS;
/// Number of outputs after those that give the tip's place, in a network of places.
pub const PLACE_OUTPUTS: usize = hivtac_sensor::force::model::PLACE_OUTPUTS;

/// Meaning of the outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Meaning {
    /// F_x, F_y, F_z in N, film frame.
    #[default]
    ForceVector,
    /// α and β in degrees, |F| in N (the paper's).
    AnglesMagnitude,
    /// F_x, F_y, F_z in N, and p_x, p_y in mm: the film's point under the tip, by its rest
    /// position, film frame.
    ForceAndPlace,
}

impl Meaning {
    /// Whether the place is among the outputs.
    pub fn tells_place(self) -> bool {
        self == Meaning::ForceAndPlace
    }

    /// Whether the force is a vector.
    pub fn is_vector(self) -> bool {
        self != Meaning::AnglesMagnitude
    }

    /// Number of outputs.
    pub fn outputs(self) -> usize {
        self.chip_units().len()
    }

    /// The outputs for this force (N), without a place; a zero force has the angles 0.
    pub fn of_force(self, force_n: [f64; 3]) -> [f64; OUTPUTS] {
        match self {
            Meaning::ForceVector | Meaning::ForceAndPlace => force_n,
            Meaning::AnglesMagnitude => polar(force_n),
        }
    }

    /// The force (N) given by these outputs.
    pub fn to_force(self, outputs: [f64; OUTPUTS]) -> [f64; 3] {
        match self {
            Meaning::ForceVector | Meaning::ForceAndPlace => outputs,
            Meaning::AnglesMagnitude => from_polar(outputs),
        }
    }

    /// The chip's steps (µN, m°, µm) per unit of each output.
    pub fn chip_units(self) -> &'static [f64] {
        match self {
            Meaning::ForceVector => &[1e6; 3],
            Meaning::AnglesMagnitude => &[1e3, 1e3, 1e6],
            Meaning::ForceAndPlace => &[1e6, 1e6, 1e6, 1e3, 1e3],
        }
    }
}

/// How the chip holds weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Arithmetic {
    /// int8 weights with a scale for each output of a layer, but int16 in the first and the last.
    #[default]
    Int8PerChannel,
    /// int16 weights with a scale for each output of a layer, and activations of twelve bits.
    Int16,
}

/// One layer: y = W·x + b. Every layer but a network's last is followed by ReLU.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// W as \[output\]\[input\], as PyTorch stores it.
    pub weights: Vec<Vec<f32>>,
    /// b, one for each output.
    pub bias: Vec<f32>,
}

impl Layer {
    /// Inputs of the layer.
    pub fn inputs(&self) -> usize {
        self.weights.first().map_or(0, Vec::len)
    }

    /// Outputs of the layer.
    pub fn outputs(&self) -> usize {
        self.weights.len()
    }

    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let dot =
            |row: &Vec<f32>| -> f64 { row.iter().zip(x).map(|(&w, &x)| f64::from(w) * x).sum() };
        self.weights
            .iter()
            .zip(&self.bias)
            .map(|(row, &b)| dot(row) + f64::from(b))
            .collect()
    }
}

/// A smaller deviation is only the rounding of a mean.
const NO_SIGMA: f64 = 1e-9;
/// The σ of a constant answer, in N or degrees: smaller than any relevant change, and large enough
/// for the chip's numbers.
pub(crate) const CONSTANT_ANSWER: f64 = 1e-5;

/// Mean and standard deviation, component by component.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Standardization {
    /// Means.
    pub mean: Vec<f64>,
    /// Standard deviations, all > 0.
    pub sigma: Vec<f64>,
}

impl Standardization {
    /// Means and population standard deviations of a network's inputs. A constant component gets σ
    /// = 1, and thus standardizes to 0 without a division by 0.
    ///
    /// # Errors
    /// When `rows` is empty.
    pub fn of<const N: usize>(rows: &[[f64; N]]) -> Result<Self> {
        Self::with(rows, 1.0)
    }

    /// The same for its answers. A constant one gets a tiny σ, so that any output of the network
    /// results in that constant.
    ///
    /// # Errors
    /// When `rows` is empty.
    pub fn of_answers<const N: usize>(rows: &[[f64; N]]) -> Result<Self> {
        Self::with(rows, CONSTANT_ANSWER)
    }

    fn with<const N: usize>(rows: &[[f64; N]], constant: f64) -> Result<Self> {
        ensure!(
            !rows.is_empty(),
            "nothing to standardize: the data set has no usable row"
        );
        let count = rows.len() as f64;
        let mean: Vec<f64> = (0..N)
            .map(|i| rows.iter().map(|r| r[i]).sum::<f64>() / count)
            .collect();
        let variance = |i: usize| {
            rows.iter()
                .map(|r| (r[i] - mean[i]) * (r[i] - mean[i]))
                .sum::<f64>()
                / count
        };
        let usable = |sigma: f64| if sigma > NO_SIGMA { sigma } else { constant };
        let sigma = (0..N).map(|i| usable(variance(i).sqrt())).collect();
        Ok(Self { mean, sigma })
    }

    /// (x − mean) / σ.
    pub fn forward(&self, x: &[f64]) -> Vec<f64> {
        x.iter()
            .zip(&self.mean)
            .zip(&self.sigma)
            .map(|((x, m), s)| (x - m) / s)
            .collect()
    }

    /// x·σ + mean.
    pub fn backward(&self, x: &[f64]) -> Vec<f64> {
        x.iter()
            .zip(&self.mean)
            .zip(&self.sigma)
            .map(|((x, m), s)| x * s + m)
            .collect()
    }
}

/// A network with its input and output scaling: features in pixels to a force in newtons.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Network {
    /// Meaning of its outputs.
    #[serde(default)]
    pub meaning: Meaning,
    /// How the chip holds its weights.
    #[serde(default)]
    pub arithmetic: Arithmetic,
    /// Features in px (the rectangle's area in px²).
    pub input: Standardization,
    /// The outputs, in the units of their meaning.
    pub output: Standardization,
    /// For each hidden layer, the largest activation that the chip can carry (see `quantize`).
    pub activation_max: Vec<f64>,
    /// The layers, in order.
    pub layers: Vec<Layer>,
}

impl Network {
    /// Checks that the parts match each other and that every number is finite.
    ///
    /// # Errors
    /// Names the part that is wrong.
    pub fn validate(&self) -> Result<()> {
        let scaling = |s: &Standardization, n: usize| s.mean.len() == n && s.sigma.len() == n;
        ensure!(
            scaling(&self.input, INPUTS),
            "the input scaling needs {INPUTS} means and deviations"
        );
        let outputs = self.meaning.outputs();
        ensure!(
            scaling(&self.output, outputs),
            "the output scaling needs {outputs} means and deviations"
        );
        self.validate_layers()?;
        let deviations = self
            .input
            .sigma
            .iter()
            .chain(&self.output.sigma)
            .chain(&self.activation_max);
        ensure!(
            deviations.clone().all(|&s| s.is_finite() && s > 0.0),
            "deviations and maxima must be above zero"
        );
        let means = self.input.mean.iter().chain(&self.output.mean);
        ensure!(
            means.clone().all(|m| m.is_finite()),
            "a mean is not a finite number"
        );
        Ok(())
    }

    fn validate_layers(&self) -> Result<()> {
        ensure!(!self.layers.is_empty(), "it has no layers");
        let hidden = self.layers.len().saturating_sub(1);
        ensure!(
            self.activation_max.len() == hidden,
            "{hidden} hidden layers need {hidden} activation maxima"
        );
        let mut inputs = INPUTS;
        for (i, layer) in self.layers.iter().enumerate() {
            let shape_ok =
                layer.outputs() > 0 && layer.weights.iter().all(|row| row.len() == inputs);
            ensure!(shape_ok, "layer {i} is not a matrix with {inputs} columns");
            ensure!(
                layer.bias.len() == layer.outputs(),
                "layer {i} needs {} biases",
                layer.outputs()
            );
            let mut numbers = layer.weights.iter().flatten().chain(&layer.bias);
            ensure!(
                numbers.all(|w| w.is_finite()),
                "layer {i} holds a number that is not finite"
            );
            inputs = layer.outputs();
        }
        let outputs = self.meaning.outputs();
        ensure!(
            inputs == outputs,
            "the last layer has {inputs} outputs instead of {outputs}"
        );
        Ok(())
    }

    /// The output of a hidden layer.
    fn activations(&self, layer: usize, x: &[f64]) -> Vec<f64> {
        let sums = self.layers[layer].apply(x);
        sums.into_iter().map(|v| v.max(0.0)).collect()
    }

    /// The float reference: features (px, px²) to a force (N).
    pub fn force_n(&self, features: &[f64; INPUTS]) -> [f64; 3] {
        self.meaning.to_force(self.predict(features))
    }

    /// The place (mm) for features (px, px²); `None` if the network gives no places.
    pub fn place_mm(&self, features: &[f64; INPUTS]) -> Option<[f64; PLACE_OUTPUTS]> {
        let outputs = self.outputs(features);
        let place = outputs.get(OUTPUTS..)?;
        place.try_into().ok()
    }

    /// Features (px, px²) to the outputs of the force, in the units of their meaning.
    pub fn predict(&self, features: &[f64; INPUTS]) -> [f64; OUTPUTS] {
        let outputs = self.outputs(features);
        std::array::from_fn(|o| outputs[o])
    }

    /// Features (px, px²) to all outputs, in the units of their meaning.
    fn outputs(&self, features: &[f64; INPUTS]) -> Vec<f64> {
        let Some((last, hidden)) = self.layers.split_last() else {
            return vec![0.0; OUTPUTS];
        };
        let mut x = self.input.forward(features);
        for layer in 0..hidden.len() {
            x = self.activations(layer, &x);
        }
        self.output.backward(&last.apply(&x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_component_standardizes_to_zero() {
        let scaling = Standardization::of(&[[1.0, 5.0], [3.0, 5.0]]).unwrap();
        assert_eq!(scaling.mean, [2.0, 5.0]);
        assert_eq!(scaling.sigma, [1.0, 1.0]);
        assert_eq!(scaling.forward(&[3.0, 5.0]), [1.0, 0.0]);
        assert_eq!(scaling.backward(&[1.0, 0.0]), [3.0, 5.0]);
    }

    #[test]
    fn a_constant_answer_is_the_constant() {
        let scaling = Standardization::of_answers(&[[1.0, 5.0], [3.0, 5.0]]).unwrap();
        assert_eq!(scaling.sigma, [1.0, CONSTANT_ANSWER]);
        assert!((scaling.backward(&[1.0, 2.0])[1] - 5.0).abs() < 1e-4);
    }

    #[test]
    fn nothing_cannot_be_standardized() {
        assert!(Standardization::of::<2>(&[]).is_err());
    }

    pub(super) fn tiny() -> Network {
        let ones = |n: usize| Standardization {
            mean: vec![0.0; n],
            sigma: vec![1.0; n],
        };
        let hidden = Layer {
            weights: vec![vec![1.0; INPUTS], vec![-1.0; INPUTS]],
            bias: vec![0.5, 0.0],
        };
        let last = Layer {
            weights: vec![vec![1.0, 2.0]; OUTPUTS],
            bias: vec![0.0, 1.0, -1.0],
        };
        Network {
            meaning: Meaning::ForceVector,
            arithmetic: Arithmetic::Int8PerChannel,
            input: ones(INPUTS),
            output: ones(OUTPUTS),
            activation_max: vec![1.0],
            layers: vec![hidden, last],
        }
    }

    #[test]
    fn the_forward_pass_is_layers_and_relu() {
        let network = tiny();
        network.validate().unwrap();
        assert_eq!(network.predict(&[1.0; INPUTS]), [11.5, 12.5, 10.5]);
        assert_eq!(network.predict(&[-1.0; INPUTS]), [22.0, 23.0, 21.0]);
        assert_eq!(
            network.activation_maxima(&[[1.0; INPUTS], [-2.0; INPUTS]]),
            [22.0]
        );
    }

    #[test]
    fn a_place_comes_after_the_force() {
        let mut network = tiny();
        assert_eq!(network.place_mm(&[1.0; INPUTS]), None);
        network.meaning = Meaning::ForceAndPlace;
        let error = network.validate().unwrap_err().to_string();
        assert!(error.contains("needs 5 means"), "{error}");
        network.output.mean.extend([0.5, -0.5]);
        network.output.sigma.extend([2.0, 2.0]);
        assert!(network.validate().is_err(), "three outputs are too few");
        let last = &mut network.layers[1];
        last.weights.extend([vec![0.1, 0.0], vec![0.0, 0.1]]);
        last.bias.extend([0.0, 1.0]);
        network.validate().unwrap();
        assert_eq!(network.predict(&[1.0; INPUTS]), [11.5, 12.5, 10.5]);
        let [x, y] = network.place_mm(&[1.0; INPUTS]).unwrap();
        assert!((x - 2.8).abs() < 1e-6 && (y - 1.5).abs() < 1e-6, "{x} {y}");
    }

    #[test]
    fn angles_and_vector_mean_the_same_force() {
        for force in [
            [0.01, -0.02, -0.1],
            [0.0, 0.0, -0.2],
            [0.0; 3],
            [-0.03, 0.0, -0.01],
        ] {
            for meaning in [
                Meaning::ForceVector,
                Meaning::AnglesMagnitude,
                Meaning::ForceAndPlace,
            ] {
                let back = meaning.to_force(meaning.of_force(force));
                let off = force
                    .iter()
                    .zip(back)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                assert!(off < 1e-15, "{meaning:?} {force:?} {back:?}");
            }
        }
        let [alpha, beta, size] = Meaning::AnglesMagnitude.of_force([0.1, 0.0, -0.1]);
        assert!(
            (alpha - 45.0).abs() < 1e-12 && beta == 0.0 && (size - 0.02_f64.sqrt()).abs() < 1e-15
        );
    }

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let refused = |change: fn(&mut Network), words: &str| {
            let mut network = tiny();
            change(&mut network);
            let error = network.validate().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused(|n| n.layers.clear(), "no layers");
        refused(|n| n.layers.truncate(1), "activation maxima");
        refused(|n| n.layers[0].weights[1].truncate(3), "layer 0");
        refused(|n| n.layers[1].bias.truncate(2), "biases");
        refused(|n| n.layers[1].weights.truncate(2), "layer 1");
        refused(|n| n.layers[0].weights[0][0] = f32::NAN, "not finite");
        refused(|n| n.input.sigma[4] = 0.0, "above zero");
        refused(|n| n.activation_max.clear(), "maxima");
    }
}
