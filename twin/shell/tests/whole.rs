//! Tests of the committed tables of the whole film against the full solution.

use hivtac_shell::whole::{Errors, WholeCheck, WholeDomain, check_whole};
use hivtac_twin::film::reduced::{LARGEST_RADIUS_MM, SMALLEST_RADIUS_MM, Unit};
use hivtac_twin::film::whole::WholeFilm;

/// Largest errors of centroids, px at 320×240 `ov7725`: anywhere, and near the tip.
const MOST_PX: [f64; 2] = [0.1, 0.15];
/// The largest error of a film that differs from the nominal one as much as one built by hand.
const MOST_PX_OF_A_UNIT: f64 = 0.4;

fn check(domain: &WholeDomain, loads: usize, threads: usize) -> WholeCheck {
    let found = check_whole(WholeFilm::nominal(), domain, loads, threads, |_, _| ());
    let found = found.unwrap();
    println!("{domain:?}: {found:?}");
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
    assert_good(&check(&WholeDomain::within(6.0), 2, 1));
}

fn check_film_built_by_hand(loads: usize, threads: usize) {
    let unit = Unit {
        stiffness: 0.8,
        thickness: 1.1,
        grip: 1.5,
        posts_mm: [[0.3, -0.2], [-0.3, 0.1], [0.2, 0.3], [0.1, -0.3]],
        ..Unit::default()
    };
    let domain = WholeDomain {
        unit,
        radii_mm: [SMALLEST_RADIUS_MM, LARGEST_RADIUS_MM],
        ..WholeDomain::within(6.0)
    };
    let found = check(&domain, loads, threads);
    for errors in [found.anywhere, found.near] {
        assert!(errors.count > 0 && errors.worst_px < MOST_PX_OF_A_UNIT);
    }
}

#[test]
#[ignore = "10 s: full solutions"]
fn dots_of_a_film_built_by_hand_move_as_in_its_full_solution() {
    check_film_built_by_hand(2, 1);
}

/// The four dots move as well by these tables as by their own.
#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn dots_anywhere_move_as_in_the_full_solution_everywhere() {
    let threads = std::thread::available_parallelism().unwrap().get();
    let found = check(&WholeDomain::within(6.0), 30, threads);
    assert_good(&found);
    assert!(
        found.four.rms_px() < found.four_by_own.rms_px(),
        "{found:?}"
    );
    check_film_built_by_hand(4, threads);
}
