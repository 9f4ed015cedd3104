//! Tests of snapshots: a frame is sent as the camera showed it while forces go on; some events end
//! it early.

use crate::common::{HELLO_MS, Run, Setup, command, firmware, hello};
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_twin::{Preset, Scene, Shutter};
use hivtac_wire::message::{DeviceMessage, Outcome, Reply, Request, Snapshot};

/// Time at which it is requested, ms.
const ASKED_MS: u64 = 240;
/// The number of the command.
const ID: u16 = 7;

fn setup(virtual_ms: u64) -> Setup {
    Setup::new(firmware(), virtual_ms).at(ASKED_MS, take(ID))
}

fn take(id: u16) -> Action {
    Action::Send(command(id, Request::Snapshot))
}

/// One snapshot: its header, and its bytes that came in order.
pub struct Taken {
    header: Snapshot,
    pub bytes: Vec<u8>,
}

/// Returns all snapshots that were begun.
pub fn snapshots(run: &Run) -> Vec<Taken> {
    let mut all: Vec<Taken> = Vec::new();
    for message in &run.messages {
        match message {
            DeviceMessage::Snapshot(header) => all.push(Taken {
                header: header.clone(),
                bytes: Vec::new(),
            }),
            DeviceMessage::SnapshotPart(part) => {
                let last = all.last_mut().expect("a header before a part");
                assert_eq!(part.offset as usize, last.bytes.len());
                last.bytes.extend(&part.bytes);
            }
            _ => {}
        }
    }
    all
}

/// Returns the camera's picture of that frame, byte for byte.
fn shown(run: &Run, scene: &str, frame: u32) -> Vec<u8> {
    let line = run.truth.iter().find(|line| line["frame"] == frame);
    let line = line.unwrap_or_else(|| panic!("frame {frame} was never exposed"));
    let number = |key: &str| line[key].as_f64().unwrap();
    let shutter = Shutter {
        exposure_s: number("exposure_s"),
        readout_s: number("readout_s"),
    };
    let scene = Scene::preset(scene, Preset::Ov7725, 320, 240, 1).unwrap();
    let exposure = line["exposure"].as_u64().unwrap();
    let pixels = scene.frame_by(&shutter, exposure, number("time_s")).pixels;
    pixels
        .iter()
        .flat_map(|pixel| pixel.to_be_bytes())
        .collect()
}

/// Asserts that a snapshot is complete and equals the camera's picture.
fn assert_shown(run: &Run, scene: &str, taken: &Taken) {
    assert_eq!(taken.bytes.len(), 153_600);
    assert!(
        taken.bytes == shown(run, scene, taken.header.frame),
        "every byte"
    );
}

/// Returns the answers to a command.
fn outcomes(run: &Run, id: u16) -> Vec<Outcome> {
    let answers = run.answers(id);
    answers.into_iter().map(|(outcome, _)| outcome).collect()
}

/// Samples leave enough of the line's capacity to send a frame in a seventh of a second. No sample
/// and no frame is lost, and a sample waits for one part at most. Two other requests during the
/// snapshot are refused.
#[test]
fn a_frame_is_sent_as_it_was_shown_and_forces_go_on() {
    // A force that stays: another one needs other times for its steps.
    let setup = Setup {
        scene: "static",
        ..setup(440)
    };
    let run = setup
        .at(ASKED_MS + 1, take(8))
        .at(ASKED_MS + 60, take(9))
        .run();
    let taken = snapshots(&run);
    assert_eq!(taken.len(), 1, "{}", run.log());
    let header = &taken[0].header;
    assert_eq!((header.width, header.height), (320, 240));
    assert_shown(&run, "static", &taken[0]);
    assert_eq!(outcomes(&run, ID), [Outcome::Done]);
    assert_eq!(outcomes(&run, 8), [Outcome::Busy]);
    assert_eq!(outcomes(&run, 9), [Outcome::Busy]);
    assert_reply_is_last(&run);
    let samples = run.samples();
    let own = samples.iter().find(|sample| sample.frame == header.frame);
    assert_eq!(own.map(|sample| sample.time_us), Some(header.time_us));
    assert!(samples.len() > 30, "{}", samples.len());
    assert_eq!(run.missing_frames(), Vec::<u32>::new());
    assert_eq!((run.report.dcmi.overruns, run.rejected.frames()), (0, 0));
    run.assert_only_setup_drops();
    check_latency(&run, header.frame.into());
}

fn assert_reply_is_last(run: &Run) {
    let is_reply =
        |message: &DeviceMessage| matches!(message, DeviceMessage::Reply(Reply { id: ID, .. }));
    let is_part = |message: &DeviceMessage| matches!(message, DeviceMessage::SnapshotPart(_));
    let end = run.messages.iter().position(is_reply).unwrap();
    assert!(!run.messages[end..].iter().any(is_part));
}

