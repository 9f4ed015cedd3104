//! Provokes each message that `docs/troubleshooting.md` quotes, and compares it with the page.

use crate::documents::{first_cells, root_file, row, section};
use crate::fake::*;
use crate::run::*;
use hivtac_terms::force::Force;
use hivtac_terms::status::Status;
use hivtac_wire::failure::{Failure, FailureKind};
use hivtac_wire::frame::encode;
use hivtac_wire::health::{BrownOut, Health, ResetReason};
use hivtac_wire::message::{DeviceHello, DeviceMessage, Outcome, Sample};
use serde_json::Value;
use std::io::Read;

fn page() -> String {
    root_file("docs/troubleshooting.md")
}

/// A device that serves any host, with something changed.
fn device(change: impl FnOnce(&mut Conversation) + Send + 'static) -> FakeDevice {
    FakeDevice::on_tcp([Box::new(move |device| {
        change(device);
        device.serve();
    })])
}

/// A sample with a status, and without a force where that says so.
fn with_status(number: u32, status: Status) -> DeviceMessage {
    let DeviceMessage::Sample(sample) = sample(number, number) else {
        unreachable!("it is a sample");
    };
    let has_force = !status.intersects(Status::NO_FORCE);
    let force: Option<Force> = sample.force.filter(|_| has_force);
    DeviceMessage::Sample(Sample {
        status,
        force,
        ..sample
    })
}

