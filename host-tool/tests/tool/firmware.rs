//! Tests a firmware update without USB: files that are refused at once, and a loader that does not
//! appear. `src/firmware/tests.rs` has the rest.

use crate::fake::*;
use crate::run::*;
use hivtac_wire::image::examples;
use hivtac_wire::message::*;
use hivtac_wire::version::HelloPrefix;

const LENGTH: usize = 0x1000;

/// Writes an image for this board; returns its path.
fn image(directory: &tempfile::TempDir, board: &str) -> String {
    let image = examples::image(board, "1.1", LENGTH, 1);
    file(directory, image.bytes())
}

fn file(directory: &tempfile::TempDir, bytes: &[u8]) -> String {
    let path = directory.path().join("new.bin");
    std::fs::write(&path, bytes).unwrap();
    path.to_str().unwrap().to_owned()
}

fn is_start(message: &HostMessage) -> bool {
    let HostMessage::Command(Command { request, .. }) = message else {
        return false;
    };
    *request == Request::StartLoader
}

/// A device that goes away when it must start its loader.
fn until_loader(device: &mut Conversation) {
    while let Some(message) = device.next() {
        let starts = is_start(&message);
        device.answer_to(message);
        if starts {
            return;
        }
    }
}

#[test]
fn a_loader_that_does_not_appear_is_no_device() {
    let directory = tempfile::tempdir().unwrap();
    let device = FakeDevice::on_tcp([Box::new(until_loader)]);
    let file = image(&directory, "fake board");
    let port = ["--port", &device.port, "--wait", "0.5"];
    let run = run(&[&["update", "firmware", &file], &port[..]].concat());
    assert_eq!(run.code, Some(3));
    assert!(
        run.stderr.contains("did not appear with its loader"),
        "{}",
        run.stderr
    );
}

/// A device of another version ignores commands, and is asked by the frozen part of a hello.
#[test]
fn a_device_of_another_version_is_asked_for_its_loader() {
    let directory = tempfile::tempdir().unwrap();
    let answers = |wanted: HelloPrefix| -> Script {
        Box::new(move |device: &mut Conversation| {
            let Some(HostMessage::Hello(came)) = device.next() else {
                panic!("a hello is needed");
            };
            assert_eq!(came, wanted.into());
            let protocol = PROTOCOL_VERSION + 1;
            let other = DeviceHello {
                protocol,
                ..hello()
            };
            device.send(DeviceMessage::Hello(other));
            device.end_after_what_was_sent();
        })
    };
    let scripts = [HelloPrefix::OURS, HelloPrefix::START_LOADER].map(answers);
    let device = FakeDevice::on_tcp(scripts);
    let file = image(&directory, "fake board");
    let port = ["--port", &device.port, "--wait", "0.5"];
    let run = run(&[&["update", "firmware", &file], &port[..]].concat());
    assert_eq!(run.code, Some(3), "{}", run.stderr);
    assert!(
        run.stderr.contains("did not appear with its loader"),
        "{}",
        run.stderr
    );
}

#[test]
fn an_image_for_another_board_is_refused_and_the_device_goes_on() {
    let directory = tempfile::tempdir().unwrap();
    let script: Script = Box::new(|device: &mut Conversation| {
        while let Some(message) = device.next() {
            assert!(!is_start(&message), "nothing may happen to the device");
            device.answer_to(message);
        }
    });
    let device = FakeDevice::on_tcp([script]);
    let file = image(&directory, "another board");
    let run = run(&["update", "firmware", &file, "--port", &device.port]);
    assert_eq!(run.code, Some(1));
    let reported =
        "for the board another board, and the device is a fake board; give the firmware for";
    assert!(run.stderr.contains(reported), "{}", run.stderr);
}

#[test]
fn a_file_that_is_no_image_is_refused_before_the_device_is_asked() {
    let whole = examples::image("fake board", "1.1", LENGTH, 1);
    let mut damaged = whole.bytes().to_vec();
    *damaged.last_mut().unwrap() ^= 1;
    let cut = &whole.bytes()[..whole.bytes().len() - 100];
    let unsealed = examples::loaded("fake board", "1.1", LENGTH, 1);
    let cases: [(&[u8], &str); 6] = [
        (b"text", "no firmware of this sensor"),
        (b"", "no firmware of this sensor"),
        (b"\x7fELF and more", "an ELF that cannot be read"),
        (&damaged, "damaged: the checksum of its program"),
        (cut, "cut: it has"),
        (&unsealed, "give the ELF itself"),
    ];
    for (bytes, reported) in cases {
        let directory = tempfile::tempdir().unwrap();
        let path = file(&directory, bytes);
        let run = run(&["update", "firmware", &path, "--port", "tcp:127.0.0.1:1"]);
        assert_eq!(run.code, Some(1));
        assert!(run.stderr.contains(&path), "{}", run.stderr);
        assert!(run.stderr.contains(reported), "{}", run.stderr);
    }
}

#[test]
fn a_device_that_is_nowhere_is_no_device() {
    let directory = tempfile::tempdir().unwrap();
    let file = image(&directory, "fake board");
    let run = run(&["update", "firmware", &file, "--port", "tcp:127.0.0.1:1"]);
    assert_eq!(run.code, Some(3), "{}", run.stderr);
}
