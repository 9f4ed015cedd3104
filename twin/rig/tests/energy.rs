//! Tests that the core sleeps whenever there is nothing to do (`docs/results/energy.md`).

use crate::common::{Setup, firmware, openmv};

/// Prints how much of its time the core is awake; `-- --nocapture` shows it.
#[test]
fn the_core_sleeps_between_rows() {
    for (board, setup, stated) in [
        ("WeAct, OV7725", Setup::new(firmware(), 1_000), 0.27),
        ("OpenMV, MT9V034", openmv(1_000), 0.19),
    ] {
        let run = setup.run();
        let awake = run.report.awake.expect("a run of a second");
        println!("{board}: awake {:.0} % of the time", 100.0 * awake);
        assert!((awake - stated).abs() < 0.05, "{board}: {awake}");
    }
}
