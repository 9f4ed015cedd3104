use super::geometry::{Geometry, Pose};
use super::matrix::{Matrix, transposed};
use super::pair::Pair;
use super::*;
use proptest::prelude::*;

/// 1 mN and 1 mN·mm.
const SMALL: f64 = 1e-9;

fn felt(force: Vector, place: [f64; 2]) -> Felt {
    Felt {
        force,
        covariance: covariance(force, 1e-3, 0.02),
        place: Some((place, 1e-4)),
    }
}

fn near(found: f64, wanted: f64) {
    assert!((found - wanted).abs() < SMALL, "{found} for {wanted}");
}

fn all_near(found: Vector, wanted: Vector) {
    assert!(
        (0..3).all(|row| (found[row] - wanted[row]).abs() < SMALL),
        "{found:?} {wanted:?}"
    );
}

/// An object of 30 mN hangs, squeezed with 100 mN, 2 mm off both films' middles along y. Down is y
/// of the grip and of the first film, −y of the second. By hand: each film is pulled down by 15 mN,
/// and the torques about x cancel but for nothing: −z₁ F_y − z₂ F_y = 0; about z there is none, as
/// x is 0 everywhere; y F_z of one cancels that of the other.
#[test]
fn a_hanging_object_shows_its_weight_and_what_squeezes_it() {
    let geometry = Geometry::default();
    let first = felt([0.0, 0.015, -0.1], [0.0, 0.002]);
    let second = felt([0.0, -0.015, -0.1], [0.0, -0.002]);
    let held = Held::of(&geometry, [&first, &second]);
    near(held.force, 0.1);
    all_near(held.common, [0.0, 0.030, 0.0]);
    let (torque, _) = held.torque.unwrap();
    all_near(torque, [0.0; 3]);
    // 0.5 · 100 − 15 mN.
    near(held.margin, 0.035);
}

/// By hand, each number with its own: the fingers press unequally, off their middles.
#[test]
fn a_wrench_is_that_computed_by_hand() {
    let geometry = Geometry::default();
    let first = felt([0.01, 0.02, -0.1], [0.001, 0.002]);
    let second = felt([0.03, -0.01, -0.2], [-0.002, 0.003]);
    let held = Held::of(&geometry, [&first, &second]);
    // The second film's y and z are turned over: (0.03, 0.01, 0.2) N at (−2, −3, 15) mm.
    near(held.force, (0.1 + 0.2) / 2.0);
    all_near(held.common, [0.04, 0.03, 0.1]);
    let (torque, _) = held.torque.unwrap();
    // (1, 2, −15) mm × (0.01, 0.02, −0.1) N = (0.1, −0.05, 0.0) mN·m, and
    // (−2, −3, 15) mm × (0.03, 0.01, 0.2) N = (−0.75, 0.85, 0.07) mN·m.
    all_near(torque, [-0.65e-3, 0.80e-3, 0.07e-3]);
    let margins = [0.05 - 0.01_f64.hypot(0.02), 0.1 - 0.03_f64.hypot(0.01)];
    near(held.margin, margins[0].min(margins[1]));
}

/// By hand: two presses straight in, with 1 mN of size and 0.02 rad · 0.1 N / √2 across.
#[test]
fn uncertainties_come_from_both_fingers() {
    let geometry = Geometry::default();
    let press = felt([0.0, 0.0, -0.1], [0.0, 0.0]);
    let held = Held::of(&geometry, [&press, &press]);
    let across = 0.1 * 0.02 / 2.0_f64.sqrt();
    near(held.force_sigma, (2.0 * 1e-6_f64 / 4.0).sqrt());
    let both = 2.0_f64.sqrt();
    all_near(
        held.common_sigma,
        [both * across, both * across, both * 1e-3],
    );
    near(held.margin_sigma, across.hypot(0.5 * 1e-3));
    let (_, sigmas) = held.torque.unwrap();
    // 15 mm times the force across, and the force times 0.1 mm.
    let one = (15e-3 * across).hypot(0.1 * 1e-4);
    all_near(sigmas, [both * one, both * one, 0.0]);
}

#[test]
fn without_a_place_there_is_no_torque() {
    let geometry = Geometry::default();
    let mut first = felt([0.01, 0.02, -0.1], [0.001, 0.002]);
    let second = first;
    first.place = None;
    assert_eq!(Held::of(&geometry, [&first, &second]).torque, None);
}

fn turn(axis: Vector, angle: f64) -> Matrix {
    let length = dot(axis, axis).sqrt();
    let axis = axis.map(|part| part / length);
    let (sin, cos) = angle.sin_cos();
    let across = crossing(axis);
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let same = if row == column { cos } else { 0.0 };
            same + sin * across[row][column] + (1.0 - cos) * axis[row] * axis[column]
        })
    })
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = transposed(b);
    a.map(|row| columns.map(|column| dot(row, column)))
}

fn any_force() -> impl Strategy<Value = Felt> {
    let force = [-0.2..0.2_f64, -0.2..0.2, -0.3..0.0];
    let place = [-4e-3..4e-3_f64, -4e-3..4e-3];
    (force, place).prop_map(|(force, place)| felt(force, place))
}

