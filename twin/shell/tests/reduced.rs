//! Tests of the committed tables against the full solution.

use std::sync::LazyLock;

use hivtac_shell::{Design, Domain, Film, check, press_load};
use hivtac_twin::film::Film as ReducedFilm;
use hivtac_twin::film::reduced::{LARGEST_RADIUS_MM, NOMINAL_RADIUS_MM, SMALLEST_RADIUS_MM, Unit};
use hivtac_twin::{Camera, Contact, Disc, Load, Preset};

/// Largest error of the reduced film's markers, px at 320×240 `ov7725`.
const MOST_PX: f64 = 0.1;
/// The same for a unit that differs from the nominal film as much as one built by hand.
const MOST_PX_OF_A_UNIT: f64 = 0.3;

static CAMERA: LazyLock<Camera> = LazyLock::new(|| Camera::new(Preset::Ov7725, 320, 240).unwrap());

/// A force, N, its place, mm, and the tip's radius, mm.
type Case = ([f64; 3], [f64; 2], f64);

fn load((force_n, place_mm, radius_mm): Case) -> Load {
    let load = Load::from_vector(force_n).unwrap();
    let load = load.with_offset_mm(place_mm).unwrap();
    load.with_tip_radius_mm(radius_mm).unwrap()
}

/// Compares the reduced film of a unit with its elements.
fn agree(unit: &Unit, loads: &[Load], most_px: f64) {
    let reduced = ReducedFilm::of(*unit).unwrap();
    let mut film = Film::new(&Design::of(unit)).unwrap();
    for load in loads {
        reduced.check(load).unwrap();
        let pressed = reduced.press(load);
        let full = press_load(&mut film, load).unwrap();
        for (a, b) in full.state.force_n.iter().zip(pressed.force_n) {
            assert!((a - b).abs() < 2e-3, "{load:?}: force {a} {b} N");
        }
        for (id, disc) in reduced
            .markers_mm()
            .array::<4>()
            .map(Disc::marker)
            .into_iter()
            .enumerate()
        {
            let [[x, y], [a, b]] = [
                disc.centroid_px(|rest| film.displacement(&full.state, rest), &CAMERA),
                disc.centroid_px(|rest| pressed.displacement(rest), &CAMERA),
            ];
            let error = (a - x).hypot(b - y);
            assert!(error < most_px, "{error} px: marker {id}, {load:?}");
        }
    }
}

#[test]
fn tables_are_the_full_solution() {
    let cases = [
        ([0.0, 0.0, -0.2], [0.0, 0.0], 0.5),
        ([0.05, -0.11, -0.19], [-3.3, 2.2], 0.5),
        ([0.01, 0.0, -0.05], [4.0, 3.4], 0.5),
        ([-0.001, 0.0005, -0.002], [4.9, -4.9], 0.3),
        ([0.02, 0.03, -0.1], [1.0, -2.7], 1.4),
    ];
    agree(&Unit::default(), &cases.map(load), MOST_PX);
}

#[test]
#[ignore = "10 s: full solutions"]
fn a_film_built_by_hand_is_its_full_solution() {
    let unit = Unit {
        stiffness: 0.8,
        thickness: 1.1,
        grip: 1.5,
        posts_mm: [[0.3, -0.2], [-0.3, 0.1], [0.2, 0.3], [0.1, -0.3]],
        markers_mm: [[0.25, -0.2], [-0.15, 0.3], [0.2, 0.25], [-0.3, -0.1]].into(),
    };
    let cases = [
        ([0.01, -0.02, -0.1], [0.5, -0.3], 0.5),
        ([-0.03, 0.01, -0.15], [-2.5, 1.0], 0.5),
        ([0.0, 0.01, -0.03], [2.0, 3.0], 0.8),
        // Next to markers that are glued off their places.
        ([0.01, 0.01, -0.1], [3.2, 3.0], 0.5),
        ([0.0, -0.02, -0.1], [-2.9, -2.6], 0.5),
        ([0.0, 0.0, -0.05], [-3.5, 2.9], 0.5),
    ];
    agree(&unit, &cases.map(load), MOST_PX_OF_A_UNIT);
}

/// Where the markers' images are, px.
type Images = [[f64; 2]; 4];

/// Images under each load with gravity in this direction: of the full solution, and of the reduced
/// film.
fn images(down: [f64; 3], loads: &[Load]) -> Vec<[Images; 2]> {
    let weighed = Some(down).filter(|down| *down != [0.0; 3]);
    let reduced = ReducedFilm::default().with_down(weighed).unwrap();
    let discs = reduced.markers_mm().array::<4>().map(Disc::marker);
    let design = Design {
        down,
        ..Design::default()
    };
    let mut film = Film::new(&design).unwrap();
    let of_load = |load| {
        let (full, ours) = (press_load(&mut film, load).unwrap(), reduced.press(load));
        let of_full =
            |disc: &Disc| disc.centroid_px(|rest| film.displacement(&full.state, rest), &CAMERA);
        let of_ours = |disc: &Disc| disc.centroid_px(|rest| ours.displacement(rest), &CAMERA);
        [discs.each_ref().map(of_full), discs.each_ref().map(of_ours)]
    };
    loads.iter().map(of_load).collect()
}

