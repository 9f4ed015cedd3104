//! Tests of models that a host sends to the firmware: used from a frame on, kept through restarts
//! and power cuts, or refused.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::common::{Run, Setup, command, firmware};
use crate::cuts;
use hivtac_rig::peripherals::flash::{BANK, Contents, Cut, Leaves, Operation};
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{PixelFormat, Threshold, Yuv422};
use hivtac_wire::frame::CRC32;
use hivtac_wire::health::Problem;
use hivtac_wire::message::{
    DeviceMessage, MODEL_PART_BYTES, ModelIdentity, ModelPart, ModelSource, Outcome, Request,
    Sample,
};
use hivtac_wire::settings::{Name, Selection};

/// The model that is built into the firmware.
const BUILT_IN: &[u8] = include_bytes!("../../../calibration/models/default.hvtm");
/// A model for frames in YUV422.
const YUV422: &[u8] = include_bytes!("../../../calibration/models/yuv422/default.hvtm");
/// The unique number of the rig's part.
const UNIT: &[u8; 12] = b"hivtac-rig-1";
/// Numbers of commands.
const BEGIN: u16 = 40;
const USE: u16 = 41;
const LATER: u16 = 42;
const FIRST_PART: u16 = 1000;
/// Time at which they are sent, ms.
const SEND_MS: u64 = 170;
/// Time for some frames after a restart.
const RESTART_MS: u64 = 215;
/// Time by which a model is in use. The parts take 0.15 s, an erase 1 s, the words 0.4 s; the log
/// of a new device needs another erase.
const UPDATED_MS: u64 = 1_850;
const FIRST_UPDATED_MS: u64 = UPDATED_MS + 1_000;
/// Time by which a reset is done, even if it erases a sector.
const RESET_MS: u64 = 1_300;
/// Sizes in the second bank.
const SECTOR_BYTES: usize = 128 << 10;
const WORD_BYTES: usize = 32;

/// Returns a model file with some bytes changed, and the checksum that fits.
fn changed(file: &[u8], changes: &[(usize, &[u8])]) -> Vec<u8> {
    let mut file = file.to_vec();
    for (at, bytes) in changes {
        file[*at..at + bytes.len()].copy_from_slice(bytes);
    }
    let end = file.len() - 4;
    let crc = CRC32.checksum(&file[..end]);
    file[end..].copy_from_slice(&crc.to_le_bytes());
    file
}

/// Returns the built-in model as if it were calibrated on this unit: origin and unit.
fn own() -> Vec<u8> {
    changed(BUILT_IN, &[(62, &[1]), (64, UNIT)])
}

fn crc_of(file: &[u8]) -> u32 {
    let (_, crc) = file.split_at(file.len() - 4);
    u32::from_le_bytes(crc.try_into().unwrap())
}

/// Returns all messages that send a model and put it to use.
fn upload(file: &[u8]) -> Vec<u8> {
    let bytes = file.len() as u32;
    let mut commands = command(BEGIN, Request::BeginModel { bytes });
    for (nth, chunk) in (0..).zip(file.chunks(MODEL_PART_BYTES)) {
        let part = ModelPart {
            offset: u32::from(nth) * MODEL_PART_BYTES as u32,
            bytes: chunk.try_into().unwrap(),
        };
        commands.extend(command(FIRST_PART + nth, Request::ModelPart(part)));
    }
    commands.extend(command(USE, Request::UseModel));
    commands
}

fn send(id: u16, request: Request) -> Action {
    Action::Send(command(id, request))
}

fn setup(flash: &Path, virtual_ms: u64) -> Setup {
    Setup {
        flash: Some(flash.to_owned()),
        ..Setup::new(firmware(), virtual_ms)
    }
}

/// Makes an update without a camera. The update does not need one, and the camera costs most of the
/// time.
fn update(flash: &Path, file: &[u8]) -> Setup {
    setup(flash, FIRST_UPDATED_MS)
        .fault("camera-absent")
        .at(SEND_MS, Action::Send(upload(file)))
}

fn model(run: &Run) -> &ModelIdentity {
    let hello = run.hellos().pop().expect("a hello");
    hello.model.as_ref().expect("a model")
}

/// The checksum of a device's model, and its source.
type Has = (u32, ModelSource);

/// Returns the model of a device after a restart; the device measures with it.
fn restarted(flash: &Path) -> Has {
    has(&started(flash))
}

