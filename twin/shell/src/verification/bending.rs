//! Verifies large rotations: the elastica.

use super::*;

/// A cantilever strip under a force at its end that keeps its direction.
///
/// K. Mattiasson, Int. J. Numer. Meth. Engng 17 (1981) 145, from elliptic integrals. For a load P
/// L²/(E I) of 1, 5 and 10 the end goes down by 0.30172, 0.71379, 0.81061 L and back by 0.05643,
/// 0.38763, 0.55500 L.
#[test]
fn a_cantilever_bends_as_eulers_elastica() {
    let strip = Material {
        youngs_mpa: 1000.0,
        poisson: 0.0,
        thickness_mm: 0.1,
    };
    let (length, width) = (10.0, 1.0);
    let mut shell = rectangle([length, width], [24, 1], &strip);
    let columns = shell.grid().functions()[0];
    for k in 0..shell.grid().unknowns() / 3 {
        let held: &[usize] = match k % columns {
            0 => &[0, 1, 2],
            // No slope: the second column stays at the height of the first.
            1 => &[2],
            _ => &[],
        };
        for c in held {
            shell.pin(3 * k + c, PIN_N_PER_MM);
        }
    }
    let stiffness = strip.bending_n_mm() * width;
    for (load, down, back) in [
        (1.0, 0.30172, 0.05643),
        (5.0, 0.71379, 0.38763),
        (10.0, 0.81061, 0.55500),
    ] {
        let force = load * stiffness / (length * length);
        let end = [length, width / 2.0];
        let u = ramped(&shell, &point_force(&shell, end, force, 2), 10);
        let [dx, _, dz] = displacement(&shell, &u, end);
        println!(
            "elastica {load}: {:.5} {down:.5}, {:.5} {back:.5}",
            dz / length,
            -dx / length
        );
        assert!(
            (dz / length - down).abs() < 3e-4,
            "load {load}: {} {down}",
            dz / length
        );
        assert!(
            (-dx / length - back).abs() < 3e-4,
            "load {load}: {} {back}",
            -dx / length
        );
    }
}
