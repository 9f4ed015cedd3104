//! Tests of snapshots from the firmware in the rig, through the host tool: the tool's own sensing
//! finds in them what the device found, bit for bit.

use crate::rig::{Rig, ToolOutput, json_lines, tool};
use hivtac_tests::artifact;
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::string::String;

/// Takes a raw snapshot of a rig.
fn take(rig: &Rig, raw: &Path) -> Value {
    let raw = raw.to_str().unwrap();
    let output = tool(rig, "snapshot", &["--json", "--raw", raw]).unwrap();
    assert_eq!(output.code, Some(0), "{output:?}");
    json_lines(&output.out).unwrap().remove(0)
}

/// Returns the results of `hivtac sense` on a file.
fn sense(options: &[&str]) -> Value {
    let output = Command::new(artifact::named_by("HIVTAC_TOOL"))
        .args(["sense", "--json"])
        .args(options)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    json_lines(&text).unwrap().remove(0)
}

#[test]
fn sense_finds_the_devices_own_markers_in_its_snapshot() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.pam");
    let rig = Rig::start(&["--scene", "demo", "--seed", "1"]).unwrap();
    let reported = take(&rig, &file);
    rig.finish().unwrap();
    let found = sense(&[file.to_str().unwrap()]);
    assert!(reported["markers"].is_array(), "{reported}");
    assert_eq!(reported["markers"], found["markers"]);
    assert_eq!(
        (&reported["width"], &reported["height"]),
        (&found["width"], &found["height"])
    );
}

/// In YUV422 as well, by the raw frame and the model for it.
#[test]
fn so_it_does_in_yuv422() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.pam");
    let elf = artifact::named_by("HIVTAC_BUG_ELFS").join("yuv422.elf");
    let rig = Rig::start_with(&elf, &["--scene", "demo", "--seed", "1"]).unwrap();
    let reported = take(&rig, &file);
    rig.finish().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let model = root.join("calibration/models/yuv422/default.hvtm");
    let found = sense(&["--model", model.to_str().unwrap(), file.to_str().unwrap()]);
    assert!(reported["markers"].is_array(), "{reported}");
    assert_eq!(reported["markers"], found["markers"]);
}

/// With the nominal sensor at rest, `focus` ends with its first picture.
#[test]
fn focus_finds_the_nominal_sensor_right() {
    let rig = Rig::start(&["--scene", "rest"]).unwrap();
    let output = tool(&rig, "focus", &["--json"]).unwrap();
    rig.finish().unwrap();
    assert_eq!(output.code, Some(0), "{output:?}");
    let lines = json_lines(&output.out).unwrap();
    assert_eq!((lines.len(), &lines[0]["right"]), (1, &true.into()));
    let checks = lines[0]["checks"].as_array().unwrap();
    assert_eq!(checks.len(), 23, "{checks:?}");
}

/// The device begins with a threshold that finds no marker. `threshold auto` finds one with which
/// the device has forces again.
#[test]
#[ignore = "6 s"]
fn a_wrong_threshold_is_mended() {
    let rig = Rig::start(&["--scene", "static", "--seed", "1"]).unwrap();
    let run = |command, options: &[&str]| {
        let output = tool(&rig, command, options).unwrap();
        assert_eq!(output.code, Some(0), "{output:?}");
        output.out
    };
    let forces = || {
        let lines = run("monitor", &["--json", "--frames", "8"]);
        let lines = json_lines(&lines).unwrap();
        lines
            .iter()
            .filter(|line| line["force"].is_object())
            .count()
    };
    run("threshold", &["--hsv", "80,100,100,255,45,255"]);
    assert_eq!(forces(), 0, "with a threshold for cyan dots");
    let reported = json_lines(&run("threshold auto", &["--json"]))
        .unwrap()
        .remove(0);
    assert_eq!(
        (&reported["is_of_model"], &reported["set"]),
        (&true.into(), &true.into()),
        "{reported}"
    );
    let level = |name: &str, which: &str| reported[name][which].as_u64().unwrap();
    let half_way = reported["half_way"]["saturation_low"].as_u64().unwrap();
    assert!(
        level("film", "high") < half_way && half_way < level("dots", "low"),
        "{reported}"
    );
    assert!(
        (0.005..0.015).contains(&reported["passed"].as_f64().unwrap()),
        "{reported}"
    );
    assert!(forces() >= 6, "forces are back");
    rig.finish().unwrap();
}

/// The camera sends nothing: the tool reports it, and writes no file.
#[test]
fn without_a_camera_it_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.pam");
    let rig = Rig::start(&["--scene", "static", "--fault", "camera-absent"]).unwrap();
    let path = file.to_str().unwrap();
    let output: ToolOutput = tool(&rig, "snapshot", &["--raw", path]).unwrap();
    rig.finish().unwrap();
    assert_eq!(output.code, Some(6), "{output:?}");
    assert!(output.err.contains("camera"), "{output:?}");
    assert!(!file.exists());
}
