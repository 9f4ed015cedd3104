//! Tests that the firmware in the rig, through the host tool, gives the same forces as the sensing
//! on this computer for the camera's frames.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use crate::rig::{Rig, ToolOutput, exposed, json_lines, tool};
use hivtac_sensor::force::model::Model;
use hivtac_sensor::motion::Motion;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::ByteOrder;
use hivtac_tests::artifact;
use hivtac_twin::{Format, Options, Preset, Scene};
use serde_json::{Value, json};

const SEED: u64 = 1;
/// A frame of the OV7725 has 278 lines, and each exposes a row. One of the OV5640 has 467; 441 of
/// these expose 240 rows.
const OV7725: Motion = Motion::rolling(278);
const OV5640: Motion = Motion::rolling(254);

/// A sensor on this computer with the firmware's model and the shape of a new device.
fn sensor_of(model: &[u8], motion: Motion) -> Box<Sensor<'_>> {
    let model = Model::parse(model).unwrap();
    let mut sensor = Box::new(Sensor::<64>::new());
    let settings = model.conditions.settings(ByteOrder::Native);
    sensor.configure(settings, Some(model)).unwrap();
    sensor.set_motion(motion);
    sensor.set_contact_shape(ContactShape::default());
    sensor
}

fn model_file(name: &str) -> Vec<u8> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    fs::read(root.join("calibration/models").join(name)).unwrap()
}

/// Returns the expected values in `monitor --json` for a measurement, in the integers of the force.
fn expected(measurement: &Measurement) -> Value {
    let force = measurement.force.map(|force| {
        let [x, y, z] = force.cartesian.map(|component| component.0);
        let place = force.place;
        json!([
            force.alpha.0,
            force.beta.0,
            force.magnitude.0,
            x,
            y,
            z,
            force.direction_sigma.0,
            force.magnitude_sigma.0,
            place.map(|place| place.x.0),
            place.map(|place| place.y.0),
            place.map(|place| place.sigma.0),
        ])
    });
    let contact = (measurement.force).map(|_| measurement.status.contains(Status::CONTACT));
    let status = measurement.status.names().collect::<Vec<_>>();
    json!({ "force": force, "contact": contact, "status": status })
}

/// Returns the same values from a line of the tool.
fn said(line: &Value) -> Value {
    let force = &line["force"];
    let integer = |key: &str, unit: f64| match force[key].as_f64() {
        Some(value) => json!((value * unit).round() as i64),
        None => Value::Null,
    };
    let force = force.is_object().then(|| {
        json!([
            integer("alpha_deg", 1e3),
            integer("beta_deg", 1e3),
            integer("magnitude_n", 1e6),
            integer("x_n", 1e6),
            integer("y_n", 1e6),
            integer("z_n", 1e6),
            integer("direction_sigma_deg", 1e3),
            integer("magnitude_sigma_n", 1e6),
            integer("place_x_mm", 1e3),
            integer("place_y_mm", 1e3),
            integer("place_sigma_mm", 1e3),
        ])
    });
    // Slip does not follow from one frame alone.
    let names = line["status"].as_array().unwrap().iter();
    let status: Vec<_> = names.filter(|name| *name != "slip").collect();
    json!({ "force": force, "contact": line["contact"], "status": status })
}

/// Returns the host tool's lines for the next frames of a rig.
fn monitor(rig: &Rig, frames: usize) -> Vec<Value> {
    let output = tool(rig, "monitor", &["--json", "--frames", &frames.to_string()]).unwrap();
    assert_eq!(output.code, Some(0), "{output:?}");
    let lines = json_lines(&output.out).unwrap();
    assert_eq!(lines.len(), frames);
    lines
}

/// Frames that the device may have measured before its first sample's frame.
const EARLIER: u64 = 4;

