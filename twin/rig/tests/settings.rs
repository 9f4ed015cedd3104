//! Tests of the settings in the device's flash: they are kept through restarts and power cuts.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::common::{Setup, command, down, firmware};
use crate::cuts::{self, Start};
use hivtac_rig::peripherals::flash::{Contents, Cut, Leaves};
use hivtac_rig::script::Action;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{HsvBox, PixelFormat, Threshold};
use hivtac_terms::units::Micrometres;
use hivtac_wire::message::{DeviceMessage, Outcome, Request, Sample};
use hivtac_wire::settings::{Found, Name, RestPosition, Selection, SettingsReport};

/// Numbers of commands.
const SET: u16 = 30;
const KEEP: u16 = 40;
const REPORT: u16 = 50;
/// Times at which they are sent, ms.
const SET_MS: u64 = 170;
const KEEP_MS: u64 = 190;
/// Time for some frames after a restart, and the report.
const RESTART_MS: u64 = 225;
/// Time by which an erase, which takes 1 s, is over.
const ERASED_MS: u64 = 1_350;
/// The firmware writes the first two of the second bank's sectors.
const SECTOR_BYTES: usize = 128 << 10;

fn name(text: &str) -> Name {
    text.try_into().unwrap()
}

fn send(id: u16, request: Request) -> Action {
    Action::Send(command(id, request))
}

/// Returns a run at rest with this flash that asks for the settings at its end.
fn setup(flash: &Path, virtual_ms: u64) -> Setup {
    let setup = Setup::new(firmware(), virtual_ms);
    let setup = setup.at(virtual_ms - 20, send(REPORT, Request::GetSettings));
    Setup {
        scene: "rest",
        shape: None,
        flash: Some(flash.to_owned()),
        ..setup
    }
}

/// Sets a name and keeps only that; without a camera, which this does not need.
fn naming(flash: &Path, text: &str, virtual_ms: u64) -> Setup {
    let only_name = Selection {
        name: true,
        ..Selection::NONE
    };
    setup(flash, virtual_ms)
        .fault("camera-absent")
        .at(SET_MS, send(SET, Request::SetName(name(text))))
        .at(KEEP_MS, send(KEEP, Request::Keep(only_name)))
}

/// Returns the settings of a device after a restart.
fn restarted(flash: &Path) -> SettingsReport {
    settings_of(setup(flash, RESTART_MS)).0
}

/// Returns the settings that a device reports in a run, and the words of the flash that decided
/// them.
fn settings_of(setup: Setup) -> Start<SettingsReport> {
    let run = setup.run();
    assert!(!run.samples().is_empty(), "it measures");
    let sample = run.samples()[0];
    assert!(sample.force.is_some(), "{sample:?}");
    let report = run.settings();
    let untared = sample.status.contains(Status::TARE_MISSING);
    assert_eq!(untared, report.tare.is_none(), "{sample:?}");
    assert_eq!(run.hellos()[0].name, report.name);
    (report.clone(), run.report.flash_words.clone())
}

/// The flash of a device that keeps the name "old" and a tare, and its report of them.
static OLD: LazyLock<(Vec<u8>, SettingsReport)> = LazyLock::new(old);

fn old() -> (Vec<u8>, SettingsReport) {
    let directory = tempfile::tempdir().unwrap();
    let flash = directory.path().join("flash");
    let run = setup(&flash, ERASED_MS)
        .at(SET_MS, send(SET, Request::Tare { frames: 2 }))
        .at(SET_MS, send(SET + 1, Request::SetName(name("old"))))
        .at(KEEP_MS + 20, send(KEEP, Request::Keep(Selection::ALL)))
        .protected()
        .run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    run.assert_only_setup_drops();
    assert_eq!(run.missing_frames(), [0; 0], "forces go on");
    let kept = run.settings().clone();
    assert_eq!(kept.kept, Selection::ALL);
    assert_eq!((kept.found, kept.erases), (Found::Nothing, 1));
    assert_eq!(kept.contact_shape, ContactShape::Unknown);
    (std::fs::read(&flash).unwrap(), kept)
}

