//! Tests `hivtac twin`: it answers every command as a device does, and its forces are true.

use crate::run::*;
use crate::view::client::View;
use hivtac_host::clock::Clock;
use hivtac_host::grip::Reading;
use hivtac_host::grip::geometry::Geometry;
use hivtac_host::grip::pair::Pair;
use hivtac_host::recording::Recording;
use hivtac_wire::message::DeviceMessage;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Child;

const MODEL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../calibration/models/default.hvtm"
);

/// A press that stays, at a place and with a tilt.
const PRESSED: &str = "[film]\noffset_mm = [1.5, -1.0]\n[load]\nmotion = \"press\"\n[load.press]\n\
                       force_n = 0.12\nalpha_deg = 5.0\nbeta_deg = -4.0\nstart_s = 0.0\n\
                       rise_s = 0.05\nhold_s = 600.0\n";

/// A twin in a folder of its own; ended when it is dropped.
struct Twin {
    run: Option<Run>,
    port: String,
    folder: tempfile::TempDir,
}

impl Twin {
    fn of(arguments: &[&str]) -> Twin {
        Twin::in_folder(tempfile::tempdir().unwrap(), arguments)
    }

    fn in_folder(folder: tempfile::TempDir, arguments: &[&str]) -> Twin {
        let mut run = start(&[&["twin"], arguments].concat());
        let ready = first_line(run.child());
        let port = match ready.strip_prefix("ready tcp=") {
            Some(address) => format!("tcp:{address}"),
            None => ready.strip_prefix("ready pty=").expect("a port").to_owned(),
        };
        Twin {
            run: Some(run),
            port,
            folder,
        }
    }

    /// A twin that is pressed as `PRESSED` says and logs the truth; with the log's path.
    fn pressed(arguments: &[&str]) -> (Twin, String) {
        let folder = tempfile::tempdir().unwrap();
        let [scene, truth] = ["press.toml", "truth.jsonl"].map(|name| text(&folder, name));
        std::fs::write(&scene, PRESSED).unwrap();
        let own = ["--scene", &scene, "--truth", &truth];
        (Twin::in_folder(folder, &[&own, arguments].concat()), truth)
    }

    /// Runs a command on it.
    fn run(&self, arguments: &[&str]) -> Finished {
        run(&[arguments, &["--port", &self.port, "--timeout", "10"]].concat())
    }

    /// Runs a command that must succeed; returns its output.
    fn done(&self, arguments: &[&str]) -> String {
        let run = self.run(arguments);
        assert_eq!(run.code, Some(0), "{arguments:?}: {}", run.stderr);
        run.stdout
    }

    /// The samples of a command that prints JSON lines.
    fn samples(&self, arguments: &[&str]) -> Vec<Value> {
        let lines = self.done(&[&["monitor", "--json"], arguments].concat());
        let lines = lines
            .lines()
            .map(|line| serde_json::from_str(line).unwrap());
        lines.collect()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&self.done(&[arguments, &["--json"]].concat())).unwrap()
    }
}

impl Drop for Twin {
    fn drop(&mut self) {
        if let Some(mut run) = self.run.take() {
            let child = run.child();
            // Fails only if it has already ended.
            let _ = kill_process(Pid::from_child(child), Signal::TERM);
            let _ = child.wait();
        }
    }
}

