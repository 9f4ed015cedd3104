//! `hivtac monitor` when the device, the reader or the user goes away.

use crate::fake::*;
use crate::run::*;
use std::io::{BufRead, BufReader, Read};

#[test]
fn a_pulled_cable_is_an_error_after_the_summary() {
    let script = || -> Script {
        Box::new(|device| {
            device.until_start();
            device.send(sample(5, 5));
            // Time for the tool to read: a hangup may discard what waits in the terminal.
            std::thread::sleep(std::time::Duration::from_millis(300));
        })
    };
    for device in [FakeDevice::on_tcp([script()]), FakeDevice::on_pty(script())] {
        let run = run(&["monitor", "--port", &device.port, "--json"]);
        assert_eq!(run.code, Some(5), "{run:?}");
        assert_eq!(sequence_numbers(&run.stdout), [5]);
        let lines: Vec<_> = run.stderr.lines().collect();
        assert_eq!(lines[0], "1 frames shown, 1 received, 0 lost");
        let last = lines.last().unwrap();
        let lost = format!("hivtac: connection to {} lost: ", device.port);
        assert!(last.starts_with(&lost), "{last}");
        assert!(last.contains("cable pulled or device reset?"), "{last}");
    }
}

#[test]
fn a_cable_pulled_and_put_back_is_survived() {
    let first: Script = Box::new(|device| {
        device.until_start();
        samples(0..3)
            .into_iter()
            .for_each(|message| device.send(message));
    });
    let device = FakeDevice::on_tcp([first, streaming(samples(10..13))]);
    let run = run(&[
        "monitor",
        "--port",
        &device.port,
        "--json",
        "--frames",
        "6",
        "--reconnect",
    ]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(sequence_numbers(&run.stdout), [0, 1, 2, 10, 11, 12]);
    let stderr = &run.stderr;
    assert!(stderr.contains("lost: the other end closed it"), "{stderr}");
    assert!(
        stderr.contains(&format!(
            "hivtac: connected again to {} after ",
            device.port
        )),
        "{stderr}"
    );
    assert!(
        stderr.contains("hivtac: 7 samples missed, 0 more frames passed meanwhile\n"),
        "{stderr}"
    );
    assert!(
        stderr.contains("\n6 frames shown, 6 received, 7 lost\n"),
        "{stderr}"
    );
    assert!(
        stderr.contains("\nconnected again 1 times; 0 frames passed meanwhile\n"),
        "{stderr}"
    );
}

#[test]
fn a_device_that_forgot_the_conversation_is_lost() {
    let forgetful = || -> Script {
        Box::new(|device| {
            device.until_start();
            device.send(sample(5, 5));
            while device.next().is_some() {}
        })
    };
    let arguments = [
        "monitor",
        "--json",
        "--timeout",
        "0.5",
        "--frames",
        "2",
        "--port",
    ];
    let device = FakeDevice::on_tcp([forgetful()]);
    let alone = start(&[&arguments[..], &[&device.port]].concat());
    let device = FakeDevice::on_tcp([forgetful(), streaming(samples(0..1))]);
    let again = start(&[&arguments[..], &[&device.port, "--reconnect"]].concat());
    let alone = alone.finish();
    assert_eq!(alone.code, Some(5), "{alone:?}");
    let why = "lost: the device sends nothing and does not answer; ";
    assert!(alone.stderr.contains(why), "{alone:?}");
    let again = again.finish();
    assert_eq!(again.code, Some(0), "{again:?}");
    assert_eq!(sequence_numbers(&again.stdout), [5, 0]);
    assert!(
        again.stderr.contains("; the device started anew 1 times"),
        "{again:?}"
    );
}

#[test]
fn a_device_whose_camera_is_silent_is_waited_for() {
    let device = FakeDevice::on_pty(Box::new(|device| {
        device.until_start();
        // The probe.
        assert!(device.answer_one());
        device.send(sample(1, 1));
        device.serve();
    }));
    let run = run(&["monitor", "--json", "--frames", "1", "--port", &device.port]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let note =
        "hivtac: no sample for 5 s, but the device answers; does the camera run? (waiting)\n";
    assert!(run.stderr.starts_with(note), "{run:?}");
}

#[test]
fn a_reader_that_goes_away_ends_it_in_peace() {
    let device = FakeDevice::on_tcp([Box::new(|device| {
        device.until_start();
        for number in 0.. {
            device.send(sample(number, number));
            if device.host_is_gone {
                return;
            }
        }
    })]);
    let mut run = start(&["monitor", "--port", &device.port, "--json"]);
    let mut first = String::new();
    let mut reader = BufReader::new(run.child().stdout.take().unwrap());
    reader.read_line(&mut first).unwrap();
    assert_eq!(sequence_numbers(&first), [0]);
    drop(reader);
    let run = run.finish();
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.stderr.contains(" frames shown, "), "{}", run.stderr);
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
}

#[test]
fn ctrl_c_ends_with_the_summary() {
    for signal_name in ["INT", "TERM"] {
        let device = FakeDevice::on_tcp([streaming(samples(0..2))]);
        let mut run = start(&["monitor", "--port", &device.port]);
        let mut reader = BufReader::new(run.child().stdout.take().unwrap());
        let mut lines = String::new();
        for _ in 0..4 {
            reader.read_line(&mut lines).unwrap();
        }
        signal(run.child().id(), signal_name);
        reader.read_to_string(&mut lines).unwrap();
        assert!(
            lines.contains("\n2 frames shown, 2 received, 0 lost\n"),
            "{lines}"
        );
        let run = run.finish();
        assert_eq!(run.code, Some(130));
        assert_eq!(run.stderr, "");
    }
}

#[test]
fn a_slow_reader_gets_everything() {
    const COUNT: u32 = 5000;
    let (done, all_sent) = std::sync::mpsc::channel();
    let device = FakeDevice::on_tcp([Box::new(move |device| {
        device.until_start();
        samples(0..COUNT)
            .into_iter()
            .for_each(|message| device.send(message));
        done.send(()).unwrap();
        device.serve();
    })]);
    let count = COUNT.to_string();
    let run = start(&[
        "monitor",
        "--port",
        &device.port,
        "--json",
        "--frames",
        &count,
    ]);
    all_sent
        .recv_timeout(std::time::Duration::from_secs(20))
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(100));
    let run = run.finish();
    assert!(
        sequence_numbers(&run.stdout)
            .into_iter()
            .eq(0..u64::from(COUNT))
    );
    assert_eq!(run.code, Some(0));
}
