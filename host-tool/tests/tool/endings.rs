//! Tests `hivtac monitor` when the device, the reader or the user goes away.

use crate::fake::*;
use crate::run::*;
use hivtac_wire::message::{DeviceMessage, HostMessage, LogLevel, LogLine};
use std::io::{BufRead, BufReader, Read};
use std::process::ChildStdout;
use std::time::{Duration, Instant};

#[test]
fn a_pulled_cable_is_an_error_after_the_summary() {
    for is_tcp in [true, false] {
        let (pull, pulled) = std::sync::mpsc::channel();
        let script: Script = Box::new(move |device| {
            device.until_start();
            device.send(sample(5, 5));
            // A hangup may discard bytes that wait in the terminal.
            pulled.recv().unwrap();
        });
        let device = match is_tcp {
            true => FakeDevice::on_tcp([script]),
            false => FakeDevice::on_pty(script),
        };
        let mut run = start(&["monitor", "--port", &device.port, "--json"]);
        let shown = run.child().stdout.take().unwrap();
        let mut shown = BufReader::new(shown).lines();
        let first = shown.next().expect("it shows the sample").unwrap();
        assert_eq!(sequence_numbers(&first), [5]);
        pull.send(()).unwrap();
        let run = run.finish();
        assert_eq!(run.code, Some(5), "{run:?}");
        assert!(shown.next().is_none());
        let lines: Vec<_> = run.stderr.lines().collect();
        assert_eq!(lines[0], "1 frames shown, 1 received, 0 lost");
        let last = lines.last().unwrap();
        let lost = format!("hivtac: connection to {} lost: ", device.port);
        assert!(last.starts_with(&lost), "{last}");
        let question = match is_tcp {
            true => "is a replay over, or has the program there ended?",
            false => "cable pulled or device reset?",
        };
        assert!(last.contains(question), "{last}");
    }
}

