//! The firmware in the rig gives, through the host tool, the very forces that the sensing gives on this computer for the
//! frames that the camera has shown.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use hivtac_scene::{Preset, Scene};
use hivtac_sensing::model::Model;
use hivtac_sensing::pipeline::{Measurement, Sensor};
use hivtac_sensing::settings::Settings;
use hivtac_sensing::threshold::ByteOrder;
use hivtac_tests::rig::{Rig, json_lines, tool};
use serde_json::{Value, json};

const SEED: u64 = 5;

/// The sensing on this computer, with the model that the firmware carries.
fn on_this_computer(model: &[u8], pixels: &[u16]) -> Measurement {
    let model = Model::parse(model).unwrap();
    let mut sensor = Box::new(Sensor::<64>::new());
    let settings = Settings::of_model(&model, ByteOrder::Native);
    sensor.configure(settings, Some(model)).unwrap();
    sensor.begin_frame();
    pixels.chunks(320).for_each(|row| sensor.push_row(row));
    sensor.finish_frame()
}

fn model_file() -> Vec<u8> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    fs::read(root.join("calibration/models/default.hvtm")).unwrap()
}

/// What `monitor --json` must say of a measurement, in the integers that the force is made of.
fn expected(measurement: &Measurement) -> Value {
    let force = measurement.force.map(|force| {
        let vector = force
            .cartesian
            .map(|vector| vector.map(|component| component.0));
        json!([
            force.alpha.0,
            force.beta.0,
            force.magnitude.0,
            vector.map(|v| v[0]),
            vector.map(|v| v[1]),
            vector.map(|v| v[2]),
            force.direction_sigma.0,
            force.magnitude_sigma.0,
        ])
    });
    json!({ "force": force, "status": measurement.status.names().collect::<Vec<_>>() })
}

/// The same of a line that it said.
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
        ])
    });
    json!({ "force": force, "status": line["status"] })
}

/// Runs a scene and holds every line of the host tool against the sensing here. Gives the lines.
fn compare(name: &str, preset: Preset, frames: usize) -> Vec<Value> {
    let seed = SEED.to_string();
    let options = ["--scene", name, "--seed", &seed, "--preset", preset.name()];
    let rig = Rig::start(&options).unwrap();
    let output = tool(
        &rig,
        "monitor",
        &["--json", "--frames", &frames.to_string()],
    )
    .unwrap();
    assert_eq!(output.code, Some(0), "{output:?}\nrig: {}", rig.log());
    let lines = json_lines(&output.out).unwrap();
    assert_eq!(lines.len(), frames);
    let truth = rig.truth().unwrap();
    let shown: HashMap<u64, &Value> = truth
        .iter()
        .map(|line| (line["frame"].as_u64().unwrap(), line))
        .collect();
    let scene = Scene::preset(name, preset, 320, 240, SEED).unwrap();
    let model = model_file();
    for line in &lines {
        let exposure = shown[&line["frame"].as_u64().unwrap()];
        let number = exposure["exposure"].as_u64().unwrap();
        let frame = scene.frame(number, exposure["time_s"].as_f64().unwrap());
        assert_eq!(
            said(line),
            expected(&on_this_computer(&model, &frame.pixels)),
            "{line}"
        );
    }
    check_counting(&lines);
    rig.finish().unwrap();
    lines
}

/// Nothing was lost: sequence, frame and time go on without a gap.
fn check_counting(lines: &[Value]) {
    let number = |line: &Value, key: &str| line[key].as_u64().unwrap();
    for pair in lines.windows(2) {
        let step = |key| number(&pair[1], key) - number(&pair[0], key);
        assert_eq!((step("seq"), step("frame")), (1, 1), "{pair:?}");
        // 39.03 frames a second; an edge is stamped within 50 µs.
        assert!(step("time_us").abs_diff(25_620) < 50, "{pair:?}");
    }
}

#[test]
fn a_moving_tip_gives_the_same_forces() {
    let lines = compare("demo", Preset::Ov7725, 16);
    let forces = lines
        .iter()
        .filter(|line| line["force"].is_object())
        .count();
    assert_eq!(forces, lines.len(), "every frame of the demo has a force");
    let sizes = lines
        .iter()
        .map(|line| line["force"]["magnitude_n"].as_f64().unwrap());
    let (low, high) = sizes.fold((f64::MAX, f64::MIN), |(l, h), size| {
        (l.min(size), h.max(size))
    });
    assert!(high - low > 0.02, "the force changes: {low} to {high} N");
}

#[test]
fn another_camera_geometry_gives_the_same_results() {
    // The markers of this geometry are smaller and nearer to each other than the model's.
    compare("static", Preset::Paper, 4);
}
