//! The committed curves against the full solution, and what they say of the film.

use hivtac_film::{Design, Film, check, fit, markers, paper_camera, press_load};
use hivtac_scene::film::stuck::{Solved, tangent};
use hivtac_scene::film::{Family, Film as ReducedFilm, MAX_STUCK_N};
use hivtac_scene::{Contact, Load, MARKERS};

/// How far the reduced film's markers may be off, px at 800×600.
const MOST_PX: f64 = 0.1;

/// |F|, α, β and offset.
type Case = (f64, f64, f64, [f64; 2]);

fn load((force_n, alpha_deg, beta_deg, offset_mm): Case, contact: Contact) -> Load {
    let load = Load::from_angles(force_n, alpha_deg, beta_deg).unwrap();
    let load = load.with_contact(contact).unwrap();
    load.with_offset_mm(offset_mm).unwrap()
}

/// Holds the reduced film and elements against each other.
fn agree(contact: Contact, overhang_mm: f64, cases: &[Case]) {
    let camera = paper_camera().unwrap();
    let reduced = ReducedFilm::with_overhang(overhang_mm).unwrap();
    let mut film = Film::new(&Design {
        overhang_mm,
        ..Design::default()
    })
    .unwrap();
    for case in cases {
        let load = load(*case, contact);
        reduced.check(&load).unwrap();
        let (pressed, full) = (reduced.press(&load), press_load(&mut film, &load).unwrap());
        for (a, b) in full.state.tip_mm.iter().zip(pressed.tip_mm) {
            assert!((a - b).abs() < 0.02, "{load:?}: tip {a} {b} mm");
        }
        for (a, b) in full.state.force_n.iter().zip(pressed.force_n) {
            assert!((a - b).abs() < 2e-3, "{load:?}: force {a} {b} N");
        }
        for (id, full) in markers(&film, &full.state, &camera).iter().enumerate() {
            let [x, y] = MARKERS[id].centroid_px(|rest| pressed.displacement(rest), &camera);
            let error = (full.seen_px[0] - x).hypot(full.seen_px[1] - y);
            assert!(error < MOST_PX, "{error} px: marker {id}, {load:?}");
        }
    }
}

#[test]
fn force_curves_are_the_full_solution() {
    let cases = [
        (0.25, 12.0, -10.0, [-0.17, 0.18]),
        (0.05, -7.0, 4.0, [0.0, 0.25]),
        (0.002, 12.0, 10.0, [0.0, 0.0]),
        (0.4, 0.0, 5.0, [0.1, 0.0]),
    ];
    agree(Contact::Force, 0.0, &cases);
}

#[test]
fn force_curves_of_the_overhanging_film_are_its_full_solution() {
    let cases = [(0.15, 10.0, -6.0, [-0.1, 0.2])];
    agree(Contact::Force, 6.0, &cases);
}

#[test]
fn stuck_films_are_the_full_solution() {
    let cases = [
        (0.2, 5.0, -3.0, [0.0, 0.0]),
        (0.25, 12.0, 10.0, [-0.17, 0.18]),
        (0.02, -8.0, 2.0, [0.2, 0.0]),
        // Where one side of the film buckles.
        (0.01, -11.5, -7.0, [0.0, 0.0]),
        (0.0092, 10.4, 9.9, [0.0, 0.0]),
        (0.012, 3.0, 10.0, [0.1, -0.2]),
    ];
    agree(Contact::Stick, 0.0, &cases);
}

#[test]
fn slip_curves_are_the_full_solution() {
    let cases = [
        (0.2, 9.0, -3.0, [0.0, 0.0]),
        (0.1, -11.0, 9.0, [0.1, 0.2]),
        // Sticks.
        (0.2, 1.0, 0.0, [0.0, 0.0]),
    ];
    agree(Contact::Slip { mu: 0.6 }, 0.0, &cases);
    agree(Contact::Slip { mu: 0.1 }, 0.0, &cases[1..2]);
    agree(Contact::Slip { mu: 1.0 }, 0.0, &cases[..1]);
}

/// Independent loads of the whole domain, as in the notes of `scene/data`.
#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn curves_are_the_full_solution_everywhere() {
    let threads = std::thread::available_parallelism().unwrap().get();
    for (contact, poses) in [
        (Contact::Force, 20),
        (Contact::Stick, 30),
        (Contact::Slip { mu: 0.6 }, 10),
    ] {
        let design = Design::default();
        let film = ReducedFilm::default();
        let check = check(&film, &design, contact, poses, threads, |_, _| ()).unwrap();
        assert!(check.worst_px < MOST_PX, "{contact}: {check:?}");
    }
}