/// Checks that samples leave at most 1.5 ms later than before, also at half speed.
fn check_latency(run: &Run, kept: u64) {
    let latencies = run.latencies();
    let longest = |frames: std::ops::Range<u64>| {
        let of_frames = latencies.range(frames).map(|(_, latency)| *latency);
        of_frames.fold(0.0, f64::max)
    };
    let [before, own, then] = [kept - 5..kept, kept..kept + 1, kept + 1..kept + 20].map(longest);
    println!(
        "latency at most {:.2} ms before, {:.2} ms of the frame that is kept, {:.2} ms then",
        before * 1e3,
        own * 1e3,
        then * 1e3
    );
    assert!(own.max(then) - before < 1.5e-3);
}

/// A broken frame is not sent; the next whole one is. Although blocks take up to 16 times as long,
/// its bands are copied.
#[test]
#[ignore = "20 s"]
fn an_overrun_costs_a_frame_and_a_busy_bus_nothing() {
    let run = setup(450).fault("dcmi-overrun@241").fault("bus-busy").run();
    assert_eq!(run.report.dcmi.overruns, 1);
    let taken = snapshots(&run);
    assert_eq!(taken.len(), 1);
    assert_shown(&run, "demo", &taken[0]);
    assert_eq!(run.frames_after_a_loss(), [taken[0].header.frame]);
    assert_eq!(run.missing_frames().len(), 1);
}

/// The camera is silent for longer than a snapshot waits.
#[test]
#[ignore = "10 s: 2.4 s of virtual time"]
fn without_frames_it_is_given_up() {
    let run = setup(2400).fault("camera-silent@235-2300").run();
    assert!(snapshots(&run).is_empty());
    assert_eq!(outcomes(&run, ID), [Outcome::NoGoodFrames]);
}

/// The host takes no bytes for longer than the device waits. The device gives up the snapshot and
/// reports it. Samples go on, and the next snapshot is whole.
#[test]
fn a_host_that_does_not_read_ends_it() {
    let run = setup(670)
        .fault("host-not-reading@280-420")
        .at(480, take(8))
        .run();
    let taken = snapshots(&run);
    assert_eq!(taken.len(), 2);
    assert!(taken[0].bytes.len() < 153_600);
    assert_eq!(outcomes(&run, ID), [Outcome::NotRead]);
    assert_shown(&run, "demo", &taken[1]);
    assert_eq!(outcomes(&run, 8), [Outcome::Done]);
    let after = |sample: &&&hivtac_wire::message::Sample| sample.time_us > 450_000;
    assert!(run.samples().iter().filter(after).count() > 20);
}

/// The host starts again: the old conversation's snapshot ends, and the new one's is whole.
#[test]
fn a_new_conversation_ends_it_and_can_have_its_own() {
    let again = 300;
    let run = setup(480)
        .at(again, Action::Send(hello()))
        .at(again + 2, take(8))
        .run();
    let taken = snapshots(&run);
    assert_eq!(taken.len(), 2);
    assert!(taken[0].bytes.len() < 153_600);
    assert_eq!(outcomes(&run, ID), []);
    let is_hello = |message: &DeviceMessage| matches!(message, DeviceMessage::Hello(_));
    let second = run
        .messages
        .iter()
        .enumerate()
        .filter(|(_, message)| is_hello(message))
        .nth(1);
    let after = &run.messages[second.unwrap().0..];
    assert!(
        matches!(after[1], DeviceMessage::Snapshot(_)),
        "{:?}",
        after[1]
    );
    assert_shown(&run, "demo", &taken[1]);
    assert_eq!(outcomes(&run, 8), [Outcome::Done]);
}

/// The cable is pulled between the parts and put back: nothing of the snapshot remains.
#[test]
#[ignore = "10 s: as a host that does not read"]
fn a_pulled_cable_ends_it() {
    let again = HELLO_MS + 400;
    let run = setup(770)
        .fault("cable-pulled@280-350")
        .at(again, Action::Send(hello()))
        .at(again + 2, Action::Send(command(3, Request::Start)))
        .at(again + 20, take(8))
        .run();
    let taken = snapshots(&run);
    assert_eq!(taken.len(), 2);
    assert!(taken[0].bytes.len() < 153_600);
    assert_shown(&run, "demo", &taken[1]);
    assert_eq!(outcomes(&run, 8), [Outcome::Done]);
    assert_eq!(run.report.resets, 0);
    let dropped = run
        .samples()
        .iter()
        .any(|s| s.status.contains(Status::CAPTURE_OVERRUN));
    assert!(!dropped);
}
