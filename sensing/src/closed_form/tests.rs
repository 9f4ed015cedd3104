use super::*;
use crate::model::samples::spec;
use crate::model::{ClosedFormSpec, Model, OutputKind};
use crate::network::Network;
use crate::units::Px;
use proptest::prelude::*;
use std::{vec, vec::Vec};

const DIAGONAL: i32 = 23_170;

fn form(knots: Vec<[i32; 3]>, step_bits: u8) -> ClosedFormSpec {
    let d = DIAGONAL;
    ClosedFormSpec {
        directions: [[-d, -d], [d, -d], [d, d], [-d, d]],
        step_bits,
        knots,
    }
}

/// A film of 100 µN per px of radius, 200 µN per px of shift, and 3 µN per px² of shift.
fn linear() -> ClosedFormSpec {
    let knot = |i: i32| [100 * i, 200 << 8, 3 << 8];
    form((0..40).map(knot).collect(), 16)
}

fn at(centroids: [(i32, i32); 4]) -> Features {
    Features {
        centroids: centroids.map(|(x, y)| (Px(x), Px(y))),
        ..Features::default()
    }
}

/// Runs a form as a model, from rest at the origin.
fn run(form: ClosedFormSpec, centroids: [(i32, i32); 4]) -> ([i32; 3], bool) {
    let mut spec = spec(&[11, 3]);
    (spec.layers, spec.closed_form) = (Vec::new(), Some(form));
    let bytes = spec.encode().unwrap();
    let model = Model::parse(&bytes).unwrap();
    let output = Network::new().run(&model, &at(centroids), &Features::default());
    (output.values, output.input_saturated)
}

const PX: i32 = 1 << 16;

#[test]
fn radius_and_shift_become_the_force() {
    let apart = |r: i32, s: [i32; 2]| {
        let d = (f64::from(r) / 2_f64.sqrt()).round() as i32;
        [(-d, -d), (d, -d), (d, d), (-d, d)].map(|(x, y)| (x + s[0], y + s[1]))
    };
    assert_eq!(
        run(linear(), apart(10 * PX, [0, 0])),
        ([0, 0, -1000], false)
    );
    let ([x, y, z], beyond) = run(linear(), apart(5 * PX / 2, [PX, -2 * PX]));
    assert_eq!(([x, y, z], beyond), ([200, -400, -250 - 15], false));
    // Beyond the last knot it goes on, and says so.
    assert_eq!(
        run(linear(), apart(39 * PX, [0, 0])),
        ([0, 0, -3900], false)
    );
    assert_eq!(run(linear(), apart(50 * PX, [0, 0])), ([0, 0, -5000], true));
    // Markers that come together mean no force.
    assert_eq!(run(linear(), apart(-10 * PX, [0, 0])), ([0, 0, 0], false));
}

#[test]
fn a_network_adds_to_it() {
    let mut spec = spec(&[11, 4, 3]);
    let bytes = spec.encode().unwrap();
    let model = Model::parse(&bytes).unwrap();
    let features = at([(3 * PX, 0), (5 * PX, 0), (5 * PX, PX), (0, PX)]);
    let alone = Network::new().run(&model, &features, &Features::default());
    spec.closed_form = Some(linear());
    let bytes = spec.encode().unwrap();
    let model = Model::parse(&bytes).unwrap();
    assert_eq!(model.name(), "closed form + 11-4-3 ov7725");
    let both = Network::new().run(&model, &features, &Features::default());
    let (form, _) = model
        .closed_form
        .unwrap()
        .force(&features, &Features::default());
    assert_ne!(form, [0; 3]);
    let sums = [0, 1, 2].map(|i: usize| alone.values[i].saturating_add(form[i]));
    assert_eq!(both.values, sums);
}

