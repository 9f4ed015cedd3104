//! Training with burn: first in floats, then with the chip's rounding in the forward pass.

mod module;

use anyhow::{Result, ensure};
use burn::optim::{AdamConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::{Device, Tensor, TensorData};
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use crate::network::{INPUTS, Network, OUTPUTS, Standardization};
use module::Mlp;

/// How to train.
#[derive(Clone, Debug)]
pub struct Options {
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Passes over the data in floats.
    pub epochs: usize,
    /// Passes over the data after that, with the chip's rounding.
    pub rounded_epochs: usize,
    /// Rows that share one optimizer step.
    pub batch: usize,
    /// Adam's step size at the beginning; it falls linearly to nothing.
    pub learning_rate: f64,
    /// Decides first weights and shuffling.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            hidden: vec![64, 64],
            epochs: 150,
            rounded_epochs: 100,
            batch: 64,
            learning_rate: 2e-3,
            seed: 1,
        }
    }
}

/// Features (px, px²) with the force (N) that made them.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Features, row by row.
    pub features: Vec<[f64; INPUTS]>,
    /// Forces, row by row.
    pub forces: Vec<[f64; OUTPUTS]>,
}

/// One finished pass over the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Passes finished, from 1.
    pub epoch: usize,
    /// Passes in all.
    pub epochs: usize,
    /// Whether the chip's rounding was on.
    pub rounded: bool,
    /// Mean squared error of the standardized force over the pass; a constant answer has 1.
    pub loss: f64,
}

/// Trains a network. The same samples and options give the same network on the same machine.
///
/// # Errors
/// When there is too little data, features and forces differ in number, or training diverges.
pub fn train(
    samples: &Samples,
    options: &Options,
    mut report: impl FnMut(Progress),
) -> Result<Network> {
    check(samples, options)?;
    let input = Standardization::of(&samples.features)?;
    let output = Standardization::of(&samples.forces)?;
    let mut trainer = Trainer::new(samples, options, &input, &output);
    let epochs = options.epochs + options.rounded_epochs;
    let phase = |rounded: bool, epoch: usize, loss: f64| Progress {
        epoch,
        epochs,
        rounded,
        loss,
    };

    for epoch in 0..options.epochs {
        let loss = trainer.pass(epoch, options.epochs, options.learning_rate, None);
        report(phase(false, epoch + 1, loss));
    }
    let mut network = trainer.network(&input, &output);
    network.activation_max = network.activation_maxima(&samples.features);
    let ranges = network.activation_max.clone();
    trainer.optimizer = AdamConfig::new().init();
    for epoch in 0..options.rounded_epochs {
        // A third of the first step: the weights are near their place already.
        let loss = trainer.pass(
            epoch,
            options.rounded_epochs,
            options.learning_rate / 3.0,
            Some(&ranges),
        );
        report(phase(true, options.epochs + epoch + 1, loss));
    }
    network.layers = trainer.mlp.to_layers();
    network
        .validate()
        .map_err(|e| e.context("training diverged: try a smaller learning rate"))?;
    Ok(network)
}

fn check(samples: &Samples, options: &Options) -> Result<()> {
    let rows = samples.features.len();
    ensure!(
        rows == samples.forces.len(),
        "{rows} rows of features, but {} of forces",
        samples.forces.len()
    );
    ensure!(rows > 0, "the data set has no usable row");
    ensure!(options.batch > 0, "a batch needs at least one row");
    ensure!(
        options.hidden.iter().all(|w| (1..=512).contains(w)),
        "hidden layers are 1 to 512 wide"
    );
    ensure!(
        options.learning_rate > 0.0,
        "the learning rate must be above zero"
    );
    Ok(())
}

struct Trainer {
    mlp: Mlp,
    optimizer: ModuleOptimizer,
    device: Device,
    random: ChaCha8Rng,
    batch: usize,
    order: Vec<usize>,
    features: Vec<[f32; INPUTS]>,
    forces: Vec<[f32; OUTPUTS]>,
}

impl Trainer {
    fn new(
        samples: &Samples,
        options: &Options,
        input: &Standardization,
        output: &Standardization,
    ) -> Self {
        let device = Device::flex().autodiff();
        let mut random = ChaCha8Rng::seed_from_u64(options.seed);
        let widths = [&[INPUTS], &options.hidden[..], &[OUTPUTS]].concat();
        Self {
            mlp: Mlp::random(&widths, &mut random, &device),
            optimizer: AdamConfig::new().init(),
            device,
            random,
            batch: options.batch,
            order: (0..samples.features.len()).collect(),
            features: standardized(&samples.features, input),
            forces: standardized(&samples.forces, output),
        }
    }