/// A folder with that flash.
pub struct Device {
    _directory: tempfile::TempDir,
    pub flash: PathBuf,
    kept: SettingsReport,
}

impl Device {
    pub fn new() -> Device {
        let (contents, kept) = &*OLD;
        let directory = tempfile::tempdir().unwrap();
        let flash = directory.path().join("flash");
        std::fs::write(&flash, contents).unwrap();
        Device {
            _directory: directory,
            flash,
            kept: kept.clone(),
        }
    }
}

#[test]
fn name_tare_and_threshold_are_kept_while_forces_go_on() {
    let device = Device::new();
    let first = restarted(&device.flash);
    let expected = SettingsReport {
        found: Found::Settings,
        // The untouched film has not been seen for a second since the start.
        seen: None,
        ..device.kept.clone()
    };
    assert_eq!(first, expected);
    assert!(first.tare.is_some());
    // Another threshold is kept alone: the device begins with it, and keeps the rest.
    let green = Threshold::Rgb565(HsvBox::of_limits([40, 80, 100, 255, 45, 255]));
    let only_threshold = Selection {
        threshold: true,
        ..Selection::NONE
    };
    let run = setup(&device.flash, 300)
        .at(SET_MS, send(SET, Request::SetThreshold(green)))
        .at(SET_MS + 40, send(KEEP, Request::Keep(only_threshold)))
        .run();
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    let run = setup(&device.flash, RESTART_MS).run();
    assert_eq!(run.hellos()[0].threshold, green);
    assert_eq!(run.settings().name, "old");
    assert_eq!(run.settings().tare, device.kept.tare);
    assert_eq!(run.settings().erases, 1, "there is room for hundreds");
}

/// The message about gravity gets no answer. Its direction belongs to a tare and is kept. An
/// invalid direction counts as unknown, and the device reports that.
#[test]
#[ignore = "25 s: an erase while frames are measured"]
fn which_way_it_is_held_goes_with_a_tare_and_is_kept() {
    let directory = tempfile::tempdir().unwrap();
    let flash = directory.path().join("flash");
    let reported = Direction([0, 600, -800]);
    let run = setup(&flash, ERASED_MS)
        .at(SET_MS - 10, down(Down::Told(reported)))
        .at(SET_MS, send(SET, Request::Tare { frames: 2 }))
        .at(KEEP_MS + 20, send(KEEP, Request::Keep(Selection::ALL)))
        .run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    let report = run.settings();
    assert_eq!(
        (report.down, report.kept.down),
        (Down::Told(reported), true)
    );
    assert_eq!(report.tare.unwrap().down, Some(reported));
    // A restart keeps it. Turned over, the sensor continues to measure, and it reports an invalid
    // direction.
    let run = setup(&flash, 260)
        .at(SET_MS, down(Down::Told(Direction([0, 600, 800]))))
        .at(SET_MS + 30, down(Down::Told(Direction([1, 2, 3]))))
        .run();
    let samples = run.samples();
    let is_unknown = |sample: &&Sample| sample.status.contains(Status::WEIGHT_UNKNOWN);
    assert!(!is_unknown(&samples[0]) && is_unknown(samples.last().unwrap()));
    assert_eq!(run.settings().tare.unwrap().down, Some(reported));
    assert_eq!(
        (run.settings().down, run.settings().kept.down),
        (Down::Unknown, false)
    );
    run.assert_only_setup_drops();
    assert_eq!(run.missing_frames(), [0; 0], "forces go on");
}