/// Compares every line of the host tool with the sensing on this computer, which measures the same
/// frames from one of the first on.
fn check_forces(rig: &Rig, lines: &[Value], scene: &Scene, model: &[u8], motion: Motion) {
    let truth = rig.truth().unwrap();
    let shown: HashMap<u64, &Value> = truth
        .iter()
        .map(|line| (line["frame"].as_u64().unwrap(), line))
        .collect();
    let number = |line: &Value| line["frame"].as_u64().unwrap();
    let (first, last) = (number(&lines[0]), number(&lines[lines.len() - 1]));
    let frames: HashMap<u64, Vec<u16>> = (first.saturating_sub(EARLIER)..=last)
        .filter_map(|frame| Some((frame, exposed(scene, shown.get(&frame)?).pixels)))
        .collect();
    let follows_from = |earlier: u64| {
        let mut sensor = sensor_of(model, motion);
        for frame in first - earlier..=last {
            let pixels = frames.get(&frame).ok_or("no such frame")?;
            // The motion in the first frame is unknown. For that reason it may get a second look.
            let measured = match frame == first - earlier && earlier > 0 {
                true => sensor.measure_frame_closely(pixels),
                false => sensor.measure_frame(pixels),
            };
            if let Some(line) = lines.iter().find(|line| number(line) == frame) {
                follows(&said(line), &expected(&measured))?;
            }
        }
        Ok::<(), String>(())
    };
    let found: Vec<_> = (0..=EARLIER.min(first)).map(follows_from).collect();
    assert!(found.iter().any(Result::is_ok), "{found:#?}");
}

/// Checks that a sample has the values of its frame alone, with uncertainties that are not smaller:
/// the device adds the film's possible creep by earlier frames.
fn follows(said: &Value, measured: &Value) -> Result<(), String> {
    const SIGMAS: [usize; 3] = [6, 7, 10];
    let reported = |value: &Value| {
        let mut value = value.clone();
        let mut sigmas = Vec::new();
        if let Some(force) = value["force"].as_array_mut() {
            sigmas.extend(SIGMAS.map(|at| force[at].take().as_i64()));
        }
        (value, sigmas)
    };
    let ((said_rest, said_sigmas), (rest, sigmas)) = (reported(said), reported(measured));
    let as_certain = said_sigmas.iter().zip(&sigmas).all(|(a, b)| a >= b);
    match said_rest == rest && as_certain {
        true => Ok(()),
        false => Err(format!("{said} of a frame with {measured}")),
    }
}

/// Runs a scene and compares every line of the host tool with the sensing on this computer. Returns
/// the lines.
fn compare(name: &str, preset: Preset, frames: usize) -> Vec<Value> {
    let seed = SEED.to_string();
    let options = ["--scene", name, "--seed", &seed, "--preset", preset.name()];
    let rig = Rig::start(&options).unwrap();
    let lines = monitor(&rig, frames);
    let scene = Scene::preset(name, preset, 320, 240, SEED).unwrap();
    check_forces(&rig, &lines, &scene, &model_file("default.hvtm"), OV7725);
    check_counting(&lines);
    rig.finish().unwrap();
    lines
}

/// Checks that nothing was lost: sequence, frame and time continue without a gap.
fn check_counting(lines: &[Value]) {
    let number = |line: &Value, key: &str| line[key].as_u64().unwrap();
    for pair in lines.windows(2) {
        let step = |key| number(&pair[1], key) - number(&pair[0], key);
        assert_eq!((step("seq"), step("frame")), (1, 1), "{pair:?}");
        // 156.12 frames a second; the error of an edge's time stamp is less than 50 µs.
        assert!(step("time_us").abs_diff(6_405) < 50, "{pair:?}");
    }
}

#[test]
fn a_moving_tip_gives_the_same_forces() {
    let lines = compare("demo", Preset::Ov7725, 16);
    // The first frame may have no predecessor; it is then measured as it is seen.
    let sizes = lines[1..].iter().map(|line| {
        let size = line["force"]["magnitude_n"].as_f64();
        size.unwrap_or_else(|| panic!("every frame of the demo has a force: {line}"))
    });
    let (low, high) = sizes.fold((f64::MAX, f64::MIN), |(l, h), size| {
        (l.min(size), h.max(size))
    });
    assert!(high - low > 0.02, "the force changes: {low} to {high} N");
}

