//! The curves in `data/force.csv` against the full solution, and what they say of the film.

use hivtac_film::{Contact, Design, Film, MARKERS_MM, Reduced, markers, paper_camera};
use hivtac_scene::Load;

fn by_force() -> Reduced {
    include_str!("../data/force.csv").parse().unwrap()
}

fn hold_against_full(reduced: &Reduced, cases: &[(f64, f64, f64, [f64; 2])]) {
    let mut film = Film::new(&Design::default()).unwrap();
    let camera = paper_camera().unwrap();
    for &(force_n, alpha, beta, offset) in cases {
        let load = Load::from_angles(force_n, alpha, beta).unwrap();
        let contact = Contact::Force(load.vector_n());
        film.move_tip(offset).unwrap();
        let state = film.press(contact, &film.rest()).unwrap();
        let pressed = reduced.press(&load, offset).unwrap();
        assert!((pressed.tip_depth_mm + state.tip_mm[2]).abs() < 0.02);
        for (k, full) in markers(&film, &state, &camera).iter().enumerate() {
            let [dx, dy, dz] = pressed.moved_mm[k];
            let [x, y] = camera.project([MARKERS_MM[k][0] + dx, MARKERS_MM[k][1] + dy, dz]);
            let error = (x - full.seen_px[0]).hypot(y - full.seen_px[1]);
            assert!(
                error < 0.1,
                "{error} px: marker {k}, {force_n} N, {alpha}°, {beta}°"
            );
        }
    }
}

#[test]
fn force_curves_are_the_full_solution() {
    let cases = [
        (0.25, 12.0, -10.0, [-0.17, 0.18]),
        (0.05, -7.0, 4.0, [0.0, 0.25]),
        (0.002, 12.0, 10.0, [0.0, 0.0]),
    ];
    hold_against_full(&by_force(), &cases);
}

#[test]
fn no_force_moves_nothing() {
    let reduced = by_force();
    let rest = reduced.press(&Load::REST, [0.1, 0.1]).unwrap();
    assert_eq!(rest.tip_depth_mm, 0.0);
    assert_eq!(rest.moved_mm, [[0.0; 3]; 4]);
    let slight = Load::from_angles(1e-9, 0.0, 0.0).unwrap();
    assert!(reduced.press(&slight, [0.0; 2]).unwrap().tip_depth_mm.abs() < 1e-3);
}

#[test]
fn mirrored_loads_move_mirrored_markers() {
    let reduced = by_force();
    let right = Load::from_angles(0.2, 6.0, 0.0).unwrap();
    let left = Load::from_angles(0.2, -6.0, 0.0).unwrap();
    let right = reduced.press(&right, [0.1, 0.05]).unwrap();
    let left = reduced.press(&left, [-0.1, 0.05]).unwrap();
    assert!((right.tip_depth_mm - left.tip_depth_mm).abs() < 1e-12);
    for (a, b) in [(0, 1), (3, 2)] {
        let ([x, y, z], [mx, my, mz]) = (right.moved_mm[a], left.moved_mm[b]);
        assert!((x + mx).abs() < 1e-12 && (y - my).abs() < 1e-12 && (z - mz).abs() < 1e-12);
    }
}
