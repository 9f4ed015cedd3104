use super::*;
use crate::force::model::{LARGEST_UNCERTAINTY, Uncertainty, UncertaintyKnot};
use crate::force::model::{samples::place_spec, samples::spec};
use crate::force::network::Output;
use hivtac_terms::conditions::ContactReading;
use hivtac_terms::units::UnsignedMicroNewtons;
use proptest::prelude::*;

fn vector(x: i32, y: i32, z: i32) -> [MicroNewtons; 3] {
    [x, y, z].map(MicroNewtons)
}

fn polar(alpha: i32, beta: i32, magnitude: i32) -> Polar {
    Polar {
        alpha: MilliDegrees(alpha),
        beta: MilliDegrees(beta),
        magnitude: MicroNewtons(magnitude),
    }
}

/// F = |F| · (sin α cos β, sin β, −cos α cos β) in floating point.
fn exact_vector(polar: Polar) -> [f64; 3] {
    let angle = |angle: MilliDegrees| (f64::from(angle.0) * 1e-3).to_radians();
    let (sin_a, cos_a) = angle(polar.alpha).sin_cos();
    let (sin_b, cos_b) = angle(polar.beta).sin_cos();
    [sin_a * cos_b, sin_b, -cos_a * cos_b].map(|part| part * f64::from(polar.magnitude.0))
}

fn vector_error(polar: Polar) -> f64 {
    let found = polar.to_vector().map(|component| f64::from(component.0));
    let exact = exact_vector(polar);
    (0..3)
        .map(|i| (found[i] - exact[i]).abs())
        .fold(0.0, f64::max)
}

/// Errors of α and β in m°, of |F| in µN.
fn polar_error(vector: [MicroNewtons; 3]) -> [f64; 3] {
    let [x, y, z] = vector.map(|component| f64::from(component.0));
    let found = Polar::of_vector(vector);
    // Along y, α is 0 by definition.
    let alpha = if x == 0.0 && z == 0.0 {
        0.0
    } else {
        x.atan2(-z).to_degrees() * 1e3
    };
    let beta = y.atan2(x.hypot(z)).to_degrees() * 1e3;
    let alpha_error = (f64::from(found.alpha.0) - alpha).abs();
    [
        alpha_error.min(360_000.0 - alpha_error),
        (f64::from(found.beta.0) - beta).abs(),
        (f64::from(found.magnitude.0) - (x * x + y * y + z * z).sqrt()).abs(),
    ]
}

#[test]
fn the_convention() {
    for (angles, expected) in [
        (polar(0, 0, 200_000), vector(0, 0, -200_000)),
        (polar(30_000, 0, 1_000_000), vector(500_000, 0, -866_025)),
        (polar(-30_000, 0, 1_000_000), vector(-500_000, 0, -866_025)),
        (polar(0, 30_000, 1_000_000), vector(0, 500_000, -866_025)),
        (polar(90_000, 0, 1_000), vector(1_000, 0, 0)),
        (polar(0, 90_000, 1_000), vector(0, 1_000, 0)),
        (polar(180_000, 0, 1_000), vector(0, 0, 1_000)),
        (
            polar(90_000, 45_000, 1_000_000),
            vector(707_107, 707_107, 0),
        ),
    ] {
        assert_eq!(angles.to_vector(), expected, "{angles:?}");
        assert_eq!(Polar::of_vector(expected), angles, "{expected:?}");
    }
}

#[test]
fn corners_of_the_range_and_far_beyond() {
    for alpha in (-180..=180).step_by(5) {
        for beta in (-90..=90).step_by(5) {
            for magnitude in [1, 10, 1_000, 200_000, 1_000_000, 10_000_000] {
                let angles = polar(alpha * 1000, beta * 1000, magnitude);
                assert!(vector_error(angles) <= 0.6, "{angles:?}");
            }
            let largest = polar(alpha * 1000, beta * 1000, i32::MAX);
            assert!(vector_error(largest) <= 9.0, "{largest:?}");
        }
    }
}

#[test]
fn no_force_has_no_direction() {
    assert_eq!(Polar::of_vector(vector(0, 0, 0)), Polar::default());
    assert_eq!(polar(12_345, -6_789, 0).to_vector(), vector(0, 0, 0));
    for tiny in [
        vector(1, 0, 0),
        vector(0, -1, 0),
        vector(0, 0, 1),
        vector(1, 1, -1),
    ] {
        let [alpha, beta, magnitude] = polar_error(tiny);
        assert!(
            alpha <= 0.51 && beta <= 0.51 && magnitude <= 0.5,
            "{tiny:?}"
        );
    }
}

#[test]
fn the_largest_vectors_saturate() {
    for z in [i32::MIN, i32::MAX] {
        let corner = Polar::of_vector(vector(i32::MIN, i32::MIN, z));
        assert_eq!(corner.magnitude, MicroNewtons(i32::MAX));
        assert_eq!(corner.beta, MilliDegrees(-35_264));
    }
}

/// The output of a network that gives only a force.
fn output(values: [i32; 3]) -> Output {
    Output {
        values,
        ..Output::default()
    }
}

