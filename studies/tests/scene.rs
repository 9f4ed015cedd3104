//! `hivtac-studies scene …` as a user runs it.

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

fn stdout(output: &Output) -> String {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// What is said of a mistake; all of `words` are in it.
fn assert_refused(directory: &Path, arguments: &[&str], words: &[&str]) {
    let output = run(directory, arguments);
    assert!(!output.status.success(), "{arguments:?}");
    assert_ne!(
        output.status.code(),
        None,
        "{arguments:?} ended by a signal"
    );
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
    assert_eq!(info.color_type, png::ColorType::Rgb);
    (info.width, info.height, pixels)
}

const FILE: &str = r#"
seed = 3
[camera]
preset = "paper"
width = 400
height = 300
[load]
motion = "static"
"#;

#[test]
fn a_picture_is_the_frame() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    for format in ["rgb565", "yuv422", "mono", "jpeg"] {
        let text = FILE.replace("width", &format!("format = \"{format}\"\nwidth"));
        fs::write(here.join("scene.toml"), &text).unwrap();
        let arguments = ["render", "scene.toml", "--out", "a.png", "--number", "7"];
        let said = stdout(&run(here, &arguments));
        assert!(said.contains("400×300") && said.contains(format), "{said}");
        let (width, height, pixels) = png(&here.join("a.png"));
        let frame = Scene::from_toml(&text).unwrap().frame(7, 0.0);
        assert_eq!((width, height), (frame.width, frame.height));
        assert!(pixels == frame.to_rgb888(), "{format}");
    }
}

#[test]
fn time_and_scale_are_those_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let arguments = [
        "render", "demo", "--out", "a.png", "--at", "0.7", "--scale", "2",
    ];
    stdout(&run(here, &arguments));
    let (width, height, pixels) = png(&here.join("a.png"));
    assert_eq!((width, height), (640, 480));
    let scene = Scene::preset("demo", Preset::Ov7725, 320, 240, 1).unwrap();
    let frame = scene.frame(0, 0.7).to_rgb888();
    for (x, y) in [(0, 0), (77, 44), (319, 239), (160, 120)] {
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let big = 3 * ((2 * y + dy) * 640 + 2 * x + dx);
            let small = 3 * (y * 320 + x);
            assert_eq!(pixels[big..big + 3], frame[small..small + 3]);
        }
    }
}

#[test]
fn an_overlay_marks_the_true_centroids() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    for scale in ["1", "3"] {
        let plain = ["render", "static", "--out", "a.png", "--scale", scale];
        stdout(&run(here, &plain));
        stdout(&run(
            here,
            &[&plain[..3], &["b.png", "--scale", scale, "--overlay"]].concat(),
        ));
        let (width, _, before) = png(&here.join("a.png"));
        let (_, _, after) = png(&here.join("b.png"));
        let scene = Scene::preset("static", Preset::Ov7725, 320, 240, 1).unwrap();
        let scale: f64 = scale.parse().unwrap();
        for marker in scene.truth(0.0).markers {
            let [x, y] = marker.unwrap().centroid_px;
            let [x, y] = [x, y].map(|px| ((px + 0.5) * scale) as usize);
            let at = 3 * (y * width as usize + x);
            let [red, green, _] = [before[at], before[at + 1], before[at + 2]];
            assert!(red > 2 * green, "the marker is red");
            assert_eq!(after[at..at + 3], [0, 255, 255]);
        }
        let differing = before.iter().zip(&after).filter(|(a, b)| a != b).count();
        assert!(differing < after.len() / 50, "little else changes");
    }
}

