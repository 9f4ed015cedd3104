//! Tests recordings with a gauge at a serial port, and Ctrl-C.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;

use super::fake::*;

/// Both ends of a new pseudo-terminal, and its name.
pub fn pseudo_terminal() -> (File, File, String) {
    let gauge = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)
        .unwrap();
    rustix::pty::grantpt(&gauge).unwrap();
    rustix::pty::unlockpt(&gauge).unwrap();
    let name = rustix::pty::ptsname(&gauge, Vec::new()).unwrap();
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let host = rustix::fs::open(&name, flags, Mode::empty()).unwrap();
    (gauge.into(), host.into(), name.into_string().unwrap())
}

/// Plays a gauge that shows the pressing force 0.15 s late, with an occasional spoilt line, until
/// `end`.
fn play(mut gauge: File, begun: Instant, end: Arc<AtomicBool>) {
    let mut count = 0;
    while !end.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(10));
        let force = press_n(begun.elapsed().as_secs_f64() - 0.15);
        count += 1;
        let line = if count % 50 == 0 {
            "+0.0".to_owned() + "?\r\n"
        } else {
            format!("{force:+.4}N\r\n")
        };
        if gauge.write_all(line.as_bytes()).is_err() {
            return;
        }
    }
}

/// Frames in which the hand presses and lets go often enough for clocks to be aligned.
const FRAMES: usize = 400;

/// Waits until a recording holds this number of samples.
fn wait_for_samples(here: &Path, count: usize) {
    let file = here.join("unit/samples.csv");
    let lines = || std::fs::read_to_string(&file).map_or(0, |text| text.lines().count());
    let end = Instant::now() + Duration::from_secs(60);
    while lines() < count {
        assert!(Instant::now() < end, "{} lines in a minute", lines());
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_gauge_at_a_port_is_heard_and_ctrl_c_loses_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let begun = Instant::now();
    let clock = move || {
        std::thread::sleep(Duration::from_millis(10));
        begun.elapsed().as_secs_f64()
    };
    let sensor = FakeSensor::start(Box::new(clock), usize::MAX);
    let (gauge, _held, name) = pseudo_terminal();
    let end = Arc::<AtomicBool>::default();
    let player = std::thread::spawn({
        let end = end.clone();
        move || play(gauge, begun, end)
    });
    let arguments = [
        "collect",
        "record",
        "--into",
        "unit",
        "--port",
        &sensor.port,
        "--gauge-port",
        &name,
        "--rest-seconds",
        "0.5",
        "--seconds",
        "600",
    ];
    let mut child = start(here, &arguments);
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"\n0 0\n").unwrap();
    wait_for_samples(here, FRAMES);
    let status = Command::new("kill")
        .args(["-s", "INT", &child.id().to_string()])
        .status();
    assert!(status.unwrap().success());
    let output = child.wait_with_output().unwrap();
    let said = std::fs::read_to_string(here.join("said")).unwrap();
    end.store(true, Ordering::Relaxed);
    player.join().unwrap();
    assert!(
        !output.status.success() && said.contains("the same command goes on"),
        "{said}"
    );

    let align: Vec<_> = "collect align --recording unit --out data.csv"
        .split(' ')
        .collect();
    let report = stdout(run(here, &align, ""));
    let lag: f64 = report
        .split("clock is ")
        .nth(1)
        .unwrap()
        .split(' ')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    // A busy computer adds some milliseconds on either side.
    assert!((0.1..0.2).contains(&lag), "{report}");
    assert!(
        report.contains("gauge lines were not used (no reading"),
        "{report}"
    );
}

/// A gauge set to a different output would waste ten loads.
#[test]
fn a_gauge_that_sends_no_readings_ends_the_guide_at_once() {
    let sends = |line: &'static str, words: &[&str]| {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        let begun = Instant::now();
        let clock = move || {
            std::thread::sleep(Duration::from_millis(5));
            begun.elapsed().as_secs_f64()
        };
        let sensor = FakeSensor::start(Box::new(clock), usize::MAX);
        let (mut gauge, _held, name) = pseudo_terminal();
        let end = Arc::<AtomicBool>::default();
        let player = std::thread::spawn({
            let end = end.clone();
            move || {
                while !end.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_millis(20));
                    let _ = gauge.write_all(line.as_bytes());
                }
            }
        });
        let unit = ["unit", "--into", "unit", "--port", &sensor.port];
        let more = ["--gauge-port", &name, "--rest-seconds", "0.3"];
        let load = ["--seconds", "0.5"];
        let (output, said) = run(here, &[&unit[..], &more, &load].concat(), "\n\n\n\n");
        end.store(true, Ordering::Relaxed);
        player.join().unwrap();
        assert!(!output.status.success(), "{said}");
        for words in words {
            assert!(said.contains(words), "no {words}: {said}");
        }
        assert!(!said.contains("Load 2"), "{said}");
        let takes = std::fs::read_to_string(here.join("unit/takes.csv")).unwrap();
        assert!(takes.lines().count() <= 2, "{takes}");
    };
    let unreadable = [
        "the first such line is `ID FX-50` (no reading)",
        "--gauge-unit",
    ];
    sends("ID FX-50\r\n", &unreadable);
    sends("", &["sends nothing", "--gauge-ask", "Load 1"]);
}
