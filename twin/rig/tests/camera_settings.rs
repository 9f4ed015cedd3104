//! Tests of exposure, gain and rate as a user sets them. They are used, kept through restarts and
//! power cuts, and refused out of their ranges.

use std::path::Path;

use crate::common::{Run, Setup, command, firmware, openmv};
use crate::cuts;
use crate::settings::Device;
use hivtac_rig::peripherals::flash::Contents;
use hivtac_rig::script::Action;
use hivtac_terms::camera::{CameraSettings, Rate};
use hivtac_terms::status::Status;
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_wire::message::{Outcome, Request};
use hivtac_wire::settings::{CameraReport, Selection};

const SET: u16 = 30;
const KEEP: u16 = 40;
const REPORT: u16 = 50;
/// Forces come by this time.
const SET_MS: u64 = 220;
/// By these times the registers are set, and three frames came.
const KEEP_MS: u64 = 290;
const KEPT_MS: u64 = 330;
/// Time for some frames after a start, and the report.
const RESTART_MS: u64 = 240;
/// By this time exposure and gain at half the rate are found, and frames came.
const AT_HALF_RATE_MS: u64 = 620;
/// The same at the full rate.
const AT_FULL_RATE_MS: u64 = 460;

const CAMERA: Selection = Selection {
    camera: true,
    ..Selection::NONE
};

fn send(id: u16, request: Request) -> Action {
    Action::Send(command(id, request))
}

fn exposed(us: u32, gain: Option<u16>) -> CameraSettings {
    CameraSettings {
        exposure: Some(Microseconds(us)),
        gain: gain.map(Sixteenths),
        rate: Rate::Full,
        white: None,
    }
}

fn at(rate: Rate) -> CameraSettings {
    CameraSettings {
        rate,
        ..CameraSettings::default()
    }
}

/// Sets the camera, and asks for the settings at the end.
fn setting(setup: Setup, settings: CameraSettings) -> Setup {
    let report_ms = setup.virtual_ms - 20;
    setup
        .at(SET_MS, send(SET, Request::SetCamera(settings)))
        .at(report_ms, send(REPORT, Request::GetSettings))
}

fn started(flash: &Path) -> Run {
    let setup = Setup {
        flash: Some(flash.to_owned()),
        ..Setup::new(firmware(), RESTART_MS)
    };
    let report = send(REPORT, Request::GetSettings);
    setup.at(RESTART_MS - 20, report).run()
}

/// Returns a run that keeps these camera settings.
fn keeping(flash: &Path, settings: CameraSettings, virtual_ms: u64) -> Setup {
    let setup = Setup {
        flash: Some(flash.to_owned()),
        ..Setup::new(firmware(), virtual_ms)
    };
    setting(setup, settings).at(KEEP_MS, send(KEEP, Request::Keep(CAMERA)))
}

/// Returns the true times between the exposures of samples with consecutive frames, ms.
fn frame_times_ms(run: &Run, frames: std::ops::Range<u32>) -> Vec<f64> {
    let exposed_s = |frame: u32| {
        let line = run.truth.iter().find(|line| line["frame"] == frame);
        line.expect("exposed")["time_s"].as_f64().unwrap()
    };
    let samples = run.followed().into_iter();
    let frames = samples.filter(|sample| frames.contains(&sample.frame));
    let time = |frame| 1e3 * (exposed_s(frame) - exposed_s(frame - 1));
    frames.map(|sample| time(sample.frame)).collect()
}

/// Asserts that each frame was measured, or passed while the camera was set. Exceptions are the
/// frame under way at that time and the one under way now.
fn assert_counted(run: &Run) {
    let stats = run.stats();
    assert_eq!(
        [stats.dropped_overrun, stats.dropped_size],
        [0; 2],
        "{stats:?}"
    );
    assert!(stats.dropped_busy <= 1, "{stats:?}");
    let counted = stats.frames_processed + stats.dropped_setup + stats.dropped_busy;
    assert!(stats.frames_exposed - counted <= 1, "{stats:?}");
    assert_eq!(stats.camera_restarts, 0);
}