#[test]
fn mistakes_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let render = |scene: &'static str| ["render", scene, "--out", "a.png"];
    let file = |text: &str| fs::write(here.join("a.toml"), text).unwrap();
    file("[light]\ngian = 0.3\n");
    assert_refused(
        here,
        &render("a.toml"),
        &["a.toml", "line 2", "gian", "gain"],
    );
    file("[light]\n\ngain = 30\n");
    assert_refused(here, &render("a.toml"), &["line 3", "gain is 30", "0 to 4"]);
    file("[load.static]\nforce_n = \"much\"\n");
    assert_refused(here, &render("a.toml"), &["line 2", "force_n"]);
    assert_refused(here, &render("none.toml"), &["cannot read none.toml"]);
    assert_refused(here, &render("swep"), &["swep", "sweep", "demo"]);
    assert!(!here.join("a.png").exists(), "nothing is written");

    let refused = |more: &[&str], words: &[&str]| {
        let arguments = [&render("demo")[..], more].concat();
        assert_refused(here, &arguments, words);
    };
    refused(&["--at", "-1"], &["--at -1"]);
    refused(&["--at", "nan"], &["--at"]);
    refused(&["--scale", "0"], &["--scale"]);
    assert_refused(
        here,
        &["render", "demo", "--out", "none/a.png"],
        &["cannot write none/a.png"],
    );
    assert_refused(
        here,
        &["cases", "--only", "xyz", "--out", "a.png"],
        &["xyz"],
    );
    let effects = |more: &[&str], words: &[&str]| {
        let few = ["effects", "--frames", "2"];
        assert_refused(here, &[&few, more].concat(), words);
    };
    effects(&["--size", "big"], &["big", "320x240"]);
    effects(&["--size", "321x240"], &["321×240"]);
    effects(&["--preset", "mine"], &["mine", "ov7725"]);
    fs::write(here.join("a.md"), "no place\n").unwrap();
    effects(&["--document", "a.md"], &["a.md", "effects ov7725 320x240"]);
}

#[test]
fn hard_cases_fill_a_sheet() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let arguments = [
        "cases",
        "--only",
        "missing",
        "--columns",
        "3",
        "--out",
        "a.png",
    ];
    let said = stdout(&run(here, &arguments));
    assert!(said.contains("6 cases"), "{said}");
    let (width, height, pixels) = png(&here.join("a.png"));
    assert!(width > 3 * 160 && height > 2 * 120);
    let red = pixels
        .chunks(3)
        .filter(|p| p[0] > 120 && p[1] < 70 && p[2] < 70);
    assert!(red.count() > 500, "markers are to be seen");
    stdout(&run(here, &["render", "missing-0", "--out", "b.png"]));
    assert_eq!(png(&here.join("b.png")).0, 320);
}

#[test]
fn effects_are_a_table_in_three_forms() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let few = ["effects", "--frames", "4"];
    let text = stdout(&run(here, &few));
    assert!(text.contains("equidistant lens") && text.contains("noise floor"));
    let json = stdout(&run(here, &[&few[..], &["--json"]].concat()));
    let table: Value = serde_json::from_str(&json).unwrap();
    let floor = table["noise_floor"]["motion_px"]["rms"].as_f64().unwrap();
    assert!((0.001..0.3).contains(&floor), "{floor}");
    let effects = table["effects"].as_array().unwrap();
    let of = |name: &str| effects.iter().find(|row| row["name"] == name).unwrap();
    assert_eq!(of("equidistant lens")["above_floor"], true);
    assert_eq!(of("equidistant lens")["in_default"], true);
    assert_eq!(of("optical centre")["above_floor"], false);
    assert!(
        of("focal length")["change"]["force_mn"]["rms"]
            .as_f64()
            .unwrap()
            > 0.1
    );
    let sizes = effects
        .iter()
        .map(|row| row["change"]["motion_px"]["rms"].as_f64());
    let sizes: Vec<f64> = sizes.map(|rms| rms.unwrap_or(f64::INFINITY)).collect();
    assert!(sizes.is_sorted_by(|a, b| a >= b), "{sizes:?}");

    let document = "before\n<!-- effects ov7725 320x240: begin -->\n<!-- effects ov7725 320x240: \
                    end -->\nafter\n";
    fs::write(here.join("a.md"), document).unwrap();
    stdout(&run(here, &[&few[..], &["--document", "a.md"]].concat()));
    let written = fs::read_to_string(here.join("a.md")).unwrap();
    assert!(written.starts_with("before\n") && written.ends_with("\nafter\n"));
    assert_eq!(
        written
            .lines()
            .filter(|line| line.starts_with("| "))
            .count(),
        2 + effects.len()
    );
}

