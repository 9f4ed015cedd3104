//! Tests of the rig's faults through the host tool: each leads to its documented status or counter,
//! and passes.

use crate::rig::{Rig, SILENCE_S, TIMEOUT_S, ToolOutput, json_lines, tool_waiting};
use serde_json::Value;

/// Watches a run with faults by `monitor --json`. Returns the tool's output, its lines, and the
/// rig's counters.
fn watch(faults: &[&str], options: &[&str]) -> (ToolOutput, Vec<Value>, Value) {
    watch_waiting(TIMEOUT_S, faults, options)
}

/// As [`watch`], with a cable that is pulled, after which no sample comes.
fn watch_pulled(options: &[&str]) -> (ToolOutput, Vec<Value>, Value) {
    watch_waiting(SILENCE_S, &["cable-pulled@300-700"], options)
}

fn watch_waiting(
    timeout_s: u32,
    faults: &[&str],
    options: &[&str],
) -> (ToolOutput, Vec<Value>, Value) {
    let mut rig_options = vec!["--scene", "static"];
    for fault in faults {
        rig_options.extend(["--fault", fault]);
    }
    let rig = Rig::start(&rig_options).unwrap();
    let options = [&["--json"], options].concat();
    let output = tool_waiting(&rig, timeout_s, "monitor", &options).unwrap();
    let lines = json_lines(&output.out).unwrap();
    let counters = rig.finish().unwrap();
    (output, lines, counters)
}

fn has_status(line: &Value, name: &str) -> bool {
    line["status"]
        .as_array()
        .is_some_and(|names| names.iter().any(|n| n == name))
}

/// Returns the number after `what` in the summary, as in `overrun 3`.
fn counter(output: &ToolOutput, what: &str) -> u64 {
    let rest = output
        .err
        .split_once(&format!("{what} "))
        .map(|(_, rest)| rest);
    let digits = rest.and_then(|rest| rest.split(|c: char| !c.is_ascii_digit()).next());
    let number = digits.and_then(|digits| digits.parse().ok());
    number.unwrap_or_else(|| panic!("no {what} in the summary: {}", output.err))
}

/// Checks that the last frames have forces again.
fn check_recovery(output: &ToolOutput, lines: &[Value]) {
    assert_eq!(output.code, Some(0), "{output:?}");
    let last = lines.last().expect("at least one line");
    assert!(last["force"].is_object(), "recovered: {last}");
    assert!(!has_status(last, "frame_dropped"), "recovered: {last}");
}

#[test]
fn a_silent_camera_is_started_again() {
    let (output, lines, _) = watch(&["camera-silent@300-400"], &["--frames", "60"]);
    check_recovery(&output, &lines);
    assert!(
        lines
            .iter()
            .any(|line| has_status(line, "camera_restarted")),
        "{lines:?}"
    );
    assert!(counter(&output, "camera timeouts") > 0, "{}", output.err);
    assert!(counter(&output, "restarts") > 0, "{}", output.err);
}

#[test]
fn an_overrun_costs_its_frame_and_no_more() {
    let (output, lines, _) = watch(&["dcmi-overrun@300-302"], &["--frames", "60"]);
    check_recovery(&output, &lines);
    assert!(
        lines.iter().any(|line| has_status(line, "capture_overrun")),
        "{lines:?}"
    );
    assert!(counter(&output, "overruns") > 0, "{}", output.err);
}

#[test]
fn a_host_that_does_not_read_loses_samples_and_the_camera_none() {
    // Longer than the device's own buffers last, shorter than the silence after which the monitor
    // asks.
    let (output, lines, _) = watch(&["host-not-reading@300-700"], &["--frames", "90"]);
    check_recovery(&output, &lines);
    assert!(counter(&output, "USB") > 0, "{}", output.err);
    let no_gap = "0 frames not processed";
    assert!(
        output.err.contains(no_gap),
        "the camera never waits: {}",
        output.err
    );
    let gap = lines.windows(2).any(|pair| {
        let step = |key: &str| pair[1][key].as_u64().unwrap() - pair[0][key].as_u64().unwrap();
        step("seq") > 1 && step("frame") == step("seq")
    });
    assert!(gap, "the loss is a gap in the sequence: {lines:?}");
}

#[test]
#[ignore = "12 s"]
fn a_pulled_cable_is_reported_and_survived() {
    let (output, lines, counters) = watch_pulled(&["--frames", "60", "--reconnect"]);
    check_recovery(&output, &lines);
    assert_eq!(counters["usb"]["enumerations"], 2, "{counters}");
    assert!(output.err.contains("connected again"), "{}", output.err);
}

#[test]
#[ignore = "25 s: as one that reconnects"]
fn a_pulled_cable_ends_a_monitor_that_does_not_reconnect() {
    let (output, ..) = watch_pulled(&["--frames", "60"]);
    assert_eq!(output.code, Some(5), "{output:?}");
}
