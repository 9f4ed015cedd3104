//! Tests readers of a device's UART, on which it only sends.

use crate::fake::*;
use crate::run::*;
use hivtac_wire::message::*;

/// A device that is in the middle of a frame when somebody listens.
fn sending(numbers: std::ops::Range<u32>) -> Script {
    Box::new(move |device| {
        device.raw(&[1, 2, 3, 0]);
        device.send(DeviceMessage::Hello(hello()));
        for sample in samples(numbers) {
            device.send(sample);
        }
        while device.next().is_some() {}
    })
}

#[test]
fn its_samples_are_shown_and_it_is_asked_nothing() {
    let device = FakeDevice::on_tcp([sending(0..3)]);
    let port = format!("uart:{}", device.port);
    let run = run(&["monitor", "--port", &port, "--csv", "--frames", "3"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert_eq!(run.stdout.lines().count(), 1 + 3);
    assert!(run.stderr.contains("3 received, 0 lost"), "{}", run.stderr);
    assert!(run.stderr.contains("rejected here: 0"), "{}", run.stderr);
    assert_eq!(device.commands.iter().count(), 0);
}

/// On a serial port, from the first hello on that comes whole.
#[test]
fn a_reader_joins_at_any_time() {
    let device = FakeDevice::on_pty(Box::new(|device| {
        for number in 0.. {
            device.send(DeviceMessage::Hello(hello()));
            device.send(sample(number, number));
            std::thread::sleep(std::time::Duration::from_millis(5));
            if device.host_is_gone {
                return;
            }
        }
    }));
    let port = format!("uart:{}", device.port);
    let run = run(&["monitor", "--port", &port, "--csv", "--frames", "5"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stderr.contains("5 received, 0 lost"), "{}", run.stderr);
}

/// As all that read samples do: it asks for them, and once more at its end.
#[test]
fn a_recording_needs_no_answer() {
    let device = FakeDevice::on_tcp([sending(0..9)]);
    let port = format!("uart:{}", device.port);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.csv");
    let file = file.to_str().unwrap();
    let run = run(&["record", file, "--port", &port, "--seconds", "0.5"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert_eq!(
        std::fs::read_to_string(file).unwrap().lines().count(),
        1 + 9
    );
    assert_eq!(device.commands.iter().count(), 0);
}

#[test]
fn what_needs_an_answer_is_refused() {
    let device = FakeDevice::on_tcp([sending(0..0)]);
    let port = format!("uart:{}", device.port);
    let run = run(&["tare", "--port", &port]);
    assert_eq!(run.code, Some(6), "{}", run.stderr);
    let why = format!(
        "cannot ask the device over {port}: \"tare\": it only sends samples there; use its USB port"
    );
    assert!(run.stderr.contains(&why), "{}", run.stderr);
}

/// Another program's bytes, or another rate.
#[test]
fn a_line_without_a_hello_is_no_sensor() {
    let device = FakeDevice::on_tcp([Box::new(|device: &mut Conversation| {
        device.raw(b"hello, robot\n");
        while device.next().is_some() {}
    })]);
    let port = format!("uart:{}", device.port);
    let run = run(&["monitor", "--port", &port, "--timeout", "0.3"]);
    assert_eq!(run.code, Some(3), "{}", run.stderr);
    assert!(run.stderr.contains("no hello from uart:"), "{}", run.stderr);
}
