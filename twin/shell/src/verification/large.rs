//! Verifies the limit of large deflections: a membrane.

use super::*;

const HALF_MM: f64 = 5.0;
const LOAD_N_PER_MM2: f64 = 0.02;

/// Returns the depth in the middle of a long strip between two held edges under a dead load, ∫ λ q
/// X/T dX.
///
/// The strip is a string of St Venant–Kirchhoff's law with H the constant horizontal force and q X
/// the vertical one. A λ(λ²−1)/2 = √(H² + q² X²) gives the stretch λ at each X. The strip must
/// still span the gap: ∫ λ H/T dX = half of it.
fn string_depth(stiffness: f64) -> f64 {
    let integrals = |h: f64| {
        let (mut across, mut down) = (0.0, 0.0);
        let n = 20_000;
        for i in 0..n {
            let vertical = LOAD_N_PER_MM2 * HALF_MM * (i as f64 + 0.5) / n as f64;
            let tension = (h * h + vertical * vertical).sqrt();
            let per_tension = stretch(2.0 * tension / stiffness) / tension * HALF_MM / n as f64;
            across += per_tension * h;
            down += per_tension * vertical;
        }
        (across, down)
    };
    let (mut low, mut high) = (1e-9, stiffness);
    for _ in 0..100 {
        let middle = (low + high) / 2.0;
        if integrals(middle).0 < HALF_MM {
            low = middle;
        } else {
            high = middle;
        }
    }
    integrals(low).1
}

/// Returns λ ≥ 1 with λ³ − λ = c.
fn stretch(c: f64) -> f64 {
    let mut x = 1.0 + c.cbrt();
    for _ in 0..60 {
        x -= (x * x * x - x - c) / (3.0 * x * x - 1.0);
    }
    x
}

#[test]
fn a_strip_under_load_is_a_string() {
    // Thin, with bending at 10⁻⁶ of the energy, and soft, with a stretch by half.
    let strip = Material {
        youngs_mpa: 10.0,
        poisson: 0.49,
        thickness_mm: 0.01,
    };
    let mut shell = rectangle([2.0 * HALF_MM, 1.0], [24, 1], &strip);
    let columns = shell.grid().functions()[0];
    for k in 0..shell.grid().unknowns() / 3 {
        let edge = depth(&shell, k)[0] == 0;
        // Plane strain: no motion along y, and no variation along it.
        shell.pin(3 * k + 1, PIN_N_PER_MM);
        if edge {
            shell.pin(3 * k, PIN_N_PER_MM);
            shell.pin(3 * k + 2, PIN_N_PER_MM);
        }
    }
    assert_eq!(columns, 27);
    let u = ramped(&shell, &pressure(&shell, LOAD_N_PER_MM2, 2), 1);
    let w = displacement(&shell, &u, [HALF_MM, 0.5])[2];
    let expected = string_depth(strip.membrane_n_per_mm());
    println!("string: depth {w:.6} mm, exact {expected:.6} mm");
    assert!(expected > 3.0, "a large deflection: {expected}");
    assert!((w / expected - 1.0).abs() < 2e-3, "{w} {expected}");
}