/// The committed file is what its command makes. Another processor may round otherwise: to a few of the last digit.
#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn committed_curves_come_from_their_command() {
    let threads = std::thread::available_parallelism().unwrap().get();
    let made = fit(Family::Slip, &Design::default(), threads, |_, _| ()).unwrap();
    let made = made.to_string();
    let committed = include_str!("../../scene/data/slip.csv").lines();
    let committed: Vec<&str> = committed.filter(|line| !line.starts_with('#')).collect();
    assert_eq!(made.lines().count(), committed.len());
    for (made, committed) in made.lines().zip(committed) {
        let (made, committed) = (made.split(','), committed.split(','));
        let (made, committed): (Vec<&str>, Vec<&str>) = (made.collect(), committed.collect());
        assert_eq!(made[..5], committed[..5]);
        for (made, committed) in made[5..].iter().zip(&committed[5..]) {
            let [made, committed] = [made, committed].map(|word| word.parse::<f64>().unwrap());
            assert!((made - committed).abs() < 1e-6, "{made} {committed}");
        }
    }
}

/// Some of the committed solutions, found from rest.
#[test]
fn committed_solutions_are_the_full_solution() {
    let solved: Solved = include_str!("../../scene/data/stick.csv").parse().unwrap();
    let mut film = Film::new(&Design::default()).unwrap();
    for (way, state) in solved.states.iter().step_by(199) {
        let (sin, cos) = way.turn_deg.to_radians().sin_cos();
        let tangent = tangent(way.size, way.steepness);
        let direction = [tangent * cos, tangent * sin, -1.0];
        let force_n = MAX_STUCK_N * way.size.powi(3);
        let length = (1.0 + tangent * tangent).sqrt();
        let load = Load::from_vector(direction.map(|part| part * force_n / length)).unwrap();
        let load = load.with_contact(Contact::Stick).unwrap();
        let full = press_load(&mut film, &load).unwrap().state;
        let [x, y, z] = [full.force_n[0], full.force_n[1], full.tip_mm[2]];
        for (a, b) in [x, y, z].iter().zip(state.answer.tip) {
            assert!((a - b).abs() < 1e-4, "{way:?}: tip {a} {b}");
        }
        let camera = paper_camera().unwrap();
        let markers = markers(&film, &full, &camera);
        for (k, (marker, disc)) in markers.iter().zip(state.answer.discs).enumerate() {
            let [cx, cy] = MARKERS[k].centre_mm;
            let seen = MARKERS[k].centroid_px(|[x, y]| disc.at([x - cx, y - cy]), &camera);
            for (a, b) in marker.seen_px.iter().zip(seen) {
                // Of the file's digits; the affine map nearest to the film is off by several times as much.
                assert!((a - b).abs() < 0.01, "{way:?}: marker {a} {b} px");
            }
            let (a, b) = (marker.moved_mm[2], disc.moved_mm[2]);
            assert!((a - b).abs() < 1e-4, "{way:?}: marker {a} {b} mm");
        }
    }
}

#[test]
fn a_sliding_tip_keeps_its_friction_ratio_and_direction() {
    let mut film = Film::new(&Design {
        fineness: 0.5,
        ..Design::default()
    })
    .unwrap();
    let load = load((0.15, 8.0, 6.0, [0.0; 2]), Contact::Slip { mu: 0.4 });
    let loaded = press_load(&mut film, &load).unwrap();
    let ([x, y, z], [sx, sy]) = (loaded.state.force_n, loaded.touches_mm);
    assert!((x.hypot(y) + 0.4 * z).abs() < 1e-5, "{x} {y} {z}");
    assert!(sx * x > 0.0 && (sx * y - sy * x).abs() < 1e-4 * sx.hypot(sy));
    // The film lags behind the stage by the slide.
    let [tx, _, tz] = loaded.state.tip_mm;
    let [lx, _, lz] = load.vector_n();
    assert!((tx + sx - tz * lx / lz).abs() < 1e-6);
}

/// Where a distracting thing may be: the film away from its markers is interpolated.
#[test]
fn the_film_between_markers_is_roughly_the_full_solution() {
    let mut film = Film::new(&Design::default()).unwrap();
    let reduced = ReducedFilm::default();
    for case in [(0.02, 0.0, 0.0, [0.0; 2]), (0.25, 12.0, 0.0, [0.0; 2])] {
        let load = load(case, Contact::Force);
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
        assert!(worst.0 < 0.4, "{worst:?}");
    }
}
