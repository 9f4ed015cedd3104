//! Tests of the report of a failure that ended the program, with firmware that has seeded bugs, and
//! of starts that fail repeatedly.

use crate::common::{Bug, Run, Setup, command, elf, firmware, hello, other};
use hivtac_rig::report::Report;
use hivtac_rig::script::{Action, Restart};
use hivtac_rig::usb_host::Port;
use hivtac_wire::failure::{Failure, FailureKind};
use hivtac_wire::health::{Health, Problem, ResetReason};
use hivtac_wire::image::{FLASH, Image};
use hivtac_wire::message::{Outcome, Request};
use object::{Object, ObjectSymbol};
use std::path::Path;

const ASKED: u16 = 40;
/// The bug's frame is measured at about 260 ms. The program is back on USB 140 ms later, and fails
/// again 260 ms later.
const BACK_MS: u64 = 480;

fn seeded() -> Setup {
    Setup::new(other("seeded-bugs"), 510).ask_health_at(BACK_MS, ASKED)
}

fn health(run: &Run) -> &Health {
    assert_eq!(run.outcome(ASKED), Outcome::Done);
    run.health()
}

fn failure(health: &Health) -> &Failure {
    health.failure.as_ref().expect("it is reported")
}

/// The name of the function at an address of an ELF.
fn function(elf: &Path, address: u32) -> String {
    let bytes = std::fs::read(elf).unwrap();
    let file = object::File::parse(&*bytes).unwrap();
    let around = |symbol: &object::Symbol| {
        let begin = symbol.address() & !1;
        (begin..begin + symbol.size()).contains(&u64::from(address))
    };
    let symbol = file.symbols().find(around);
    symbol.expect("code is there").name().unwrap().to_owned()
}

/// Each seed leaves other words in memory at power-on.
#[test]
fn a_device_that_never_failed_tells_none() {
    for seed in 1..=3 {
        let mut setup = Setup::new(firmware(), 230).fault("camera-absent");
        setup.seed = seed;
        let run = setup.ask_health_at(200, ASKED).run();
        let health = health(&run);
        assert_eq!(health.failure, None);
    }
}

#[test]
#[ignore = "15 s: two starts with frames"]
fn a_bus_error_is_reported_after_the_reset_with_its_place() {
    let run = seeded().run_with(Bug::BusFault);
    let health = health(&run);
    assert_eq!(health.reset, ResetReason::Software);
    assert_eq!(health.problems, Problem::SoftwareReset.bit());
    let failure = failure(health);
    assert_eq!(failure.kind, FailureKind::BusFault, "{failure:x?}");
    assert_eq!((failure.starts_ago, failure.count), (1, 1));
    assert_eq!(failure.address, Some(0x2600_0000));
    assert_eq!(failure.exception, 0, "thread mode");
    let at = failure.program_counter.unwrap();
    let name = function(&other("seeded-bugs"), at);
    assert!(name.contains("access_nothing"), "{at:#x} {name}");
}

#[test]
fn a_panic_is_reported_with_its_source_line() {
    let run = seeded().run_with(Bug::Panic);
    let failure = failure(health(&run));
    assert_eq!(failure.kind, FailureKind::Panic, "{failure:x?}");
    let (path, line) = failure.place.split_once(':').unwrap();
    assert!(path.ends_with("src/seeded_bugs.rs"), "{path}");
    let source = include_str!("../../../firmware/src/seeded_bugs.rs");
    let line: usize = line.parse().unwrap();
    assert!(source.lines().nth(line - 1).unwrap().contains("panic!"));
}

/// The stack's memory cannot take the registers, so where it was is not known.
#[test]
#[ignore = "15 s: two starts with frames"]
fn a_stack_that_is_used_up_is_reported() {
    let run = seeded().run_with(Bug::StackOverflow);
    let failure = failure(health(&run));
    assert_eq!(failure.kind, FailureKind::StackOverflow, "{failure:x?}");
    assert_eq!(failure.count, 1);
}

/// Thread mode stands still at about 220 ms. The watchdog counts from its last food on.
#[test]
#[ignore = "15 s: until the watchdog ends it"]
fn a_program_that_stands_still_is_reported() {
    let setup = Setup::new(other("seeded-bugs"), 2_700).ask_health_at(2_650, ASKED);
    let run = setup.run_with(Bug::Hang);
    let health = health(&run);
    assert_eq!(health.reset, ResetReason::Watchdog);
    assert_eq!(failure(health).kind, FailureKind::Watchdog);
    assert_eq!(run.report.resets, 1);
}

