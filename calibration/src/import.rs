//! Imports a network trained in PyTorch from a safetensors file (`docs/training.md` has the
//! layout).

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};

use crate::network::{Arithmetic, INPUTS, Layer, Meaning, Network, Standardization};

/// The entry of the file's metadata with the meaning of the outputs.
const MEANING: &str = "meaning";

/// Reads a network. The maxima of its hidden layers are still missing:
/// [`Network::activation_maxima`] takes them from data.
///
/// # Errors
/// When the file cannot be read or is not a safetensors file; when its tensors are not a network
/// with its scaling. Names the tensor.
pub fn load(path: &Path) -> Result<Network> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&bytes)
        .with_context(|| format!("{} is not a network that can be imported", path.display()))
}

/// Parses the network in the bytes of a safetensors file.
///
/// # Errors
/// When they are not a safetensors file, or its tensors are not a network with its scaling; names
/// the tensor.
pub fn parse(bytes: &[u8]) -> Result<Network> {
    let tensors = SafeTensors::deserialize(bytes).context("not a safetensors file")?;
    let layers = layer_numbers(&tensors)?
        .into_iter()
        .map(|number| layer(&tensors, number))
        .collect::<Result<Vec<_>>>()?;
    let meaning = meaning(bytes)?;
    let network = Network {
        meaning,
        arithmetic: Arithmetic::default(),
        input: scaling(&tensors, "input", INPUTS)?,
        output: scaling(&tensors, "output", meaning.outputs())?,
        activation_max: vec![1.0; layers.len().saturating_sub(1)],
        layers,
    };
    network.validate()?;
    Ok(network)
}

fn meaning(bytes: &[u8]) -> Result<Meaning> {
    let (_, metadata) = SafeTensors::read_metadata(bytes)?;
    let name = metadata
        .metadata()
        .as_ref()
        .and_then(|entries| entries.get(MEANING));
    let name = name.with_context(|| {
        format!(
            "the file's metadata has no `{MEANING}`: force-vector, angles-magnitude or \
                 force-and-place"
        )
    })?;
    serde_json::from_value(name.as_str().into())
        .with_context(|| format!("metadata `{MEANING}` is `{name}`"))
}

/// Numbers of the linear layers, in order; an `nn.Sequential` also numbers its ReLUs.
fn layer_numbers(tensors: &SafeTensors<'_>) -> Result<Vec<usize>> {
    let number = |name: &str| {
        name.strip_suffix(".weight")
            .and_then(|number| number.parse().ok())
    };
    let mut numbers: Vec<usize> = tensors.names().into_iter().filter_map(number).collect();
    numbers.sort_unstable();
    ensure!(
        !numbers.is_empty(),
        "there is no tensor `0.weight`: save the state of an nn.Sequential"
    );
    Ok(numbers)
}

fn layer(tensors: &SafeTensors<'_>, number: usize) -> Result<Layer> {
    let name = format!("{number}.weight");
    let weights = tensors
        .tensor(&name)
        .with_context(|| format!("tensor `{name}`"))?;
    let &[outputs, inputs] = weights.shape() else {
        bail!(
            "tensor `{name}` has {} dimensions instead of 2",
            weights.shape().len()
        );
    };
    ensure!(inputs > 0, "tensor `{name}` has no columns");
    let values = numbers(&weights).with_context(|| format!("tensor `{name}`"))?;
    let bias = vector(tensors, &format!("{number}.bias"), outputs)?;
    Ok(Layer {
        weights: values
            .chunks(inputs)
            .map(|row| row.iter().map(|&w| w as f32).collect())
            .collect(),
        bias: bias.iter().map(|&b| b as f32).collect(),
    })
}

fn scaling(tensors: &SafeTensors<'_>, name: &str, length: usize) -> Result<Standardization> {
    Ok(Standardization {
        mean: vector(tensors, &format!("{name}.mean"), length)?,
        sigma: vector(tensors, &format!("{name}.sigma"), length)?,
    })
}

fn vector(tensors: &SafeTensors<'_>, name: &str, length: usize) -> Result<Vec<f64>> {
    let tensor = tensors
        .tensor(name)
        .with_context(|| format!("tensor `{name}`"))?;
    let shape = tensor.shape();
    ensure!(
        shape == [length],
        "tensor `{name}` has the shape {shape:?} instead of [{length}]"
    );
    numbers(&tensor).with_context(|| format!("tensor `{name}`"))
}

fn numbers(tensor: &TensorView<'_>) -> Result<Vec<f64>> {
    let data = tensor.data();
    match tensor.dtype() {
        Dtype::F32 => Ok(data
            .as_chunks()
            .0
            .iter()
            .map(|&bytes| f64::from(f32::from_le_bytes(bytes)))
            .collect()),
        Dtype::F64 => Ok(data
            .as_chunks()
            .0
            .iter()
            .map(|&bytes| f64::from_le_bytes(bytes))
            .collect()),
        other => bail!("its numbers are {other:?}: use float32 or float64"),
    }
}