fn force_of(
    outputs: [i32; 3],
    edit: fn(&mut crate::force::model::encode::ModelSpec),
) -> (Force, Status) {
    let mut spec = spec(&[11, 3]);
    edit(&mut spec);
    let bytes = spec.encode().unwrap();
    of_outputs(&Model::parse(&bytes).unwrap(), &output(outputs))
}

#[test]
fn both_output_kinds_mean_the_same() {
    let angles = polar(8_000, -6_000, 200_000);
    let outputs = angles.to_vector().map(|component| component.0);
    let (by_vector, status) = force_of(outputs, |_| {});
    let (by_angles, _) = force_of([8_000, -6_000, 200_000], |spec| {
        spec.output = OutputKind::AnglesMagnitude;
    });
    assert_eq!(status, Status::CONTACT);
    assert_eq!(by_vector.cartesian, by_angles.cartesian);
    assert_eq!(by_angles.alpha, MilliDegrees(8_000));
    assert_eq!(by_angles.magnitude, MicroNewtons(200_000));
    assert!((by_vector.alpha.0 - 8_000).abs() <= 1 && (by_vector.beta.0 + 6_000).abs() <= 1);
}

#[test]
fn the_vector_of_a_pressing_direction_lies_along_it() {
    for contact in [ContactReading::Stick, ContactReading::Slip] {
        let mut spec = spec(&[11, 3]);
        spec.conditions.contact = contact;
        let bytes = spec.encode().unwrap();
        let model = Model::parse(&bytes).unwrap();
        let outputs = [12_000, -9_000, -99_000];
        let (force, _) = of_outputs(&model, &output(outputs));
        assert_eq!(force.cartesian, outputs.map(MicroNewtons));
        let of_angles = polar(force.alpha.0, force.beta.0, force.magnitude.0).to_vector();
        for (of_angles, component) in of_angles.iter().zip(force.cartesian) {
            assert!((of_angles.0 - component.0).abs() <= 3, "{contact:?}");
        }
    }
}

#[test]
fn odd_angles_are_brought_into_their_range() {
    let angles = |spec: &mut crate::force::model::encode::ModelSpec| {
        spec.output = OutputKind::AnglesMagnitude;
    };
    let (force, _) = force_of([190_000, 100_000, -5], angles);
    assert_eq!(
        (force.alpha.0, force.beta.0, force.magnitude.0),
        (-170_000, 90_000, 0)
    );
    let (force, _) = force_of([i32::MIN, i32::MIN, i32::MIN], angles);
    assert!((-180_000..=180_000).contains(&force.alpha.0));
}

/// The status of a contact, without its contact bit.
fn of_contact(status: Status) -> Status {
    assert!(status.contains(Status::CONTACT));
    Status(status.0 & !Status::CONTACT.0)
}

/// 1,270 µN across the force, 800 µN along it; |F| ≤ 1 N, |α| ≤ 15°, |β| ≤ 14°.
#[test]
fn trust_in_a_force() {
    let status = |x, y, z| of_contact(force_of([x, y, z], |_| {}).1);
    assert_eq!(status(0, 0, -200_000), Status::OK);
    assert_eq!(
        status(0, 0, -1_049_000),
        Status::OK,
        "within the margin of a twentieth"
    );
    assert_eq!(status(0, 0, -1_051_000), Status::MAGNITUDE_OUT_OF_RANGE);
    assert_eq!(
        status(28_000, 0, -100_000),
        Status::OK,
        "15.6°, within the margin of 1°"
    );
    assert_eq!(
        status(29_000, 0, -100_000),
        Status::DIRECTION_OUT_OF_RANGE,
        "16.2°"
    );
    assert_eq!(status(0, 26_500, -100_000), Status::OK, "14.8°");
    assert_eq!(
        status(0, -27_500, -100_000),
        Status::DIRECTION_OUT_OF_RANGE,
        "15.4°"
    );
    assert_eq!(
        status(0, 0, 100_000),
        Status::DIRECTION_OUT_OF_RANGE,
        "a pull"
    );
    assert_eq!(
        status(0, 0, 1_051_000),
        Status::MAGNITUDE_OUT_OF_RANGE | Status::DIRECTION_OUT_OF_RANGE,
        "a pull beyond the range"
    );
    // 1,270 µN / |F| is 5° at 14.55 mN.
    assert_eq!(status(0, 0, -14_700), Status::OK);
    assert_eq!(status(0, 0, -14_500), Status::DIRECTION_UNRELIABLE);
    assert_eq!(
        status(10_000, 0, 0),
        Status::DIRECTION_UNRELIABLE,
        "angles do not count then"
    );
}

#[test]
fn a_force_carries_the_uncertainty_of_its_size() {
    let rising = |spec: &mut crate::force::model::encode::ModelSpec| {
        spec.uncertainty.step_bits = 15;
        spec.uncertainty.knots[3].along = MicroNewtons(1_000);
    };
    for direction in [[0, 0, -1], [0, 1, 0]] {
        let (force, _) = force_of(direction.map(|part| 90 * 1024 * part), rising);
        let expected = (1_270.0f64 / (90.0 * 1024.0)).to_degrees() * 1e3;
        assert!((f64::from(force.direction_sigma.0) - expected).abs() <= 0.6);
        // 90 KiB µN lie between the knots of 64 and 96.
        assert_eq!(force.magnitude_sigma, UnsignedMicroNewtons(963));
    }
}

