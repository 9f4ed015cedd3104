//! Tests `hivtac self-test`.

use crate::fake::*;
use crate::run::*;
use hivtac_wire::health::{Health, Problem, ResetReason};
use serde_json::{Value, json};

fn device(health: Health) -> FakeDevice {
    FakeDevice::on_tcp([Box::new(move |device| {
        device.health = health;
        device.serve();
    })])
}

fn ill() -> FakeDevice {
    device(Health {
        reset: ResetReason::Watchdog,
        temperature_centidegrees: None,
        // A problem of a later version is ignored.
        problems: Problem::ModelFallback.bit() | Problem::WatchdogReset.bit() | 1 << 30,
        at_start: Problem::ModelFallback.bit() | Problem::CameraRegisters.bit(),
        ..HEALTHY
    })
}

#[test]
fn a_good_device_passes_its_self_test() {
    let run = run(&["self-test", "--port", &device(HEALTHY).port]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert_eq!(run.stdout.lines().count(), Problem::ALL.len());
    assert!(!run.stdout.contains("PROBLEM"), "{}", run.stdout);
}

#[test]
fn problems_are_reported_with_code_and_advice() {
    let run = run(&["self-test", "--port", &ill().port]);
    assert_eq!(run.code, Some(9));
    let problems: Vec<_> = run
        .stdout
        .lines()
        .filter(|l| l.contains("PROBLEM"))
        .collect();
    assert!(
        problems[0].starts_with(" 2  PROBLEM  model_fallback: "),
        "{problems:?}"
    );
    assert!(
        problems[1].starts_with(" 6  PROBLEM  watchdog_reset: "),
        "{problems:?}"
    );
    assert_eq!(problems.len(), 2);
    assert!(run.stderr.contains("2 of 14"), "{}", run.stderr);
    let gone = "10  good     camera_registers: not so at the start\n";
    assert!(run.stdout.contains(gone), "{}", run.stdout);
}

#[test]
fn a_self_test_as_json() {
    let run = run(&["self-test", "--json", "--port", &ill().port]);
    assert_eq!(run.code, Some(9));
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["good"], false);
    assert_eq!(
        report["problems"][1],
        json!({ "code": 6, "name": "watchdog_reset" })
    );
    assert_eq!(report["health"]["temperature_c"], Value::Null);
    let at_start = json!(["model_fallback", "camera_registers"]);
    assert_eq!(report["health"]["at_start"], at_start);
}

#[test]
fn info_names_problems() {
    let run = run(&["info", "--port", &ill().port]);
    let expected = "problems   model_fallback, watchdog_reset; ";
    assert!(run.stdout.contains(expected), "{}", run.stdout);
    let at_start = "at start   model_fallback, camera_registers\n";
    assert!(run.stdout.contains(at_start), "{}", run.stdout);
    assert!(
        run.stdout
            .contains("started by watchdog; temperature unknown")
    );
}