/// Tip depth and the markers' (x, y) of `scene film --json`.
fn film(more: &[&str]) -> (f64, [[f64; 2]; 4]) {
    let directory = tempfile::tempdir().unwrap();
    let pressed = "film --preset paper --force-n 0.1 --alpha-deg 5 --beta-deg 0 --json";
    let arguments: Vec<&str> = pressed.split(' ').chain(more.iter().copied()).collect();
    let answer: Value = serde_json::from_str(&stdout(&run(directory.path(), &arguments))).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let markers = answer["markers"].as_array().unwrap();
    assert_eq!(answer.as_object().unwrap().len(), 2);
    assert_eq!(markers.len(), 4);
    for (id, marker) in markers.iter().enumerate() {
        assert_eq!(marker["id"], id);
        for key in ["dx_mm", "dy_mm", "dz_mm"] {
            assert!(number(&marker[key]).abs() < 10.0);
        }
        assert!(
            number(&marker["dz_mm"]) < -1.0,
            "a press goes to the camera"
        );
    }
    let seen = [0, 1, 2, 3].map(|id| ["x_px", "y_px"].map(|key| number(&markers[id][key])));
    (number(&answer["tip_depth_mm"]), seen)
}

#[test]
fn the_films_curves_agree_with_its_solver() {
    let (depth, seen) = film(&["--contact", "force"]);
    assert!((depth - 4.707).abs() < 0.005, "{depth}");
    // Upper left, upper right, lower right, lower left; all farther right than without the tilt.
    let [[ax, ay], [bx, by], [cx, cy], [dx, dy]] = seen;
    assert!(ax < 399.5 && ay < 299.5 && bx > 399.5 && by < 299.5);
    assert!(cx > 399.5 && cy > 299.5 && dx < 399.5 && dy > 299.5);
    assert!((ax + bx + cx + dx) / 4.0 > 399.9);
    let asides = ["--offset-mm", "0.15,-0.1"];
    let (_, aside) = film(&asides);
    assert!((aside[0][0] - seen[0][0]).abs() > 0.2, "an offset shows");
    let (_, stuck) = film(&["--contact", "stick"]);
    assert!(
        stuck[0][0] - seen[0][0] > 3.0,
        "a tip that sticks pulls farther"
    );
    for more in [
        vec!["--contact", "force"],
        asides.to_vec(),
        vec!["--contact", "stick"],
        vec!["--contact", "slip:0.4"],
    ] {
        let (depth, reduced) = film(&more);
        let (full_depth, full) = film(&[&more[..], &["--solver", "full"]].concat());
        assert!((depth - full_depth).abs() < 0.005, "{more:?}");
        for (a, b) in reduced.iter().zip(&full) {
            let off = (a[0] - b[0]).hypot(a[1] - b[1]);
            assert!(off < 0.1, "{more:?}: {off} px");
        }
    }
}

#[test]
fn what_the_film_cannot_do_is_said() {
    let directory = tempfile::tempdir().unwrap();
    let refused = |more: &[&str], words: &[&str]| {
        assert_refused(directory.path(), &[&["film"], more].concat(), words);
    };
    refused(&["--force-n", "0.6"], &["0.6 N", "0.25"]);
    refused(&["--force-n", "-0.1"], &["-0.1 N"]);
    refused(&["--alpha-deg", "40"], &["tangential", "0.8"]);
    let stuck = ["--contact", "stick"];
    refused(&[&stuck[..], &["--alpha-deg", "20"]].concat(), &["12°"]);
    refused(&["--contact", "glue"], &["glue", "stick"]);
    refused(&["--contact", "slip:2"], &["2", "0.05 to 0.8"]);
    refused(&["--offset-mm", "5.3,0"], &["offset is 5.3", "up to 5"]);
    refused(
        &["--contact", "slip:9"],
        &["friction ratio is 9", "0.05 to 0.8"],
    );
    refused(&["--offset-mm", "1"], &["--offset-mm", "0.1,-0.2"]);
    refused(
        &[&stuck[..], &["--offset-mm", "1,0"]].concat(),
        &["offset is 1 mm", "0.25"],
    );
    refused(&["--solver", "half"], &["half", "reduced", "full"]);
}