/// Returns the run of a device after a restart.
fn started(flash: &Path) -> Run {
    setup(flash, RESTART_MS).run()
}

/// Returns the device's model, and asserts that it measures with it.
fn has(run: &Run) -> Has {
    let followed = run.followed();
    let sample = followed.last().expect("it measures");
    assert!(sample.force.is_some(), "{sample:?}");
    let model = model(run);
    let simulated = sample.status.contains(Status::NOT_CALIBRATED);
    assert_eq!(simulated, model.simulated, "{sample:?}");
    (model.crc, model.source)
}

/// The flash of a device that keeps a name.
static NAMED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let device = Device::new(None);
    let name = Name::try_from("thumb").unwrap();
    let run = setup(&device.flash, 1_350)
        .fault("camera-absent")
        .at(SEND_MS, send(LATER, Request::SetName(name)))
        .at(SEND_MS + 10, send(LATER + 1, Request::Keep(Selection::ALL)))
        .run();
    assert_eq!(run.outcome(LATER + 1), Outcome::Done);
    std::fs::read(&device.flash).unwrap()
});

/// The flash of the same device after it got its own model.
static UPDATED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let device = Device::new(Some(&NAMED));
    let run = update(&device.flash, &own()).run();
    assert_eq!(run.outcome(USE), Outcome::Done, "{}", run.log());
    assert_eq!(model(&run).source, ModelSource::Kept);
    std::fs::read(&device.flash).unwrap()
});

/// A folder with a flash file.
pub struct Device {
    _directory: tempfile::TempDir,
    pub flash: PathBuf,
}

impl Device {
    fn new(contents: Option<&[u8]>) -> Device {
        let directory = tempfile::tempdir().unwrap();
        let flash = directory.path().join("flash");
        if let Some(contents) = contents {
            std::fs::write(&flash, contents).unwrap();
        }
        Device {
            _directory: directory,
            flash,
        }
    }

    fn of(contents: &Contents) -> Device {
        let device = Device::new(None);
        contents.save(&device.flash).unwrap();
        device
    }

    fn contents(&self) -> Contents {
        Contents::load(&self.flash).unwrap()
    }

    /// Returns a device with its own model, as if it were calibrated.
    pub fn updated() -> Device {
        Device::new(Some(&UPDATED))
    }
}

/// The film is the same, and so are the forces; but from one frame on they come from the unit's own
/// model.
#[test]
fn a_model_is_used_from_a_frame_on_and_after_a_restart() {
    let device = Device::new(Some(&NAMED));
    let run = setup(&device.flash, UPDATED_MS)
        .at(SEND_MS, Action::Send(upload(&own())))
        .run();
    assert_eq!(run.outcome(BEGIN), Outcome::Done);
    let parts = BUILT_IN.len().div_ceil(MODEL_PART_BYTES) as u16;
    for part in 0..parts {
        assert_eq!(run.outcome(FIRST_PART + part), Outcome::Done);
    }
    assert_eq!(run.outcome(USE), Outcome::Done);
    run.assert_only_setup_drops();
    assert_eq!(run.missing_frames(), [0; 0], "forces go on");
    let is_own = |sample: &&Sample| !sample.status.contains(Status::NOT_CALIBRATED);
    let samples = run.samples().into_iter();
    let (own_ones, before): (Vec<&Sample>, Vec<&Sample>) = samples.partition(is_own);
    assert!(
        before.len() > 100 && own_ones.len() > 10,
        "{}",
        before.len()
    );
    assert!(
        before.last().unwrap().frame < own_ones[0].frame,
        "one change"
    );
    assert!(own_ones.iter().all(|sample| sample.force.is_some()));
    let (crc, source) = (crc_of(&own()), ModelSource::Kept);
    assert_eq!((model(&run).crc, model(&run).source), (crc, source));
    assert_eq!(restarted(&device.flash), (crc, source));
    println!(
        "longest latency {} µs",
        run.latencies().values().fold(0.0, |a: f64, b| a.max(*b)) * 1e6
    );
}

