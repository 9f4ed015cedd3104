//! Where the paper is ambiguous or wrong: the numbers that the documentation gives for each
//! reading.

use hivtac_studies::paper_model::{
    Design, NormalPress, PinholeDistance, disp_s_mm, shear_stretch, sheared_position_mm,
    stretched_projection_mm,
};
use proptest::prelude::*;

use crate::{readings, table};

const A: f64 = 14.0;
const F: f64 = 2.1;

fn assert_close(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance, "{got} is not {want}");
}

fn press(pm_mm: f64, z_mm: f64) -> NormalPress<f64> {
    NormalPress {
        pm_mm,
        z_mm,
        d_ph_mm: 10.0,
        epsilon_mm: 0.0,
    }
}

/// The second and third lines of eq. 17 with the one-argument arctangent, and the second with two
/// arguments.
fn lines_of_eq_17(pm: f64, z: f64) -> [f64; 3] {
    let rest = libm::atan(pm / 10.0);
    let third = libm::atan(z * pm / (pm * pm + 10.0 * (10.0 - z)));
    [
        F * (libm::atan(pm / (10.0 - z)) - rest),
        F * third,
        F * (libm::atan2(pm, 10.0 - z) - rest),
    ]
}

#[test]
fn the_lines_of_eq_17_part_at_the_pinhole() {
    for (z, printed) in [
        (9.0, [1.888, 1.888, 1.888]),
        (11.0, [-3.920, 2.677, 2.677]),
        (13.0, [-3.226, -3.226, 3.371]),
    ] {
        let lines = lines_of_eq_17(5.257, z);
        for (line, number) in lines.into_iter().zip(printed) {
            assert_close(line, number, 5e-4);
        }
        let computed = press(5.257, z).disp_n_mm(F).unwrap();
        assert_close(computed, lines[2], 1e-14);
    }
    // The third line is wrong from z = D_ph + PM² / D_ph on.
    let [_, before, right] = lines_of_eq_17(5.0, 12.499);
    assert_close(before, right, 1e-14);
    let [_, after, right] = lines_of_eq_17(5.0, 12.501);
    assert_close(right - after, std::f64::consts::PI * F, 1e-12);
}

#[test]
fn in_f32_the_second_line_loses_everything_for_tiny_depths() {
    let rows = table::rows();
    let errors = |d_ph: f64| {
        let tiny = rows.iter().find(|row| {
            row.quantity == "disp_n"
                && (row.pm - 5.257).abs() < 1e-6
                && row.epsilon == 0.0
                && row.z < 1.01e-6
                && (row.d_ph_mm - d_ph).abs() < 1e-3
        });
        let row = tiny.expect("a row of 1 nm");
        (row.error_of_second_line(), row.error::<f32>())
    };
    let (axial, slant) = (errors(10.0), errors(11.298));
    assert_close(axial.0, 0.447, 1e-3);
    assert_eq!(slant.0, 1.0);
    assert!(axial.1 < 3e-7 && slant.1 < 3e-7);
}

#[test]
fn disp_n_peaks_inside_the_film() {
    for (d_ph, z, at_r, peak, corner) in [
        (PinholeDistance::Slant, 1e-6, 0.3571, 7.425e-8, 4.703e-8),
        (PinholeDistance::Slant, 3.5, 0.2985, 0.3334, 0.1800),
        (PinholeDistance::Slant, 7.0, 0.2128, 0.9658, 0.3947),
        (PinholeDistance::Axial, 1e-6, 0.5051, 1.0500e-7, 8.451e-8),
        (PinholeDistance::Axial, 3.5, 0.4072, 0.4489, 0.3160),
        (PinholeDistance::Axial, 7.0, 0.2766, 1.1941, 0.6664),
    ] {
        let design = Design::<f64>::paper(d_ph);
        let r = design.best_r(z, 0.0).unwrap().unwrap();
        assert_close(r, at_r, 5e-5);
        let at = |pm| design.disp_n_mm(pm, z).unwrap();
        assert_close(at(r * design.pn_mm()) / peak, 1.0, 2e-4);
        assert_close(at(design.pn_mm()) / corner, 1.0, 2e-4);
    }
}

#[test]
fn the_slant_distance_makes_another_angle() {
    let angle = |d_ph| {
        let d_ph = Design::<f64>::paper(d_ph).d_ph_mm(5.257).unwrap();
        libm::atan(5.257 / d_ph) * 180.0 / std::f64::consts::PI
    };
    assert_close(angle(PinholeDistance::Slant), 24.95, 5e-3);
    assert_close(angle(PinholeDistance::Axial), 27.73, 5e-3);
}

