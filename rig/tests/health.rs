//! What the flashed firmware says of itself, and how it gives way to the part's own loader.

use crate::common::{Setup, command, firmware};
use hivtac_rig::script::Action;
use hivtac_wire::health::{Health, Problem, ResetReason};
use hivtac_wire::message::{DeviceMessage, Outcome, Request};

const ASKED: u16 = 40;
const ASKED_MS: u64 = 200;

fn ask(request: Request, virtual_ms: u64) -> Setup {
    let asked = Action::Send(command(ASKED, request));
    Setup::new(firmware(), virtual_ms).at(ASKED_MS, asked)
}

fn health(setup: Setup) -> Health {
    let run = setup.run();
    assert_eq!(run.outcome(ASKED), Outcome::Done);
    let mut told = run.messages.iter().filter_map(|message| match message {
        DeviceMessage::Health(health) => Some(*health),
        _ => None,
    });
    told.next().expect("it tells")
}

#[test]
fn a_device_that_was_just_switched_on_has_no_problem() {
    let health = health(ask(Request::GetHealth, 230));
    assert_eq!(health.reset, ResetReason::PowerOn, "{health:?}");
    // The emulator's part is at 30 °C.
    let temperature = health.temperature_centidegrees.expect("its sensor tells");
    assert!((2_900..3_100).contains(&temperature), "{health:?}");
    assert_eq!(health.stack_bytes, 28 << 10);
    let free = health.stack_bytes - health.stack_used;
    assert!(health.stack_used > 1_000 && free > 6_000, "{health:?}");
    assert_eq!(health.problems, 0, "{health:?}");
    println!("{health:?}");
}

#[test]
fn a_camera_that_is_not_there_is_a_problem() {
    let health = health(ask(Request::GetHealth, 230).fault("camera-absent"));
    assert_eq!(health.problems, Problem::CameraSilent.bit(), "{health:?}");
}

/// The loader's stand-in does nothing: the part leaves USB and does not come back, as firmware
/// that only restarts would.
#[test]
fn the_parts_own_loader_is_started_on_request() {
    let run = ask(Request::StartLoader, 900).fault("camera-absent").run();
    assert_eq!(run.outcome(ASKED), Outcome::Done);
    let report = &run.report;
    assert_eq!(report.resets, 1, "{:?}", report.usb_log);
    assert_eq!(report.usb.enumerations, 1, "{:?}", report.usb_log);
    assert!(report.refused.is_empty(), "{:?}", report.refused);
}