/// A model of another unit, for another frame size, in another layout, damaged, or cut is not kept,
/// and the device reports the reason.
#[test]
fn a_model_that_is_none_for_this_device_is_refused_with_its_reason() {
    let mut damaged = own();
    damaged[5000] ^= 1;
    let another_unit = changed(BUILT_IN, &[(62, &[1]), (64, b"hivtac-rig-2")]);
    let smaller = changed(BUILT_IN, &[(32, &[0xA0, 0])]);
    let packed = changed(BUILT_IN, &[(6, &[2])]);
    for (file, outcome, reason) in [
        (damaged, Outcome::ModelUnusable, "damaged"),
        (another_unit, Outcome::AnotherSensor, "another unit"),
        (smaller, Outcome::AnotherSensor, "another camera"),
        (packed, Outcome::ModelUnusable, "packed as 2"),
        (own()[..500].to_vec(), Outcome::ModelUnusable, "500 bytes"),
    ] {
        let device = Device::new(None);
        let run = setup(&device.flash, 400)
            .fault("camera-absent")
            .at(SEND_MS, Action::Send(upload(&file)))
            .run();
        assert_eq!(run.outcome(USE), outcome, "{reason}");
        assert!(run.log().contains(reason), "{reason}: {}", run.log());
        assert_eq!(
            run.report.flash_operations,
            [],
            "{reason}: nothing was written"
        );
        assert_eq!(model(&run).source, ModelSource::BuiltIn);
    }
}

#[test]
fn parts_that_do_not_follow_each_other_are_refused() {
    let device = Device::new(None);
    let part = |offset, bytes: &[u8]| {
        Request::ModelPart(ModelPart {
            offset,
            bytes: bytes.try_into().unwrap(),
        })
    };
    let asked = [
        (part(0, &[1]), Outcome::InvalidArgument),
        (Request::UseModel, Outcome::InvalidArgument),
        (Request::BeginModel { bytes: 0 }, Outcome::InvalidArgument),
        (
            Request::BeginModel { bytes: 163_841 },
            Outcome::InvalidArgument,
        ),
        (Request::BeginModel { bytes: 4 }, Outcome::Done),
        (part(1, &[1]), Outcome::InvalidArgument),
        (part(0, &[1, 2]), Outcome::Done),
        (part(0, &[1, 2]), Outcome::InvalidArgument),
        (part(2, &[3, 4, 5]), Outcome::InvalidArgument),
        (part(u32::MAX, &[3]), Outcome::InvalidArgument),
        (Request::UseModel, Outcome::InvalidArgument),
        (part(2, &[3, 4]), Outcome::InvalidArgument),
        (Request::BeginModel { bytes: 2 }, Outcome::Done),
        (part(0, &[1, 2]), Outcome::Done),
        (Request::UseModel, Outcome::ModelUnusable),
    ];
    let mut setup = setup(&device.flash, 260).fault("camera-absent");
    for (nth, (request, _)) in (0..).zip(&asked) {
        let at = SEND_MS + 2 * u64::from(nth);
        setup = setup.at(at, send(BEGIN + nth, request.clone()));
    }
    let run = setup.run();
    for (nth, (request, outcome)) in (0..).zip(asked) {
        assert_eq!(run.outcome(BEGIN + nth), outcome, "{nth}: {request:?}");
    }
    assert_eq!(run.report.flash_operations, []);
}

/// A model for another pixel format makes the camera send it; no frame is read in the wrong format.
#[test]
#[ignore = "7 s"]
fn a_model_for_another_pixel_format_sets_the_camera() {
    let device = Device::new(Some(&NAMED));
    let run = setup(&device.flash, UPDATED_MS + 150)
        .fault("camera-absent@0-900")
        .at(SEND_MS, Action::Send(upload(YUV422)))
        .run();
    assert_eq!(run.outcome(USE), Outcome::Done, "{}", run.log());
    let hello = run.hellos().pop().unwrap();
    assert_eq!(hello.threshold.format(), PixelFormat::Yuv422);
    let misread = Status::IMAGE_DARK | Status::IMAGE_SATURATED;
    let samples = run.samples();
    let bad = samples
        .iter()
        .filter(|sample| sample.status.intersects(misread));
    let bad: Vec<_> = bad.collect();
    assert!(bad.is_empty(), "{bad:?}");
    let last = &samples[samples.len() - 5..];
    assert!(last.iter().all(|sample| sample.force.is_some()), "{last:?}");
    assert_eq!(
        restarted(&device.flash),
        (crc_of(YUV422), ModelSource::Kept)
    );
}

