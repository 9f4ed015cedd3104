//! Tests of variants of the chip: an old revision, and a program that the ROM's loader starts.

use crate::common::{Setup, firmware};
use crate::led;
use hivtac_rig::chip::Revision;
use hivtac_rig::machine::Entry;
use hivtac_rig::usb_host::Port;

/// Revision Y ends at 400 MHz. The LED flashes twice a second and nothing else is set up; 480 MHz
/// would end the run.
#[test]
fn an_old_revision_is_refused_with_a_flashing_led() {
    let setup = Setup {
        revision: Revision::Y,
        ..Setup::new(firmware(), 1_600)
    };
    let directory = tempfile::tempdir().unwrap();
    let report = setup
        .try_run(&directory.path().join("truth"))
        .unwrap()
        .report;
    assert_eq!(
        (report.port, report.exposures, report.resets),
        (Port::Empty, 0, 0)
    );
    led::assert_flashes_twice(&report);
}

/// `dfu-util …:leave` enters the program with the ROM's vector table in use.
#[test]
fn a_program_that_the_loader_started_takes_its_own_interrupts() {
    let setup = Setup {
        entry: Entry::Loader,
        ..Setup::new(firmware(), 220)
    };
    let run = setup.run();
    assert!(run.samples().len() >= 3, "{:?}", run.report);
    assert_eq!(run.report.resets, 0);
}