/// The light of the scene exposes the film well in 4 ms at a gain of one. Here it is half of that
/// time, with a gain of two.
#[test]
fn exposure_and_gain_that_are_set_are_in_use_while_frames_are_counted() {
    let run = setting(Setup::new(firmware(), 330), exposed(2_000, Some(32))).run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    let CameraReport {
        settings,
        exposure,
        gain,
        ..
    } = run.settings().camera;
    assert_eq!(settings, exposed(2_000, Some(32)));
    // Half a line is 12 µs.
    assert!(exposure.0.abs_diff(2_000) <= 12, "{exposure}");
    assert_eq!(gain, Sixteenths(32));
    assert!(!run.settings().kept.camera);
    assert_counted(&run);
    let missing = run.missing_frames();
    let [gap] = run.frames_after_a_loss()[..] else {
        panic!("one gap: {missing:?}");
    };
    let samples = run.samples();
    let after = samples.iter().filter(|sample| sample.frame > gap);
    assert!(after.clone().count() >= 4);
    for sample in after {
        let dark = Status::IMAGE_DARK | Status::IMAGE_SATURATED;
        assert_eq!(sample.status.0 & dark.0, 0, "{sample:?}");
        assert!(sample.force.is_some(), "{sample:?}");
    }
    // Device time and true time keep their difference. After the change the exposure's middle is
    // 1 ms later in the frame, which both times include.
    run.assert_times();
}

#[test]
fn a_gain_alone_follows_the_light_and_then_stays() {
    let run = setting(Setup::new(firmware(), 330), exposed(2_000, None)).run();
    let CameraReport { exposure, gain, .. } = run.settings().camera;
    assert!(exposure.0.abs_diff(2_000) <= 12, "{exposure}");
    assert!((30..=34).contains(&gain.0), "{gain:?}");
    let last = run.samples().last().unwrap().status;
    assert!(!last.contains(Status::IMAGE_DARK), "{last:?}");
}

/// An eighth of the light that the film needs: a search would find more.
#[test]
#[ignore = "15 s: an erase while frames are measured"]
fn a_kept_exposure_is_used_at_the_start_in_place_of_the_search() {
    let Device { flash, .. } = &Device::new();
    let dark = exposed(500, Some(16));
    let run = keeping(flash, dark, KEPT_MS).run();
    assert_eq!([SET, KEEP].map(|id| run.outcome(id)), [Outcome::Done; 2]);
    assert!(run.settings().kept.camera);
    let run = started(flash);
    assert_eq!(run.settings().camera.settings, dark);
    assert!(run.settings().kept.camera);
    assert!(run.samples().len() >= 4);
    for sample in run.samples() {
        let status = sample.status;
        let is_dark = status.contains(Status::IMAGE_DARK);
        assert!(
            is_dark || status.contains(Status::MARKERS_MISSING),
            "{sample:?}"
        );
    }
    // The device and the camera are as new: the device searches the light.
    let reset = Setup {
        flash: Some(flash.clone()),
        ..Setup::new(firmware(), 450)
    };
    let reset = reset.at(SET_MS, send(SET, Request::Reset));
    let run = reset.at(430, send(REPORT, Request::GetSettings)).run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    let report = run.settings();
    assert_eq!(report.camera.settings, CameraSettings::default());
    assert!(report.kept.camera);
    assert!(
        run.samples().last().unwrap().force.is_some(),
        "{}",
        run.log()
    );
}

#[test]
fn what_is_out_of_its_range_is_refused_and_nothing_changes() {
    let bad = [
        exposed(23, None),
        exposed(6_500, None),
        exposed(2_000, Some(15)),
        exposed(2_000, Some(65)),
    ];
    let mut setup = Setup::new(firmware(), 270);
    for (nth, settings) in (0..).zip(bad) {
        let id = SET + nth as u16;
        setup = setup.at(SET_MS + 5 * nth, send(id, Request::SetCamera(settings)));
    }
    let run = setup.at(250, send(REPORT, Request::GetSettings)).run();
    for nth in 0..bad.len() as u16 {
        assert_eq!(run.outcome(SET + nth), Outcome::InvalidArgument, "{nth}");
    }
    let report = run.settings().camera;
    assert_eq!(report.settings, CameraSettings::default());
    let limits = report.limits;
    let can = limits.check(&exposed(6_358, Some(64)));
    assert_eq!((can, limits.check(&bad[1]).is_err()), (Ok(()), true));
    assert_eq!(run.missing_frames(), [0; 0]);
}