#[test]
fn means_of_r_are_those_of_the_documentation() {
    for (d_ph, [positive, with_zeros]) in [
        (PinholeDistance::Slant, [0.2609, 0.2548]),
        (PinholeDistance::Axial, [0.3546, 0.3462]),
    ] {
        let design = Design::paper(d_ph);
        let mean = design.mean_best_r(300).unwrap();
        assert_close(mean.positive, positive, 1e-4);
        assert_close(mean.with_zeros, with_zeros, 1e-4);
        assert_close(mean.positive_share, 0.976, 5e-4);
        // An independent way to it.
        let scanned = readings::as_printed(d_ph);
        assert_close(scanned[0], positive, 2e-4);
        assert_close(scanned[1], with_zeros, 2e-4);
    }
    let off = (0.2655 - 0.2609) * Design::<f64>::paper(PinholeDistance::Slant).pn_mm();
    assert_close(off, 0.09, 5e-3);
}

#[test]
fn other_readings_do_not_give_the_paper_s_mean_either() {
    let slant = PinholeDistance::Slant;
    assert_close(readings::depth_of_the_centre(slant)[0], 0.192, 1e-3);
    assert_close(readings::constant_epsilon(slant)[0], 0.234, 1e-3);
    let seen = readings::shear_as_seen(slant).mean_best_r(100).unwrap();
    assert_close(seen.positive, 0.2825, 2e-4);
    let [low, high] = readings::over_grids(slant);
    assert_close(low, 0.2585, 1e-4);
    assert_close(high, 0.2614, 1e-4);
}

#[test]
fn eq_19_as_printed_is_no_constant() {
    let shear = [0.0, 5.0];
    let [to_o, to_c] = shear_stretch(A, shear).unwrap();
    assert_close(to_o, 1.1920, 5e-5);
    assert_close(to_c, 0.8406, 5e-5);
    let printed = |fraction: f64| {
        let [x, y] = sheared_position_mm([0.0, fraction], A, shear).unwrap();
        libm::hypot(x, y - 5.0) / libm::hypot(x, y)
    };
    assert_close(printed(0.5), 0.7052, 5e-5);
    assert_close(printed(0.25), 0.5168, 5e-5);
}

#[test]
fn eq_20_as_printed_adds_the_whole_shear() {
    let (r, shear) = (0.2655, [0.0, 1.0]);
    let moved = |fractions: [f64; 2]| {
        let [o, c] = fractions;
        let rest = [-A * (o + c), A * (c - o)];
        let [x, y] = sheared_position_mm(fractions, A, shear).unwrap();
        [x - rest[0], y - rest[1]]
    };
    let [_, corrected] = moved([r, 0.0]);
    assert_close(corrected, 0.7345, 1e-12);
    // Printed: PM' is the sum of PM'_O and PM'_C, so that their displacements add.
    let printed = moved([r, 0.0])[1] + moved([0.0, 0.0])[1];
    assert_close(printed, 1.7345, 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// ε of eq. 13 is 0 in every direction and at every depth.
    #[test]
    fn epsilon_is_zero(pm_a in 0.0..14.0, pm_b in 0.0..14.0, depth in 0.0..50.0) {
        let pm = libm::hypot(pm_a, pm_b);
        let epsilon = stretched_projection_mm([pm_a, pm_b], A, depth).unwrap() - pm;
        prop_assert!(epsilon.abs() <= 1e-15 * pm, "{epsilon:e} at {pm}");
    }

    /// The corrected eqs. 19 and 20 are eq. 21, parallel to the shear.
    #[test]
    fn the_corrected_shear_is_eq_21(o in 0.0..0.5, c in 0.0..0.5, x in -7.0..7.0, y in -7.0..7.0) {
        let [mx, my] = sheared_position_mm([o, c], A, [x, y]).unwrap();
        let (dx, dy) = (mx + A * (o + c), my + A * (o - c));
        let shear = libm::hypot(x, y);
        let expected = disp_s_mm(o + c, 1.0, shear).unwrap();
        prop_assert!((libm::hypot(dx, dy) - expected).abs() <= 1e-14 * (A + shear));
        prop_assert!((dx * y - dy * x).abs() <= 1e-13 * (A + shear) * (1.0 + shear));
    }

    /// Both lines of eq. 17 before the pinhole, where the second can be computed.
    #[test]
    fn disp_n_is_the_second_line(pm in 0.0..19.0, z in 0.0..9.99) {
        let [second, _, _] = lines_of_eq_17(pm, z);
        prop_assert!((press(pm, z).disp_n_mm(F).unwrap() - second).abs() <= 2e-15);
    }
}
