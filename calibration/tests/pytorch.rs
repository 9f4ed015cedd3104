//! Imports a network that PyTorch wrote (`python/train_pytorch.py --hidden 12,8 --epochs 60
//! --examples 5`).

use std::collections::HashMap;
use std::path::PathBuf;

use hivtac_calibration::data::dataset::{Loads, Recipe, generate};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::fit::fit;
use hivtac_calibration::import::{load, parse};
use hivtac_calibration::network::{INPUTS, Meaning, Network, OUTPUTS};
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::Options;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/pytorch.safetensors")
}

fn numbers(tensor: &TensorView<'_>) -> Vec<f64> {
    tensor
        .data()
        .chunks(8)
        .map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()))
        .collect()
}

#[test]
fn it_answers_as_it_did_in_pytorch() {
    let network = load(&path()).unwrap();
    assert_eq!(network.meaning, Meaning::ForceVector);
    let widths: Vec<usize> = network.layers.iter().map(|layer| layer.outputs()).collect();
    assert_eq!(widths, [12, 8, 3]);

    let bytes = std::fs::read(path()).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let features = numbers(&tensors.tensor("example.features").unwrap());
    let answers = numbers(&tensors.tensor("example.answers").unwrap());
    assert_eq!(features.len(), 5 * INPUTS);
    for (features, answers) in features.chunks(INPUTS).zip(answers.chunks(OUTPUTS)) {
        let predicted = network.predict(features.try_into().unwrap());
        for (found, expected) in predicted.iter().zip(answers) {
            // PyTorch sums in single precision: 1e-6 of the answers' size.
            assert!((found - expected).abs() < 1e-6, "{predicted:?} {answers:?}");
        }
    }
}

#[test]
fn it_goes_on_to_the_chip() {
    let data = generate(
        &Recipe {
            loads: Loads::Random(52),
            rest: 8,
            range: Range::default(),
            ..Recipe::default()
        },
        || (),
    )
    .unwrap();
    let network = load(&path()).unwrap();
    let options = Options {
        epochs: 0,
        rounded_epochs: 0,
        start: Some(network.clone()),
        ..Options::default()
    };
    let fitted = fit(&data, &options, |_| ()).unwrap();
    let found = fitted.weights.network().unwrap();
    assert_eq!(found.layers, network.layers);
    assert_ne!(found.activation_max, network.activation_max);
    assert!(export(&fitted.weights).is_ok());
}

/// The network in the documented layout, written by this test.
fn written(
    network: &Network,
    meaning: &str,
    change: impl Fn(&mut Vec<(String, Vec<usize>, Vec<f64>)>),
) -> Vec<u8> {
    let mut tensors = vec![
        (
            "input.mean".to_owned(),
            vec![INPUTS],
            network.input.mean.clone(),
        ),
        (
            "input.sigma".to_owned(),
            vec![INPUTS],
            network.input.sigma.clone(),
        ),
        (
            "output.mean".to_owned(),
            vec![OUTPUTS],
            network.output.mean.clone(),
        ),
        (
            "output.sigma".to_owned(),
            vec![OUTPUTS],
            network.output.sigma.clone(),
        ),
    ];
    for (i, layer) in network.layers.iter().enumerate() {
        let weights = layer.weights.concat().into_iter().map(f64::from).collect();
        let bias = layer.bias.iter().map(|&b| f64::from(b)).collect();
        // Numbered as in an nn.Sequential, which has a ReLU after each.
        tensors.push((
            format!("{}.weight", 2 * i),
            vec![layer.outputs(), layer.inputs()],
            weights,
        ));
        tensors.push((format!("{}.bias", 2 * i), vec![layer.outputs()], bias));
    }
    change(&mut tensors);
    let data: Vec<Vec<u8>> = tensors
        .iter()
        .map(|(_, _, values)| values.iter().flat_map(|v| v.to_le_bytes()).collect())
        .collect();
    let views = tensors.iter().zip(&data).map(|((name, shape, _), data)| {
        (
            name.clone(),
            TensorView::new(Dtype::F64, shape.clone(), data).unwrap(),
        )
    });
    let metadata = HashMap::from([("meaning".to_owned(), meaning.to_owned())]);
    serialize(views, Some(metadata)).unwrap()
}

#[test]
fn what_is_read_can_be_written_and_read_again() {
    let network = load(&path()).unwrap();
    assert_eq!(
        parse(&written(&network, "force-vector", |_| ())).unwrap(),
        network
    );
    let angles = parse(&written(&network, "angles-magnitude", |_| ())).unwrap();
    assert_eq!(angles.meaning, Meaning::AnglesMagnitude);
}

#[test]
fn what_is_no_network_is_refused_with_the_tensor() {
    let network = load(&path()).unwrap();
    let refused = |bytes: &[u8], words: &str| {
        let error = format!("{:#}", parse(bytes).unwrap_err());
        assert!(error.contains(words), "no `{words}` in: {error}");
    };
    refused(b"nothing", "not a safetensors file");
    refused(&written(&network, "angles", |_| ()), "angles");
    refused(
        &written(&network, "force-vector", |t| drop(t.remove(0))),
        "input.mean",
    );
    refused(
        &written(&network, "force-vector", |t| t.retain(|t| t.0 != "2.bias")),
        "2.bias",
    );
    refused(
        &written(&network, "force-vector", |t| {
            t.retain(|t| !t.0.ends_with("weight"))
        }),
        "0.weight",
    );
    refused(
        &written(&network, "force-vector", |t| t[4].1 = vec![12 * INPUTS]),
        "0.weight",
    );
    refused(
        &written(&network, "force-vector", |t| t[0].2[3] = f64::NAN),
        "not a finite number",
    );
    refused(
        &written(&network, "force-vector", |t| t[1].2[3] = 0.0),
        "above zero",
    );
    refused(
        &written(&network, "force-vector", |t| t[4].2[3] = f64::INFINITY),
        "layer 0",
    );
    // A number too large for single precision becomes infinite.
    refused(
        &written(&network, "force-vector", |t| t[4].2[3] = 1e300),
        "layer 0",
    );
}
