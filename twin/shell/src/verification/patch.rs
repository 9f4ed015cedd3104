//! Verifies that constant strain and constant curvature are exact.

use super::*;
use crate::spline::SUPPORT;

const FILM: Material = Material {
    youngs_mpa: 1.0,
    poisson: 0.49,
    thickness_mm: 0.5,
};

/// Returns a film of unequal cells.
fn uneven() -> Shell {
    let axes = [
        Axis::new(&[0.0, 0.7, 1.0, 2.2, 3.0, 5.0]),
        Axis::new(&[0.0, 1.1, 1.3, 2.0, 4.0]),
    ];
    Shell::new(Grid { axes, points: 3 }, &Sheet::of(&FILM))
}

/// Returns the largest force on a function that vanishes with its slope on the edges. It is zero in
/// equilibrium.
fn inner_force(shell: &Shell, u: &[f64], components: &[usize]) -> f64 {
    let gradient = shell.derivatives(u).gradient;
    let inside = gradient.chunks(3).enumerate().filter(|(k, _)| {
        let [x, y] = depth(shell, *k);
        x.min(y) >= 2
    });
    inside
        .flat_map(|(_, force)| components.iter().map(|&c| force[c].abs()))
        .fold(0.0, f64::max)
}

#[test]
fn a_constant_large_strain_is_exact() {
    let shell = uneven();
    // The film is stretched, sheared and turned out of the plane.
    let u = coefficients(&shell, |x, y| {
        [0.2 * x + 0.1 * y, -0.15 * x + 0.3 * y, 0.4 * x - 0.2 * y]
    });
    let a1: [f64; 3] = [1.2, -0.15, 0.4];
    let a2: [f64; 3] = [0.1, 1.3, -0.2];
    let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let [e1, e2, g] = [
        (dot(&a1, &a1) - 1.0) / 2.0,
        (dot(&a2, &a2) - 1.0) / 2.0,
        dot(&a1, &a2),
    ];
    let nu = FILM.poisson;
    let density = e1 * e1 + e2 * e2 + 2.0 * nu * e1 * e2 + (1.0 - nu) / 2.0 * g * g;
    let expected = 20.0 * 0.5 * FILM.membrane_n_per_mm() * density;
    assert!((shell.energy(&u) - expected).abs() < 1e-12 * expected);
    assert!(inner_force(&shell, &u, &[0, 1, 2]) < 1e-13);
}

#[test]
fn rigid_motion_is_free() {
    let shell = uneven();
    let (sin, cos) = 0.8f64.sin_cos();
    let u = coefficients(&shell, |x, y| {
        [3.0 + (cos - 1.0) * x, -2.0 + 0.0 * y, 1.0 + sin * x]
    });
    assert!(shell.energy(&u).abs() < 1e-15);
    let gradient = shell.derivatives(&u).gradient;
    assert!(gradient.iter().all(|part| part.abs() < 1e-13));
}

/// Returns the coefficients of w = (p x² + q y² + 2 r x y)/2.
fn bent(shell: &Shell, [p, q, r]: [f64; 3]) -> Vec<f64> {
    let [x, y] = &shell.grid().axes;
    let (x2, y2) = (squares(x), squares(y));
    let (x1, y1): (Vec<f64>, Vec<f64>) = (x.greville().collect(), y.greville().collect());
    let mut u = Vec::new();
    for j in 0..y1.len() {
        for i in 0..x1.len() {
            u.extend([0.0, 0.0, (p * x2[i] + q * y2[j]) / 2.0 + r * x1[i] * y1[j]]);
        }
    }
    u
}

/// Returns the coefficients of x², by interpolation on each span.
fn squares(axis: &Axis) -> Vec<f64> {
    let mut coefficients = vec![0.0; axis.functions()];
    for span in 0..axis.spans() {
        let [from, to] = axis.ends(span);
        let points: Vec<f64> = (0..SUPPORT)
            .map(|k| from + (to - from) * k as f64 / 3.0)
            .collect();
        let matrix = points
            .iter()
            .map(|&x| axis.basis(span, x)[0].to_vec())
            .collect();
        let side = points.iter().map(|x| x * x).collect();
        let local = crate::newton::solve_small(matrix, side).unwrap();
        coefficients[span..span + SUPPORT].copy_from_slice(&local);
    }
    coefficients
}

#[test]
fn a_constant_small_curvature_is_exact() {
    let shell = uneven();
    // Small enough that membrane strain, of second order, has less than 10⁻⁷ of the bending energy.
    let size = 1e-6;
    let [p, q, r] = [1.0, -0.6, 0.4];
    let u = bent(&shell, [size * p, size * q, size * r]);
    let nu = FILM.poisson;
    let density = p * p + q * q + 2.0 * nu * p * q + 2.0 * (1.0 - nu) * r * r;
    let expected = 20.0 * 0.5 * FILM.bending_n_mm() * density * size * size;
    assert!((shell.energy(&u) - expected).abs() < 1e-7 * expected);
    assert!(inner_force(&shell, &u, &[2]) < 1e-7 * size * FILM.bending_n_mm());
}