fn text(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

fn first_line(child: &mut Child) -> String {
    let mut line = String::new();
    let stdout = child.stdout.as_mut().unwrap();
    BufReader::new(stdout).read_line(&mut line).unwrap();
    line.trim_end().to_owned()
}

#[test]
fn a_twin_answers_as_a_device_does() {
    let twin = Twin::of(&["--scene", "rest"]);
    let info = twin.json(&["info"]);
    assert_eq!(info["board"], "twin + ov7725");
    assert_eq!(info["model"]["source"], "built-in");
    let health = twin.json(&["self-test"]);
    assert_eq!(health["good"], true, "{health}");
    let tared = twin.done(&["tare"]);
    assert!(tared.contains("tare"), "{tared}");
    twin.done(&["settings", "set", "name", "thumb"]);
    twin.done(&["settings", "set", "contact", "flat:2"]);
    twin.done(&["settings", "set", "rate", "78"]);
    let settings = twin.done(&["settings", "get"]);
    for line in [
        "thumb",
        "78 frames a second",
        "a rigid face of 2 mm radius",
        "taken",
    ] {
        assert!(settings.contains(line), "{line}: {settings}");
    }
    twin.done(&["settings", "reset"]);
    let settings = twin.done(&["settings", "get"]);
    assert!(settings.contains("156 frames a second"), "{settings}");
    assert!(!settings.contains("thumb"), "{settings}");
    twin.done(&["expose"]);
}

#[test]
fn a_twin_keeps_what_it_is_reported_to_keep() {
    let twin = Twin::of(&["--scene", "rest"]);
    twin.done(&["tare", "--keep"]);
    let settings = twin.done(&["settings", "get"]);
    assert!(settings.contains("taken (kept)"), "{settings}");
    let other = ["threshold", "--hsv", "170,10,90,255,45,255"];
    twin.done(&other);
    let settings = twin.done(&["settings", "get"]);
    assert!(settings.contains("V 45–255 (until restart)"), "{settings}");
}

#[test]
fn a_twin_sends_the_frame_that_it_senses() {
    let twin = Twin::of(&["--scene", "rest"]);
    let [raw, png] = ["frame.pam", "frame.png"].map(|name| text(&twin.folder, name));
    let said = twin.done(&["snapshot", &png, "--raw", &raw]);
    assert!(said.contains("320"), "{said}");
    let sensed = run(&["sense", &raw, "--json"]);
    assert_eq!(sensed.code, Some(0), "{}", sensed.stderr);
    // The camera then sends other pixels; the rest position of the former is forgotten.
    twin.done(&["tare"]);
    let lines = twin.samples(&["--frames", "5"]);
    assert!(!status(&lines[4]).contains(&"tare_missing"), "{lines:?}");
    twin.done(&["threshold", "--cr", "162"]);
    let lines = twin.samples(&["--frames", "5"]);
    let seen = status(&lines[4]);
    assert!(seen.contains(&"model_mismatch"), "{seen:?}");
    twin.done(&["snapshot", &png]);
}

fn status(sample: &Value) -> Vec<&str> {
    let names = sample["status"].as_array().unwrap().iter();
    names.map(|name| name.as_str().unwrap()).collect()
}

#[test]
fn a_twin_takes_models_that_fit_it() {
    let twin = Twin::of(&["--scene", "rest"]);
    let sent = twin.done(&["update", "model", MODEL]);
    assert!(sent.contains("in use and kept"), "{sent}");
    assert_eq!(twin.json(&["info"])["model"]["source"], "kept");
    twin.done(&["update", "model", "--built-in"]);
    assert_eq!(twin.json(&["info"])["model"]["source"], "built-in");
    let other = MODEL.replace("default.hvtm", "mt9v034/default.hvtm");
    let refused = twin.run(&["update", "model", &other]);
    assert_eq!(refused.code, Some(6), "{refused:?}");
    assert!(
        refused.stderr.contains("for another camera than ov7725"),
        "{}",
        refused.stderr
    );
    assert_eq!(twin.json(&["info"])["model"]["source"], "built-in");
}

#[test]
fn a_twin_of_eight_dots_tells_all_of_them_and_names_another_model() {
    let twin = Twin::of(&["--scene", "rest", "--layout", "8v"]);
    assert_eq!(twin.json(&["info"])["model"]["markers"], 8);
    let tared = twin.json(&["tare"]);
    assert_eq!(tared["markers"].as_array().unwrap().len(), 8, "{tared}");
    let [table, bag] = ["rest.csv", "rest.mcap"].map(|name| text(&twin.folder, name));
    for file in [&table, &bag] {
        twin.done(&["record", file, "--seconds", "0.3"]);
    }
    let rows = std::fs::read_to_string(&table).unwrap();
    let (header, last) = (rows.lines().next(), rows.lines().last());
    assert!(header.unwrap().ends_with("x7_px,y7_px,area7_px"), "{rows}");
    assert!(!last.unwrap().ends_with(','), "{rows}");
    assert!(std::fs::metadata(&bag).unwrap().len() > 10_000);

    let focus = twin.done(&["focus"]);
    assert!(
        focus.contains("  7   ") && focus.contains("all is right"),
        "{focus}"
    );
    twin.done(&["update", "model", MODEL]);
    let samples = twin.samples(&["--frames", "20"]);
    let last = samples.last().unwrap();
    assert!(last["force"].is_null(), "{last}");
    let status = last["status"].as_array().unwrap();
    assert!(status.contains(&"another_layout".into()), "{last}");
}

/// Returns |sensed − true| over the stated standard uncertainty, of |F|, both angles and both
/// coordinates of the place.
fn ratios(sample: &Value, truth: &Value) -> Vec<f64> {
    let force = &sample["force"];
    let number = |value: &Value| value.as_f64().unwrap();
    let one_axis = std::f64::consts::FRAC_1_SQRT_2;
    let ratio = |name: &str, sigma: &str, part: f64| {
        (number(&force[name]) - number(&truth[name])).abs() / (part * number(&force[sigma]))
    };
    vec![
        ratio("magnitude_n", "magnitude_sigma_n", 1.0),
        ratio("alpha_deg", "direction_sigma_deg", one_axis),
        ratio("beta_deg", "direction_sigma_deg", one_axis),
        ratio("place_x_mm", "place_sigma_mm", 1.0),
        ratio("place_y_mm", "place_sigma_mm", 1.0),
    ]
}

/// Returns the lines of a truth log by their frames.
fn truths(log: &str) -> HashMap<u64, Value> {
    let lines = std::fs::read_to_string(log).unwrap();
    let lines = lines
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    lines
        .map(|line| (line["frame"].as_u64().unwrap(), line))
        .collect()
}

/// A tip wanders, as the error of one place alone may be larger than its σ.
#[test]
fn forces_of_presses_are_within_three_sigma_of_the_truth() {
    for camera in ["ov7725", "ov5640", "mt9v034"] {
        let folder = tempfile::tempdir().unwrap();
        let [scene, log] = ["demo.toml", "truth.jsonl"].map(|name| text(&folder, name));
        let wanders = format!("[camera]\npreset = \"{camera}\"\n[load]\nmotion = \"demo\"\n");
        std::fs::write(&scene, wanders).unwrap();
        let own = ["--camera", camera, "--scene", &scene, "--truth", &log];
        let twin = Twin::in_folder(folder, &own);
        twin.done(&["settings", "set", "contact", "needle"]);
        let samples = twin.samples(&["--frames", "300"]);
        let truths = truths(&log);
        let pressed = samples
            .iter()
            .filter(|sample| sample["force"]["place_x_mm"].is_number());
        let ratios: Vec<f64> = pressed
            .map(|sample| (sample, &truths[&sample["frame"].as_u64().unwrap()]))
            .filter(|(_, truth)| truth["place_x_mm"].is_number())
            .flat_map(|(sample, truth)| ratios(sample, truth))
            .collect();
        assert!(ratios.len() > 5 * 200, "{camera}: {}", ratios.len());
        let within = ratios.iter().filter(|ratio| **ratio < 3.0).count();
        // 99.7 % of a normal distribution.
        assert!(
            within * 100 >= ratios.len() * 99,
            "{camera}: {within} of {}",
            ratios.len()
        );
    }
}

#[test]
fn frames_come_at_the_cameras_rate() {
    for (camera, hz) in [("ov7725", 156.1), ("ov5640", 119.1), ("mt9v034", 231.9)] {
        let twin = Twin::of(&["--camera", camera]);
        let samples = twin.samples(&["--seconds", "2"]);
        let time = |sample: &Value| 1e-6 * sample["time_us"].as_f64().unwrap();
        let frame = |sample: &Value| sample["frame"].as_f64().unwrap();
        let (first, last) = (&samples[0], &samples[samples.len() - 1]);
        let rate = (frame(last) - frame(first)) / (time(last) - time(first));
        assert!((rate - hz).abs() < 0.5, "{camera}: {rate}");
    }
}

#[test]
fn disturbances_are_seen() {
    let seen = |arguments: &[&str]| {
        let (twin, _) = Twin::pressed(arguments);
        let samples = twin.samples(&["--frames", "60"]);
        let last = &samples[59];
        status(last)
            .into_iter()
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let has = |names: &[String], name: &str| names.iter().any(|it| it == name);
    let usual = seen(&[]);
    assert!(!has(&usual, "markers_implausible"), "{usual:?}");
    let glare = seen(&["--glare"]);
    assert_ne!(glare, usual);
    let dim = seen(&["--dim", "0.1"]);
    assert!(
        has(&dim, "image_dark") || has(&dim, "frame_disturbed"),
        "{dim:?}"
    );
}

/// Another unit has its own number, and another rest position than the model's.
#[test]
fn units_are_drawn_by_their_number() {
    let place = |unit: &str| {
        let twin = Twin::of(&["--scene", "rest", "--unit", unit]);
        let id = twin.json(&["info"])["device_id"]
            .as_str()
            .unwrap()
            .to_owned();
        twin.done(&["tare"]);
        (id, twin.json(&["settings", "get"])["tare"].clone())
    };
    let (seventh, again, eighth) = (place("7"), place("7"), place("8"));
    assert_eq!(seventh.0, again.0);
    assert_ne!(seventh.0, eighth.0);
    assert_ne!(seventh.1, eighth.1);
}

/// A calibrated unit has its model at once, and its dots rest where that has them.
#[test]
fn a_calibrated_unit_goes_by_its_own_model() {
    let (twin, _) = Twin::pressed(&["--unit", MODEL]);
    let samples = twin.samples(&["--frames", "20"]);
    let force = &samples[19]["force"];
    let true_values = [
        ("magnitude_n", 0.12),
        ("place_x_mm", 1.5),
        ("place_y_mm", -1.0),
    ];
    for (name, expected) in true_values {
        let found = force[name].as_f64().unwrap();
        assert!((found - expected).abs() < 0.05 * expected.abs(), "{force}");
    }
    let status = status(&samples[19]);
    assert!(!status.contains(&"rest_moved"), "{status:?}");
}

#[test]
fn a_recorded_course_is_pressed_again() {
    let folder = tempfile::tempdir().unwrap();
    let course = text(&folder, "course.csv");
    let rows = "time_us,x_n,y_n,z_n\n0,0,0,-0.1\n100000,0,0,-0.1\n";
    std::fs::write(&course, rows).unwrap();
    let twin = Twin::in_folder(folder, &["--scene", "rest", "--course", &course]);
    let samples = twin.samples(&["--frames", "40"]);
    let force = samples[39]["force"]["magnitude_n"].as_f64().unwrap();
    assert!((force - 0.1).abs() < 0.005, "{force}");
}

/// A course with both of two contacts, as `monitor --csv` writes them, presses with both.
#[test]
fn a_course_of_two_contacts_is_reported_as_two() {
    let folder = tempfile::tempdir().unwrap();
    let course = text(&folder, "course.csv");
    let of = |number: u32| {
        ["x_n", "y_n", "z_n", "place_x_mm", "place_y_mm"]
            .map(|name| format!(",contact{number}_{name}"))
            .concat()
    };
    let row = "0,0,-0.11,0,0,-0.05,-2.5,1,0,0,-0.06,1.5,-0.5\n";
    let rows = format!("time_s,x_n,y_n,z_n{}{}\n0,{row}1,{row}", of(1), of(2));
    std::fs::write(&course, rows).unwrap();
    let twin = Twin::in_folder(folder, &["--layout", "8v", "--course", &course]);
    twin.done(&["settings", "set", "contact", "needle"]);
    let samples = twin.samples(&["--frames", "300"]);
    let last = &samples[299];
    assert!(status(last).contains(&"two_contacts"), "{last}");
    let mut contacts = last["contacts"].as_array().unwrap().clone();
    contacts.sort_by_key(|contact| contact["place_x_mm"].as_f64().map(|x| (1e3 * x) as i64));
    assert_eq!(contacts.len(), 2, "{last}");
    for (contact, (x, force)) in contacts.iter().zip([(-2.5, 0.05), (1.5, 0.06)]) {
        assert!(
            (contact["place_x_mm"].as_f64().unwrap() - x).abs() < 0.3,
            "{contact}"
        );
        assert!(
            (contact["magnitude_n"].as_f64().unwrap() - force).abs() < 0.01,
            "{contact}"
        );
    }
}

#[test]
fn a_pseudo_terminal_serves_one_host_after_the_other() {
    let folder = tempfile::tempdir().unwrap();
    let link = text(&folder, "sensor");
    let twin = Twin::in_folder(folder, &["--pty", &link]);
    assert_eq!(twin.port, link);
    let samples = twin.samples(&["--frames", "20"]);
    assert_eq!(samples.len(), 20);
    assert_eq!(twin.samples(&["--frames", "20"]).len(), 20);
    assert_eq!(twin.json(&["info"])["board"], "twin + ov7725");
}

/// The exit code and message of a twin that does not start.
fn refused(arguments: &[&str]) -> (Option<i32>, String) {
    let run = run(&[&["twin"], arguments].concat());
    (run.code, run.stderr)
}

#[test]
fn what_cannot_be_simulated_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, contents: &str| {
        std::fs::write(folder.path().join(name), contents).unwrap();
        text(&folder, name)
    };
    let unknown_key = file("key.toml", "[load]\nmotoin = \"rest\"\n");
    let large = file("large.toml", "[camera]\nwidth = 640\nheight = 480\n");
    let course = file("course.csv", "time_s,x_n,y_n,z_n\n0,a,0,0\n");
    let twin = Twin::of(&["--scene", "rest"]);
    let (_, taken) = twin.port.rsplit_once(':').unwrap();
    let missing = folder.path().join("none.toml").display().to_string();
    for (arguments, code, words) in [
        (["--scene", "dance"], 1, "unknown scene `dance`"),
        (["--scene", &missing], 1, "none.toml"),
        (["--scene", &unknown_key], 1, "motoin"),
        (["--scene", &large], 1, "640 × 480"),
        (["--course", &course], 1, "line 2: \"a\" is not a number"),
        (["--unit", "0"], 2, "from 1 to 1000000"),
        (["--unit", &missing], 1, "none.toml"),
        (["--dim", "9"], 2, "from 0.05 to 2"),
        (["--listen", taken], 1, "choose another with --listen"),
    ] {
        let (got, said) = refused(&arguments);
        assert!(
            got == Some(code) && said.contains(words),
            "{arguments:?}: {got:?} {said}"
        );
    }
    let without = run(&["view", "--scene", "demo"]);
    assert_eq!(without.code, Some(2), "{without:?}");
    assert!(without.stderr.contains("--twin"), "{}", without.stderr);
}

#[test]
fn a_twin_has_no_loader() {
    let twin = Twin::of(&["--scene", "rest"]);
    let file = text(&twin.folder, "firmware.bin");
    let image = hivtac_wire::image::examples::image("weact-h743", "1.2", 5_000, 1);
    std::fs::write(&file, image.bytes()).unwrap();
    let refused = twin.run(&["update", "firmware", &file]);
    assert_eq!(refused.code, Some(6), "{refused:?}");
    assert!(
        refused.stderr.contains("a twin has no loader"),
        "{}",
        refused.stderr
    );
    assert_eq!(twin.json(&["info"])["board"], "twin + ov7725");
}

/// Two fingers press an object from both sides as `PRESSED` says: the force straight in squeezes,
/// and the part along x pulls both; the second finger's y is turned over.
#[test]
fn two_twins_are_a_grip() {
    let (thumb, _) = Twin::pressed(&[]);
    let folder = tempfile::tempdir().unwrap();
    let scene = text(&folder, "press.toml");
    let camera = "[camera]\npreset = \"mt9v034\"\n";
    std::fs::write(&scene, [camera, PRESSED].concat()).unwrap();
    let index = Twin::in_folder(folder, &["--scene", &scene, "--camera", "mt9v034"]);
    thumb.done(&["settings", "set", "name", "thumb"]);
    index.done(&["settings", "set", "name", "index"]);
    let fingers = format!("{},{}", thumb.port, index.port);
    let shown = run(&["grip", &fingers, "--json", "--seconds", "2"]);
    assert_eq!(shown.code, Some(0), "{}", shown.stderr);
    let grips: Vec<Value> = (shown.stdout.lines())
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert!(grips.len() > 20, "{}", grips.len());
    let last = grips.last().unwrap();
    assert_eq!(
        (&last["cause"], &last["contact"]),
        (&Value::Null, &true.into()),
        "{last}"
    );
    assert!(last["status"]["thumb"].is_array() && last["status"]["index"].is_array());
    let held = &last["grip"];
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{last}"));
    let [alpha, beta] = [5.0_f64, -4.0].map(f64::to_radians);
    let [x, z] = [
        0.12 * alpha.sin() * beta.cos(),
        -0.12 * alpha.cos() * beta.cos(),
    ];
    let near = |found: f64, wanted: f64, sigma: f64| {
        assert!(
            (found - wanted).abs() < 4.0 * sigma,
            "{found} for {wanted} ± {sigma}: {last}"
        );
    };
    near(number(&held["force_n"]), -z, number(&held["force_sigma_n"]));
    for (axis, wanted) in [2.0 * x, 0.0, 0.0].into_iter().enumerate() {
        let [found, sigma] = ["common_n", "common_sigma_n"].map(|it| number(&held[it][axis]));
        near(found, wanted, sigma);
    }
    let pull = x.hypot(0.12 * beta.sin());
    near(
        number(&held["margin_n"]),
        -0.5 * z - pull,
        number(&held["margin_sigma_n"]),
    );
    assert!(shown.stderr.contains("latency: p50"), "{}", shown.stderr);
}

/// The first finger's page shows the grip of both.
#[test]
fn two_twins_are_a_grip_on_the_page() {
    let [(thumb, _), (index, _)] = [Twin::pressed(&[]), Twin::pressed(&[])];
    thumb.done(&["settings", "set", "name", "thumb"]);
    index.done(&["settings", "set", "name", "index"]);
    let fingers = format!("{},{}", thumb.port, index.port);
    let view = View::with(&[], &["--grip", &fingers]);
    let squeezed = "grip of thumb and index: 1";
    let says = |state: &Value| state["grip"].as_str().map(str::to_owned);
    let is_known = |state: &Value| says(state).is_some_and(|it| it.starts_with(squeezed));
    let reported = says(&view.events().state(0, is_known)).unwrap();
    assert!(
        reported.contains(" mN; margin ") && reported.contains(" mN; together "),
        "{reported}"
    );
    assert_eq!(view.events().state(1, |_| true)["grip"], Value::Null);
}

#[test]
fn a_grip_needs_two_fingers_and_its_file() {
    let twin = Twin::of(&["--scene", "rest"]);
    let port = &twin.port;
    let alone = run(&["grip", port]);
    assert_eq!(alone.code, Some(2));
    assert!(
        alone.stderr.contains("two fingers are needed"),
        "{}",
        alone.stderr
    );
    let other = Twin::of(&["--scene", "rest", "--camera", "mt9v034"]);
    let file = text(&twin.folder, "poses.json");
    let fingers = format!("{port},{}", other.port);
    let missing = run(&["grip", &fingers, "--poses", &file]);
    assert_eq!(missing.code, Some(1));
    assert!(missing.stderr.contains("cannot read"), "{}", missing.stderr);
    std::fs::write(&file, "{}").unwrap();
    let empty = run(&["grip", &fingers, "--poses", &file]);
    let why = "poses.json: it is no geometry of a grip: missing field `fingers`";
    assert!(empty.stderr.contains(why), "{}", empty.stderr);
}

/// Recorded grips are those that come of both sensors' recorded samples, on one clock.
#[test]
fn a_grip_is_recorded_beside_its_sensors() {
    let twin = Twin::of(&["--scene", "rest"]);
    let other = Twin::of(&["--scene", "rest", "--camera", "mt9v034"]);
    let fingers = format!("{},{}", twin.port, other.port);
    let recorded = text(&twin.folder, "grip.mcap");
    let run = run(&["record", &recorded, "--grip", &fingers, "--seconds", "1"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let recorded_forces = numbers_of(&recorded, "/hivtac/grip/force");
    assert!(recorded_forces.len() > 20, "{}", recorded_forces.len());
    let units = [&twin, &other].map(|it| it.json(&["info"])["device_id"].clone());
    let forces = forces_of_both(&recorded, &units.map(|it| it.as_str().unwrap().to_owned()));
    // By their bits: unknown numbers are NaN.
    let bits = |forces: Vec<f64>| forces.into_iter().map(f64::to_bits).collect::<Vec<_>>();
    assert_eq!(bits(forces), bits(recorded_forces));
}

/// The numbers of a topic with numbers alone.
fn numbers_of(file: &str, topic: &str) -> Vec<f64> {
    let bytes = std::fs::read(file).unwrap();
    let messages = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap);
    let of_topic = messages.filter(|message| message.channel.topic == topic);
    // Behind the encoding.
    let number = |message: mcap::Message| message.data[4..].try_into().map(f64::from_le_bytes);
    of_topic.map(|message| number(message).unwrap()).collect()
}

/// The grip forces by a file's samples of two sensors.
fn forces_of_both(file: &str, units: &[String; 2]) -> Vec<f64> {
    let mut all = Vec::new();
    for (finger, unit) in units.iter().enumerate() {
        let (mut recording, _) = Recording::open(Path::new(file), Some(unit)).unwrap();
        while let Some((came_ns, message)) = recording.next_message().unwrap() {
            all.push((came_ns, finger, message));
        }
    }
    all.sort_by_key(|(came_ns, ..)| *came_ns);
    let mut clocks = [Clock::default(), Clock::default()];
    let mut pair = Pair::new(Geometry::default());
    let mut forces = Vec::new();
    for (came_ns, finger, message) in all {
        match message {
            DeviceMessage::Stats(stats) => clocks[finger].latency(stats.latency_us),
            DeviceMessage::Sample(sample) => {
                let stamp_ns = clocks[finger].stamp_ns(sample.time_us, came_ns);
                let grips = pair.push(finger, Reading::of(&sample, stamp_ns, came_ns));
                forces.extend(
                    grips
                        .iter()
                        .map(|it| it.held.map_or(f64::NAN, |it| it.force)),
                );
            }
            _ => (),
        }
    }
    forces
}