#[test]
fn files_are_checked() {
    let mut alone = spec(&[11, 3]);
    (alone.layers, alone.closed_form) = (Vec::new(), Some(linear()));
    let refused = |change: fn(&mut ClosedFormSpec), words: &str| {
        let mut spec = alone.clone();
        change(spec.closed_form.as_mut().unwrap());
        let error = std::format!("{}", spec.encode().unwrap_err());
        assert!(error.contains(words), "{error}");
    };
    refused(|f| f.step_bits = 23, "distance of knots");
    refused(|f| f.knots.truncate(1), "number of knots");
    refused(|f| f.knots = vec![[0; 3]; 258], "number of knots");
    refused(|f| f.directions[2][1] = 32_769, "direction");
    refused(|f| f.knots[7][0] = 50, "g");
    refused(|f| f.knots[0][0] = -1, "g");
    refused(|f| f.knots[3][2] = 1 << 30, "knot");
    let mut neither = alone.clone();
    neither.closed_form = None;
    assert!(std::format!("{}", neither.encode().unwrap_err()).contains("layer count"));
    let mut angles = alone.clone();
    angles.output = OutputKind::AnglesMagnitude;
    assert!(std::format!("{}", angles.encode().unwrap_err()).contains("output kind"));
    let bytes = alone.encode().unwrap();
    let model = Model::parse(&bytes).unwrap();
    assert_eq!(ClosedFormSpec::of(&model.closed_form.unwrap()), linear());
    assert_eq!(model.name(), "closed form ov7725");
}

/// The same in 128 bits, where nothing can overflow.
fn reference(form: &ClosedFormSpec, moved: [[i128; 2]; 4]) -> [i128; 3] {
    let d = |k: usize, axis: usize| i128::from(form.directions[k][axis]);
    let apart: i128 = (0..4)
        .map(|k| moved[k][0] * d(k, 0) + moved[k][1] * d(k, 1))
        .sum();
    let radius = ((apart + (1 << 16)) >> 17).max(0);
    let shift = [0, 1].map(|axis| (moved.iter().map(|m| m[axis]).sum::<i128>() + 2) >> 2);
    let step = 1_i128 << form.step_bits;
    let index = (radius / step).min(form.knots.len() as i128 - 2) as usize;
    let curve = |c: usize| {
        let [from, to] = [index, index + 1].map(|i| i128::from(form.knots[i][c]));
        let part = radius - index as i128 * step;
        let value = from + ((to - from) * part + step / 2).div_euclid(step);
        value.clamp(-i128::from(LARGEST_KNOT), i128::from(LARGEST_KNOT))
    };
    let square = ((shift[0] * shift[0] + shift[1] * shift[1] + (1 << 15)) >> 16).min(1 << 32);
    let scaled = |product: i128| (product + (1 << 23)) >> 24;
    let force = [
        scaled(curve(1) * shift[0]),
        scaled(curve(1) * shift[1]),
        -(curve(0) + scaled(curve(2) * square)),
    ];
    force.map(|f| f.clamp(-i128::from(i32::MAX), i128::from(i32::MAX)))
}

proptest! {
    #[test]
    fn it_is_the_exact_arithmetic_everywhere(
        mut knots in prop::collection::vec(prop::array::uniform3(-LARGEST_KNOT..=LARGEST_KNOT), 2..40),
        directions in prop::array::uniform4(prop::array::uniform2(-ONE..=ONE)),
        step_bits in 0..=MAX_STEP_BITS,
        moved in prop::array::uniform4(prop::array::uniform2(-(800 << 16)..=800 << 16)),
        small in 0..20_u32,
    ) {
        let mut rising: Vec<i32> = knots.iter().map(|knot| knot[0].abs()).collect();
        rising.sort_unstable();
        knots.iter_mut().zip(rising).for_each(|(knot, g)| knot[0] = g);
        let form = ClosedFormSpec { directions, step_bits, knots };
        let moved = moved.map(|m: [i32; 2]| m.map(|v| v >> small));
        let expected = reference(&form, moved.map(|m| m.map(i128::from)));
        let (found, _) = run(form, moved.map(|m| (m[0], m[1])));
        prop_assert_eq!(found.map(i128::from), expected);
    }
}