/// The largest difference of the weight's effect on the images between the full solution and the
/// reduced film, px.
fn off_px(with: &[Images; 2], without: &[Images; 2]) -> f64 {
    let does = |way: usize, k: usize, c: usize| with[way][k][c] - without[way][k][c];
    let off = |k| [0, 1].map(|c| does(1, k, c) - does(0, k, c));
    let off = (0..4).map(off).map(|[x, y]| x.hypot(y));
    off.fold(0.0, f64::max)
}

/// The effect of weight, without the errors of the tables for a weightless film.
#[test]
#[ignore = "15 s: full solutions"]
fn weight_does_what_the_full_solution_says() {
    let cases = [
        ([0.0, 0.0, -0.004], [1.0, -2.0], 0.5),
        ([0.0, 0.0, -0.02], [0.0, 0.0], 0.5),
        ([0.01, -0.02, -0.06], [-2.3, 3.2], 0.5),
        ([0.0, 0.0, -0.2], [3.0, 2.2], 0.5),
    ];
    let loads = [vec![Load::REST], cases.map(load).to_vec()].concat();
    let without = images([0.0; 3], &loads);
    for down in [
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.48, 0.64, -0.6],
        [0.0, -0.8, 0.6],
    ] {
        let with = images(down, &loads);
        let off = with
            .iter()
            .zip(&without)
            .map(|(with, without)| off_px(with, without));
        let off: Vec<f64> = off.collect();
        println!("{down:?}: at rest, at 4 mN, pressed {off:.4?} px");
        let [at_rest, light, pressed @ ..] = &off[..] else {
            panic!("{off:?}");
        };
        assert!(*at_rest < 0.005 && *light < 0.5);
        assert!(pressed.len() == 3 && pressed.iter().all(|off| *off < 0.04));
    }
}

#[test]
#[ignore = "10 s: full solutions"]
fn labels_of_a_stage_are_the_full_solution() {
    let label = |n: f64, alpha: f64, beta: f64, contact: Contact| {
        let load = Load::from_angles(n, alpha, beta).unwrap();
        load.with_contact(contact).unwrap()
    };
    let loads = [
        label(0.2, 4.0, -2.0, Contact::Stick),
        label(0.05, -3.0, 1.0, Contact::Stick),
        label(0.2, 9.0, -3.0, Contact::Slip { mu: 0.6 }),
        label(0.1, -8.0, 6.0, Contact::Slip { mu: 0.3 }),
    ];
    agree(&Unit::default(), &loads, MOST_PX);
}

/// Independent loads of the whole domain: the first of those that `reduce -- film/data --check`
/// uses.
#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn tables_are_the_full_solution_everywhere() {
    let threads = std::thread::available_parallelism().unwrap().get();
    let check = |radii_mm, loads| {
        let domain = Domain::within(4.0, radii_mm);
        check(&Unit::default(), &domain, loads, threads, |_, _| ()).unwrap()
    };
    let nominal = check([NOMINAL_RADIUS_MM; 2], 40);
    assert!(nominal.worst_px < MOST_PX, "{nominal:?}");
    assert!(nominal.rms_px < 0.2 * MOST_PX, "{nominal:?}");
    let other = check([SMALLEST_RADIUS_MM, LARGEST_RADIUS_MM], 20);
    assert!(other.worst_px < 4.0 * MOST_PX, "{other:?}");
    assert!(other.rms_px < 0.5 * MOST_PX, "{other:?}");
}

#[test]
fn a_sliding_tip_keeps_its_friction_ratio_and_direction() {
    let mut film = Film::new(&Design {
        fineness: 0.5,
        ..Design::default()
    })
    .unwrap();
    let load = Load::from_angles(0.15, 8.0, 6.0).unwrap();
    let load = load.with_contact(Contact::Slip { mu: 0.4 }).unwrap();
    let loaded = press_load(&mut film, &load).unwrap();
    let ([x, y, z], [sx, sy]) = (loaded.state.force_n, loaded.touches_mm);
    assert!((x.hypot(y) + 0.4 * z).abs() < 1e-5, "{x} {y} {z}");
    assert!(sx * x > 0.0 && (sx * y - sy * x).abs() < 1e-4 * sx.hypot(sy));
    // The film lags behind the stage by the slide.
    let [tx, _, tz] = loaded.state.tip_mm;
    let [lx, _, lz] = load.vector_n();
    assert!((tx + sx - tz * lx / lz).abs() < 1e-6);
}

/// The places where a distracting thing may be: the film away from its markers is interpolated.
#[test]
#[ignore = "10 s: full solutions"]
fn the_film_between_markers_is_roughly_the_full_solution() {
    let mut film = Film::new(&Design::default()).unwrap();
    let reduced = ReducedFilm::default();
    let cases = [
        ([0.0, 0.0, -0.02], [0.0; 2], 0.5),
        ([0.05, 0.0, -0.24], [0.0; 2], 0.5),
        ([0.03, 0.0, -0.2], [3.0, -1.0], 0.5),
    ];
    for load in cases.map(load) {
        let state = press_load(&mut film, &load).unwrap().state;
        let pressed = reduced.press(&load);
        let mut worst = (0.0, [0.0; 2]);
        for (i, j) in (-14..=14).flat_map(|i| (-14..=14).map(move |j| (i, j))) {
            let rest = [f64::from(i), f64::from(j)];
            let full = film.displacement(&state, rest).into_iter();
            let pair = full.zip(pressed.displacement(rest));
            let error = pair.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            if error > worst.0 {
                worst = (error, rest);
            }
        }
        println!("{} N: {worst:?}", load.magnitude_n());
        assert!(worst.0 < 0.8, "{worst:?}");
    }
}