proptest! {
    /// Both fingers turned together: vectors turn with them, numbers stay.
    #[test]
    fn a_common_turn_turns_vectors_alone(
        first in any_force(), second in any_force(),
        axis in [0.1..1.0_f64, -1.0..1.0, -1.0..1.0], angle in -3.0..3.0_f64,
    ) {
        let geometry = Geometry::default();
        let turn = turn(axis, angle);
        let poses = geometry.poses.map(|pose| Pose {
            turn: product(&turn, &pose.turn),
            middle: times(&turn, pose.middle),
        });
        let axis = times(&turn, geometry.axis);
        let turned = Geometry { poses, axis, ..geometry };
        let [before, after] =
            [geometry, turned].map(|geometry| Held::of(&geometry, [&first, &second]));
        near(after.force, before.force);
        near(after.force_sigma, before.force_sigma);
        near(after.margin, before.margin);
        near(after.margin_sigma, before.margin_sigma);
        all_near(after.common, times(&turn, before.common));
        all_near(after.torque.unwrap().0, times(&turn, before.torque.unwrap().0));
        let square = |sigmas: Vector| dot(sigmas, sigmas);
        near(square(after.common_sigma), square(before.common_sigma));
    }

    /// The fingers exchanged, with their poses: nothing changes.
    #[test]
    fn swapped_fingers_are_the_same_grip(first in any_force(), second in any_force()) {
        let geometry = Geometry::default();
        let [one, other] = geometry.poses;
        let axis = geometry.axis.map(|part| -part);
        let swapped = Geometry { poses: [other, one], axis, ..geometry };
        let before = Held::of(&geometry, [&first, &second]);
        let after = Held::of(&swapped, [&second, &first]);
        near(after.force, before.force);
        near(after.force_sigma, before.force_sigma);
        near(after.margin, before.margin);
        all_near(after.common, before.common);
        all_near(after.torque.unwrap().0, before.torque.unwrap().0);
        all_near(after.torque.unwrap().1, before.torque.unwrap().1);
    }
}

const FRAME_NS: u64 = 6_405_000;

/// A sample of a press by a force that grows with time: 1 N/s.
fn reading(stamp_ns: u64) -> Reading {
    Reading {
        stamp_ns,
        came_ns: stamp_ns + 5_000_000,
        status: Status::CONTACT,
        felt: Some(felt([0.0, 0.0, -1e-9 * stamp_ns as f64], [0.0, 0.0])),
    }
}

fn refused(stamp_ns: u64) -> Reading {
    let status = Status::MARKERS_MISSING | Status::NOT_CALIBRATED;
    let felt = None;
    Reading {
        status,
        felt,
        ..reading(stamp_ns)
    }
}

/// Two fingers whose frames are half a frame apart; each of the first's gets its grip when the
/// second's next sample comes, with the force of that very time.
#[test]
fn frames_of_two_cameras_are_compared_at_one_time() {
    let mut pair = Pair::new(Geometry::default());
    let mut grips = Vec::new();
    for frame in 1..20 {
        grips.extend(pair.push(1, reading(frame * FRAME_NS)));
        grips.extend(pair.push(0, reading(frame * FRAME_NS + FRAME_NS / 2)));
    }
    assert_eq!(grips.len(), 18);
    for (grip, frame) in grips.iter().zip(1..) {
        assert_eq!(grip.stamp_ns, frame * FRAME_NS + FRAME_NS / 2);
        assert_eq!(grip.contact(), Some(true));
        let held = grip.held.unwrap();
        near(held.force, 1e-9 * grip.stamp_ns as f64);
        all_near(held.common, [0.0; 3]);
    }
}

#[test]
fn a_finger_that_refuses_or_is_silent_is_the_cause() {
    let names = ["thumb".to_owned(), "index".to_owned()];
    let reported = |grips: &[Grip]| {
        let grip = grips.last().expect("a grip");
        assert_eq!(grip.contact(), None);
        assert!(lines::json(grip, &names).contains(r#""grip":null,"#));
        lines::cause(grip, &names).unwrap()
    };
    let mut pair = Pair::new(Geometry::default());
    assert_eq!(pair.push(1, reading(FRAME_NS)), []);
    assert_eq!(pair.push(1, reading(2 * FRAME_NS)), []);
    let first = pair.push(0, refused(FRAME_NS + 1));
    assert_eq!(reported(&first), "thumb: markers_missing");
    pair.push(1, refused(3 * FRAME_NS));
    let second = pair.push(0, reading(2 * FRAME_NS + 1));
    assert_eq!(reported(&second), "index: markers_missing");
    let both = second[0].status;
    assert!(both[0].contains(Status::CONTACT) && both[1].contains(Status::NOT_CALIBRATED));
    // The second finger says no more: after 0.1 s that is the cause.
    let silent: Vec<Grip> = (3..30)
        .flat_map(|frame| pair.push(0, reading(frame * FRAME_NS + 1)))
        .collect();
    assert!(!silent.is_empty() && silent.len() < 27, "{}", silent.len());
    assert_eq!(reported(&silent), "index: no samples");
    // It is back, and the first one is gone.
    let back: Vec<Grip> = (30..60)
        .flat_map(|frame| pair.push(1, reading(frame * FRAME_NS)))
        .collect();
    assert_eq!(reported(&back), "thumb: no samples");
    assert!(
        back.iter()
            .rev()
            .take_while(|it| it.held == Err(Cause::Silent(0)))
            .count()
            > 5
    );
}

/// The first finger's samples come later than several of the second's.
#[test]
fn a_finger_whose_samples_come_late_has_its_grips_all_the_same() {
    let mut pair = Pair::new(Geometry::default());
    for frame in 1..9 {
        pair.push(1, reading(frame * FRAME_NS));
    }
    let late: Vec<Grip> = (2..5)
        .flat_map(|frame| pair.push(0, reading(frame * FRAME_NS + FRAME_NS / 3)))
        .collect();
    assert_eq!(late.len(), 3);
    assert!(late.iter().all(|grip| grip.held.is_ok()));
}
