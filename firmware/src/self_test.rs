//! Tests the device itself: at the start, before the first sample, and on request.
//!
//! # Design
//! The test at the start is limited to cheap checks: flash, model and stack by their known state,
//! and the arithmetic by one answer of the built-in model. The camera's set-up checks its identity,
//! its registers and its frame time anyway. Only the temperature is omitted, because its converter
//! takes time.
//!
//! # Limitations A kept model gets no known question. Its checksum proves that its bytes are those
//! that were sent, and the built-in model's answer proves kernels and arithmetic.
//! `docs/firmware.md` has the argument.

use crate::condition::{self, Condition};
use crate::dtcm_table::Sensor;
use crate::model;
use crate::settings;
use crate::{camera, failure, faults, stack, supply};
use core::sync::atomic::{AtomicU32, Ordering};
use hivtac_wire::health::{Health, Problem, ResetReason};
use hivtac_wire::message::ModelSource;
use hivtac_wire::settings::Found;

/// Problems found at the start, bits of `Problem`. Written at boot and by the capture task; read by
/// the memory task and the LED task.
static AT_START: AtomicU32 = AtomicU32::new(0);

/// The camera's problems in its newest set-up, bits of `Problem`. Written by the capture task; read
/// by the memory task.
static CAMERA_PROBLEM: AtomicU32 = AtomicU32::new(0);

/// Highest temperature of the junction, where the sensor is, hundredths of a degree: 20 °C below
/// the absolute maximum of 125 °C (DS12110 Rev. 5, table 22), as the core has its highest voltage.
const HOTTEST: i16 = 10_500;

/// A clock is wrong if frames are longer or shorter than one part in this many. Crystals differ by
/// a tenth of a thousandth.
const FRAME_TIME_PART: u32 = 100;

/// The flash owner's part of the self-test.
pub struct OfFlash {
    /// The content of the flash at the start.
    pub found: Found,
    /// Number of failed attempts to write.
    pub failures: u32,
}

/// Runs all checks, with this temperature, hundredths of a degree.
pub fn health(flash: &OfFlash, temperature_centidegrees: Option<i16>) -> Health {
    let at_start = AT_START.load(Ordering::Relaxed);
    let is_hot = temperature_centidegrees.is_none_or(|temperature| temperature > HOTTEST);
    let found = [
        (
            Problem::CameraSilent,
            condition::get() == Condition::NoCamera,
        ),
        (Problem::Temperature, is_hot),
    ];
    Health {
        reset: faults::reset_reason(),
        temperature_centidegrees,
        stack_used: stack::used(),
        stack_bytes: stack::bytes(),
        problems: bits(&found)
            | standing(flash)
            | CAMERA_PROBLEM.load(Ordering::Relaxed)
            | at_start & Problem::Arithmetic.bit(),
        at_start,
        brown_out: supply::brown_out(),
        failure: failure::last(),
    }
}

/// Runs the cheap checks. Call once, after `sensor` is configured.
pub fn at_start(flash: &OfFlash, sensor: &mut Sensor) {
    let wrong = !model::answers_right(sensor);
    let problems = standing(flash) | bits(&[(Problem::Arithmetic, wrong)]);
    AT_START.store(problems, Ordering::Relaxed);
}

/// Runs the checks that are possible at any time.
fn standing(flash: &OfFlash) -> u32 {
    let reset = faults::reset_reason();
    let model = settings::of_pipeline().and_then(|settings| settings.model);
    let source = model.as_ref().map(|model| model.source);
    bits(&[
        (Problem::ModelMissing, model.is_none()),
        (
            Problem::ModelFallback,
            source == Some(ModelSource::Fallback),
        ),
        (
            Problem::SettingsUnread,
            flash.found == Found::AnotherVersion,
        ),
        (Problem::FlashFails, flash.failures > 0),
        (Problem::StackLow, stack::used() > stack::bytes() / 5 * 4),
        (Problem::WatchdogReset, reset == ResetReason::Watchdog),
        (Problem::SoftwareReset, reset == ResetReason::Software),
    ])
}

fn bits(found: &[(Problem, bool)]) -> u32 {
    let bit = |(problem, is_there): &(Problem, bool)| if *is_there { problem.bit() } else { 0 };
    found.iter().map(bit).fold(0, |all, bit| all | bit)
}

/// Records that the camera could not be set up; `starting` is true until it was set up once.
pub fn camera_failed(error: &camera::Error, starting: bool) {
    let problem = match error {
        camera::Error::Bus(_) => Problem::CameraSilent,
        camera::Error::Other(_) | camera::Error::WrongId { .. } => Problem::AnotherCamera,
        camera::Error::Register { .. } => Problem::CameraRegisters,
    };
    CAMERA_PROBLEM.store(problem.bit(), Ordering::Relaxed);
    if starting {
        AT_START.fetch_or(problem.bit(), Ordering::Relaxed);
    }
}

/// Records that the camera was set up; its frame time, µs, `None` if no frame came; and its
/// problems, bits of `Problem`. `starting` is true the first time.
pub fn camera_answers(frame_us: Option<u32>, should_us: u32, problems: u32, starting: bool) {
    let off = |us: u32| us.abs_diff(should_us) > should_us / FRAME_TIME_PART;
    let problem = problems | bits(&[(Problem::Clocks, frame_us.is_some_and(off))]);
    CAMERA_PROBLEM.store(problem, Ordering::Relaxed);
    if starting {
        AT_START.fetch_or(problem, Ordering::Relaxed);
    }
}

/// Records that settings of the camera were changed, and its problems now, bits of `Problem`.
pub fn camera_set(problems: u32) {
    let clocks = CAMERA_PROBLEM.load(Ordering::Relaxed) & Problem::Clocks.bit();
    CAMERA_PROBLEM.store(problems | clocks, Ordering::Relaxed);
}

/// Returns whether a problem was found at the start that the LED's other patterns do not show, and
/// with which forces are not to be trusted.
pub fn failed_at_start() -> bool {
    const REPORTED_OTHERWISE: [Problem; 6] = [
        Problem::CameraSilent,
        Problem::AnotherCamera,
        Problem::CameraRegisters,
        Problem::Exposure,
        Problem::WatchdogReset,
        Problem::SoftwareReset,
    ];
    let otherwise = REPORTED_OTHERWISE.map(Problem::bit);
    let otherwise = otherwise.iter().fold(0, |all, bit| all | bit);
    AT_START.load(Ordering::Relaxed) & !otherwise != 0
}
