//! Tests of the brown-out level, an option byte that firmware sets once in a chip's life.

use std::path::{Path, PathBuf};

use crate::common::{Bug, Run, Setup, firmware, other};
use hivtac_rig::peripherals::flash::{Contents, FACTORY_OPTIONS, LEVEL, Operation};
use hivtac_wire::health::{BrownOut, Health, Problem, ResetReason};
use hivtac_wire::message::Outcome;

const ASKED: u16 = 40;
/// The camera is absent: a start that sets the level is a quarter of a second longer.
const BACK_MS: u64 = 500;

/// A new chip whose owner has chosen some options: IO_HSLV, and the watchdog stops in Stop mode.
const CHOSEN: u32 = (FACTORY_OPTIONS | 1 << 29) & !(1 << 17);
/// The options that firmware sets.
const SET: Operation = Operation::Options {
    options: CHOSEN | LEVEL,
};

/// A chip with its options, which outlive a run.
struct Chip {
    _folder: tempfile::TempDir,
    flash: PathBuf,
}

impl Chip {
    fn new(options: u32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let flash = folder.path().join("flash");
        Contents::with_options(options).save(&flash).unwrap();
        Self {
            _folder: folder,
            flash,
        }
    }

    fn setup(&self) -> Setup {
        let setup = Setup::new(firmware(), BACK_MS + 40).fault("camera-absent");
        let setup = setup.ask_health_at(BACK_MS, ASKED);
        Setup {
            flash: Some(self.flash.clone()),
            ..setup
        }
    }

    /// Returns its options.
    fn options(&self) -> u32 {
        Contents::load(&self.flash).unwrap().options
    }
}

fn health(run: &Run) -> &Health {
    assert_eq!(run.outcome(ASKED), Outcome::Done);
    run.health()
}

/// Asserts that the level is not set, and that the device serves its host.
fn assert_left(chip: &Chip, run: &Run, before: u32, problems: u32) {
    assert_eq!(chip.options(), before);
    let health = health(run);
    assert_eq!(health.brown_out, BrownOut::Off);
    let camera = Problem::CameraSilent.bit();
    assert_eq!(health.problems & !camera, problems, "{health:?}");
}

#[test]
fn a_new_chip_gets_its_level_once_and_keeps_its_other_options() {
    let chip = Chip::new(CHOSEN);
    let run = chip.setup().run();
    assert_eq!(run.report.flash_operations, [SET]);
    assert_eq!(chip.options(), CHOSEN | LEVEL);
    assert_eq!(health(&run).brown_out, BrownOut::High, "without a reset");
    let camera = Problem::CameraSilent.bit();
    assert_eq!(health(&run).problems, camera);

    let again = chip.setup().run();
    assert_eq!(again.report.flash_operations, []);
    assert_eq!(health(&again).brown_out, BrownOut::High);
}

#[test]
fn a_lower_level_is_raised() {
    let chip = Chip::new(FACTORY_OPTIONS | 1 << 2);
    chip.setup().run();
    assert_eq!(chip.options(), FACTORY_OPTIONS | LEVEL);
}

/// The old options stay, or the new ones are there; either device starts.
#[test]
fn a_power_cut_leaves_a_device_that_starts_and_has_its_level_then() {
    for leaves in ["before", "torn", "after"] {
        let chip = Chip::new(CHOSEN);
        let mut setup = chip.setup();
        setup.cut = Some(format!("0:{leaves}").parse().unwrap());
        let cut = setup.try_run(Path::new("/dev/null")).unwrap();
        assert!(cut.report.power_was_cut);
        let is_set = leaves == "after";
        assert_eq!(chip.options() == CHOSEN | LEVEL, is_set, "{leaves}");
        assert!(is_set || chip.options() == CHOSEN, "{leaves}");

        let next = chip.setup().run();
        let expected: &[Operation] = if is_set { &[] } else { &[SET] };
        assert_eq!(next.report.flash_operations, expected, "{leaves}");
        assert_eq!(health(&next).brown_out, BrownOut::High);
        assert_eq!(chip.options(), CHOSEN | LEVEL);
    }
}

/// It is low, it becomes low, or it comes back.
#[test]
fn nothing_is_written_while_the_supply_is_not_steady() {
    for fault in ["supply-low", "supply-low@100", "supply-low@0-100"] {
        let chip = Chip::new(CHOSEN);
        let run = chip.setup().fault(fault).run();
        assert_eq!(run.report.flash_operations, [], "{fault}");
        assert_left(&chip, &run, CHOSEN, 0);
    }
}

#[test]
fn a_change_that_fails_is_reported_and_the_device_works() {
    let chip = Chip::new(CHOSEN);
    let run = chip.setup().fault("flash-fails").run();
    assert_eq!(run.report.flash_operations, [SET]);
    assert_left(&chip, &run, CHOSEN, Problem::FlashFails.bit());
}

/// Readout protection is somebody's decision about this chip, and level 2 allows no change.
#[test]
fn a_protected_chip_is_left_alone() {
    for protection in [0x55, 0xCC] {
        let options = FACTORY_OPTIONS & !0xFF00 | protection << 8;
        let chip = Chip::new(options);
        let run = chip.setup().run();
        assert_eq!(run.report.flash_operations, []);
        assert_left(&chip, &run, options, 0);
    }
}

/// A chip that the watchdog resets in the change would do so for ever. Here the supply is low at
/// the first start, and good after the watchdog's reset.
#[test]
#[ignore = "15 s: until the watchdog ends it"]
fn a_start_by_the_watchdog_does_not_try_again() {
    let chip = Chip::new(CHOSEN);
    let setup = Setup::new(other("seeded-bugs"), 3_000).ask_health_at(2_950, ASKED);
    let setup = Setup {
        flash: Some(chip.flash.clone()),
        ..setup
    };
    let run = setup.fault("supply-low@0-1000").run_with(Bug::Hang);
    assert_eq!(run.report.resets, 1);
    assert_eq!(run.report.flash_operations, []);
    assert_eq!(health(&run).reset, ResetReason::Watchdog);
    assert_eq!(health(&run).brown_out, BrownOut::Off);
}
