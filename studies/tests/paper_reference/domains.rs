//! Limits and properties over whole domains.

use hivtac_studies::paper_model::{
    Design, Map, NormalPress, OutOfDomain, PinholeDistance, disp_s_mm, image_radius_mm,
    shear_stretch, sheared_position_mm, stretched_projection_mm,
};
use proptest::prelude::*;

use crate::picture;

const READINGS: [PinholeDistance; 2] = [PinholeDistance::Slant, PinholeDistance::Axial];
const BAD: [f64; 4] = [-1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

fn design() -> Design<f64> {
    Design::paper(PinholeDistance::Slant)
}

fn refuses<T: std::fmt::Debug>(result: Result<T, OutOfDomain>, quantity: &str) {
    assert_eq!(result.unwrap_err().quantity, quantity);
}

#[test]
fn what_is_no_length_is_refused() {
    for bad in BAD {
        refuses(image_radius_mm(bad, 1.0), "f");
        refuses(image_radius_mm(2.1, bad), "θ");
        refuses(disp_s_mm(bad, 20.0, 1.0), "PM");
        refuses(disp_s_mm(1.0, bad, 1.0), "PN");
        refuses(disp_s_mm(1.0, 20.0, bad), "PP'");
        refuses(stretched_projection_mm([bad, 1.0], 14.0, 1.0), "PM_A");
        refuses(stretched_projection_mm([1.0, bad], 14.0, 1.0), "PM_B");
        refuses(stretched_projection_mm([1.0, 1.0], bad, 1.0), "a");
        refuses(stretched_projection_mm([1.0, 1.0], 14.0, bad), "d");
        refuses(
            sheared_position_mm([bad, 0.5], 14.0, [1.0, 1.0]),
            "PM_O / PO",
        );
        refuses(
            sheared_position_mm([0.5, bad], 14.0, [1.0, 1.0]),
            "PM_C / PC",
        );
        refuses(design().disp_n_mm(bad, 1.0), "PM");
        refuses(design().quality_mm(1.0, bad, 1.0), "z_m'");
        refuses(design().quality_mm(1.0, 1.0, bad), "PP'");
        refuses(design().best_r(bad, 1.0), "z_m'");
        refuses(design().best_r(1.0, bad), "PP'");
    }
    refuses(shear_stretch(14.0, [f64::NAN, 1.0]), "σ_x");
    refuses(shear_stretch(14.0, [1.0, f64::INFINITY]), "σ_y");
}

#[test]
fn a_press_is_checked() {
    let good = NormalPress {
        pm_mm: 5.0,
        z_mm: 1.0,
        d_ph_mm: 10.0,
        epsilon_mm: 0.1,
    };
    for bad in BAD {
        let all = |press: NormalPress<f64>, quantity| {
            refuses(press.r_m_mm(2.1), quantity);
            refuses(press.r_m_pressed_mm(2.1), quantity);
            refuses(press.disp_n_mm(2.1), quantity);
        };
        all(NormalPress { pm_mm: bad, ..good }, "PM");
        all(NormalPress { z_mm: bad, ..good }, "z_m'");
        all(
            NormalPress {
                d_ph_mm: bad,
                ..good
            },
            "D_ph",
        );
        all(
            NormalPress {
                epsilon_mm: bad,
                ..good
            },
            "ε",
        );
        refuses(good.disp_n_mm(bad), "f");
    }
}

#[test]
fn the_ends_of_each_domain() {
    refuses(design().disp_n_mm(20.0, 1.0), "PM");
    refuses(disp_s_mm(20.1, 20.0, 1.0), "PM");
    refuses(design().best_r(10.0, 1.0), "z_m'");
    refuses(
        sheared_position_mm([0.6, 0.5], 14.0, [1.0, 1.0]),
        "PM_O / PO + PM_C / PC",
    );
    assert!(design().best_r(9.999_999_999, 1.0).unwrap().is_some());
    let message = design().best_r(12.0, 1.0).unwrap_err().to_string();
    assert_eq!(message, "z_m' is 12: use 0 to below 10");
}

#[test]
fn the_pinhole_itself_has_no_direction() {
    let at = |pm_mm: f64, z_mm: f64| NormalPress {
        pm_mm,
        z_mm,
        d_ph_mm: 10.0,
        epsilon_mm: 0.0,
    };
    refuses(at(0.0, 10.0).disp_n_mm(2.1), "z_m'");
    refuses(design().disp_n_mm(0.0, 10.0), "z_m'");
    assert!(at(1e-6, 10.0).disp_n_mm(2.1).is_ok());
    assert_eq!(at(0.0, 9.0).disp_n_mm(2.1), Ok(0.0));
    // Behind it, the axis is half a turn away.
    assert_eq!(at(0.0, 11.0).disp_n_mm(2.1), Ok(2.1 * std::f64::consts::PI));
}

#[test]
fn a_design_is_checked() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let designs = [
            (
                Design {
                    half_side_mm: bad,
                    ..design()
                },
                "a",
            ),
            (
                Design {
                    focal_mm: bad,
                    ..design()
                },
                "f",
            ),
            (
                Design {
                    film_distance_mm: bad,
                    ..design()
                },
                "the film's distance",
            ),
            (
                Design {
                    normal_weight: bad,
                    ..design()
                },
                "the weight of disp_N",
            ),
        ];
        for (design, quantity) in designs {
            refuses(design.best_r(1.0, 1.0), quantity);
            refuses(design.quality_mm(1.0, 1.0, 1.0), quantity);
            refuses(Map::new(&design, 5), quantity);
        }
    }
}