/// A radius out of range is refused, and the earlier setting stays.
#[test]
fn what_presses_is_set_reported_kept_and_reset() {
    let Device { flash, kept, .. } = &Device::new();
    let only_shape = Selection {
        contact_shape: true,
        ..Selection::NONE
    };
    let [flat, round] = [
        ContactShape::Flat(Micrometres(4_000)),
        ContactShape::Round(Micrometres(249)),
    ];
    let setting = |shape| Request::SetContactShape(shape);
    let run = setup(flash, 260)
        .at(SET_MS, send(SET, setting(flat)))
        .at(SET_MS + 5, send(SET + 1, setting(round)))
        .at(KEEP_MS, send(KEEP, Request::Keep(only_shape)))
        .run();
    let outcomes = [SET, SET + 1, KEEP].map(|id| run.outcome(id));
    let expected = [Outcome::Done, Outcome::InvalidArgument, Outcome::Done];
    assert_eq!(outcomes, expected);
    assert_eq!(run.settings().contact_shape, flat);
    assert_eq!(run.settings().kept, Selection::ALL);
    run.assert_only_setup_drops();
    assert_eq!(run.missing_frames(), [0; 0], "forces go on");
    let found = restarted(flash);
    assert_eq!((found.contact_shape, found.tare), (flat, kept.tare));
    let needle = send(SET, setting(ContactShape::Needle));
    let report = setup(flash, 240)
        .at(SET_MS, needle)
        .run()
        .settings()
        .clone();
    assert_eq!(report.contact_shape, ContactShape::Needle);
    assert!(!report.kept.contact_shape, "until restart");
    assert_eq!(restarted(flash).contact_shape, flat);
    let run = setup(flash, 280)
        .at(SET_MS, send(SET, Request::Reset))
        .run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    let report = run.settings();
    assert_eq!(report.contact_shape, ContactShape::Unknown);
    assert!(report.kept.contact_shape);
}

/// Cuts the power at each operation of a change of the name, in each way. The device has the old or
/// the new name and its tare, and reports the same at the next start.
fn every_cut_of_a_new_name(before: &Contents) {
    let device = Device::new();
    before.save(&device.flash).unwrap();
    let run = naming(&device.flash, "new", ERASED_MS).run();
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    let start = |flash: &Path| {
        // An incomplete record is written anew at the start, which may need an erase.
        let (first, words) = settings_of(setup(flash, ERASED_MS).fault("camera-absent@225"));
        let again = setup(flash, RESTART_MS).fault("camera-absent").run();
        assert_eq!(again.settings().name, first.name);
        (
            first,
            words.union(&again.report.flash_words).copied().collect(),
        )
    };
    let mut names = Vec::new();
    let judge = |cut, _: &Contents, found: &SettingsReport| {
        assert!(["old", "new"].contains(&found.name.as_str()), "{found:?}");
        assert_eq!(found.tare, device.kept.tare, "{cut:?}");
        assert_eq!(found.kept, Selection::ALL);
        names.push(found.name.clone());
    };
    let whole = run.report.flash_operations;
    cuts::start_each(before, &whole, start, judge);
    assert_eq!((&*names[0], &**names.last().unwrap()), ("old", "new"));
}

/// A new device's log has much room.
#[test]
#[ignore = "slow"]
fn after_a_power_cut_the_old_or_the_new_is_there() {
    every_cut_of_a_new_name(&Contents::load(&Device::new().flash).unwrap());
}

/// The change begins with an erase of the log's other sector.
#[test]
#[ignore = "slow"]
fn after_a_power_cut_in_a_full_log_the_old_or_the_new_is_there() {
    every_cut_of_a_new_name(&cuts::full(Contents::load(&Device::new().flash).unwrap()));
}

/// A device that never kept anything begins with an erase. A cut erase leaves some words blank,
/// some torn, and some unchanged.
#[test]
#[ignore = "10 s"]
fn after_a_power_cut_in_the_first_erase_settings_can_be_kept() {
    let directory = tempfile::tempdir().unwrap();
    let flash = directory.path().join("flash");
    let cut = Some(Cut {
        operation: 0,
        leaves: Leaves::Torn,
    });
    let run = Setup {
        cut,
        ..naming(&flash, "new", ERASED_MS)
    }
    .run();
    assert!(run.report.power_was_cut);
    let found = restarted(&flash);
    assert_eq!((found.name.as_str(), found.found), ("", Found::Nothing));
    let run = naming(&flash, "new", ERASED_MS).run();
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    assert_eq!(restarted(&flash).name, "new");
}

