//! Tests `hivtac check`, `record` and `replay`, end to end.

use crate::fake::*;
use crate::run::*;
use hivtac_wire::message::{DeviceMessage, Request, Stats};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::time::Duration;

/// A device that sends samples with these numbers, one every 5 ms, and its counters; then waits.
fn paced(numbers: Vec<u32>) -> Script {
    paced_and_counted(numbers, |_| ())
}

/// The same device; it calls `tell` with the number of each sample that it sent.
fn paced_and_counted(numbers: Vec<u32>, tell: impl Fn(u32) + Send + 'static) -> Script {
    Box::new(move |device| {
        while let Some(message) = device.next() {
            if let hivtac_wire::message::HostMessage::Command(command) = &message
                && matches!(command.request, Request::Start | Request::StartWithMarkers)
            {
                device.reply(command.id, hivtac_wire::message::Outcome::Done);
                for number in &numbers {
                    device.send(sample(*number, *number));
                    tell(*number);
                    std::thread::sleep(Duration::from_millis(5));
                }
                device.send(DeviceMessage::Stats(Stats {
                    uptime_us: 10,
                    latency_us: 4_785,
                    ..Stats::default()
                }));
                continue;
            }
            device.answer_to(message);
        }
    })
}

#[test]
fn check_measures_and_its_exit_code_says_which_limit_failed() {
    let check = |numbers: Vec<u32>, limits: &[&str]| {
        let device = FakeDevice::on_tcp([paced(numbers)]);
        let common = [
            "check",
            "--json",
            "--seconds",
            "0.6",
            "--port",
            &device.port,
        ];
        run(&[&common, limits].concat())
    };
    let all: Vec<u32> = (0..60).collect();
    let good = check(all.clone(), &["--min-rate", "29", "--max-loss", "0"]);
    assert_eq!(good.code, Some(0), "{good:?}");
    let report: Value = serde_json::from_str(&good.stdout).unwrap();
    assert_eq!(report["samples"], 60);
    assert!(
        (report["rate_hz"].as_f64().unwrap() - 30.0).abs() < 0.1,
        "{report}"
    );
    // Frames of 33.333 ms arrive every 5 ms.
    let jitter = report["jitter_p50_ms"].as_f64().unwrap();
    assert!((20.0..30.0).contains(&jitter), "{report}");
    assert_eq!(report["latency_ms"], 4.785);
    let slow = check(all, &["--min-rate", "150", "--max-loss", "0"]);
    assert_eq!(slow.code, Some(7), "{slow:?}");
    let gaps: Vec<u32> = (0..60).filter(|n| n % 20 != 7).collect();
    let lossy = check(gaps, &["--max-loss", "2"]);
    assert_eq!(lossy.code, Some(8), "{lossy:?}");
    let report: Value = serde_json::from_str(&lossy.stdout).unwrap();
    assert_eq!(
        (&report["lost"], &report["causes"]["on the way"]),
        (&json!(3), &json!(3))
    );
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }
}

/// The sequence numbers that `monitor` shows of a recording, as fast as it reads.
pub fn replayed(options: &[&str], frames: &str) -> Vec<u64> {
    let mut replay = start(&[&["replay", "--fast", "--json"], options].concat());
    let mut said = String::new();
    let stdout = replay.child().stdout.take().unwrap();
    BufReader::new(stdout).read_line(&mut said).unwrap();
    let said: Value = serde_json::from_str(&said).unwrap();
    let port = format!("tcp:{}", said["tcp"].as_str().unwrap());
    let monitor = run(&["monitor", "--json", "--frames", frames, "--port", &port]);
    let replay = replay.finish();
    assert_eq!(replay.code, Some(0), "{replay:?}");
    sequence_numbers(&monitor.stdout)
}

#[test]
fn what_was_recorded_is_played_as_it_came() {
    let folder = Folder::new();
    let file = folder.path("a.mcap");
    let device = FakeDevice::on_tcp([paced((3..40).collect())]);
    let port = &device.port;
    let recorded = run(&[
        "record",
        &file,
        "--seconds",
        "0.5",
        "--json",
        "--port",
        port,
    ]);
    assert_eq!(recorded.code, Some(0), "{recorded:?}");
    let reported: Value = serde_json::from_str(&recorded.stdout).unwrap();
    assert_eq!(
        [&reported["file"], &reported["whole"], &reported["samples"]],
        [&json!(file), &json!(true), &json!(37)]
    );
    assert!(
        recorded.stderr.contains("recorded: 37 received, 0 lost"),
        "{recorded:?}"
    );
    assert!(!std::path::Path::new(&format!("{file}.partial")).exists());
    assert!(replayed(&[&file], "37").into_iter().eq(3..40));
    let again = run(&["record", &file, "--port", &device.port]);
    assert_eq!(again.code, Some(1));
    assert!(
        again.stderr.contains("there is such a file already"),
        "{again:?}"
    );
}