/// The reset button leaves the memory, and the failure is older by a start.
#[test]
#[ignore = "30 s: several starts"]
fn a_failure_is_reported_until_the_power_is_cut() {
    let run = |restart: Restart| {
        let setup = Setup::new(other("seeded-bugs"), 620).restart_at(400, restart);
        setup.ask_health_at(580, ASKED).run_with(Bug::BusFault)
    };
    let run_on = run(Restart::Button);
    let reported = health(&run_on);
    assert_eq!(reported.reset, ResetReason::Pin);
    let failed = failure(reported);
    assert_eq!((failed.kind, failed.starts_ago), (FailureKind::BusFault, 2));

    let anew = run(Restart::PowerCycle);
    let reported = health(&anew);
    assert_eq!(reported.reset, ResetReason::PowerOn);
    assert_eq!(reported.failure, None);
}

/// The firmware that is written over USB makes the addresses of the one before worthless.
#[test]
#[ignore = "30 s: several starts"]
fn a_failure_is_forgotten_with_new_firmware() {
    let loader = Action::Send(command(41, Request::StartLoader));
    let run = Setup::new(other("seeded-bugs"), 1_400)
        .at(BACK_MS, Action::Send(hello()))
        .at(BACK_MS + 10, loader)
        .ask_health_at(1_350, ASKED)
        .run_with(Bug::Panic);
    assert_eq!(run.outcome(41), Outcome::Done);
    // It fails again after the loader: this is the only failure that it knows.
    assert_eq!(health(&run).failure.as_ref().map(|it| it.count), Some(1));
}

/// Runs the image of firmware with a seeded bug, as an update writes it.
fn sealed(bug: Bug, setup: impl FnOnce(Setup) -> Setup) -> Report {
    let image = Image::of_elf(&std::fs::read(other("seeded-bugs")).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flash.elf");
    std::fs::write(&path, elf(FLASH.start, image.bytes())).unwrap();
    let setup = setup(Setup::new(path, 1_000));
    let truth = folder.path().join("truth");
    setup
        .with(bug, |setup| setup.try_run(&truth))
        .unwrap()
        .report
}

/// The rig's loader starts the program 0.3 s later, which fails again, four times in each round.
#[test]
#[ignore = "20 s: as one that stands still in its start"]
fn a_program_that_fails_in_its_start_ends_in_the_loader() {
    let until = |virtual_ms: u64| {
        sealed(Bug::FaultAtStart, |setup| Setup {
            virtual_ms,
            ..setup
        })
    };
    // A start takes some milliseconds: the first stage checks 0.6 MB.
    let report = until(300);
    assert_eq!((report.resets, report.port), (4, Port::Empty));
    assert!(report.refused.len() <= 1, "{:?}", report.refused);
    let resets = until(900).resets;
    assert!(resets > 4 && resets.is_multiple_of(4), "{resets}");
}

#[test]
fn a_program_that_stands_still_in_its_start_ends_in_the_loader() {
    let report = sealed(Bug::HangAtStart, |setup| Setup {
        virtual_ms: 8_500,
        ..setup
    });
    assert_eq!((report.resets, report.port), (4, Port::Empty));
}

/// The core waits for the crystal until the watchdog resets it. The chip's loader needs none.
#[test]
#[ignore = "20 s: as one that stands still in its start"]
fn a_board_whose_crystal_does_not_start_ends_in_the_loader() {
    let image = Image::of_elf(&std::fs::read(firmware()).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flash.elf");
    std::fs::write(&path, elf(FLASH.start, image.bytes())).unwrap();
    let setup = Setup::new(path, 8_500).fault("crystal-silent");
    let report = setup.try_run(&folder.path().join("truth")).unwrap().report;
    assert_eq!((report.resets, report.port), (4, Port::Empty));
}

/// Neither pulls of the reset line, as of a supply that comes and goes, nor power cuts count; and
/// after one of them the program has four starts again.
#[test]
#[ignore = "70 s: many starts"]
fn a_supply_that_comes_and_goes_does_not_end_in_the_loader() {
    for restart in [Restart::Button, Restart::PowerCycle] {
        let image = Image::of_elf(&std::fs::read(firmware()).unwrap()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flash.elf");
        std::fs::write(&path, elf(FLASH.start, image.bytes())).unwrap();
        let setup = (1..=6).fold(Setup::new(path, 1_000), |setup, nth| {
            setup.restart_at(100 * nth, restart)
        });
        let run = setup.ask_health_at(960, ASKED).run();
        assert_eq!(run.report.resets, 6);
        assert_eq!(health(&run).failure, None, "{restart:?}");
    }
}

/// Nobody is plugged in, and each start fails 6 s later: they were good.
#[test]
#[ignore = "30 s: several seconds of virtual time"]
fn without_a_host_a_start_that_lasts_is_good() {
    let report = sealed(Bug::FaultLate, |setup| Setup {
        virtual_ms: 30_500,
        faults: vec!["camera-absent", "cable-pulled"],
        ..setup
    });
    // The loader would make the fifth one later.
    assert_eq!((report.resets, report.port), (5, Port::Empty));
}