/// The user's own threshold stays, and for that reason there is no force. The built-in model
/// restores it.
#[test]
fn the_built_in_model_comes_back_on_request() {
    let device = Device::updated();
    let cr = Threshold::Yuv422(Yuv422 { cr_low: 150 });
    let run = setup(&device.flash, 470)
        .at(SEND_MS, send(BEGIN, Request::UseBuiltInModel))
        .at(SEND_MS + 40, send(LATER, Request::SetThreshold(cr)))
        .at(340, send(USE, Request::Reset))
        .run();
    for id in [BEGIN, LATER, USE] {
        assert_eq!(run.outcome(id), Outcome::Done, "{id}");
    }
    let hello = run.hellos().pop().unwrap();
    assert_eq!(hello.threshold.format(), PixelFormat::Rgb565);
    assert_eq!(hello.name, "");
    assert_eq!(model(&run).source, ModelSource::BuiltIn);
    let built_in = (crc_of(BUILT_IN), ModelSource::BuiltIn);
    assert_eq!(restarted(&device.flash), built_in);
}

/// Asserts that a cut run leaves the result that the operations of the complete run predict.
fn assert_left(before: &Contents, update: impl Fn(&Path) -> Setup, whole: &[Operation], cut: Cut) {
    let device = Device::of(before);
    let setup = Setup {
        cut: Some(cut),
        ..update(&device.flash)
    };
    assert!(setup.run().report.power_was_cut, "{cut:?}");
    let left = Device::of(&cuts::left(before, whole, cut));
    assert!(device.contents() == left.contents(), "{cut:?}");
}

/// A device with its own model gets another one, and the power is cut at each of the update's
/// operations, in each way. The device has the old or the new model, to the last bit.
fn every_cut_of_an_update(before: &Contents) {
    let (old, new) = (own(), changed(&own(), &[(300, &[1])]));
    let updating = |flash: &Path| update(flash, &new);
    let device = Device::of(before);
    let run = updating(&device.flash).protected().run();
    assert_eq!(run.outcome(USE), Outcome::Done, "{}", run.log());
    let whole = run.report.flash_operations;
    assert!(whole.len() > new.len() / WORD_BYTES, "each word is written");
    for operation in [0, whole.len() as u64 - 2] {
        let leaves = Leaves::Torn;
        assert_left(before, updating, &whole, Cut { operation, leaves });
    }
    let start = |flash: &Path| {
        let run = started(flash);
        (has(&run), run.report.flash_words)
    };
    let mut found = Vec::new();
    let judge = |cut, image: &Contents, (crc, source): &Has| {
        let model = [&old, &new].into_iter().find(|file| crc_of(file) == *crc);
        let model = model.unwrap_or_else(|| panic!("{cut:?}: {crc:08x}"));
        assert!(cuts::holds_model(image, model), "{cut:?}: {crc:08x}");
        assert_eq!(*source, ModelSource::Kept, "{cut:?}");
        found.push(*crc);
    };
    let starts = cuts::start_each(before, &whole, start, judge);
    assert!((4..30).contains(&starts), "{starts}");
    let [old, new] = [&old, &new].map(|file| crc_of(file));
    assert_eq!((found.first(), found.last()), (Some(&old), Some(&new)));
}

#[test]
#[ignore = "14 s"]
fn after_a_power_cut_in_an_update_the_old_or_the_new_model_is_there() {
    every_cut_of_an_update(&Device::updated().contents());
}

/// The record that names the model no longer fits into the log's sector: the other sector is
/// erased.
#[test]
#[ignore = "slow"]
fn after_a_power_cut_in_an_update_of_a_full_log_the_old_or_the_new_model_is_there() {
    every_cut_of_an_update(&cuts::full(Device::updated().contents()));
}

/// All words that a start neither read nor programmed, by the rig's report, are torn and get other
/// contents. The device sends the same bytes, bit for bit.
#[test]
fn a_start_depends_on_no_word_that_the_rig_does_not_tell() {
    let device = Device::updated();
    let before = device.contents();
    let run = started(&device.flash);
    let words = &run.report.flash_words;
    let mut spoilt = before.array.clone();
    let others = BANK
        .step_by(WORD_BYTES)
        .filter(|word| !words.contains(word));
    let others: Vec<u32> = others.collect();
    for word in &others {
        let at = (word - BANK.start) as usize;
        spoilt[at..at + WORD_BYTES]
            .iter_mut()
            .for_each(|byte| *byte = !*byte);
    }
    // Only the log's two sectors and the model's words are read.
    let read = 2 * SECTOR_BYTES / WORD_BYTES + BUILT_IN.len() / WORD_BYTES;
    assert!((read..read + 40).contains(&words.len()), "{}", words.len());
    let behind = std::iter::once(&before.options).chain(&others);
    spoilt.extend(behind.flat_map(|word| word.to_le_bytes()));
    let other = Device::new(Some(&spoilt));
    assert_eq!(other.contents().torn(), others.len());
    let again = started(&other.flash);
    assert!(again.bytes == run.bytes, "it sends the same");
    assert_eq!(&again.report.flash_words, words);
}

