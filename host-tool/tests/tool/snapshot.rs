//! Tests `hivtac snapshot` with devices that send a frame, or part of one.

use crate::fake::*;
use crate::run::*;
use hivtac_terms::force::ContactList;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{HsvBox, Threshold, Yuv422};
use hivtac_terms::units::Px;
use hivtac_twin::{Format, Load, Options, Preset, Scene};
use hivtac_wire::message::*;
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;

const RED: Threshold = Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255]));

/// The bytes of the simulated sensor's frame under a press.
fn bytes_of(format: Format) -> Vec<u8> {
    let press = Load::from_angles(0.1, 4.0, -3.0).unwrap();
    frame(format, &press, 0.0)
}

fn frame(format: Format, load: &Load, blur_px: f64) -> Vec<u8> {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
    let mut options = Options {
        format,
        ..scene.options().clone()
    };
    options.lens.blur_px = blur_px;
    let scene = scene.with_options(options).unwrap();
    let pixels = scene.render_load(load, 7).unwrap().pixels;
    let in_order = |pixel: u16| match format {
        Format::Rgb565 => pixel.to_be_bytes(),
        _ => pixel.to_le_bytes(),
    };
    pixels.into_iter().flat_map(in_order).collect()
}

/// A whole frame at rest.
pub fn rest_frame() -> Vec<DeviceMessage> {
    messages(RED, &frame(Format::Rgb565, &Load::REST, 0.0))
}

/// Markers at approximately their places in that frame.
pub fn at_rest() -> [Marker; 4] {
    [Marker {
        x: Px(3 << 15),
        y: Px(-1),
        area: 190,
    }; 4]
}

/// Header and parts as a device sends them, between other messages.
fn messages(threshold: Threshold, bytes: &[u8]) -> Vec<DeviceMessage> {
    let header = Snapshot {
        frame: 31,
        time_us: 332_135,
        width: 320,
        height: 240,
        threshold,
        bytes: 153_600,
    };
    let mut messages = vec![sample(30, 30), DeviceMessage::Snapshot(header)];
    messages.push(sample_with_markers(31));
    let parts = (0..).zip(bytes.chunks(SNAPSHOT_PART_BYTES));
    messages.extend(parts.map(|(number, bytes)| {
        DeviceMessage::SnapshotPart(SnapshotPart {
            offset: number * SNAPSHOT_PART_BYTES as u32,
            bytes: bytes.try_into().unwrap(),
        })
    }));
    messages.push(sample(32, 32));
    messages
}

fn sample_with_markers(frame: u32) -> DeviceMessage {
    DeviceMessage::Sample(Sample {
        sequence: frame,
        frame,
        time_us: 332_135,
        status: Status::TARE_MISSING,
        force: None,
        contacts: ContactList::default(),
        markers: at_rest().into(),
    })
}

fn device(messages: Vec<DeviceMessage>) -> FakeDevice {
    FakeDevice::on_tcp([Box::new(move |device: &mut Conversation| {
        device.snapshots = [messages].into();
        device.serve();
    })])
}

fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

/// The result of `hivtac sense` for a file, without the file's name.
fn sense(file: &str) -> Value {
    let found = run(&["sense", "--json", file]);
    let mut found: Value = serde_json::from_str(&found.stdout).unwrap();
    found["image"].take();
    found
}

