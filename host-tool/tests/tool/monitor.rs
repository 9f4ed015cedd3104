//! `hivtac monitor` against scripted devices.

use crate::fake::*;
use crate::run::*;
use hivtac_wire::message::*;
use hivtac_wire::status::Status;
use std::io::{BufRead, BufReader, Read, Write};

const JSON_41: &str = r#"{"seq":41,"frame":42,"time_us":1399986,"force":{"alpha_deg":-5.000,"beta_deg":2.500,"magnitude_n":0.100000,"x_n":-0.008707,"y_n":0.004362,"z_n":-0.099525,"direction_sigma_deg":0.480,"magnitude_sigma_n":0.000900},"status":["model_simulated"]}"#;

fn without_force(sequence: u32, frame: u32) -> DeviceMessage {
    DeviceMessage::Sample(Sample {
        sequence,
        frame,
        time_us: 7,
        status: Status::MARKERS_MISSING | Status::FRAME_DROPPED,
        force: None,
    })
}

fn samples(numbers: std::ops::Range<u32>) -> Vec<DeviceMessage> {
    numbers.map(|number| sample(number, number)).collect()
}

/// The sequence numbers of JSON lines.
fn sequence_numbers(stdout: &str) -> Vec<u64> {
    let lines = stdout
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    lines.map(|line| line["seq"].as_u64().unwrap()).collect()
}

