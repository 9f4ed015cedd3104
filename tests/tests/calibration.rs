//! Tests the calibration of a unit against a gauge, from its first frame to its own model. The
//! firmware runs in the rig under a scene's press. The gauge has its own clock and shows the press
//! of the scene's tip.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::rig::Rig;
use hivtac_tests::artifact;

/// |F| in N, α and β in degrees: one press per run, held for 0.4 s.
const PRESSES: [[f64; 3]; 5] = [
    [0.025, 8.0, 0.0],
    [0.060, 0.0, 8.0],
    [0.100, -8.0, 0.0],
    [0.140, 0.0, -8.0],
    [0.200, 6.0, 5.0],
];

/// Runs `hivtac-calibrate` (`HIVTAC_CALIBRATE`) with lines on its standard input. Returns its
/// standard output.
fn calibrate(here: &Path, arguments: &[&str], lines: &str) -> String {
    let mut child = Command::new(artifact::named_by("HIVTAC_CALIBRATE"))
        .current_dir(here)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(lines.as_bytes())
        .unwrap();
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    println!("$ hivtac-calibrate {}\n{said}", arguments.join(" "));
    let output = String::from_utf8(output.stdout).unwrap();
    println!("{output}");
    output
}

/// Records the untouched film and one press, and the gauge's readings of it. `number` counts from
/// 0.
fn press(here: &Path, number: usize, [force_n, alpha, beta]: [f64; 3]) {
    let scene = here.join("press.toml");
    let text = format!(
        "seed = {number}\n[load]\nmotion = \"press\"\n[load.press]\nforce_n = {force_n}\nalpha_deg \
         = {alpha:?}\nbeta_deg = {beta:?}\n\
         start_s = 1.15\nrise_s = 0.35\nhold_s = 0.4\nfall_s = 0.35\n"
    );
    fs::write(&scene, text).unwrap();
    let rig = Rig::start(&["--scene", scene.to_str().unwrap()]).unwrap();
    let record = [
        "collect",
        "record",
        "--into",
        "unit",
        "--poses",
        "poses.csv",
        "--port",
        rig.port(),
        "--timeout",
        "60",
        "--rest-seconds",
        "0.3",
        "--seconds",
        "1.3",
    ];
    // This run takes the next pose of the list; the others are for later runs.
    calibrate(here, &record, "\n\ndone\n");
    let (ahead, gauge) = (
        format!("{}", 7.3 * number as f64 - 11.9),
        format!("gauge-{number}.csv"),
    );
    let truth = rig.truth_file();
    let simulate = [
        "collect",
        "simulate-gauge",
        "--truth",
        truth.to_str().unwrap(),
        "--ahead-s",
        &ahead,
        "--out",
        &gauge,
    ];
    calibrate(here, &simulate, "");
    rig.finish().unwrap();
}

/// Returns the number that follows `words` in the part of `text` after `group`.
fn number(text: &str, group: &str, words: &str) -> f64 {
    let part = text
        .split(group)
        .nth(1)
        .and_then(|part| part.split(words).nth(1));
    let part = part.unwrap_or_else(|| panic!("no `{words}` after `{group}` in {text}"));
    part.trim_start()
        .split(' ')
        .next()
        .unwrap()
        .parse()
        .unwrap()
}

#[test]
#[ignore = "slow: 330 frames in the rig"]
fn a_unit_gets_a_model_of_its_own() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let poses = PRESSES.map(|[_, alpha, beta]| format!("{alpha},{beta}\n"));
    fs::write(here.join("poses.csv"), poses.concat()).unwrap();
    for (i, one) in PRESSES.iter().enumerate() {
        press(here, i, *one);
    }
    let gauges: Vec<String> = (0..PRESSES.len())
        .map(|i| format!("gauge-{i}.csv"))
        .collect();
    let mut align = vec!["collect", "align", "--recording", "unit"];
    gauges
        .iter()
        .for_each(|gauge| align.extend(["--gauge", gauge.as_str()]));
    let report = calibrate(here, &[&align[..], &["--out", "data.csv"]].concat(), "");
    // Device time begins a little later than the rig's, by the same time in every run.
    let lag =
        |i: usize| number(&report, &format!("run {i}: "), "clock is") - (7.3 * i as f64 - 11.9);
    for i in 0..PRESSES.len() {
        assert!(
            (lag(i) - lag(0)).abs() < 0.006,
            "run {i}: {} and {} s",
            lag(i),
            lag(0)
        );
    }
    calibrate(
        here,
        &[&align[..], &["--holds", "--out", "loads.csv"]].concat(),
        "",
    );
    let weights = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../calibration/models/default.weights"
    );
    let unit = ["unit", "--weights", weights, "--data", "loads.csv"];
    let found = calibrate(here, &[&unit[..], &["--out", "unit.weights"]].concat(), "");
    assert!(found.contains("film's Young's modulus"), "{found}");
    calibrate(
        here,
        &["export", "--weights", "unit.weights", "--out", "unit.hvtm"],
        "",
    );
    let evaluate: Vec<_> = "evaluate --model unit.hvtm --data data.csv --out report.html"
        .split(' ')
        .collect();
    let judged = calibrate(here, &evaluate, "");
    let strong = "|F| ≥ 50 mN";
    let direction_deg = number(&judged, strong, "found and true force, °:");
    let force_mn = number(&judged, strong, "root mean square error of |F|, mN:");
    assert!(
        direction_deg < 0.6 && force_mn < 2.0,
        "{direction_deg}°, {force_mn} mN"
    );
}
