//! Tests an update of the firmware: the loader's start, and the report about the device afterwards.

use crate::fake::*;
use crate::run::*;
use hivtac_wire::message::*;

/// A file that begins as a program does.
fn program(directory: &tempfile::TempDir) -> String {
    let path = directory.path().join("new.bin");
    let words = [0x2000_6000_u32, 0x0801_0101];
    std::fs::write(&path, words.map(u32::to_le_bytes).concat()).unwrap();
    path.to_str().unwrap().to_owned()
}

/// A device that goes away when it must start its loader.
fn until_loader(device: &mut Conversation) {
    while let Some(message) = device.next() {
        let starts = matches!(
            &message,
            HostMessage::Command(Command { request, .. }) if *request == Request::StartLoader
        );
        device.answer_to(message);
        if starts {
            return;
        }
    }
}

#[test]
fn the_version_is_told_before_and_after() {
    let directory = tempfile::tempdir().unwrap();
    let back: Script = Box::new(|device| {
        device.next();
        device.send(DeviceMessage::Hello(DeviceHello {
            firmware: "fake 1.1".try_into().unwrap(),
            ..hello()
        }));
    });
    let device = FakeDevice::on_tcp([Box::new(until_loader), back]);
    let file = program(&directory);
    let run = run(&["update", "firmware", &file, "--port", &device.port]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let command = format!("dfu-util -d 0483:df11 -a 0 -s 0x08000000:leave -D '{file}'\n");
    assert!(run.stdout.contains(&command), "{}", run.stdout);
    assert!(
        run.stdout.ends_with("firmware fake 1.1, was fake 1.0\n"),
        "{}",
        run.stdout
    );
}

#[test]
fn a_device_that_does_not_come_back_is_no_device() {
    let directory = tempfile::tempdir().unwrap();
    let device = FakeDevice::on_tcp([Box::new(until_loader)]);
    let file = program(&directory);
    let port = ["--port", &device.port, "--timeout", "0.2"];
    let run = run(&[&["update", "firmware", &file, "--wait", "1"], &port[..]].concat());
    assert_eq!(run.code, Some(3));
    assert!(
        run.stderr.contains("did not come back within 1 s"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_file_that_is_no_program_is_refused_before_the_device_is_asked() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("firmware");
    std::fs::write(&path, b"\x7fELF and more").unwrap();
    let path = path.to_str().unwrap();
    let run = run(&["update", "firmware", path, "--port", "tcp:127.0.0.1:1"]);
    assert_eq!(run.code, Some(1));
    assert!(run.stderr.contains("objcopy"), "{}", run.stderr);
}
