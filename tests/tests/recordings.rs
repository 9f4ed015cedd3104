//! Tests of a recording of the firmware on the rig: readers from PyPI can read it, and it can be
//! played.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::rig::{Rig, json_lines, tool};
use hivtac_tests::artifact;
use serde_json::Value;

/// Duration of a recording in seconds of this computer; the rig's seconds pass more slowly.
const SECONDS: &str = "12";

fn record(file: &Path) -> Rig {
    let rig = Rig::start(&["--scene", "demo"]).unwrap();
    let output = tool(
        &rig,
        "record",
        &["--seconds", SECONDS, file.to_str().unwrap()],
    )
    .unwrap();
    assert_eq!(output.code, Some(0), "{output:?}");
    rig
}

/// Returns the JSON lines of `monitor` on a recording that is played.
fn played(file: &Path, frames: usize) -> Vec<Value> {
    let mut replay = Command::new(artifact::named_by("HIVTAC_TOOL"))
        .args(["replay", "--fast", file.to_str().unwrap()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    let stdout = replay.stdout.take().unwrap();
    BufReader::new(stdout).read_line(&mut said).unwrap();
    let port = said.trim().replace("ready tcp=", "tcp:");
    let monitor = Command::new(artifact::named_by("HIVTAC_TOOL"))
        .args([
            "monitor",
            "--json",
            "--port",
            &port,
            "--frames",
            &frames.to_string(),
        ])
        .output()
        .unwrap();
    assert!(replay.wait().unwrap().success());
    json_lines(&String::from_utf8(monitor.stdout).unwrap()).unwrap()
}

#[test]
#[ignore = "slow, and needs PyPI's packages: run by cargo xtask test --all"]
fn a_recording_is_read_by_pypis_readers_and_played_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("demo.mcap");
    drop(record(&file));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let environment = root.join("../target/python-mcap");
    let read = Command::new("python3")
        .arg(root.join("python/read_mcap.py"))
        .args([&environment, &file])
        .output()
        .unwrap();
    assert!(
        read.status.success(),
        "{}",
        String::from_utf8_lossy(&read.stderr)
    );
    let read: Value = serde_json::from_slice(&read.stdout).unwrap();
    assert_eq!(
        (&read["profile"], &read["markers"]),
        (&"ros2".into(), &4.into())
    );
    assert_eq!(read["frame_id"], "hivtac_film");
    let samples: usize = read["summary"]["samples"]
        .as_str()
        .unwrap()
        .parse()
        .unwrap();
    let wrenches = read["counts"]["geometry_msgs/msg/WrenchStamped"]
        .as_u64()
        .unwrap();
    assert!(samples > 10 && wrenches as usize + 5 > samples, "{read}");
    assert_eq!(read["summary"]["samples_lost_on_the_way"], "0");
    // A recording that is cut anywhere can be read up to the cut.
    let cut: Vec<u64> = serde_json::from_value(read["cut"].clone()).unwrap();
    assert!(cut.is_sorted() && cut[9] > 0, "{cut:?}");

    let lines = played(&file, samples);
    assert_eq!(lines.len(), samples);
    let force = &lines
        .iter()
        .rev()
        .find(|line| line["force"].is_object())
        .unwrap()["force"];
    for (axis, name) in ["x_n", "y_n", "z_n"].into_iter().enumerate() {
        let (kept, shown) = (read["force_n"][axis].as_f64(), force[name].as_f64());
        assert!(
            (kept.unwrap() - shown.unwrap()).abs() < 1e-9,
            "{name}: {kept:?} {shown:?}"
        );
    }
}

/// Checks the firmware's own rate against limits: the virtual board has no loss.
#[test]
fn the_firmware_passes_a_check_and_an_impossible_one_fails() {
    let rig = Rig::start(&["--scene", "demo"]).unwrap();
    let options: Vec<_> = "--json --seconds 4 --min-rate 156 --max-loss 0"
        .split(' ')
        .collect();
    let output = tool(&rig, "check", &options).unwrap();
    assert_eq!(output.code, Some(0), "{output:?}");
    let report = &json_lines(&output.out).unwrap()[0];
    let rate = report["rate_hz"].as_f64().unwrap();
    assert!((rate - 156.12).abs() < 0.1, "{report}");
    drop(rig);
    let rig = Rig::start(&["--scene", "demo"]).unwrap();
    let output = tool(&rig, "check", &["--seconds", "2", "--min-rate", "157"]).unwrap();
    assert_eq!(output.code, Some(7), "{output:?}");
    assert!(
        output.err.contains("samples a second, below 157"),
        "{output:?}"
    );
}
