//! Tests of the committed tables of the whole film against the full solution.

use hivtac_shell::whole::{Errors, WholeCheck, check_whole};
use hivtac_twin::film::whole::WholeFilm;

/// Largest errors of centroids, px at 320×240 `ov7725`: anywhere, and near the tip.
const MOST_PX: [f64; 2] = [0.1, 0.15];

fn check(reach_mm: f64, loads: usize, threads: usize) -> WholeCheck {
    let found = check_whole(WholeFilm::nominal(), reach_mm, loads, threads, |_, _| ());
    let found = found.unwrap();
    println!("within ±{reach_mm} mm: {found:?}");
    found
}

fn assert_good(found: &WholeCheck) {
    let kinds = [found.anywhere, found.near];
    for (errors, most_px) in kinds.into_iter().zip(MOST_PX) {
        let Errors {
            count, worst_px, ..
        } = errors;
        assert!(count > 0 && worst_px < most_px, "{errors:?}");
        assert!(errors.rms_px() < 0.3 * most_px, "{errors:?}");
    }
    assert!(found.worst_tip_mm < 0.02, "{} mm", found.worst_tip_mm);
}

#[test]
fn dots_anywhere_move_as_in_the_full_solution() {
    assert_good(&check(6.0, 4, 1));
}

/// The four dots move as well by these tables as by their own.
#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn dots_anywhere_move_as_in_the_full_solution_everywhere() {
    let threads = std::thread::available_parallelism().unwrap().get();
    let found = check(6.0, 30, threads);
    assert_good(&found);
    assert!(
        found.four.rms_px() < found.four_by_own.rms_px(),
        "{found:?}"
    );
}