#[test]
fn picture_and_raw_frame_are_the_same_to_the_sensing() {
    let folder = TempDir::new().unwrap();
    let [png, pam, mask] = ["a.png", "a.pam", "mask.png"].map(|name| path(&folder, name));
    let bytes = bytes_of(Format::Rgb565);
    let device = device(messages(RED, &bytes));
    let run = run(&[
        "snapshot",
        "--port",
        &device.port,
        &png,
        "--raw",
        &pam,
        "--mask",
        &mask,
        "--json",
    ]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    let reported: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(
        (&reported["frame"], &reported["picture"]),
        (&31.into(), &png.into())
    );
    assert_eq!(reported["markers"][2]["x"], 1.5);
    assert_eq!(reported["status"][0], "tare_missing");
    let found = sense(&pam);
    assert!(found["force"].is_object(), "{found}");
    assert_eq!(found, sense(reported["picture"].as_str().unwrap()));
    assert!(std::fs::read(&pam).unwrap().ends_with(&bytes));
    let areas = found["markers"].as_array().unwrap().iter();
    let areas: u64 = areas.map(|marker| marker["area"].as_u64().unwrap()).sum();
    let mask = image::open(mask).unwrap().into_luma8();
    let set = mask.pixels().filter(|pixel| pixel.0[0] > 0).count();
    assert_eq!(set as u64, areas, "the mask has the markers' pixels");
    let commands: Vec<_> = device.commands.try_iter().collect();
    let expected = [Request::StartWithMarkers, Request::Snapshot, Request::Stop];
    assert_eq!(commands, expected);
}

#[test]
fn a_person_is_reported_of_the_frame() {
    let folder = TempDir::new().unwrap();
    let png = path(&folder, "a.png");
    let yuv = Threshold::Yuv422(Yuv422::RED);
    let device = device(messages(yuv, &bytes_of(Format::Yuv422)));
    let run = run(&["snapshot", "--port", &device.port, &png]);
    assert_eq!(
        run.stdout,
        format!(
            "frame 31 at 0.332135 s: 320 × 240 px, yuv422, Cr 162–255; the device found its \
             markers\nwritten: {png}\n"
        )
    );
    let middle = *image::open(png).unwrap().into_rgb8().get_pixel(160, 120);
    assert!(
        middle.0.iter().all(|level| (90..220).contains(level)),
        "grey film: {middle:?}"
    );
}

/// Checks that a run fails with this code and these words, and leaves no file.
fn check_failure(messages: Vec<DeviceMessage>, code: i32, words: &str) {
    let folder = TempDir::new().unwrap();
    let png = path(&folder, "a.png");
    let device = device(messages);
    let run = run(&["snapshot", "--port", &device.port, "--timeout", "1", &png]);
    assert_eq!(run.code, Some(code), "{run:?}");
    assert!(run.stderr.contains(words), "{run:?}");
    assert!(!Path::new(&png).exists());
}

#[test]
fn a_frame_that_is_not_whole_is_not_written() {
    let whole = || messages(RED, &bytes_of(Format::Rgb565));
    let mut gap = whole();
    gap.remove(40);
    check_failure(gap, 5, "are missing; try again");
    let mut cut = whole();
    cut.truncate(300);
    check_failure(cut, 5, "its end is missing");
    let mut headless = whole();
    headless.remove(1);
    check_failure(headless, 5, "its beginning is missing");
    let mut twice = whole();
    twice.insert(90, twice[1].clone());
    check_failure(twice, 5, "second one");
}

#[test]
fn refusals_are_explained() {
    for (outcome, words) in [
        (Outcome::Busy, "busy"),
        (Outcome::NoGoodFrames, "no whole frame"),
        (Outcome::NotRead, "took no bytes"),
    ] {
        let reply = DeviceMessage::Reply(Reply { id: 2, outcome });
        check_failure(vec![reply], 6, words);
    }
}

/// The device vanishes between the parts.
#[test]
fn a_lost_connection_is_said() {
    let folder = TempDir::new().unwrap();
    let png = path(&folder, "a.png");
    let begun = messages(RED, &bytes_of(Format::Rgb565));
    let device = FakeDevice::on_tcp([Box::new(move |device: &mut Conversation| {
        // The hello and the start of samples.
        device.answer_one();
        device.answer_one();
        device.next();
        begun
            .into_iter()
            .take(200)
            .for_each(|message| device.send(message));
    })]);
    let run = run(&["snapshot", "--port", &device.port, &png]);
    assert_eq!(run.code, Some(5), "{run:?}");
    assert!(run.stderr.contains("lost"), "{run:?}");
    assert!(!Path::new(&png).exists());
}

#[test]
fn files_that_cannot_be_written_are_named() {
    let device = device(messages(RED, &bytes_of(Format::Rgb565)));
    let finished = run(&["snapshot", "--port", &device.port, "/nowhere/a.png"]);
    assert_eq!(finished.code, Some(1), "{finished:?}");
    assert!(finished.stderr.contains("cannot write /nowhere/a.png"));
    assert_eq!(
        run(&["snapshot", "--port", "tcp:127.0.0.1:1"]).code,
        Some(2),
        "no file"
    );
}

/// Pictures until one is right.
#[test]
fn focus_goes_on_until_all_is_right() {
    let blurred = |blur_px| messages(RED, &frame(Format::Rgb565, &Load::REST, blur_px));
    let frames = [2.0, 1.5, 0.5, 0.5].map(blurred);
    let device = FakeDevice::on_tcp([Box::new(move |device: &mut Conversation| {
        device.snapshots = frames.into();
        device.serve();
    })]);
    let run = run(&["focus", "--port", &device.port, "--json"]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    let lines = run.stdout.lines();
    let lines: Vec<Value> = lines
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let right: Vec<_> = lines
        .iter()
        .map(|line| line["right"].as_bool().unwrap())
        .collect();
    assert_eq!(right, [false, false, true]);
    assert!(
        lines[0]["wrong"][0]
            .as_str()
            .unwrap()
            .contains("turn the lens")
    );
    let rims: Vec<_> = lines
        .iter()
        .map(|line| line["checks"][0]["value"].as_f64().unwrap())
        .collect();
    assert!(rims[0] > rims[1] && rims[1] > rims[2], "{rims:?}");
    assert_eq!(lines[2]["checks"][0]["what"], "rim");
    assert_eq!(lines[2]["checks"][0]["most"], 3.5);
}