/// Changes the first byte of the record in a device's flash, and sets the right checksum.
pub fn of_another_version(flash: &Path) {
    let mut contents = Contents::load(flash).unwrap();
    let sector = &mut contents.array[..SECTOR_BYTES];
    // By the storage's layout: 11 bytes before the record, with a checksum over generation and
    // record in the last four.
    let length = usize::from(u16::from_le_bytes([sector[1], sector[2]]));
    let words = sector.chunks(32);
    let mut record: Vec<u8> = words.clone().next().unwrap()[11..].to_vec();
    for word in words.skip(1) {
        record.extend(&word[1..]);
    }
    record.truncate(length);
    assert_eq!(record[0], 8, "the version");
    sector[11] = 200;
    record[0] = 200;
    let mut checked = sector[3..7].to_vec();
    checked.extend(&record);
    let checksum = hivtac_wire::frame::CRC32.checksum(&checked);
    sector[7..11].copy_from_slice(&checksum.to_le_bytes());
    contents.save(flash).unwrap();
}

#[test]
fn settings_of_another_version_are_reported_and_stay_until_something_is_kept() {
    let device = Device::new();
    of_another_version(&device.flash);
    let before = Contents::load(&device.flash).unwrap();
    let found = restarted(&device.flash);
    assert_eq!(found.found, Found::AnotherVersion);
    assert_eq!((found.name.as_str(), found.tare), ("", None));
    assert_eq!(Contents::load(&device.flash).unwrap(), before, "untouched");
    let run = naming(&device.flash, "new", RESTART_MS).run();
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    let found = restarted(&device.flash);
    assert_eq!((found.name.as_str(), found.found), ("new", Found::Settings));
}

/// The rest positions have another format, a marker outside every picture, or are those of a
/// pressed film.
#[test]
fn a_rest_position_that_is_none_is_refused_and_nothing_changes() {
    let device = Device::new();
    let good = device.kept.tare.unwrap();
    let other = RestPosition {
        format: PixelFormat::Yuv422,
        ..good
    };
    let mut outside = good;
    outside.markers[2].x.0 = i32::MAX;
    let mut pressed = good;
    let (x, y) = good.rect_center;
    for marker in &mut pressed.markers {
        marker.x.0 += (marker.x.0 - x.0) / 4;
        marker.y.0 += (marker.y.0 - y.0) / 4;
    }
    let wanted = [
        (Some(other), Outcome::InvalidArgument),
        (Some(outside), Outcome::InvalidArgument),
        (Some(pressed), Outcome::NotAtRest),
        (Some(good), Outcome::Done),
        (None, Outcome::Done),
    ];
    let mut setup = setup(&device.flash, 280).at(210, send(REPORT + 1, Request::GetSettings));
    for (nth, (position, _)) in (0..).zip(wanted) {
        let at = if nth < 4 { SET_MS } else { 230 };
        setup = setup.at(at + nth, send(SET + nth as u16, Request::SetTare(position)));
    }
    let run = setup.run();
    for (nth, (_, expected)) in (0..).zip(wanted) {
        assert_eq!(run.outcome(SET + nth), expected, "{nth}");
    }
    let reports: Vec<_> = run
        .messages
        .iter()
        .filter_map(|message| match message {
            DeviceMessage::Settings(report) => Some((report.tare, report.kept.tare)),
            _ => None,
        })
        .collect();
    assert_eq!(reports, [(Some(good), true), (None, false)]);
    let last = run.samples().last().unwrap().status;
    assert!(last.contains(Status::TARE_MISSING), "{last:?}");
}

/// A write while the supply falls may be torn: it is refused. A sector whose word was refused is
/// erased before the next one.
#[test]
fn nothing_is_written_while_the_supply_is_low() {
    let directory = tempfile::tempdir().unwrap();
    let flash = directory.path().join("flash");
    let only_name = Selection {
        name: true,
        ..Selection::NONE
    };
    let low = naming(&flash, "thumb", 1_800).fault("supply-low@180-200");
    let low = low.at(300, send(KEEP + 1, Request::Keep(only_name)));
    let run = low.run();
    assert_eq!(run.outcome(KEEP), Outcome::Worn);
    assert_eq!(run.outcome(KEEP + 1), Outcome::Done, "the supply is back");
    assert_eq!(run.settings().name, name("thumb"));
}
