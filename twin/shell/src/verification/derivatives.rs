//! Verifies the derivatives by differences on a bent, stretched and held film: the gradient against
//! the energy, and the stiffness against the gradient.

use super::*;
use crate::newton::inner;
use crate::shell::Hold;
use proptest::prelude::*;

fn film() -> Shell {
    let material = Material {
        youngs_mpa: 1.0,
        poisson: 0.49,
        thickness_mm: 0.5,
    };
    let mut shell = rectangle([4.0, 3.0], [4, 3], &material);
    let springs = [[0.3, 0.2], [3.5, 2.9]].map(|at| (at, 2.0));
    let hold = Hold::new(shell.grid(), springs);
    shell.hold(hold);
    shell.pin(40, 3.0);
    shell
}

fn moved(u: &[f64], way: &[f64], step: f64) -> Vec<f64> {
    u.iter().zip(way).map(|(u, d)| u + step * d).collect()
}

/// Returns the product of a matrix, given by its lower triangle, with a vector.
fn product(shell: &Shell, stiffness: &[f64], v: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; v.len()];
    for (column, row, value) in shell.pattern().triplets(stiffness) {
        sum[row] += value * v[column];
        if row != column {
            sum[column] += value * v[row];
        }
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]
    #[test]
    fn hold_along_any_way(
        u in prop::collection::vec(-0.25..0.25, 126),
        way in prop::collection::vec(-1.0..1.0, 126),
    ) {
        let shell = film();
        let here = shell.derivatives(&u);
        prop_assert!((here.energy - shell.energy(&u)).abs() < 1e-12);
        let h = 1e-4;
        let energy = |step: f64| shell.energy(&moved(&u, &way, step));
        let slope =
            (8.0 * (energy(h) - energy(-h)) - energy(2.0 * h) + energy(-2.0 * h)) / (12.0 * h);
        let expected = inner(&here.gradient, &way);
        prop_assert!(
            (slope - expected).abs() < 1e-7 * (1.0 + expected.abs()),
            "{slope} {expected}"
        );

        let gradient = |step: f64| shell.derivatives(&moved(&u, &way, step)).gradient;
        let (a, b, aa, bb) = (gradient(h), gradient(-h), gradient(2.0 * h), gradient(-2.0 * h));
        let size = here.stiffness.iter().fold(0.0f64, |m, k| m.max(k.abs()));
        for (k, bend) in product(&shell, &here.stiffness, &way).iter().enumerate() {
            let slope = (8.0 * (a[k] - b[k]) - aa[k] + bb[k]) / (12.0 * h);
            prop_assert!((slope - bend).abs() < 1e-6 * size, "{k}: {slope} {bend}");
        }
    }
}