/// Each bit of the page comes as its name, and a sample has no force where the page says so.
#[test]
fn every_status_is_shown_by_its_name() {
    let page = page();
    let table = section(&page, "Status");
    let samples = (0..)
        .zip(Status::NAMES)
        .map(|(number, (bit, _))| with_status(number, *bit));
    let device = FakeDevice::on_tcp([streaming(samples.collect())]);
    let frames = Status::NAMES.len().to_string();
    let port = &device.port;
    let run = run(&["monitor", "--json", "--frames", &frames, "--port", port]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let mut names = Vec::new();
    for line in run.stdout.lines() {
        let sample: Value = serde_json::from_str(line).unwrap();
        let [name] = &sample["status"].as_array().unwrap()[..] else {
            panic!("one bit was set: {line}");
        };
        let name = format!("`{}`", name.as_str().unwrap());
        let [_, cause, _] = row(table, &name);
        assert_eq!(
            sample["force"].is_null(),
            cause.starts_with("no force: "),
            "{line}"
        );
        names.push(name);
    }
    assert_eq!(names, first_cells(table));
}

fn outcome(name: &str) -> Outcome {
    let text = match name {
        "Touched" => r#"{"Touched": {"looks_like": 1200}}"#.to_owned(),
        name => format!("\"{name}\""),
    };
    serde_json::from_str(&text).unwrap()
}

#[test]
fn every_refusal_is_said_in_the_words_of_the_page() {
    let page = page();
    let table = section(&page, "What a device refuses");
    let rows = first_cells(table);
    assert!(rows.len() > 10, "{rows:?}");
    for cell in rows {
        let outcome = outcome(cell.trim_matches('`'));
        let refusing = device(move |device| device.tare = Some(outcome));
        let run = run(&["tare", "--port", &refusing.port]);
        let [_, words, _] = row(table, &cell);
        let begin = format!("hivtac: the device refused \"tare\": {words}");
        assert!(run.stderr.starts_with(&begin), "{cell}: {}", run.stderr);
        assert_eq!(run.code, Some(6), "{cell}");
    }
}

/// A recording cannot be tared: no word of pixel formats.
#[test]
fn what_a_recording_cannot_do_is_said_so() {
    let refusing = device(|device| device.tare = Some(Outcome::Unsupported));
    let run = run(&["tare", "--port", &refusing.port]);
    assert!(
        run.stderr.contains("a recording only plays"),
        "{}",
        run.stderr
    );
    assert!(!run.stderr.contains("pixel format"), "{}", run.stderr);
}

#[test]
fn every_finding_of_a_self_test_is_named_with_its_code() {
    let page = page();
    let table = section(&page, "What a self-test finds");
    let health = Health {
        problems: u32::MAX,
        ..HEALTHY
    };
    let ill = device(move |device| device.health = health);
    let run = run(&["self-test", "--port", &ill.port]);
    assert_eq!(run.code, Some(9));
    let mut codes = Vec::new();
    for line in run.stdout.lines() {
        let (code, rest) = line.trim_start().split_once("  PROBLEM  ").unwrap();
        let mut cells = table
            .lines()
            .filter(|line| line.starts_with(&format!("| {code} |")));
        let reported = cells
            .next()
            .unwrap_or_else(|| panic!("the page lacks {line}"));
        let name = rest.split(':').next().unwrap();
        assert!(
            reported.starts_with(&format!("| {code} | `{name}` |")),
            "{reported}: {line}"
        );
        codes.push(code.to_owned());
    }
    assert_eq!(codes, first_cells(table));
}

/// `hivtac info` shows each kind of failure of the page, and no other; also a low supply that
/// resets nothing.
#[test]
fn every_kind_of_failure_is_reported_by_its_name() {
    let page = page();
    let table = first_cells(section(&page, "What `hivtac info` shows of a failure"));
    let mut named: Vec<_> = table.iter().flat_map(|cell| cell.split(", ")).collect();
    for kind in FailureKind::ALL {
        let failure = Failure {
            kind,
            starts_ago: 1,
            count: 1,
            program_counter: Some(0x0806_1234),
            link_register: None,
            address: None,
            fault_status: 0,
            exception: 0,
            place: Default::default(),
        };
        let failed = device(move |device| {
            device.health.failure = Some(failure);
            device.health.brown_out = BrownOut::Off;
        });
        let info = run(&["info", "--port", &failed.port]).stdout;
        let name = kind.name();
        assert!(
            info.contains(&format!("\n           {name}, address 0x08061234\n")),
            "{info}"
        );
        assert!(info.contains("no reset when it is low"), "{info}");
        named.retain(|cell| cell.trim_matches('`') != name);
    }
    assert!(named.is_empty(), "nothing tells {named:?}");
}

/// How a test provokes an exit code: the run that ends with it.
fn ending_with(code: &str) -> Finished {
    match code {
        "0" => run(&["completion", "bash"]),
        "1" => run(&["replay", "no-such-recording.mcap"]),
        "2" => run(&["monitor", "--no-such-option"]),
        "3" => run(&["info", "--port", "tcp:127.0.0.1:1"]),
        "4" => foreign(),
        "5" => lost(),
        "6" => {
            let refusing = device(|device| device.tare = Some(Outcome::Unsteady));
            run(&["tare", "--port", &refusing.port])
        }
        "7" => check(&["--min-rate", "1000"], 0..40),
        "8" => check(&["--max-loss", "0"], (0..20).chain(25..40)),
        "9" => {
            let health = Health {
                problems: 1,
                ..HEALTHY
            };
            let ill = device(move |device| device.health = health);
            run(&["self-test", "--port", &ill.port])
        }
        "130" => interrupted(),
        code => panic!("nothing provokes the exit code {code}"),
    }
}

/// A device of another version of the protocol.
fn foreign() -> Finished {
    let foreign = FakeDevice::on_tcp([Box::new(|device| {
        let schema = 0x1122_3344_5566_7788;
        let hello = DeviceHello { schema, ..hello() };
        let mut buffer = [0; 256];
        device.next();
        device.raw(encode(&DeviceMessage::Hello(hello), &mut buffer).unwrap());
        device.serve();
    })]);
    run(&["info", "--port", &foreign.port])
}

/// A device that goes away while it streams.
fn lost() -> Finished {
    let gone = FakeDevice::on_tcp([Box::new(|device| {
        assert!(device.until_start());
        device.send(sample(0, 0));
        device.end_after_what_was_sent();
    })]);
    run(&["monitor", "--port", &gone.port])
}

fn check(limit: &[&str], numbers: impl Iterator<Item = u32>) -> Finished {
    let samples = numbers.map(|number| sample(number, number)).collect();
    let device = FakeDevice::on_tcp([streaming(samples)]);
    let common = ["check", "--seconds", "0.3", "--port", &device.port];
    run(&[&common, limit].concat())
}

fn interrupted() -> Finished {
    let device = FakeDevice::on_tcp([streaming(samples(0..1))]);
    let mut monitor = start(&["monitor", "--json", "--port", &device.port]);
    let mut first = [0];
    let stdout = monitor.child().stdout.as_mut().unwrap();
    stdout.read_exact(&mut first).unwrap();
    signal(monitor.child().id(), "INT");
    monitor.finish()
}

#[test]
fn every_exit_code_is_provoked() {
    let page = page();
    let table = section(&page, "Exit codes of hivtac");
    let codes = first_cells(table);
    assert!(codes.len() > 10, "{codes:?}");
    for code in codes {
        let run = ending_with(&code);
        assert_eq!(run.code.map(|it| it.to_string()), Some(code), "{run:?}");
    }
}

/// Each pattern of the LED, and the name by which the tests of the flashed program in the rig
/// expect it.
const PATTERNS: [(&str, &str); 6] = [
    ("breathes, 4 s", "Pattern::Breathes(4.0)"),
    ("blinks once a second", "Pattern::Flashes(1, 1.0)"),
    ("blinks five times a second", "Pattern::Flashes(1, 0.2)"),
    (
        "three flashes every two seconds",
        "Pattern::Flashes(3, 2.0)",
    ),
    ("two flashes a second", "Pattern::Flashes(2, "),
    // No program runs.
    ("dark, or always lit", ""),
];

#[test]
fn every_pattern_of_the_led_is_seen_in_the_rig() {
    let page = page();
    let reported = first_cells(section(&page, "The LED"));
    assert_eq!(reported, PATTERNS.map(|(pattern, _)| pattern));
    let tests = root_file("twin/rig/tests/led.rs");
    for (pattern, expected) in PATTERNS {
        assert!(tests.contains(expected), "no test expects {pattern}");
    }
}

/// A message that the page quotes, with the tool's name before it.
fn saying(quoted: &str) -> String {
    match quoted {
        "cannot open /dev/ttyACM0: there is no such port" => {
            run(&["info", "--port", "/dev/ttyNOWHERE"])
                .stderr
                .replace("/dev/ttyNOWHERE", "/dev/ttyACM0")
        }
        "no hello from /dev/ttyACM0 within 2 s" => {
            let silent = FakeDevice::on_pty(Box::new(|device| while device.next().is_some() {}));
            let said = run(&["info", "--port", &silent.port]).stderr;
            said.replace(&silent.port, "/dev/ttyACM0")
        }
        "cannot open /dev/ttyACM0: Unable to acquire exclusive lock on serial port" => taken(),
        "connection to /dev/ttyACM0 lost" => {
            let gone = FakeDevice::on_pty(Box::new(|device| _ = device.until_start()));
            let said = run(&["monitor", "--port", &gone.port]).stderr;
            said.replace(&gone.port, "/dev/ttyACM0")
        }
        "no sensor found: no serial port has USB id 1209:0001" | "more than one sensor found" => {
            in_tests_of("host-tool/src/port.rs", quoted)
        }
        #[cfg(not(feature = "ros2"))]
        "this hivtac was built without ROS 2" => run(&["serve", "--ros2"]).stderr,
        #[cfg(feature = "ros2")]
        "this hivtac was built without ROS 2" => format!("hivtac: {quoted}"),
        "nothing else of ROS 2 is in domain" | "another node in domain" => {
            in_tests_of("tests/python/test_serve.py", quoted)
        }
        "cannot take part in ROS 2's domain" => in_tests_of("tests/python/test_zenoh.py", quoted),
        quoted => panic!("nothing provokes {quoted:?}"),
    }
}

/// The message of a second program on a port.
fn taken() -> String {
    let device = FakeDevice::on_pty(streaming(samples(0..1)));
    let mut first = start(&["monitor", "--json", "--port", &device.port]);
    let stdout = first.child().stdout.as_mut().unwrap();
    stdout.read_exact(&mut [0]).unwrap();
    let second = run(&["info", "--port", &device.port]).stderr;
    signal(first.child().id(), "INT");
    first.finish();
    second.replace(&device.port, "/dev/ttyACM0")
}

/// The tool's message, as other tests expect it: here no port can be plugged in, and ROS 2 is not
/// built.
fn in_tests_of(file: &str, quoted: &str) -> String {
    let source = root_file(file);
    let (_, tests) = source.split_once("#[cfg(test)]").unwrap_or(("", &source));
    let text: String = tests.split("\\\n").map(str::trim_start).collect();
    assert!(
        text.contains(quoted),
        "no test of {file} expects {quoted:?}"
    );
    format!("hivtac: {quoted}")
}

#[test]
fn what_the_page_quotes_is_said() {
    let page = page();
    let text = page.replace('\n', " ");
    let quotes: Vec<&str> = text
        .split("`hivtac: ")
        .skip(1)
        .map(|rest| rest.split('`').next().unwrap())
        .filter(|quoted| !quoted.starts_with("the device refused"))
        .collect();
    assert!(quotes.len() >= 4, "{quotes:?}");
    for quoted in quotes {
        let quoted = quoted.trim_end_matches(" …");
        let said = saying(quoted);
        assert!(
            said.contains(&format!("hivtac: {quoted}")),
            "{quoted:?}: {said}"
        );
    }
    let by_reset = Health {
        reset: ResetReason::Pin,
        ..HEALTHY
    };
    let started = device(move |device| device.health = by_reset);
    let info = run(&["info", "--port", &started.port]).stdout;
    let words = "started by reset-line";
    assert!(
        text.contains(&format!("`{words}`")) && info.contains(words),
        "{info}"
    );
}