    /// One pass over the shuffled data; `ranges` turns the chip's rounding on. Returns the mean loss.
    fn pass(
        &mut self,
        epoch: usize,
        epochs: usize,
        first_rate: f64,
        ranges: Option<&[f64]>,
    ) -> f64 {
        let mut order = std::mem::take(&mut self.order);
        order.shuffle(&mut self.random);
        let batches = order.len().div_ceil(self.batch);
        let mut sum = 0.0;
        for (i, rows) in order.chunks(self.batch).enumerate() {
            let done = (epoch * batches + i) as f64 / (epochs * batches) as f64;
            sum += self.step(rows, first_rate * (1.0 - done), ranges) * rows.len() as f64;
        }
        self.order = order;
        sum / self.order.len() as f64
    }

    fn step(&mut self, rows: &[usize], rate: f64, ranges: Option<&[f64]>) -> f64 {
        let x = gather(&self.features, rows, &self.device);
        let target = gather(&self.forces, rows, &self.device);
        let y = match ranges {
            None => self.mlp.forward(x),
            Some(ranges) => self.mlp.forward_rounded(x, ranges),
        };
        let loss = (y - target).square().mean();
        let gradients = GradientsParams::from_grads(loss.backward(), &self.mlp);
        self.mlp = self.optimizer.step(rate, self.mlp.clone(), gradients);
        f64::from(loss.into_scalar::<f32>())
    }

    fn network(&self, input: &Standardization, output: &Standardization) -> Network {
        Network {
            input: input.clone(),
            output: output.clone(),
            activation_max: Vec::new(),
            layers: self.mlp.to_layers(),
        }
    }
}

fn standardized<const N: usize>(rows: &[[f64; N]], scaling: &Standardization) -> Vec<[f32; N]> {
    let one = |row: &[f64; N]| {
        let scaled = scaling.forward(row);
        std::array::from_fn(|i| scaled[i] as f32)
    };
    rows.iter().map(one).collect()
}

fn gather<const N: usize>(data: &[[f32; N]], rows: &[usize], device: &Device) -> Tensor<2> {
    let values: Vec<f32> = rows.iter().flat_map(|&row| data[row]).collect();
    Tensor::from_data(TensorData::new(values, [rows.len(), N]), device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conditions::Conditions;
    use crate::quantize::export;
    use crate::weights::{Range, Rest, Training, Uncertainty, Weights, features_from_q16};
    use hivtac_sensing::geometry::Preset;
    use hivtac_sensing::model::Model;
    use rand::Rng;

    const PX: f64 = 65_536.0;

    fn weights(network: Network) -> Weights {
        Weights {
            format: Weights::format(),
            conditions: Conditions::simulated(Preset::Ov7725, 320, 240),
            rest: Rest {
                features_q16: [1 << 20; INPUTS],
                areas_px: [200; 4],
            },
            range: Range::default(),
            uncertainty: Uncertainty::default(),
            training: Training::default(),
            network,
        }
    }

    /// Features on the chip's grid, and in px.
    fn features(random: &mut ChaCha8Rng) -> ([i64; INPUTS], [f64; INPUTS]) {
        let q16 = std::array::from_fn(|_| random.random_range(90 << 16..110_i64 << 16));
        (q16, q16.map(|q| q as f64 / PX))
    }

    #[test]
    fn training_rounds_as_the_chip_does() {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let rows: Vec<_> = (0..200).map(|_| features(&mut random)).collect();
        let px: Vec<[f64; INPUTS]> = rows.iter().map(|row| row.1).collect();
        let input = Standardization::of(&px).unwrap();
        let output = Standardization {
            mean: vec![0.0; OUTPUTS],
            sigma: vec![0.05; OUTPUTS],
        };
        let device = Device::flex();
        let mlp = Mlp::random(&[INPUTS, 16, 16, OUTPUTS], &mut random, &device);
        let mut network = Network {
            input,
            output,
            activation_max: Vec::new(),
            layers: mlp.to_layers(),
        };
        network.activation_max = network.activation_maxima(&px);

        let all: Vec<usize> = (0..rows.len()).collect();
        let x = gather(&standardized(&px, &network.input), &all, &device);
        let rounded = mlp.forward_rounded(x, &network.activation_max);
        let rounded: Vec<f32> = rounded.into_data().iter::<f32>().collect();
        let bytes = export(&weights(network.clone())).unwrap();
        let model = Model::parse(&bytes).unwrap();
        let mut chip = hivtac_sensing::network::Network::new();

        let (mut from_rounded, mut from_float) = (0.0, 0.0);
        for (i, (q16, px)) in rows.iter().enumerate() {
            let features = features_from_q16(q16).unwrap();
            let values = chip.run(&model, &features, &model.rest.features).values;
            let float = network.predict(px);
            for o in 0..OUTPUTS {
                let force = f64::from(values[o]) / 1e6;
                from_rounded += (force - f64::from(rounded[i * OUTPUTS + o]) * 0.05).abs();
                from_float += (force - float[o]).abs();
            }
        }
        // What is left are inputs rounded to 1/4096 and ties: a few activations differ by one step.
        assert!(
            from_rounded < 0.1 * from_float,
            "{from_rounded} {from_float}"
        );
    }
}
