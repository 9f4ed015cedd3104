//! Measures the errors of vector to angles and back, against `f64`.

use std::format;

use super::row;
use crate::force::Polar;
use hivtac_terms::units::{MicroNewtons, MilliDegrees};

/// The difference of two angles, m°, the shorter way round the circle.
fn apart(a: f64, b: f64) -> f64 {
    let off = (a - b).abs();
    off.min(360_000.0 - off)
}

/// Errors of α and β in m° and of |F| in µN for a vector in µN.
fn errors(vector: [i32; 3]) -> [f64; 3] {
    let found = Polar::of_vector(vector.map(MicroNewtons));
    let [x, y, z] = vector.map(f64::from);
    let sideways = x.hypot(z);
    let millidegrees = |radians: f64| radians.to_degrees() * 1e3;
    // An angle whose two components are both 0 is 0 by definition.
    let alpha = if sideways > 0.0 { x.atan2(-z) } else { 0.0 };
    let beta = if sideways > 0.0 || y != 0.0 {
        y.atan2(sideways)
    } else {
        0.0
    };
    [
        apart(f64::from(found.alpha.0), millidegrees(alpha)),
        apart(f64::from(found.beta.0), millidegrees(beta)),
        (f64::from(found.magnitude.0) - sideways.hypot(y)).abs(),
    ]
}

fn larger(worst: &mut [f64; 3], errors: [f64; 3]) {
    worst
        .iter_mut()
        .zip(errors)
        .for_each(|(w, e)| *w = w.max(e));
}

fn words([alpha, beta, size]: [f64; 3]) -> std::string::String {
    format!("{:.4} m°, {size:.4} µN", alpha.max(beta))
}

const BOUND: &str = "0.51 m°, 0.5 µN";

fn hold([alpha, beta, size]: [f64; 3]) {
    assert!(
        alpha <= 0.51 && beta <= 0.51 && size <= 0.5,
        "{alpha} {beta} {size}"
    );
}

/// Every vector of up to 40 µN in each component: 531,441 of them.
#[test]
fn angles_as_the_force_goes_to_nothing() {
    let mut worst = [0.0; 3];
    for x in -40..=40 {
        for y in -40..=40 {
            for z in -40..=40 {
                larger(&mut worst, errors([x, y, z]));
            }
        }
    }
    hold(worst);
    assert_eq!(Polar::of_vector([MicroNewtons(0); 3]), Polar::default());
    row(
        "angles as |F| → 0",
        "every vector within ±40 µN".into(),
        BOUND,
        words(worst),
    );
}

/// Directions in steps of half a degree, sizes from 1 µN to the largest that three components can
/// have.
#[test]
fn angles_at_the_ends_of_the_range() {
    let (mut worst, mut tried) = ([0.0; 3], 0);
    let sizes = [50.0, 1e3, 2e5, 1e7, 1e9, 2_147_483_646.0];
    for size in sizes {
        for alpha in (-360..=360).map(|a| f64::from(a) / 2.0) {
            for beta in (-180..=180).map(|b| f64::from(b) / 2.0) {
                let ((sa, ca), (sb, cb)) =
                    (alpha.to_radians().sin_cos(), beta.to_radians().sin_cos());
                let vector = [sa * cb, sb, -ca * cb].map(|part| (size * part).round() as i32);
                larger(&mut worst, errors(vector));
                tried += 1;
            }
        }
    }
    hold(worst);
    // Larger than the wire format can hold: |F| is limited, the direction kept.
    let corner = Polar::of_vector([MicroNewtons(i32::MIN); 3]);
    assert_eq!((corner.magnitude.0, corner.beta.0), (i32::MAX, -35_264));
    let tried =
        format!("{tried} directions and sizes, 50 µN to 2,147 N, poles and ±180° among them");
    row("angles and |F| of a vector", tried, BOUND, words(worst));
}

/// The largest error of a component, µN, over a grid of directions in steps of a quarter of a
/// degree.
fn vector_error(size: i32) -> f64 {
    let mut worst = 0.0_f64;
    for alpha in (-180_000..=180_000).step_by(250) {
        for beta in (-90_000..=90_000).step_by(250) {
            let polar = Polar {
                alpha: MilliDegrees(alpha),
                beta: MilliDegrees(beta),
                magnitude: MicroNewtons(size),
            };
            let [a, b] = [alpha, beta].map(|angle| (f64::from(angle) * 1e-3).to_radians());
            let exact = [a.sin() * b.cos(), b.sin(), -a.cos() * b.cos()];
            for (found, exact) in polar.to_vector().iter().zip(exact) {
                worst = worst.max((f64::from(found.0) - exact * f64::from(size)).abs());
            }
        }
    }
    worst
}

#[test]
fn the_cartesian_vector_over_the_whole_range() {
    for (sizes, what, bound) in [
        (&[1, 37, 1_000, 200_000, 1_000_000][..], "up to 1 N", 0.6),
        (&[5_000_000, 10_000_000], "up to 10 N", 0.6),
        (&[1_000_000_000, i32::MAX], "up to 2,147 N", 9.0),
    ] {
        let worst = sizes
            .iter()
            .map(|&size| vector_error(size))
            .fold(0.0, f64::max);
        assert!(worst <= bound, "{what}: {worst}");
        let tried = format!(
            "{what}: {} directions for each of {} sizes",
            1441 * 721,
            sizes.len()
        );
        row(
            "vector of angles and |F|",
            tried,
            &format!("{bound} µN"),
            format!("{worst:.4} µN"),
        );
    }
}
