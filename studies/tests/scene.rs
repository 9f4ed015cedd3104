//! Tests `hivtac-studies scene …` as a user runs it.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;
use std::process::{Command, Output};

use hivtac_twin::{Preset, Scene};
use serde_json::Value;

fn run(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hivtac-studies"))
        .current_dir(directory)
        .arg("scene")
        .args(arguments)
        .output()
        .unwrap()
}

fn stdout(directory: &Path, arguments: &[&str]) -> String {
    let output = run(directory, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8(output.stdout).unwrap()
}

/// Asserts that the command fails with a message that contains all of `words`.
fn assert_refused(directory: &Path, arguments: &[&str], words: &[&str]) {
    let output = run(directory, arguments);
    assert!(!output.status.success(), "{arguments:?}");
    let error = String::from_utf8(output.stderr).unwrap();
    for word in words {
        assert!(error.contains(word), "no `{word}` in:\n{error}");
    }
}

/// Width, height and pixels of a PNG file in 8-bit red, green and blue.
fn png(path: &Path) -> (u32, u32, Vec<u8>) {
    let decoder = png::Decoder::new(BufReader::new(File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels)
}

#[test]
fn a_picture_is_the_frame_and_an_overlay_marks_the_true_centroids() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let plain = ["render", "static", "--out", "a.png", "--number", "7"];
    let said = stdout(here, &plain);
    assert!(said.contains("320×240 rgb565"), "{said}");
    stdout(here, &[&plain[..], &["--scale", "3"]].concat());
    let over = ["render", "static", "--out", "b.png", "--number", "7"];
    let over = [&over[..], &["--scale", "3", "--overlay"]].concat();
    stdout(here, &over);
    let (width, height, before) = png(&here.join("a.png"));
    let (_, _, after) = png(&here.join("b.png"));
    assert_eq!((width, height), (960, 720));
    let scene = Scene::preset("static", Preset::Ov7725, 320, 240, 1).unwrap();
    let frame = scene.frame(7, 0.0).to_rgb888();
    for (k, pixel) in frame.chunks_exact(3).enumerate() {
        let (x, y) = (3 * (k % 320) + k % 3, 3 * (k / 320) + k % 2);
        assert_eq!(before[3 * (960 * y + x)..][..3], *pixel);
    }
    for marker in scene.truth(0.0).markers {
        let at = marker.unwrap().centroid_px;
        let [x, y] = at.map(|px| ((px + 0.5) * 3.0) as usize);
        assert_eq!(after[3 * (960 * y + x)..][..3], [0, 255, 255]);
    }
    let differing = before.iter().zip(&after).filter(|(a, b)| a != b).count();
    assert!(differing < after.len() / 50, "little else changes");
}

#[test]
fn mistakes_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let render = |scene: &'static str| ["render", scene, "--out", "a.png"];
    fs::write(here.join("a.toml"), "[light]\ngian = 0.3\n").unwrap();
    assert_refused(here, &render("a.toml"), &["a.toml", "line 2", "gian"]);
    assert_refused(here, &render("none.toml"), &["cannot read none.toml"]);
    assert_refused(here, &render("swep"), &["swep", "sweep", "demo"]);
    let back = [&render("demo")[..], &["--at", "-1"]].concat();
    assert_refused(here, &back, &["--at -1"]);
}

/// The kit's mechanics take their lengths from this file, `hardware/` has no other.
#[test]
fn the_kit_has_the_dimensions_of_the_simulated_sensor() {
    let directory = tempfile::tempdir().unwrap();
    let printed: Value = serde_json::from_str(&stdout(directory.path(), &["dimensions"])).unwrap();
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hardware/kit/dimensions.json");
    let kept: Value = serde_json::from_str(&fs::read_to_string(kept).unwrap()).unwrap();
    let to_do = "write it anew: hivtac-studies scene dimensions > hardware/kit/dimensions.json";
    assert_eq!(printed, kept, "{to_do}");
    assert_eq!(printed["marker_centres_mm"].as_array().unwrap().len(), 4);
}