/// A cut recording plays to the cut; another file is refused.
#[test]
fn a_recording_that_was_cut_plays_to_the_cut() {
    let folder = Folder::new();
    let file = folder.path("a.mcap");
    let device = FakeDevice::on_tcp([paced((0..40).collect())]);
    run(&["record", &file, "--seconds", "0.5", "--port", &device.port]);
    let whole = std::fs::read(&file).unwrap();
    let cut = folder.path("cut.mcap");
    // A cut before the index at the file's end.
    std::fs::write(&cut, &whole[..whole.len() / 3]).unwrap();
    let mut replay = start(&["replay", "--fast", &cut]);
    let mut said = String::new();
    let stdout = replay.child().stdout.take().unwrap();
    BufReader::new(stdout).read_line(&mut said).unwrap();
    if let Some(port) = said.trim().strip_prefix("ready tcp=") {
        run(&[
            "monitor",
            "--json",
            "--frames",
            "40",
            "--port",
            &format!("tcp:{port}"),
        ]);
        let replay = replay.finish();
        assert_eq!(replay.code, Some(0), "{replay:?}");
        assert!(
            replay.stderr.contains("is cut: it ends before its end"),
            "{replay:?}"
        );
    } else {
        assert_eq!(replay.finish().code, Some(1), "not even its hello is left");
    }
    std::fs::write(&cut, b"no recording").unwrap();
    let none = run(&["replay", &cut]);
    assert_eq!(none.code, Some(1));
    assert!(
        none.stderr.contains("is no recording of `hivtac record`"),
        "{none:?}"
    );
}

#[test]
fn a_pulled_cable_leaves_a_recording_that_plays_under_its_partial_name() {
    let folder = Folder::new();
    let file = folder.path("a.mcap");
    let device = FakeDevice::on_tcp([Box::new(|device: &mut Conversation| {
        // Until the device has been asked and started.
        device.answer_one();
        device.answer_one();
        device.answer_one();
        samples(0..30)
            .into_iter()
            .for_each(|message| device.send(message));
        device.end_after_what_was_sent();
    })]);
    let recorded = run(&["record", &file, "--port", &device.port]);
    assert_eq!(recorded.code, Some(5), "{recorded:?}");
    let partial = format!("{file}.partial");
    let reported = format!("what came until then is in {partial}");
    assert!(recorded.stderr.contains(&reported), "{recorded:?}");
    assert!(!std::path::Path::new(&file).exists());
    assert!(replayed(&[&partial], "30").into_iter().eq(0..30));
}

#[test]
fn ctrl_c_ends_a_recording_cleanly() {
    let folder = Folder::new();
    let file = folder.path("a.csv");
    let (reported, sent) = std::sync::mpsc::channel();
    // The receiver of the last numbers is gone.
    let tell = move |number| {
        let _ = reported.send(number);
    };
    let device = FakeDevice::on_tcp([paced_and_counted((0..100).collect(), tell)]);
    let mut recording = start(&["record", &file, "--port", &device.port]);
    while sent.recv_timeout(Duration::from_secs(20)).unwrap() < 50 {}
    signal(recording.child().id(), "INT");
    let recorded = recording.finish();
    assert_eq!(recorded.code, Some(130), "{recorded:?}");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.starts_with("host_time_s,exposed_time_s,seq,frame,time_us,alpha_deg,"),
        "{text}"
    );
    let fields: Vec<_> = text.lines().map(|line| line.matches(',').count()).collect();
    assert!(
        fields.len() > 20 && fields.iter().all(|n| *n == fields[0]),
        "{text}"
    );
}

/// The message is the disk's own, for MCAP as for CSV.
#[test]
fn a_full_disk_is_called_full() {
    let folder = Folder::new();
    let file = folder.path("a.mcap");
    let device = FakeDevice::on_tcp([paced((0..2_000).collect())]);
    let Finished {
        code, stderr: said, ..
    } = run_on_full_disk(40, &format!("record {file} --port {}", device.port));
    assert_eq!(code, Some(1), "{said}");
    let words = format!("cannot record into {file}.partial: File too large");
    assert!(said.contains(&words), "{said}");
}

/// Files may have a few thousand bytes here: data flushed before are whole.
#[test]
fn a_full_disk_ends_a_recording_with_what_fits() {
    let folder = Folder::new();
    let file = folder.path("a.csv");
    let device = FakeDevice::on_tcp([paced((0..2_000).collect())]);
    let Finished {
        code, stderr: said, ..
    } = run_on_full_disk(150, &format!("record {file} --port {}", device.port));
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("cannot record into "), "{said}");
    let text = std::fs::read_to_string(format!("{file}.partial")).unwrap();
    assert!(
        text.ends_with('\n') && text.lines().count() > 100,
        "{}",
        text.len()
    );
}

