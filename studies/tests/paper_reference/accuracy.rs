//! The model against the reference table.

use hivtac_studies::paper_model::{Design, PinholeDistance};

use crate::table::{self, largest_errors};

/// The errors that the documentation states: relative, but for R*, whose is |Δ(R*²)|. f64, then
/// f32.
const BOUNDS: [(&str, f64, f64); 7] = [
    ("r_m", 3e-16, 2e-7),
    ("r_m_pressed", 3e-16, 2e-7),
    ("disp_n", 4e-16, 3e-7),
    ("disp_s", 3e-16, 2e-7),
    ("d_ph", 2e-16, 1e-7),
    ("quality", 5e-16, 3e-7),
    ("best_r", 2e-16, 1e-7),
];

#[test]
fn every_quantity_is_as_accurate_as_stated() {
    let rows = table::rows();
    for (quantity, bound_f64, bound_f32) in BOUNDS {
        let (count, f64_error, f32_error) = largest_errors(&rows, quantity);
        assert!(count >= 6, "{quantity}: {count} rows");
        assert!(f64_error <= bound_f64, "{quantity} f64: {f64_error:e}");
        assert!(f32_error <= bound_f32, "{quantity} f32: {f32_error:e}");
    }
}

#[test]
fn the_table_reaches_from_a_nanometre_to_beyond_the_pinhole() {
    let rows = table::rows();
    let presses = || rows.iter().filter(|row| row.quantity == "disp_n");
    assert!(presses().any(|row| row.z < 1.01e-6));
    assert!(presses().any(|row| row.z == row.d_ph_mm));
    assert!(presses().any(|row| row.z > row.d_ph_mm && row.z < 1.000_001 * row.d_ph_mm));
    assert!(presses().any(|row| row.z >= 10.0 * row.d_ph_mm));
}

#[test]
fn r_itself_is_accurate_away_from_its_onset() {
    let rows = table::rows();
    assert!(table::error_of_r::<f64>(&rows, 0.1) <= 1e-15);
    assert!(table::error_of_r::<f32>(&rows, 0.1) <= 1e-6);
}

#[test]
fn the_mean_is_within_its_stated_distance_of_the_integral() {
    let rows = table::rows();
    for d_ph in [PinholeDistance::Slant, PinholeDistance::Axial] {
        let mean = Design::paper(d_ph).mean_best_r(700).unwrap();
        let of_it = |row: &&table::Row| row.d_ph == Some(d_ph);
        let check = |quantity: &str, got: f64| {
            let mut rows = rows.iter().filter(of_it);
            let row = rows.find(|row| row.quantity == quantity).unwrap();
            let error = (got - row.value.unwrap()).abs();
            assert!(error <= 2e-5, "{d_ph:?} {quantity}: {error:e}");
        };
        check("mean_positive", mean.positive);
        check("mean_with_zeros", mean.with_zeros);
        check("positive_share", mean.positive_share);
    }
}

#[test]
fn f32_and_f64_designs_agree_where_there_is_a_maximum() {
    for d_ph in [PinholeDistance::Slant, PinholeDistance::Axial] {
        let (single, double) = (Design::<f32>::paper(d_ph), Design::<f64>::paper(d_ph));
        for (z, shear) in [
            (0.25, 0.5),
            (1.0, 7.0),
            (7.0, 0.0),
            (0.0, 1.0),
            (0.125, 7.0),
        ] {
            let r32 = single.best_r(z as f32, shear as f32).unwrap();
            let r64 = double.best_r(z, shear).unwrap();
            assert_eq!(r32.is_some(), r64.is_some(), "{z} {shear}");
        }
    }
}