#[test]
fn json_lines_and_a_summary_on_standard_error() {
    let device = FakeDevice::on_tcp([streaming(vec![sample(41, 42), without_force(42, 43)])]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "2"]);
    let second = r#"{"seq":42,"frame":43,"time_us":7,"force":null,"status":["markers_missing","frame_dropped"]}"#;
    assert_eq!(run.stdout, format!("{JSON_41}\n{second}\n"));
    assert_eq!(
        run.stderr,
        "2 frames shown, 2 received, 0 lost\n\
         lost: 0 samples on the way (gaps in the sequence), 0 frames not processed (gaps in the frame number); \
         rejected here: 0 messages, 0 bytes\n\
         device: 0 frames exposed, 0 processed; dropped: busy 0, overrun 0, size 0, USB 0; \
         camera timeouts 0, restarts 0, overruns 0; commands rejected 0; last frame took 0 µs\n\
         without a force: 1 (markers_missing 1)\n"
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn the_device_is_asked_started_stopped_and_asked_again() {
    let device = FakeDevice::on_tcp([streaming(samples(0..1))]);
    run(&["monitor", "--port", &device.port, "--frames", "1"]);
    let commands: Vec<_> = device.commands.iter().collect();
    assert_eq!(
        commands,
        [
            Request::GetInfo,
            Request::Start,
            Request::Stop,
            Request::GetInfo
        ]
    );
}

#[test]
fn csv_has_a_header() {
    let device = FakeDevice::on_tcp([streaming(vec![sample(41, 42), without_force(42, 43)])]);
    let run = run(&["monitor", "--port", &device.port, "--csv", "--frames", "2"]);
    assert_eq!(
        run.stdout,
        "seq,frame,time_us,alpha_deg,beta_deg,magnitude_n,x_n,y_n,z_n,direction_sigma_deg,magnitude_sigma_n,status\n\
         41,42,1399986,-5.000,2.500,0.100000,-0.008707,0.004362,-0.099525,0.480,0.000900,model_simulated\n\
         42,43,7,,,,,,,,,markers_missing|frame_dropped\n"
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn a_person_sees_columns_and_the_summary_on_a_pseudo_terminal() {
    let device = FakeDevice::on_pty(streaming(vec![sample(41, 42)]));
    let run = run(&["monitor", "--port", &device.port, "--frames", "1"]);
    assert_eq!(run.stderr, "");
    let lines: Vec<_> = run.stdout.lines().collect();
    assert_eq!(
        lines[..5],
        [
            "     seq   frame         time        α        β      |F|       Fx       Fy       Fz  status",
            "                            s        °        °       mN       mN       mN       mN",
            "      41      42     1.399986   -5.000    2.500  100.000   -8.707    4.362  -99.525  model_simulated",
            "",
            "1 frames shown, 1 received, 0 lost",
        ]
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn losses_are_counted_by_cause() {
    let script: Script = Box::new(|device| {
        device.stats = Stats {
            frames_exposed: 100,
            uptime_us: 10,
            ..Stats::default()
        };
        if !device.until_start() {
            return;
        }
        device.send(sample(10, 20));
        device.raw(b"garbage in between\0");
        device.send(sample(13, 23));
        device.raw(&[3, 4, 6, 5, 9, 0xe7, 9, 0xb7, 0]);
        device.send(sample(14, 26));
        device.stats = Stats {
            frames_exposed: 107,
            frames_processed: 5,
            dropped_busy: 2,
            usb_dropped: 2,
            camera_timeouts: 1,
            processing_us: 5300,
            uptime_us: 20,
            ..Stats::default()
        };
        device.serve();
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "3"]);
    assert_eq!(
        run.stderr,
        "3 frames shown, 3 received, 4 lost\n\
         lost: 2 samples on the way (gaps in the sequence), 2 frames not processed (gaps in the frame number); \
         rejected here: 2 messages, 26 bytes (overlong 0, cobs 1, crc 1, body 0, trailing 0)\n\
         device: 7 frames exposed, 5 processed; dropped: busy 2, overrun 0, size 0, USB 2; \
         camera timeouts 1, restarts 0, overruns 0; commands rejected 0; last frame took 5300 µs\n"
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn what_is_left_over_from_before_the_hello_is_ignored() {
    let script: Script = Box::new(|device| {
        device.raw(&[9, 9, 9]);
        device.send(sample(1, 1));
        device.send(sample(2, 2));
        if device.until_start() {
            device.send(sample(7, 7));
            device.serve();
        }
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "1"]);
    assert_eq!(sequence_numbers(&run.stdout), [7]);
    assert!(
        run.stderr
            .starts_with("1 frames shown, 1 received, 0 lost\n"),
        "{}",
        run.stderr
    );
    assert!(
        run.stderr.contains("rejected here: 0 messages"),
        "{}",
        run.stderr
    );
}

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

/// The port stays open, but the device behind it was unplugged or restarted and knows nothing of the conversation.
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

/// The output is not read until the device has sent everything; nothing of it is lost.
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

#[test]
fn it_ends_after_the_given_time() {
    let device = FakeDevice::on_tcp([streaming(samples(0..2))]);
    let run = run(&[
        "monitor",
        "--port",
        &device.port,
        "--json",
        "--seconds",
        "0.5",
    ]);
    assert_eq!(sequence_numbers(&run.stdout), [0, 1]);
    assert_eq!(run.code, Some(0));
}

#[test]
fn log_lines_go_to_standard_error() {
    let log = DeviceMessage::Log(LogLine {
        level: LogLevel::Warning,
        time_us: 2_500_000,
        text: "camera silent, restarting".try_into().unwrap(),
    });
    let device = FakeDevice::on_tcp([streaming(vec![log, sample(0, 0)])]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "1"]);
    assert!(
        run.stderr
            .starts_with("device, 2.500 s, warning: camera silent, restarting\n"),
        "{}",
        run.stderr
    );
}

#[test]
fn the_truth_stands_beside_and_is_compared() {
    let mut log = tempfile::NamedTempFile::new().unwrap();
    // The sample's force exactly, twice the force in the same direction, and one at a right angle.
    for (frame, magnitude, [x, y, z]) in [
        (1, 0.1, [-0.008707, 0.004362, -0.099525]),
        (2, 0.2, [-0.017414, 0.008724, -0.19905]),
        (3, 0.01, [0.004362, 0.008707, 0.0]),
    ] {
        writeln!(
            log,
            r#"{{"frame":{frame},"time_us":1,"alpha_deg":-5,"beta_deg":2.5,"magnitude_n":{magnitude},"x_n":{x},"y_n":{y},"z_n":{z}}}"#
        )
        .unwrap();
    }
    let path = log.path().to_str().unwrap();
    let device = FakeDevice::on_tcp([streaming(vec![
        sample(0, 1),
        sample(1, 2),
        sample(2, 3),
        sample(3, 4),
        without_force(4, 5),
    ])]);
    let run = run(&[
        "monitor",
        "--port",
        &device.port,
        "--frames",
        "5",
        "--truth",
        path,
    ]);
    let lines: Vec<_> = run.stdout.lines().collect();
    assert_eq!(
        lines[3],
        "       1       2     0.066666   -5.000    2.500  100.000   -8.707    4.362  -99.525   -5.000    2.500  200.000  model_simulated"
    );
    assert!(
        lines[5].ends_with("-99.525        ?        ?        ?  model_simulated"),
        "{}",
        lines[5]
    );
    let tail = &lines[lines.len() - 2..];
    assert_eq!(
        tail,
        [
            "mean direction error: 30.000° over 3 frames with a force, 0.000° over 2 frames with true |F| ≥ 50 mN",
            "RMSE of |F|: 77.675 mN over 3 frames",
        ]
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn a_missing_truth_file_is_named() {
    let run = run(&[
        "monitor",
        "--port",
        "tcp:127.0.0.1:9",
        "--truth",
        "/nowhere/truth.jsonl",
    ]);
    assert_eq!(run.code, Some(1));
    assert!(
        run.stderr
            .starts_with("hivtac: cannot open the truth file /nowhere/truth.jsonl: "),
        "{}",
        run.stderr
    );
}
