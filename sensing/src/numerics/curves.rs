//! The closed form inside its curves, at their ends and beyond, against its formula in `f64`.

use std::format;
use std::vec::Vec;

use super::row;
use crate::closed_form::LARGEST_KNOT;
use crate::features::Features;
use crate::model::{ClosedFormSpec, Model, samples::spec};
use crate::network::{Network, Output};
use crate::units::Px;

const STEP_BITS: u8 = 16;
const KNOTS: i32 = 41;

/// A film like the default model's: 40 px of radius at 0.2 N, 3,500 µN per px of shift at first.
fn film() -> ClosedFormSpec {
    let d = 23_170;
    let knot = |i: i32| [125 * i * i, (3500 - 60 * i) << 8, (20 + i) << 8];
    ClosedFormSpec {
        directions: [[-d, -d], [d, -d], [d, d], [-d, d]],
        step_bits: STEP_BITS,
        knots: (0..KNOTS).map(knot).collect(),
    }
}

fn features(radius_px: f64, shift_px: [f64; 2]) -> Features {
    let d = 23_170.0 / 32_768.0;
    let at = |x: f64, y: f64| {
        let steps = |px: f64| Px((px * 65_536.0).round() as i32);
        (
            steps(radius_px * x * d + shift_px[0]),
            steps(radius_px * y * d + shift_px[1]),
        )
    };
    Features {
        centroids: [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
        ..Features::default()
    }
}

fn run(form: &ClosedFormSpec, features: &Features) -> Output {
    let mut spec = spec(&[11, 3]);
    (spec.layers, spec.closed_form) = (Vec::new(), Some(form.clone()));
    let bytes = spec.encode().unwrap();
    Network::new().run(
        &Model::parse(&bytes).unwrap(),
        features,
        &Features::default(),
    )
}

/// The same in `f64`, from the features as they are rounded; straight on beyond the last knot.
fn exact(form: &ClosedFormSpec, features: &Features) -> [f64; 3] {
    let px = |k: usize| {
        let (x, y) = features.centroids[k];
        [x, y].map(|px| f64::from(px.0) / 65_536.0)
    };
    let unit = |k: usize| form.directions[k].map(|part| f64::from(part) / 32_768.0);
    let radius = (0..4)
        .map(|k| px(k)[0] * unit(k)[0] + px(k)[1] * unit(k)[1])
        .sum::<f64>()
        / 4.0;
    let shift = [0, 1].map(|axis| (0..4).map(|k| px(k)[axis]).sum::<f64>() / 4.0);
    let radius = radius.max(0.0);
    let index = (radius as usize).min(form.knots.len() - 2);
    let curve = |c: usize| {
        let [from, to] = [index, index + 1].map(|i| f64::from(form.knots[i][c]));
        from + (to - from) * (radius - index as f64)
    };
    let [h, k] = [1, 2].map(|c| curve(c) / 256.0);
    let square = shift[0] * shift[0] + shift[1] * shift[1];
    [h * shift[0], h * shift[1], -curve(0) - k * square]
}

#[test]
fn the_closed_form_inside_and_beyond_its_curves() {
    let form = film();
    let last = f64::from(KNOTS - 1);
    for (what, from, to) in [
        ("inside", 0.0, last),
        ("up to twice the last knot", last, 2.0 * last),
        ("below nothing", -last, 0.0),
    ] {
        let (mut worst, mut tried) = (0.0_f64, 0);
        for step in 0..=4000 {
            let radius = from + (to - from) * f64::from(step) / 4000.0;
            for shift in [[0.0, 0.0], [0.7, -0.3], [-5.0, 4.0], [9.9, 9.9]] {
                let features = features(radius, shift);
                let (found, exact) = (run(&form, &features), exact(&form, &features));
                let off = found
                    .values
                    .iter()
                    .zip(exact)
                    .map(|(f, e)| (f64::from(*f) - e).abs());
                worst = off.fold(worst, f64::max);
                assert_eq!(
                    found.input_saturated,
                    radius > last + 1e-4,
                    "{what}: {radius}"
                );
                tried += 1;
            }
        }
        // Half a step of each rounding: the sums, the curve, the product, and with the largest shift's slope.
        assert!(worst <= 2.0, "{what}: {worst}");
        row(
            "closed form",
            format!("{what}: {tried} radii and shifts"),
            "2 µN",
            format!("{worst:.3} µN"),
        );
    }
}

/// Every knot and every displacement as large as it can be, in all combinations of signs.
#[test]
fn the_largest_curves_and_displacements_are_limited_and_told() {
    for signs in 0..32_i32 {
        let sign = |bit: i32| if signs >> bit & 1 == 1 { -1 } else { 1 };
        let mut form = film();
        form.step_bits = 0;
        // g never falls.
        form.knots = std::vec![
            [0, sign(0) * LARGEST_KNOT, sign(1) * LARGEST_KNOT],
            [
                LARGEST_KNOT,
                -sign(0) * LARGEST_KNOT,
                -sign(1) * LARGEST_KNOT
            ],
        ];
        let far = |bit: i32| {
            if sign(bit) < 0 {
                Px(i32::MIN)
            } else {
                Px(i32::MAX)
            }
        };
        let features = Features {
            centroids: [
                (Px(i32::MIN), Px(i32::MIN)),
                (Px(i32::MAX), far(2)),
                (far(3), far(4)),
                (Px(i32::MIN), Px(i32::MAX)),
            ],
            ..Features::default()
        };
        let Output {
            values,
            input_saturated,
            ..
        } = run(&form, &features);
        assert!(values.iter().all(|v| *v != i32::MIN), "{values:?}");
        assert!(input_saturated, "{signs:05b}: {values:?}");
    }
}
