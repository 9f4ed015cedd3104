//! The state of a training: weights, optimizer, data and the best weights up to now.

use anyhow::Result;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::network::scale_inputs;
use hivtac_terms::fixed::Q;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use super::adam::Adam;
use super::loss::{Across, loss};
use super::mlp::Mlp;
use super::whitening::Whitening;
use super::{Options, Samples, rounded, scaling};
use crate::data::rest::{features_from_q16, q16};
use crate::network::{Arithmetic, INPUTS, Layer, Network, Standardization};
use crate::quantize::input_scaling;

/// Number of rows in a batch of measurement.
const MEASURED_ROWS: usize = 256;

/// One of the two phases of a training.
pub(super) struct Phase {
    /// Whether the chip's rounding is on.
    pub rounded: bool,
    pub epochs: usize,
    /// The first step size.
    pub rate: f64,
}

pub(super) struct State {
    /// The network; during a phase its first layer takes whitened components.
    mlp: Mlp,
    whitening: Whitening,
    adam: Adam,
    random: ChaCha8Rng,
    batch: usize,
    order: Vec<usize>,
    training: Rows,
    held_out: Rows,
    /// The network without its layers, which are in `mlp`.
    network: Network,
    best: Option<Best>,
}

struct Best {
    layers: Mlp,
    loss: f64,
}

/// Data in the form that the network takes.
struct Rows {
    /// Components of the standardized features.
    components: Vec<[f32; INPUTS]>,
    /// The features in the chip's steps.
    steps: Vec<[i16; INPUTS]>,
    /// Standardized answers.
    answers: Vec<Vec<f32>>,
    /// Weights of errors across each force, if they differ between rows.
    across: Option<Across>,
}

impl Rows {
    fn new(
        samples: &Samples,
        network: &Network,
        whitening: &Whitening,
        across: Option<Across>,
    ) -> Result<Self> {
        let scaling = input_scaling(&network.input)?;
        let steps = samples.features.iter().map(|row| {
            let features = features_from_q16(&row.map(q16).into())?;
            Ok(scale_inputs(
                &scaling,
                &features,
                &Features::default(),
                &Features::default(),
            )
            .map(Q::bits))
        });
        let floats = standardized(&samples.features, &network.input);
        let answer = |row: usize| -> Vec<f32> {
            let scaled = network.output.forward(&samples.answer(row));
            scaled.iter().map(|&part| part as f32).collect()
        };
        let answers = (0..samples.answers.len()).map(answer);
        Ok(Self {
            components: floats.iter().map(|row| whitening.components(row)).collect(),
            steps: steps.collect::<Result<_>>()?,
            answers: answers.collect(),
            across,
        })
    }

    /// The mean loss of these rows, and its gradient by the outputs.
    fn loss(&self, outputs: &[f32], rows: &[usize]) -> (f64, Vec<f32>) {
        let targets: Vec<f32> = gathered(&self.answers, rows);
        loss(outputs, &targets, self.across.as_ref(), rows)
    }
}

fn standardized<const N: usize>(rows: &[[f64; N]], scaling: &Standardization) -> Vec<[f32; N]> {
    let one = |row: &[f64; N]| {
        let scaled = scaling.forward(row);
        std::array::from_fn(|i| scaled[i] as f32)
    };
    rows.iter().map(one).collect()
}

/// The chosen rows, feature by feature.
fn gathered<T: Copy, U: From<T>, R: AsRef<[T]>>(data: &[R], rows: &[usize]) -> Vec<U> {
    let feature = |i: usize| rows.iter().map(move |&row| U::from(data[row].as_ref()[i]));
    let features = rows.first().map_or(0, |&row| data[row].as_ref().len());
    (0..features).flat_map(feature).collect()
}