/// Cuts a factory reset at each of its operations, in each way.
fn every_cut_of_a_reset(before: &Contents) {
    let device = Device::of(before);
    let setup = setup(&device.flash, RESET_MS)
        .fault("camera-absent")
        .at(SEND_MS, send(USE, Request::Reset));
    let run = setup.run();
    assert_eq!(run.outcome(USE), Outcome::Done);
    let old: (Has, Name) = (
        (crc_of(&own()), ModelSource::Kept),
        "thumb".try_into().unwrap(),
    );
    let new = ((crc_of(BUILT_IN), ModelSource::BuiltIn), Name::new());
    let start = |flash: &Path| {
        let run = started(flash);
        (
            (has(&run), run.hellos()[0].name.clone()),
            run.report.flash_words,
        )
    };
    let mut found = Vec::new();
    let judge = |cut, _: &Contents, has: &(Has, Name)| {
        assert!(*has == old || *has == new, "{cut:?}: {has:?}");
        found.push(has.clone());
    };
    let whole = run.report.flash_operations;
    cuts::start_each(before, &whole, start, judge);
    assert_eq!((found.first(), found.last()), (Some(&old), Some(&new)));
}

#[test]
#[ignore = "10 s"]
fn after_a_power_cut_in_a_reset_everything_or_nothing_is_forgotten() {
    every_cut_of_a_reset(&Device::updated().contents());
}

/// The reset begins with an erase of the log's other sector.
#[test]
#[ignore = "slow"]
fn after_a_power_cut_in_a_reset_of_a_full_log_everything_or_nothing_is_forgotten() {
    every_cut_of_a_reset(&cuts::full(Device::updated().contents()));
}

/// One word of the model cannot be read, or reads differently. The device continues with the
/// built-in model, reports it, and accepts another model.
#[test]
#[ignore = "13 s"]
fn a_kept_model_that_is_spoilt_is_replaced_by_the_built_in_one() {
    let slot = 2 * SECTOR_BYTES;
    let word = 0x0810_0000 + (slot + 40 * WORD_BYTES) as u32;
    let torn = [UPDATED.as_slice(), &word.to_le_bytes()].concat();
    let mut other = UPDATED.clone();
    other[slot + 5000] ^= 4;
    let built_in = (crc_of(BUILT_IN), ModelSource::Fallback);
    for contents in [torn, other] {
        let device = Device::new(Some(&contents));
        let run = setup(&device.flash, RESTART_MS)
            .at(RESTART_MS - 15, send(LATER, Request::GetHealth))
            .run();
        assert_eq!(has(&run), built_in);
        let fallback = Problem::ModelFallback.bit();
        let health = run.health();
        assert_eq!((health.problems, health.at_start), (fallback, fallback));
        assert!(Contents::load(&device.flash).is_ok());
    }
}

/// The host goes away in the middle of an update, and another host begins again.
#[test]
fn an_update_ends_with_its_conversation() {
    let device = Device::new(None);
    let half = upload(&own()[..2 * MODEL_PART_BYTES]);
    let run = setup(&device.flash, 300)
        .fault("camera-absent")
        .at(SEND_MS, Action::Send(half))
        .at(SEND_MS + 20, Action::Close)
        .at(SEND_MS + 40, Action::Open)
        .at(SEND_MS + 50, Action::Send(crate::common::hello()))
        .at(SEND_MS + 60, send(LATER, Request::UseModel))
        .run();
    let replies: Vec<_> = run
        .messages
        .iter()
        .filter_map(|message| match message {
            DeviceMessage::Reply(reply) if reply.id == LATER => Some(reply.outcome),
            _ => None,
        })
        .collect();
    assert_eq!(replies, [Outcome::InvalidArgument]);
}