/// The firmware learns at its set-up which camera is there, and when its rows are exposed. The
/// scene has an OV7725's noise, which is known in the first frames.
#[test]
fn another_camera_has_rows_at_its_own_times() {
    let text = format!("seed = {SEED}\n[load]\nmotion = \"demo\"\n");
    let rig = Rig::start_under(&text, &["--camera", "ov5640"]).unwrap();
    let lines = monitor(&rig, 16);
    let scene = Scene::from_toml(&text).unwrap();
    let model = model_file("default.hvtm");
    check_forces(&rig, &lines, &scene, &model, OV5640);
    assert!(forces_but_one(&lines), "{lines:?}");
    rig.finish().unwrap();
}

#[test]
fn another_camera_geometry_gives_the_same_results() {
    // The markers of this geometry are smaller and closer to each other than the model's.
    compare("static", Preset::Paper, 4);
}

/// Runs `hivtac threshold`, which must succeed.
fn set_threshold(rig: &Rig, options: &[&str]) -> ToolOutput {
    let output = tool(rig, "threshold", options).unwrap();
    assert_eq!(output.code, Some(0), "{output:?}");
    output
}

/// Returns the number of lines with a force, and of those with a model made for other conditions.
fn forces_and_mismatches(lines: &[Value]) -> (usize, usize) {
    let mismatch = json!("model_mismatch");
    let says_so = |line: &&Value| line["status"].as_array().unwrap().contains(&mismatch);
    let has_force = |line: &&Value| line["force"].is_object();
    (
        lines.iter().filter(has_force).count(),
        lines.iter().filter(says_so).count(),
    )
}

/// Returns whether all lines except the first have forces by their own model. For the first, the
/// markers' speed during its exposure is unknown.
fn forces_but_one(lines: &[Value]) -> bool {
    let (forces, mismatches) = forces_and_mismatches(lines);
    mismatches == 0 && lines[1..].iter().all(|line| line["force"].is_object()) && forces > 0
}

/// Firmware with a model for YUV422 begins in that format, changes to RGB565 on command, and
/// returns to it.
#[test]
#[ignore = "12 s"]
fn the_pixel_format_is_chosen_while_frames_are_measured() {
    const FRAMES: usize = 5;
    let elf = artifact::named_by("HIVTAC_BUG_ELFS").join("yuv422.elf");
    let seed = SEED.to_string();
    let rig = Rig::start_with(&elf, &["--scene", "demo", "--seed", &seed]).unwrap();
    let scene = Scene::preset("demo", Preset::Ov7725, 320, 240, SEED).unwrap();
    let options = Options {
        format: Format::Yuv422,
        ..scene.options().clone()
    };
    let scene = scene.with_options(options).unwrap();
    let model = model_file("yuv422/default.hvtm");

    let first = monitor(&rig, FRAMES);
    check_forces(&rig, &first, &scene, &model, OV7725);
    assert!(forces_but_one(&first), "{first:?}");

    let output = set_threshold(&rig, &["--hsv", "170,10,100,255,45,255"]);
    assert!(output.err.contains("made for yuv422"), "{output:?}");
    assert_eq!(forces_and_mismatches(&monitor(&rig, FRAMES)), (0, FRAMES));

    let output = set_threshold(&rig, &["--cr", "162"]);
    assert_eq!(output.out, "threshold set: yuv422, Cr 162–255\n");
    let mut last = monitor(&rig, FRAMES);
    // Frames that passed during the camera's set-up are not part of the sensing.
    for line in &mut last {
        let status = line["status"].as_array_mut().unwrap();
        status.retain(|name| name != "frame_dropped");
    }
    check_forces(&rig, &last, &scene, &model, OV7725);
    assert!(forces_but_one(&last), "{last:?}");

    let output = tool(&rig, "threshold", &["--luma", "0,88"]).unwrap();
    assert_eq!(output.code, Some(6), "{output:?}");
    assert!(output.err.contains("does not send that pixel format"));
    rig.finish().unwrap();
}