/// With two programs on one port, the second gets the reason of its refusal, and the first goes on.
#[test]
fn a_second_program_on_a_port_is_refused() {
    let (go_on, reported) = std::sync::mpsc::channel();
    let device = FakeDevice::on_pty(Box::new(move |device| {
        device.until_start();
        device.send(sample(1, 1));
        reported.recv().unwrap();
        device.send(sample(2, 2));
        device.serve();
    }));
    let mut first = start(&["monitor", "--json", "--port", &device.port]);
    let shown = first.child().stdout.take().unwrap();
    let mut shown = BufReader::new(shown).lines();
    shown.next().expect("it has the port").unwrap();
    let second = run(&["info", "--port", &device.port]);
    assert_eq!(second.code, Some(3), "{second:?}");
    let advice = "close the other program that uses it";
    assert!(second.stderr.contains(advice), "{}", second.stderr);
    go_on.send(()).unwrap();
    shown.next().expect("it goes on").unwrap();
    signal(first.child().id(), "INT");
    assert_eq!(first.finish().code, Some(130));
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
    let arguments: Vec<_> = "monitor --json --timeout 0.5 --frames 2 --port"
        .split(' ')
        .collect();
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
        // The question whether the device is there.
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

/// A device that sends for as long as it has a reader.
fn endless() -> FakeDevice {
    FakeDevice::on_tcp([Box::new(|device| {
        device.until_start();
        for number in 0.. {
            device.send(sample(number, number));
            if device.host_is_gone {
                return;
            }
        }
    })])
}

/// A tool that waits for its reader never ends. A busy computer may take this long for work of a
/// tenth of a second.
const SOON: Duration = Duration::from_secs(10);

/// Waits until a pipe without a reader is full.
fn until_full(pipe: &ChildStdout) {
    let end = Instant::now() + SOON;
    let mut before = 0;
    loop {
        let held = rustix::io::ioctl_fionread(pipe).unwrap();
        if held > 0 && held == before {
            return;
        }
        assert!(Instant::now() < end, "it goes on at {held} bytes");
        before = held;
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Neither pipe is read; the first is full after some hundred lines.
#[test]
fn ctrl_c_ends_it_though_its_reader_stalls() {
    for format in [&["--json"][..], &[]] {
        let device = endless();
        let mut run = start(&[&["monitor", "--port", &device.port], format].concat());
        until_full(run.child().stdout.as_ref().unwrap());
        signal(run.child().id(), "INT");
        let asked = Instant::now();
        let status = run.child().wait().unwrap();
        assert!(asked.elapsed() < SOON, "{format:?}: {:?}", asked.elapsed());
        assert_eq!(status.code(), Some(130));
        let run = run.finish();
        assert!(run.stderr.contains(" frames shown, "), "{}", run.stderr);
        assert!(run.stdout.ends_with('\n'), "whole lines");
    }
}

#[test]
fn its_time_is_over_though_its_reader_stalls() {
    let device = FakeDevice::on_tcp([streaming(samples(0..20_000))]);
    let begun = Instant::now();
    let mut run = start(&["monitor", "--seconds", "0.6", "--port", &device.port]);
    let status = run.child().wait().unwrap();
    assert!(
        begun.elapsed() < Duration::from_millis(600) + SOON,
        "{:?}",
        begun.elapsed()
    );
    assert_eq!(status.code(), Some(0));
    let run = run.finish();
    assert!(run.stderr.contains(" frames shown, "), "{}", run.stderr);
}

/// Files may have a few thousand bytes here. The cut part of a line on a full disk is removed, also
/// when lines are appended to a file.
#[test]
fn a_full_disk_leaves_whole_lines() {
    let folder = tempfile::tempdir().unwrap();
    for to in [">", ">>"] {
        let file = folder.path().join("samples.csv");
        let before = "kept\n";
        std::fs::write(&file, before).unwrap();
        let device = endless();
        let words = format!(
            "monitor --csv --port {} {to} {}",
            device.port,
            file.display()
        );
        let Finished {
            code, stderr: said, ..
        } = run_on_full_disk(8, &words);
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains("cannot write to standard output: "), "{said}");
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(text.starts_with(before), to == ">>", "{text}");
        assert!(text.ends_with('\n') && text.lines().count() > 3, "{text}");
        let rows = text.strip_prefix(before).unwrap_or(&text).lines();
        let fields: Vec<usize> = rows.map(|row| row.matches(',').count()).collect();
        assert!(fields.iter().all(|count| *count == fields[0]), "{text}");
    }
}

/// A device sends text that could colour a terminal, clear it, or look like another line.
#[test]
fn nothing_that_a_device_says_acts_on_the_terminal() {
    let evil = "\x1b[31m\r\nhivtac: all is well\u{9b}2J\u{202e}";
    let script = |device: &mut Conversation| {
        let mut hello = hello();
        hello.board = "\x1b]0;x\x07".try_into().unwrap();
        hello.preset = "\u{9b}2J".try_into().unwrap();
        hello.model.as_mut().unwrap().name = "a\r\nb".try_into().unwrap();
        while let Some(message) = device.next() {
            match message {
                HostMessage::Hello(_) => device.send(DeviceMessage::Hello(hello.clone())),
                HostMessage::Down(_) => {}
                HostMessage::Command(command) => {
                    device.send(DeviceMessage::Log(LogLine {
                        level: LogLevel::Info,
                        time_us: 1,
                        text: evil.try_into().unwrap(),
                    }));
                    device.send(DeviceMessage::Hello(hello.clone()));
                    device.settings.name = "\u{9b}2J\u{202e}".try_into().unwrap();
                    device.answer_to(HostMessage::Command(command));
                }
            }
        }
    };
    for arguments in [
        &["info"][..],
        &["info", "--json"],
        &["monitor", "--seconds", "0.3"],
    ] {
        let device = FakeDevice::on_tcp([Box::new(script)]);
        let run = run(&[arguments, &["--port", &device.port]].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
        let text = format!("{}{}", run.stdout, run.stderr);
        let acts = |c: char| c != '\n' && c.is_control() || c == '\u{202e}';
        assert!(!text.chars().any(acts), "{text:?}");
        assert!(
            !text.lines().any(|line| line.starts_with("hivtac: all")),
            "{text:?}"
        );
        assert!(
            text.contains(r"\u{1b}[31m\u{d}\u{a}hivtac: all is well\u{9b}2J"),
            "{text:?}"
        );
    }
}