/// Frames come half as often, with the tip's forces and the right times; afterwards the old rate
/// returns.
#[test]
#[ignore = "19 s"]
fn the_rate_is_changed_while_forces_are_read_and_kept() {
    let Device { flash, .. } = &Device::new();
    let run = keeping(flash, at(Rate::Half), AT_HALF_RATE_MS).run();
    assert_eq!([SET, KEEP].map(|id| run.outcome(id)), [Outcome::Done; 2]);
    assert_counted(&run);
    run.assert_times();
    let gap = *run.missing_frames().last().unwrap();
    let [before, after] = [0..gap, gap + 1..u32::MAX].map(|frames| frame_times_ms(&run, frames));
    assert!(
        before.iter().all(|ms| (6.3..6.5).contains(ms)),
        "{before:?}"
    );
    assert!(after.len() >= 8, "{after:?}");
    assert!(
        after.iter().all(|ms| (12.7..12.9).contains(ms)),
        "{after:?}"
    );
    assert!(run.followed().iter().all(|sample| sample.force.is_some()));
    // The next start has that rate at once.
    let setup = Setup {
        flash: Some(flash.clone()),
        ..Setup::new(firmware(), AT_FULL_RATE_MS)
    };
    let run = setting(setup, at(Rate::Full)).run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    assert_counted(&run);
    run.assert_times();
    let gap = *run.missing_frames().last().unwrap();
    let [before, after] = [0..gap, gap + 1..u32::MAX].map(|frames| frame_times_ms(&run, frames));
    assert!(
        before.iter().all(|ms| (12.7..12.9).contains(ms)),
        "{before:?}"
    );
    assert!(after.iter().all(|ms| (6.3..6.5).contains(ms)), "{after:?}");
    assert!(after.len() >= 8, "{after:?}");
}

/// Power is cut at each operation that keeps an exposure, in each way: the device has the new
/// exposure or the old one.
#[test]
#[ignore = "slow"]
fn after_a_power_cut_the_old_exposure_or_the_new_is_there() {
    let device = Device::new();
    let [old, new] = [exposed(2_000, Some(32)), exposed(4_000, Some(16))];
    let run = keeping(&device.flash, old, KEPT_MS).run();
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    let before = Contents::load(&device.flash).unwrap();
    let run = keeping(&device.flash, new, KEPT_MS).run();
    assert_eq!(run.outcome(KEEP), Outcome::Done);
    let start = |flash: &Path| {
        let run = started(flash);
        assert!(run.samples().iter().all(|sample| sample.force.is_some()));
        let report = run.settings();
        let found = (report.kept.camera, report.camera.settings);
        (found, run.report.flash_words.clone())
    };
    let mut found = Vec::new();
    let judge = |cut, _: &Contents, (is_kept, settings): &(bool, CameraSettings)| {
        assert!(
            *is_kept && [old, new].contains(settings),
            "{cut:?}: {settings:?}"
        );
        found.push(*settings);
    };
    let whole = run.report.flash_operations;
    cuts::start_each(&before, &whole, start, judge);
    assert_eq!((found.first(), found.last()), (Some(&old), Some(&new)));
}

/// The other camera has different registers with the same effects.
#[test]
#[ignore = "11 s: as the usual camera"]
fn the_global_shutter_camera_takes_exposure_gain_and_rate() {
    let settings = CameraSettings {
        exposure: Some(Microseconds(1_000)),
        gain: Some(Sixteenths(32)),
        rate: Rate::Half,
        white: None,
    };
    // Its forces come some frames later than the other board's.
    let run = openmv(460)
        .at(SET_MS + 40, send(SET, Request::SetCamera(settings)))
        .at(440, send(REPORT, Request::GetSettings))
        .run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    let CameraReport {
        exposure,
        gain,
        limits,
        ..
    } = run.settings().camera;
    // Half a row is 13 µs.
    assert!(exposure.0.abs_diff(1_000) <= 13, "{exposure}");
    assert_eq!(gain, Sixteenths(32));
    assert_eq!(limits.at(Rate::Half).frames_per_second, 115);
    assert_counted(&run);
    run.assert_times();
    let gap = *run.missing_frames().last().unwrap();
    let after = frame_times_ms(&run, gap + 1..u32::MAX);
    assert!(after.len() >= 8, "{after:?}");
    assert!(after.iter().all(|ms| (8.5..8.7).contains(ms)), "{after:?}");
    // At the end of the run the scene's press is near the largest force.
    let samples = run.samples();
    let last = samples.iter().rev().take(8);
    let forces = last.filter(|sample| sample.force.is_some()).count();
    assert!(forces >= 6, "{forces}: {}", run.log());
    let too_long = CameraSettings {
        exposure: Some(Microseconds(6_000)),
        ..settings
    };
    let run = setting(openmv(260), too_long).run();
    assert_eq!(run.outcome(SET), Outcome::InvalidArgument);
}
