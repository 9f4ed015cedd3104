//! Tests of the firmware's self-test and health report, and of its switch to the part's own loader.

use crate::common::{Run, Setup, command, firmware};
use crate::settings::{Device, of_another_version};
use hivtac_rig::script::Action;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network;
use hivtac_sensor::known_answer;
use hivtac_wire::frame::CRC32;
use hivtac_wire::health::{Health, Problem, ResetReason};
use hivtac_wire::message::{Outcome, Request};

const ASKED: u16 = 40;
const ASKED_MS: u64 = 200;
/// The time is within the read-back of written registers.
const FORGETS: &str = "camera-forgets@97";

fn ask(request: Request, virtual_ms: u64) -> Setup {
    let asked = Action::Send(command(ASKED, request));
    Setup::new(firmware(), virtual_ms).at(ASKED_MS, asked)
}

fn health(setup: Setup) -> Health {
    health_of(&setup.run())
}

fn health_of(run: &Run) -> Health {
    assert_eq!(run.outcome(ASKED), Outcome::Done);
    run.health().clone()
}

#[test]
fn a_device_that_was_just_switched_on_has_no_problem() {
    let health = health(ask(Request::GetHealth, 230));
    assert_eq!(health.reset, ResetReason::PowerOn, "{health:?}");
    // The rig's part is at 60 °C.
    let temperature = health.temperature_centidegrees.expect("its sensor answers");
    assert!((5_900..6_100).contains(&temperature), "{health:?}");
    assert_eq!(health.stack_bytes, 40_960);
    let free = health.stack_bytes - health.stack_used;
    assert!(health.stack_used > 1_000 && free > 6_000, "{health:?}");
    assert_eq!((health.problems, health.at_start), (0, 0), "{health:?}");
    println!("{health:?}");
}

#[test]
fn a_camera_that_is_not_there_is_a_problem() {
    let health = health(ask(Request::GetHealth, 230).fault("camera-absent"));
    let silent = Problem::CameraSilent.bit();
    assert_eq!((health.problems, health.at_start), (silent, silent));
}

#[test]
fn a_camera_of_another_kind_is_reported() {
    let health = health(ask(Request::GetHealth, 230).fault("camera-wrong-id"));
    let another = Problem::AnotherCamera.bit();
    let now = another | Problem::CameraSilent.bit();
    assert_eq!((health.problems, health.at_start), (now, another));
}

/// The camera's registers go back to their reset values during the set-up. The camera is set up
/// anew, and forces come. The report still names the problem at the start.
#[test]
fn a_register_that_does_not_hold_what_was_written_is_reported() {
    let asked = Action::Send(command(ASKED, Request::GetHealth));
    let setup = Setup::new(firmware(), 920).at(900, asked);
    let run = setup.fault(FORGETS).run();
    let health = health_of(&run);
    let expected = (0, Problem::CameraRegisters.bit());
    assert_eq!(
        (health.problems, health.at_start),
        expected,
        "{}",
        run.log()
    );
    assert!(run.samples().last().unwrap().force.is_some());
}

/// The camera's clock loop multiplies by half of its proper factor.
#[test]
fn frames_that_take_another_time_than_they_should_are_reported() {
    let asked = Action::Send(command(ASKED, Request::GetHealth));
    let setup = Setup::new(firmware(), 400).at(380, asked);
    let run = setup.fault("camera-slow").run();
    let health = health_of(&run);
    let clocks = Problem::Clocks.bit();
    assert_eq!((health.problems, health.at_start), (clocks, clocks));
    assert!(!run.samples().is_empty(), "forces go on");
}

#[test]
fn kept_settings_that_are_not_read_are_reported() {
    let Device { flash, .. } = &Device::new();
    of_another_version(flash);
    let setup = Setup {
        flash: Some(flash.clone()),
        ..ask(Request::GetHealth, 230)
    };
    let health = health(setup);
    let unread = Problem::SettingsUnread.bit();
    assert_eq!((health.problems, health.at_start), (unread, unread));
}

/// The built-in model is replaced by a different one with a valid checksum. Its answers differ from
/// those computed at build time: the arithmetic counts as faulty.
#[test]
#[ignore = "13 s"]
fn a_built_in_model_that_answers_otherwise_is_reported() {
    let directory = tempfile::tempdir().unwrap();
    let elf = directory.path().join("firmware.elf");
    let mut program = std::fs::read(firmware()).unwrap();
    let file = include_bytes!("../../../calibration/models/default.hvtm");
    let mut windows = program.windows(file.len());
    let at = windows.position(|window| window == file);
    let at = at.expect("it is built in");
    let other = of_another_answer(file);
    program[at..at + other.len()].copy_from_slice(&other);
    std::fs::write(&elf, program).unwrap();
    let setup = Setup {
        elf,
        ..ask(Request::GetHealth, 230)
    };
    let health = health(setup);
    let arithmetic = Problem::Arithmetic.bit();
    assert_eq!((health.problems, health.at_start), (arithmetic, arithmetic));
}

/// Returns the model with one bit changed, which changes its answer, and with the right checksum.
fn of_another_answer(file: &[u8]) -> Vec<u8> {
    let answer = |file: &[u8]| {
        let model = Model::parse(file).ok()?;
        Some(known_answer::of(&model, &mut Network::new()))
    };
    let good = answer(file);
    let end = file.len() - 4;
    let changed = (0..end).step_by(499).map(|at| {
        let mut other = file.to_vec();
        other[at] ^= 0x40;
        let crc = CRC32.checksum(&other[..end]);
        other[end..].copy_from_slice(&crc.to_le_bytes());
        other
    });
    let mut others = changed.filter(|other| answer(other).is_some_and(|it| Some(it) != good));
    others.next().expect("some bit matters")
}

/// The loader's stand-in is absent from USB for a third of a second, and then starts the program by
/// a jump. The reset for it does not count as a fault of the program: its reason is `Other`. A mere
/// restart has a reason of its own.
#[test]
fn the_parts_own_loader_is_started_on_request_and_leaves_no_trace() {
    const AGAIN: u16 = 41;
    let hello = Action::Send(crate::common::hello());
    let asked = Action::Send(command(AGAIN, Request::GetHealth));
    let run = ask(Request::StartLoader, 1_100)
        .fault("camera-absent")
        .at(1_060, hello)
        .at(1_070, asked)
        .run();
    assert_eq!(run.outcome(ASKED), Outcome::Done);
    let report = &run.report;
    assert_eq!(report.resets, 1, "{:?}", report.usb_log);
    assert_eq!(report.usb.enumerations, 2, "{:?}", report.usb_log);
    assert!(report.refused.is_empty(), "{:?}", report.refused);
    assert_eq!(run.outcome(AGAIN), Outcome::Done);
    let health = run.health();
    let silent = Problem::CameraSilent.bit();
    assert_eq!(
        (health.reset, health.problems),
        (ResetReason::Other, silent)
    );
}