/// Places to 4 mm, a margin of 0.25 mm; the place is checked only during a contact.
#[test]
fn trust_in_a_place() {
    let mut spec = place_spec(&[11, 5]);
    spec.uncertainty.step_bits = 15;
    spec.uncertainty.knots[0].place = Micrometres(800);
    let bytes = spec.encode().unwrap();
    let model = Model::parse(&bytes).unwrap();
    let reported = |newtons: i32, place: [i32; 2]| {
        let values = [0, 0, -newtons];
        let output = Output {
            place,
            ..output(values)
        };
        of_outputs(&model, &output)
    };
    let (force, status) = reported(100_000, [-4_250, 4_250]);
    let place = force.place.unwrap();
    assert_eq!((place.x.0, place.y.0, place.sigma.0), (-4_250, 4_250, 120));
    assert_eq!(of_contact(status), Status::OK);
    for place in [[-4_251, 0], [0, 4_251], [i32::MIN, i32::MAX]] {
        assert_eq!(
            of_contact(reported(100_000, place).1),
            Status::PLACE_OUT_OF_RANGE
        );
    }
    let (weak, status) = reported(2_048, [9_000, 0]);
    assert_eq!(weak.place.unwrap().sigma.0, 758);
    assert!(
        status.contains(Status::PLACE_OUT_OF_RANGE)
            == is_contact(weak.magnitude, weak.magnitude_sigma)
    );
    assert!(
        !reported(1_000, [9_000, 0])
            .1
            .contains(Status::PLACE_OUT_OF_RANGE)
    );
    assert_eq!(force_of([0, 0, -100_000], |_| {}).0.place, None);
}

#[test]
fn nothing_has_no_known_direction() {
    let (none, status) = force_of([0, 0, 0], |_| {});
    assert_eq!(status, Status::DIRECTION_UNRELIABLE);
    assert_eq!((none.magnitude.0, none.alpha.0, none.beta.0), (0, 0, 0));
    assert_eq!(none.direction_sigma, UnsignedMilliDegrees(180_000));
    assert_eq!(none.magnitude_sigma, UnsignedMicroNewtons(800));
    let (tiny, _) = force_of([1, 0, 0], |_| {});
    assert_eq!(
        tiny.direction_sigma,
        UnsignedMilliDegrees(180_000),
        "saturated"
    );
}

#[test]
fn extreme_uncertainties_do_not_overflow() {
    for sigma in [MicroNewtons(0), LARGEST_UNCERTAINTY] {
        for step_bits in [0, 27] {
            let mut spec = spec(&[11, 3]);
            let knot = UncertaintyKnot {
                across: sigma,
                along: sigma,
                ..UncertaintyKnot::default()
            };
            spec.uncertainty = Uncertainty::constant(knot);
            spec.uncertainty.step_bits = step_bits;
            spec.range.magnitude = MicroNewtons(i32::MAX);
            let bytes = spec.encode().unwrap();
            let model = Model::parse(&bytes).unwrap();
            for value in [i32::MIN, -1, 0, 1, i32::MAX] {
                let (force, _) = of_outputs(&model, &output([value; 3]));
                assert_eq!(force.magnitude_sigma.0, sigma.0.unsigned_abs());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn angles_are_within_their_bounds(
        x: i32, y: i32, z: i32,
        shifts in (0u32..31, 0u32..31, 0u32..31),
    ) {
        let vector = vector(x >> shifts.0, y >> shifts.1, z >> shifts.2);
        let [alpha, beta, magnitude] = polar_error(vector);
        prop_assert!(alpha <= 0.51 && beta <= 0.51, "{alpha} {beta}");
        // Beyond 2,147 N the magnitude saturates.
        prop_assert!(magnitude <= 0.5 || Polar::of_vector(vector).magnitude.0 == i32::MAX);
    }

    #[test]
    fn vectors_are_within_their_bounds(
        alpha in -180_000..=180_000i32,
        beta in -90_000..=90_000i32,
        magnitude in 0..=10_000_000i32,
    ) {
        let error = vector_error(polar(alpha, beta, magnitude));
        prop_assert!(error <= 0.6, "{error}");
    }

    #[test]
    fn there_and_back(
        alpha in -89_000..=89_000i32,
        beta in -89_000..=89_000i32,
        magnitude in 5_000_000..=10_000_000i32,
    ) {
        let back = Polar::of_vector(polar(alpha, beta, magnitude).to_vector());
        let steep = 1.0 / (f64::from(beta) * 1e-3).to_radians().cos();
        prop_assert!(f64::from((back.alpha.0 - alpha).abs()) <= 1.0 + 0.02 * steep);
        prop_assert!((back.beta.0 - beta).abs() <= 1);
        prop_assert!((back.magnitude.0 - magnitude).abs() <= 2);
    }
}