#[test]
fn a_map_has_cells_and_stays_before_the_pinhole() {
    for cells in [0, 4097] {
        refuses(Map::new(&design(), cells), "the number of cells");
    }
    let wide = Design {
        half_side_mm: 40.0,
        ..design()
    };
    refuses(Map::new(&wide, 10), "z_m'");
}

/// The picture in the documentation is this code's, byte for byte, on every machine.
#[test]
fn the_documented_picture_is_the_map() {
    let documented = include_str!("../../../docs/pictures/figure8.svg");
    assert!(
        picture::figure8_svg().unwrap() == documented,
        "run the example paper_model with --figure8 docs/pictures/figure8.svg"
    );
}

#[test]
fn without_a_press_there_is_no_positive_maximum() {
    for d_ph in READINGS {
        let design = Design::<f64>::paper(d_ph);
        assert_eq!(design.best_r(0.0, 1.0), Ok(None));
        assert_eq!(design.best_r(0.0, 0.0), Ok(None));
        // PP' at which R* starts: 50·f·PN·z / (h·(h − z)).
        let onset = 50.0 * 2.1 * design.pn_mm() * 0.1 / (10.0 * 9.9);
        assert_eq!(design.best_r(0.1, onset * (1.0 + 1e-12)), Ok(None));
        assert!(design.best_r(0.1, onset * (1.0 - 1e-12)).unwrap().unwrap() < 1e-5);
    }
}

#[test]
fn a_small_film_has_its_maximum_in_the_corner() {
    let small = Design {
        half_side_mm: 2.0,
        ..design()
    };
    assert_eq!(small.best_r(1.0, 0.01), Ok(Some(1.0)));
}

fn any_design() -> impl Strategy<Value = Design<f64>> {
    (1.0..50.0, 0.5..10.0, 2.0..50.0, 1.0..500.0, any::<bool>()).prop_map(
        |(a, f, h, weight, slant)| Design {
            half_side_mm: a,
            focal_mm: f,
            film_distance_mm: h,
            normal_weight: weight,
            d_ph: READINGS[usize::from(slant)],
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// No R on a scan of [0, 1] is better than R*, whatever the design.
    #[test]
    fn best_r_is_the_best(design in any_design(), depth in 0.0..1.0, shear in 0.0..30.0) {
        let z = depth * design.film_distance_mm;
        prop_assume!(z < design.film_distance_mm);
        let pn = design.pn_mm();
        let q = |r: f64| design.quality_mm((r * pn).min(pn), z, shear).unwrap();
        let best = design.best_r(z, shear).unwrap().map_or(shear, q);
        for step in 0..=200 {
            let other = q(f64::from(step) / 200.0);
            prop_assert!(other <= best * (1.0 + 1e-14), "{other} at {step}, best {best}");
        }
    }

    /// R* falls with the shear and scales out: twice as large a sensor has the same R*.
    #[test]
    fn best_r_falls_with_shear_and_has_no_scale(
        design in any_design(),
        depth in 0.01..0.99,
        shear in 0.0..30.0,
    ) {
        let z = depth * design.film_distance_mm;
        let r = |shear: f64| design.best_r(z, shear).unwrap().unwrap_or(0.0);
        prop_assert!(r(shear) >= r(shear * 1.01 + 1e-9));
        let twice = Design {
            half_side_mm: 2.0 * design.half_side_mm,
            focal_mm: 2.0 * design.focal_mm,
            film_distance_mm: 2.0 * design.film_distance_mm,
            ..design
        };
        let scaled = twice.best_r(2.0 * z, 2.0 * shear).unwrap().unwrap_or(0.0);
        prop_assert!((scaled * scaled - r(shear) * r(shear)).abs() < 1e-13);
    }

    /// f32 against f64 over lengths from 1 nm to 1 m: nothing is lost anywhere.
    #[test]
    fn f32_is_as_good_everywhere(exponents in prop::array::uniform4(-6.0..3.0)) {
        let [pm, z, d_ph, epsilon] = exponents.map(|e: f64| libm::exp10(e) as f32);
        let single = NormalPress { pm_mm: pm, z_mm: z, d_ph_mm: d_ph, epsilon_mm: epsilon };
        let double = NormalPress {
            pm_mm: f64::from(pm),
            z_mm: f64::from(z),
            d_ph_mm: f64::from(d_ph),
            epsilon_mm: f64::from(epsilon),
        };
        let (got, want) = (single.disp_n_mm(2.1).unwrap(), double.disp_n_mm(2.1).unwrap());
        prop_assert!((f64::from(got) / want - 1.0).abs() <= 4e-7, "{got} {want}");
    }

    /// disp_N never falls as the marker goes deeper, through the pinhole's depth and beyond.
    #[test]
    fn deeper_is_further_out(
        pm in 1e-6..19.0,
        z in 0.0..30.0,
        more in 1e-6..1.0,
        slant in any::<bool>(),
    ) {
        let design = Design::<f64>::paper(READINGS[usize::from(slant)]);
        let at = |z| design.disp_n_mm(pm, z).unwrap();
        prop_assert!(at(z + more) >= at(z));
        prop_assert!((0.0..=2.1 * std::f64::consts::PI).contains(&at(z)));
    }
}
