//! Tests updates of a device's model.

use crate::fake::*;
use crate::run::*;
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_wire::message::*;
use hivtac_wire::settings::Selection;
use serde_json::Value;
use std::time::Duration;

const MODEL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../calibration/models/default.hvtm"
);

fn file() -> Vec<u8> {
    std::fs::read(MODEL).unwrap()
}

fn crc() -> u32 {
    let file = file();
    u32::from_le_bytes(file[file.len() - 4..].try_into().unwrap())
}

/// A device that reports this model after an update.
fn device(source: ModelSource, crc: u32, outcome: Outcome) -> FakeDevice {
    let script: Script = Box::new(move |device| {
        while let Some(message) = device.next() {
            match message {
                HostMessage::Command(Command {
                    id,
                    request: Request::UseModel,
                }) if outcome != Outcome::Done => {
                    device.send(DeviceMessage::Log(LogLine {
                        level: LogLevel::Error,
                        time_us: 2_000_000,
                        text: "the model was calibrated on another unit"
                            .try_into()
                            .unwrap(),
                    }));
                    device.reply(id, outcome);
                }
                HostMessage::Command(Command {
                    id,
                    request: Request::GetInfo,
                }) => {
                    let mut hello = hello();
                    let model = hello.model.as_mut().unwrap();
                    (model.source, model.crc) = (source, crc);
                    device.send(DeviceMessage::Hello(hello));
                    device.reply(id, Outcome::Done);
                }
                message => device.answer_to(message),
            }
        }
    });
    FakeDevice::on_tcp([script])
}

#[test]
fn a_model_is_sent_in_parts_and_its_use_read_back() {
    let device = device(ModelSource::Kept, crc(), Outcome::Done);
    let run = run(&["update", "model", MODEL, "--port", &device.port]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let start = format!(
        "in use and kept: 11-64-64-3 ov7725, CRC {:08x}, after ",
        crc()
    );
    assert!(run.stdout.starts_with(&start), "{}", run.stdout);
    let asked: Vec<Request> = device.commands.try_iter().collect();
    let bytes = file().len() as u32;
    assert_eq!(asked[0], Request::BeginModel { bytes });
    assert_eq!(asked.last(), Some(&Request::UseModel));
    let mut sent: Vec<u8> = Vec::new();
    for request in &asked[1..asked.len() - 1] {
        let Request::ModelPart(part) = request else {
            panic!("{request:?}");
        };
        assert_eq!(part.offset as usize, sent.len());
        sent.extend(&part.bytes);
    }
    assert_eq!(sent, file());
}

#[test]
fn an_update_as_json() {
    let device = device(ModelSource::Kept, crc(), Outcome::Done);
    let run = run(&["update", "model", MODEL, "--json", "--port", &device.port]);
    let value: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(value["model"]["crc"], format!("{:08x}", crc()));
    assert_eq!(value["model"]["source"], "kept");
    assert!(value["seconds"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_model_that_the_device_refuses_is_reported_with_its_reason() {
    let device = device(ModelSource::BuiltIn, 1, Outcome::AnotherSensor);
    let run = run(&["update", "model", MODEL, "--port", &device.port]);
    assert_eq!(run.code, Some(6));
    for part in ["calibrated on another unit", "for another sensor"] {
        assert!(run.stderr.contains(part), "{}", run.stderr);
    }
}

/// The tool ended its wait for an update that the device still carries out. It says how to see the
/// result, and a new attempt meanwhile gets the advice to wait.
#[test]
fn an_update_that_is_not_answered_may_be_done_all_the_same() {
    let script: Script = Box::new(|device| {
        device.answer_one();
        while let Some(message) = device.next() {
            if let HostMessage::Command(Command { id, request }) = message
                && matches!(request, Request::BeginModel { .. })
            {
                device.reply(id, Outcome::Busy);
            }
        }
    });
    let device = FakeDevice::on_tcp([script]);
    let patience = Duration::from_secs(2);
    let (mut link, _) = Link::connect(&Address::parse(&device.port), patience).unwrap();
    for (request, hint) in [
        (Request::UseModel, "`hivtac info` which model it uses"),
        (Request::UseBuiltInModel, "`hivtac info` which model"),
        (Request::Reset, "wait 10 s"),
        (Request::Keep(Selection::ALL), "`hivtac settings get`"),
        (Request::BeginModel { bytes: 4 }, "wait 10 s and try again"),
    ] {
        let failure = link.request(request, Duration::from_millis(50), |_| ());
        let message = failure.unwrap_err().to_string();
        assert!(message.contains(hint), "{message}");
    }
}

#[test]
fn a_device_that_uses_another_model_all_the_same_is_an_error() {
    let device = device(ModelSource::Fallback, 1, Outcome::Done);
    let run = run(&["update", "model", MODEL, "--port", &device.port]);
    assert_eq!(run.code, Some(6));
    assert!(run.stderr.contains("uses another model"), "{}", run.stderr);
}

#[test]
fn the_built_in_model_is_taken_back() {
    let device = device(ModelSource::BuiltIn, 0xcafe, Outcome::Done);
    let run = run(&["update", "model", "--built-in", "--port", &device.port]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let asked: Vec<Request> = device.commands.try_iter().collect();
    assert_eq!(asked, [Request::UseBuiltInModel]);
}

/// Before anything is sent: there is no device here.
#[test]
fn a_file_that_is_no_model_is_named_with_what_is_wrong() {
    let directory = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = directory.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let mut damaged = file();
    damaged[5_000] ^= 1;
    let cases = [
        (write("damaged.hvtm", &damaged), "damaged"),
        (write("text.hvtm", b"hello"), "text.hvtm: "),
        (
            write("large.hvtm", &vec![0; 163_841]),
            "at most 163840 bytes",
        ),
        (
            directory.path().join("none").display().to_string(),
            "none: ",
        ),
    ];
    for (path, word) in cases {
        let run = run(&["update", "model", &path, "--port", "tcp:127.0.0.1:1"]);
        assert_eq!(run.code, Some(1), "{word}: {}", run.stderr);
        assert!(run.stderr.contains(word), "{word}: {}", run.stderr);
    }
}
