//! `benchmark-cases FOLDER`: writes the scripts that `cargo xtask bench` runs, one file each, and prints what they are,
//! one JSON object a line: `{"name":…,"file":…,"pixels":…}`.

use std::path::{Path, PathBuf};
use std::{env, fs};

use anyhow::{Context, Result};
use hivtac_scene::{Preset, Scene};
use hivtac_sensing::model::OutputKind;
use hivtac_sensing::threshold::{ByteOrder, HsvBox};
use hivtac_tests::models::{self, Weights};
use hivtac_tests::pictures;
use hivtac_tests::script::Script;

/// The model that the sensor runs.
const SMALL: [u16; 4] = [11, 64, 64, 3];
/// The paper's model.
const PAPER: [u16; 5] = [11, 512, 512, 512, 3];

fn main() -> Result<()> {
    let folder = env::args_os().nth(1).map(PathBuf::from);
    let folder = folder.context("usage: benchmark-cases FOLDER")?;
    for (number, (name, script, pixels)) in cases()?.into_iter().enumerate() {
        let file = folder.join(format!("{number}.script"));
        write(&file, script.bytes())?;
        let line = serde_json::json!({ "name": name, "file": file, "pixels": pixels });
        println!("{line}");
    }
    Ok(())
}

type Case = (&'static str, Script, usize);

fn cases() -> Result<Vec<Case>> {
    let qvga = reference(320, 240)?;
    let large = reference(800, 600)?;
    let salted = pictures::salted(qvga.clone(), 5, 1);
    Ok(vec![
        ("QVGA, reference", frame(320, &qvga), qvga.len()),
        ("QVGA, 5 % red salt", frame(320, &salted), salted.len()),
        (
            "QVGA, all black",
            frame(320, &pictures::plain(320, 240, 0)),
            qvga.len(),
        ),
        (
            "QVGA, checkerboard",
            frame(320, &pictures::checkerboard(320, 240)),
            qvga.len(),
        ),
        ("800×600, reference", frame(800, &large), large.len()),
        ("inference 11-64-64-3", inference(&SMALL), 0),
        ("inference 11-512-512-512-3", inference(&PAPER), 0),
    ])
}

/// The reference frame: the simulated sensor under 0.1 N at α = 4°, β = −3°, with its usual light and noise.
fn reference(width: u32, height: u32) -> Result<Vec<u16>> {
    let scene = Scene::preset("static", Preset::Ov7725, width, height, 1)?;
    Ok(scene.frame(0, 1.0).pixels)
}

/// One frame through the whole pipeline, as the firmware runs it. The model is for QVGA; other sizes go without.
fn frame(width: u16, pixels: &[u16]) -> Script {
    let mut script = Script::new();
    script.threshold(&HsvBox::RED, ByteOrder::Swapped);
    if width == 320 {
        script.model(&model(&SMALL));
    }
    script.sense(width, &[pixels]);
    script
}

fn inference(widths: &[u16]) -> Script {
    let mut script = Script::new();
    script
        .model(&model(widths))
        .network(&models::rest(), &models::rest());
    script
}

fn model(widths: &[u16]) -> Vec<u8> {
    models::file(widths, Weights::Random, OutputKind::ForceVector, 1)
}

fn write(file: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(file, bytes).with_context(|| format!("writing {}", file.display()))
}