/// A sensor with another number and name, which sends samples with these numbers.
fn another(number: u8, name: &'static str, numbers: Vec<u32>) -> FakeDevice {
    let script = paced(numbers);
    FakeDevice::on_tcp([Box::new(move |device: &mut Conversation| {
        device.hello.device_id[11] = number;
        device.hello.name = name.try_into().unwrap();
        script(device);
    })])
}

/// Records these sensors.
fn record_all(devices: &[&FakeDevice], file: &str) -> Finished {
    let ports = devices.iter().flat_map(|device| ["--port", &device.port]);
    let common = ["record", file, "--seconds", "0.6", "--json"];
    run(&common.into_iter().chain(ports).collect::<Vec<_>>())
}

#[test]
fn several_sensors_are_recorded_into_one_file_and_played_one_by_one() {
    let folder = Folder::new();
    let file = folder.path("two.mcap");
    let thumb = another(1, "thumb", (0..30).collect());
    let index = another(2, "index", (100..120).collect());
    let recorded = record_all(&[&thumb, &index], &file);
    assert_eq!(recorded.code, Some(0), "{recorded:?}");
    let reported: Value = serde_json::from_str(&recorded.stdout).unwrap();
    let samples = [0, 1].map(|sensor| reported["sensors"][sensor]["samples"].clone());
    assert_eq!(samples, [json!(30), json!(20)], "{reported}");
    for (device, numbers) in [("thumb", 0..30), ("00010203040506070809 0A02", 100..120)] {
        let device = device.replace(' ', "");
        let played = replayed(
            &["--device", &device, &file],
            &(numbers.end - numbers.start).to_string(),
        );
        assert!(played.into_iter().eq(numbers), "{device}");
    }
    for (options, said) in [
        (&[][..], "more than one sensor; choose one with --device: "),
        (
            &["--device", "ring"],
            "no sensor with the name or serial number ring",
        ),
    ] {
        let refused = run(&[&["replay", &file], options].concat());
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.stderr.contains(said), "{refused:?}");
        assert!(
            refused.stderr.contains("000102030405060708090a02 index"),
            "{refused:?}"
        );
    }
}

#[test]
fn one_lost_sensor_of_several_ends_a_recording_with_what_came_of_all() {
    let folder = Folder::new();
    let file = folder.path("two.mcap");
    let thumb = another(1, "thumb", (0..30).collect());
    let pulled = FakeDevice::on_tcp([Box::new(|device: &mut Conversation| {
        device.hello.name = "index".try_into().unwrap();
        device.answer_one();
        device.answer_one();
        device.answer_one();
        samples(0..5)
            .into_iter()
            .for_each(|message| device.send(message));
        device.end_after_what_was_sent();
    })]);
    let recorded = record_all(&[&thumb, &pulled], &file);
    assert_eq!(recorded.code, Some(5), "{recorded:?}");
    let partial = format!("{file}.partial");
    assert!(
        replayed(&["--device", "thumb", &partial], "20")
            .into_iter()
            .eq(0..20)
    );
}

#[test]
fn several_sensors_go_into_no_table_and_none_is_named_twice() {
    let folder = Folder::new();
    let thumb = another(1, "thumb", vec![]);
    let table = record_all(&[&thumb, &thumb], &folder.path("two.csv"));
    assert_eq!(table.code, Some(1), "{table:?}");
    assert!(table.stderr.contains("a table has one sensor"), "{table:?}");
    let (first, second) = (another(7, "a", vec![]), another(7, "b", vec![]));
    let twice = record_all(&[&first, &second], &folder.path("two.mcap"));
    assert_eq!(twice.code, Some(1), "{twice:?}");
    assert!(
        twice.stderr.contains("the same sensor is named twice"),
        "{twice:?}"
    );
    assert!(std::fs::read_dir(folder.0.path()).unwrap().next().is_none());
}

#[test]
#[ignore = "needs PyPI's packages: run by cargo xtask test --all"]
fn several_sensors_in_one_file_are_read_by_pypis_reader() {
    let folder = Folder::new();
    let file = folder.path("two.mcap");
    let thumb = another(1, "thumb", (0..30).collect());
    let index = another(2, "index", (100..120).collect());
    assert_eq!(record_all(&[&thumb, &index], &file).code, Some(0));
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = std::process::Command::new("python3")
        .arg(root.join("tests/python/read_mcap.py"))
        .arg(root.join("target/python-mcap"))
        .arg(&file)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&read.stderr);
    assert!(read.status.success(), "{said}");
    let read: Value = serde_json::from_slice(&read.stdout).unwrap();
    for (number, name, samples) in [("01", "thumb", 30), ("02", "index", 20)] {
        let unit = format!("unit_000102030405060708090a{number}");
        let statuses = &read["topics"][format!("/hivtac/{unit}/status")];
        assert_eq!(statuses, samples, "{read}");
        let summary = &read["summaries"][format!("hivtac/{unit}")];
        assert_eq!(
            (&summary["name"], &summary["samples"]),
            (&json!(name), &json!(samples.to_string()))
        );
    }
}
