//! Verifies the linear limit against plate theory: deflections of square plates of side a.
//!
//! Sources: Timoshenko & Woinowsky-Krieger, "Theory of Plates and Shells", 2nd ed., Tables 8 and 35
//! and Sections 30, 34 and 44. The clamped plate's digits are those of Taylor & Govindjee, Commun.
//! Numer. Meth. Engng 20 (2004) 757.

use super::*;

const SIDE_MM: f64 = 10.0;
const PLATE: Material = Material {
    youngs_mpa: 1.0,
    poisson: 0.3,
    thickness_mm: 0.1,
};

/// Returns a square plate whose edges do not move along z, and do not turn if `clamped`.
fn plate(cells: usize, clamped: bool) -> Shell {
    let mut shell = rectangle([SIDE_MM; 2], [cells; 2], &PLATE);
    let held = if clamped { 2 } else { 1 };
    for k in 0..shell.grid().unknowns() / 3 {
        let [x, y] = depth(&shell, k);
        if x.min(y) < held {
            shell.pin(3 * k + 2, PIN_N_PER_MM);
        }
        if x.min(y) == 0 {
            shell.pin(3 * k, PIN_N_PER_MM);
            shell.pin(3 * k + 1, PIN_N_PER_MM);
        }
    }
    shell
}

fn centre_deflection(shell: &Shell, load: Vec<f64>) -> f64 {
    displacement(shell, &linear(shell, load), [SIDE_MM / 2.0; 2])[2]
}

/// Returns w D / (q a⁴) in the centre under pressure q.
fn under_pressure(cells: usize, clamped: bool) -> f64 {
    let shell = plate(cells, clamped);
    let q = 1e-6;
    let w = centre_deflection(&shell, pressure(&shell, q, 2));
    w * PLATE.bending_n_mm() / (q * SIDE_MM.powi(4))
}

/// Returns w D / (P a²) in the centre under a force P there.
fn under_force(cells: usize, clamped: bool) -> f64 {
    let shell = plate(cells, clamped);
    let force = 1e-6;
    let w = centre_deflection(&shell, point_force(&shell, [SIDE_MM / 2.0; 2], force, 2));
    w * PLATE.bending_n_mm() / (force * SIDE_MM.powi(2))
}

/// Sums Navier's series for the simply supported plate, all modes to the 999th.
fn navier(term: impl Fn(f64, f64) -> f64) -> f64 {
    let odd = || (0..500).map(|k| f64::from(2 * k + 1));
    odd()
        .flat_map(|m| odd().map(move |n| (m, n)))
        .map(|(m, n)| term(m, n))
        .sum()
}

#[test]
fn supported_plate_under_pressure_converges_with_order_four() {
    let pi = std::f64::consts::PI;
    let sign = |m: f64| if m % 4.0 == 1.0 { 1.0 } else { -1.0 };
    let exact =
        16.0 / pi.powi(6) * navier(|m, n| sign(m) * sign(n) / (m * n * (m * m + n * n).powi(2)));
    assert!((exact - 0.004_062_35).abs() < 1e-8);
    let errors = [4, 8, 16].map(|cells| (under_pressure(cells, false) - exact).abs() / exact);
    println!("supported, pressure, 4/8/16 cells: errors {errors:?}");
    assert!(errors[2] < 3e-6, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1]).log2() > 3.5, "{errors:?}");
    }
}

#[test]
fn clamped_plate_under_pressure_converges_with_order_four() {
    let exact = 0.001_265_319_1;
    let errors = [4, 8, 16].map(|cells| (under_pressure(cells, true) - exact).abs() / exact);
    println!("clamped, pressure, 4/8/16 cells: errors {errors:?}");
    assert!(errors[2] < 3e-5, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1]).log2() > 3.5, "{errors:?}");
    }
}

#[test]
fn plates_under_a_force_converge_with_order_two() {
    let pi = std::f64::consts::PI;
    let supported = 4.0 / pi.powi(4) * navier(|m, n| (m * m + n * n).powi(-2));
    for (clamped, exact) in [(false, supported), (true, 0.005_612_0)] {
        let errors = [4, 8, 16].map(|cells| (under_force(cells, clamped) - exact).abs() / exact);
        println!("clamped {clamped}, force, 4/8/16 cells: errors {errors:?}");
        assert!(errors[2] < 3e-3, "{errors:?}");
        for pair in errors.windows(2) {
            assert!((pair[0] / pair[1]).log2() > 1.7, "{errors:?}");
        }
    }
}

/// Pure twist, which tests the free edges. The plate is held at three corners and pulled at the
/// fourth: w = P x y / (2 D (1−ν)).
#[test]
fn a_plate_twisted_at_its_corners_is_exact() {
    let mut shell = rectangle([SIDE_MM; 2], [5, 4], &PLATE);
    let [columns, rows] = shell.grid().functions();
    let corners = [0, columns - 1, (rows - 1) * columns];
    for k in corners {
        shell.pin(3 * k + 2, PIN_N_PER_MM);
    }
    // In its plane the plate only needs to be kept in place.
    for unknown in [0, 1, 3 * (columns - 1) + 1] {
        shell.pin(unknown, PIN_N_PER_MM);
    }
    let force = 1e-6;
    let u = linear(&shell, point_force(&shell, [SIDE_MM; 2], force, 2));
    for (x, y) in [(10.0, 10.0), (5.0, 5.0), (3.0, 8.0), (10.0, 4.0)] {
        let exact = force * x * y / (2.0 * PLATE.bending_n_mm() * (1.0 - PLATE.poisson));
        let w = displacement(&shell, &u, [x, y])[2];
        assert!((w - exact).abs() < 1e-6 * exact, "({x}, {y}): {w} {exact}");
    }
}