impl State {
    pub fn new(training: &Samples, held_out: &Samples, options: &Options) -> Result<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(options.seed);
        let (mut mlp, network) = match &options.start {
            Some(start) => (Mlp::of_layers(&start.layers), start.clone()),
            None => {
                let outputs = options.meaning.outputs();
                let widths = [&[INPUTS], &options.hidden[..], &[outputs]].concat();
                (Mlp::random(&widths, &mut random), blank(training, options)?)
            }
        };
        let network = Network {
            arithmetic: options.arithmetic,
            ..network
        };
        let whitening = Whitening::of(&standardized(&training.features, &network.input));
        if options.start.is_none() {
            whitening.fold(&mut mlp);
        }
        let rows = |samples: &Samples| {
            let weighed = |weight| Across::new(samples, training, weight);
            let across = options.direction_weight_in_use().map(weighed);
            Rows::new(samples, &network, &whitening, across)
        };
        Ok(Self {
            adam: Adam::new(&mlp),
            mlp,
            random,
            batch: options.batch,
            order: (0..training.features.len()).collect(),
            training: rows(training)?,
            held_out: rows(held_out)?,
            whitening,
            network,
            best: None,
        })
    }

    /// Starts a phase. At the start of the rounded phase, the layers trained before determine the
    /// largest activation of each hidden layer on the chip.
    pub fn begin(&mut self, phase: &Phase, training: &Samples) -> Result<()> {
        self.best = None;
        if phase.rounded {
            self.network.layers = self.mlp.to_layers();
            // Twelve-bit activations have enough steps, and equalizing would make the weights after
            // them coarser.
            if phase.epochs > 0 && self.network.arithmetic != Arithmetic::Int16 {
                self.network.equalize(&training.features);
            }
            self.network.activation_max = self.network.activation_maxima(&training.features);
            if phase.epochs > 0 {
                self.mlp = Mlp::of_layers(&self.network.layers);
            }
        }
        if phase.epochs > 0 {
            self.whitening.unfold(&mut self.mlp);
        }
        self.adam = Adam::new(&self.mlp);
        Ok(())
    }

    /// One pass over the shuffled data. Returns the mean loss over it, and that on the held-out
    /// data after it.
    pub fn pass(&mut self, phase: &Phase, epoch: usize) -> Result<[f64; 2]> {
        let mut order = std::mem::take(&mut self.order);
        order.shuffle(&mut self.random);
        let batches = order.len().div_ceil(self.batch);
        let mut sum = 0.0;
        for (i, rows) in order.chunks(self.batch).enumerate() {
            let done = (epoch * batches + i) as f64 / (phase.epochs * batches) as f64;
            sum += self.step(rows, phase.rate * (1.0 - done), phase.rounded)? * rows.len() as f64;
        }
        self.order = order;
        let held_out = self.held_out_loss(phase.rounded)?;
        self.remember(held_out);
        Ok([sum / self.order.len() as f64, held_out])
    }

    fn step(&mut self, rows: &[usize], rate: f64, rounded: bool) -> Result<f64> {
        let loss = |outputs: &[f32]| self.training.loss(outputs, rows);
        let (loss, gradients) = if rounded {
            self.network.layers = self.by_features();
            let inputs = gathered(&self.training.steps, rows);
            let seen = rounded::forward(&self.network, inputs, rows.len())?;
            let (loss, gradient) = loss(&seen.trace.outputs);
            let mut gradients = seen.mlp.backward(&seen.trace, gradient, rows.len());
            gradients[0].weights = self.whitening.gradient(&gradients[0].weights);
            (loss, gradients)
        } else {
            let trace = self
                .mlp
                .forward(gathered(&self.training.components, rows), rows.len());
            let (loss, gradient) = loss(&trace.outputs);
            (loss, self.mlp.backward(&trace, gradient, rows.len()))
        };
        self.adam.step(&mut self.mlp, &gradients, rate);
        Ok(loss)
    }

    fn held_out_loss(&mut self, rounded: bool) -> Result<f64> {
        let all: Vec<usize> = (0..self.held_out.answers.len()).collect();
        self.network.layers = if rounded {
            self.by_features()
        } else {
            Vec::new()
        };
        let mut sum = 0.0;
        for rows in all.chunks(MEASURED_ROWS) {
            let outputs = if rounded {
                let inputs = gathered(&self.held_out.steps, rows);
                rounded::forward(&self.network, inputs, rows.len())?
                    .trace
                    .outputs
            } else {
                self.mlp
                    .forward(gathered(&self.held_out.components, rows), rows.len())
                    .outputs
            };
            sum += self.held_out.loss(&outputs, rows).0 * rows.len() as f64;
        }
        Ok(sum / all.len() as f64)
    }

    fn remember(&mut self, loss: f64) {
        let best = self.best.get_or_insert_with(|| Best {
            layers: self.mlp.clone(),
            loss,
        });
        // A NaN loss is never the best; without held-out samples the last pass counts as the best.
        if loss <= best.loss || loss.is_nan() {
            (best.layers, best.loss) = (self.mlp.clone(), loss);
        }
    }

    /// The layers in training, the first taking features.
    fn by_features(&self) -> Vec<Layer> {
        let mut mlp = self.mlp.clone();
        self.whitening.fold(&mut mlp);
        mlp.to_layers()
    }

    /// The training data in the chip's steps.
    #[cfg(test)]
    pub fn chip_inputs(&self) -> Vec<f64> {
        let all: Vec<usize> = (0..self.training.steps.len()).collect();
        gathered(&self.training.steps, &all)
    }

    /// Restores the best weights of the phase.
    pub fn take_best(&mut self) {
        if let Some(best) = self.best.take() {
            self.mlp = best.layers;
            self.whitening.fold(&mut self.mlp);
        }
    }

    /// The trained network.
    pub fn network(mut self) -> Result<Network> {
        self.network.layers = self.mlp.to_layers();
        self.network.validate()?;
        Ok(self.network)
    }
}

/// A network without layers, with scaling from the data.
fn blank(training: &Samples, options: &Options) -> Result<Network> {
    let [input, output] = scaling(training, options.meaning)?;
    Ok(Network {
        meaning: options.meaning,
        arithmetic: options.arithmetic,
        input,
        output,
        activation_max: Vec::new(),
        layers: Vec::new(),
    })
}
