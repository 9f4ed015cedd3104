use hivtac_twin::{Camera, Preset};

use super::*;
use crate::{Contact as TipContact, Design, markers};

fn film() -> Film {
    let design = Design {
        fineness: 0.35,
        ..Design::default()
    };
    Film::new(&design).unwrap()
}

fn touch(film: &Film, body: &Body, force_n: [f64; 3]) -> Touch {
    film.press_body(body, force_n, &film.rest()).unwrap()
}

/// Returns the largest distance of the images of a marker in two states, px at 320×240.
fn apart_px(film: &Film, a: &Equilibrium, b: &Equilibrium) -> f64 {
    let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
    let [a, b] = [a, b].map(|state| markers(film, state, &camera).map(|one| one.seen_px));
    let pairs = a.iter().zip(&b);
    pairs
        .map(|([ax, ay], [bx, by])| (ax - bx).hypot(ay - by))
        .fold(0.0, f64::max)
}

const BALL: Shape = Shape::Sphere { radius_mm: 5.0 };
const BAR: Shape = Shape::Cylinder {
    radius_mm: 0.8,
    length_mm: 6.0,
    ends: Ends::Rounded,
};
const FACE: Shape = Shape::Face { radius_mm: 2.0 };

#[test]
fn energies_of_penetration_have_their_derivatives() {
    // A point that begins to touch within a step changes some of the third digit.
    const STEP: f64 = 1e-6;
    let film = film();
    let body = Body {
        turned_deg: 20.0,
        tilt_deg: 3.0,
        stiffness_n_per_mm3: 1.0,
        ..Body::rigid(FACE, [1.0, 0.5])
    };
    let points = Points::new(&film, &body);
    let foot = [1.02, 0.48, 0.2];
    let u: Vec<f64> = (0..film.unknowns())
        .map(|k| 1e-3 * ((k * 7 % 11) as f64))
        .collect();
    let pattern = film.shell().pattern();
    let mut stiffness = vec![0.0; pattern.entries()];
    let second = points.second((&u, &foot), (pattern, &mut stiffness));
    let at = points.first(&u, &foot);
    assert!(at.energy > 0.0 && at.by_body[2] < 0.0);
    for c in 0..3 {
        let [back, forth] = [-STEP, STEP].map(|step| {
            let mut there = foot;
            there[c] += step;
            points.first(&u, &there)
        });
        let rate = |a: f64, b: f64| (b - a) / (2.0 * STEP);
        assert!((rate(back.energy, forth.energy) - at.by_body[c]).abs() < 1e-6);
        for d in 0..3 {
            let found = rate(back.by_body[d], forth.by_body[d]);
            assert!((found - second.by_body[c][d]).abs() < 5e-3, "{found}");
        }
        let pairs = back
            .by_film
            .iter()
            .zip(&forth.by_film)
            .zip(&second.mixed[c]);
        for ((back, forth), mixed) in pairs {
            assert!((rate(*back, *forth) - mixed).abs() < 5e-3);
        }
    }
    // Along a motion of the film: all of the stiffness at once.
    let way: Vec<f64> = (0..u.len())
        .map(|k| ((k * 5 % 13) as f64 - 6.0) / 6.0)
        .collect();
    let [back, forth] = [-STEP, STEP].map(|step| {
        let there: Vec<f64> = u
            .iter()
            .zip(&way)
            .map(|(u, part)| u + step * part)
            .collect();
        points.first(&there, &foot)
    });
    let slope: f64 = at.by_film.iter().zip(&way).map(|(a, b)| a * b).sum();
    assert!(((forth.energy - back.energy) / (2.0 * STEP) - slope).abs() < 1e-5 * slope.abs());
    let mut bend = 0.0;
    for (column, row, value) in pattern.triplets(&stiffness) {
        let twice = if row == column { 1.0 } else { 2.0 };
        bend += twice * value * way[row] * way[column];
    }
    let parts = forth.by_film.iter().zip(&back.by_film).zip(&way);
    let found: f64 = parts
        .map(|((b, a), way)| (b - a) / (2.0 * STEP) * way)
        .sum();
    assert!((found - bend).abs() < 1e-3 * bend, "{found} {bend}");
}

#[test]
fn the_posts_bear_what_presses_the_body() {
    let film = film();
    let force = [0.012, -0.008, -0.1];
    for shape in [BALL, BAR, FACE] {
        let body = Body {
            turned_deg: 40.0,
            tilt_deg: 2.0,
            ..Body::rigid(shape, [1.5, -1.0])
        };
        let pressed = touch(&film, &body, force);
        assert_eq!(pressed.state.force_n, force);
        for (reaction, force) in pressed.state.reaction_n.iter().zip(force) {
            assert!((reaction + force).abs() < 1e-7);
        }
        let [x, y] = pressed.patch.centre_mm();
        assert!((x - 1.5).hypot(y + 1.0) < 1.0, "{shape:?} {x} {y}");
        assert!(pressed.deep_mm < 0.01 && pressed.area_mm2 > 0.1);
    }
}

#[test]
fn a_straight_press_at_the_middle_is_symmetric() {
    let film = film();
    for shape in [BALL, BAR, FACE] {
        let pressed = touch(&film, &Body::rigid(shape, [0.0; 2]), [0.0, 0.0, -0.1]);
        let [x, y] = pressed.patch.centre_mm();
        assert!(x.abs() < 1e-5 && y.abs() < 1e-5, "{shape:?} {x} {y}");
        let [a, b] = pressed.reach_mm;
        match shape {
            BAR => assert!(a > 2.0 && b < 0.5, "along x"),
            BALL => assert!((a - b).abs() < 0.1 && (0.9..1.6).contains(&a)),
            _ => assert!((a - b).abs() < 0.1 && (1.9..2.2).contains(&a)),
        }
    }
}

#[test]
fn a_small_ball_is_a_tip_of_its_contacts_size() {
    let film = film();
    let (place, force) = ([2.0, 1.0], [0.0, 0.0, -0.1]);
    let ball = Body::rigid(Shape::Sphere { radius_mm: 0.6 }, place);
    let pressed = touch(&film, &ball, force);
    let tip = TipContact::Force(force);
    let tip = film.press_at(pressed.patch.centre_mm(), 0.25, tip, &film.rest());
    assert!(apart_px(&film, &pressed.state, &tip.unwrap()) < 0.005);
    let spread = film.press_patch(&pressed.patch, force, &film.rest());
    assert!(apart_px(&film, &pressed.state, &spread.unwrap()) < 0.005);
}

#[test]
#[ignore = "10 s: full solutions"]
fn a_rigid_body_is_rigid_enough() {
    let film = film();
    for shape in [BALL, FACE] {
        let press = |stiffness_n_per_mm3| {
            let body = Body {
                tilt_deg: 2.0,
                stiffness_n_per_mm3,
                ..Body::rigid(shape, [1.5, -1.0])
            };
            touch(&film, &body, [0.0, 0.005, -0.1]).state
        };
        let [half, whole] = [RIGID_N_PER_MM3 / 2.0, RIGID_N_PER_MM3].map(press);
        let moved = apart_px(&film, &half, &whole);
        println!("{shape:?}: {moved:.4} px from half of the stiffness");
        assert!(moved < 0.01, "{shape:?} {moved}");
    }
}

#[test]
fn a_tilted_face_presses_with_its_lower_side() {
    let film = film();
    let body = Body {
        turned_deg: 90.0,
        tilt_deg: 5.0,
        ..Body::rigid(FACE, [0.0; 2])
    };
    let [x, y] = touch(&film, &body, [0.0, 0.0, -0.1]).patch.centre_mm();
    assert!(x.abs() < 1e-5 && y < -0.1, "{x} {y}");
}

#[test]
fn a_pad_covers_four_millimetres_by_two_and_a_half() {
    let film = film();
    let pad = Body::pad([0.0; 2], 0.0);
    let [a, b] = touch(&film, &pad, [0.0, 0.0, -0.1]).reach_mm;
    assert!((a - 4.0).abs() < 0.2 && (b - 2.5).abs() < 0.2, "{a} {b}");
}

#[test]
fn what_cannot_press_is_refused() {
    let film = film();
    let refused = |body: Body, force_n| {
        let pressed = film.press_body(&body, force_n, &film.rest());
        pressed.err().map(|why| why.to_string()).unwrap()
    };
    let ball = Body::rigid(BALL, [0.0; 2]);
    assert!(refused(ball, [0.0, 0.0, 0.1]).contains("z < 0"));
    assert!(refused(ball, [f64::NAN, 0.0, -0.1]).contains("finite"));
    let steep = Body {
        tilt_deg: 80.0,
        ..ball
    };
    assert!(refused(steep, [0.0, 0.0, -0.1]).contains("tilt"));
    let none = Body::rigid(Shape::Sphere { radius_mm: -1.0 }, [0.0; 2]);
    assert!(refused(none, [0.0, 0.0, -0.1]).contains("more than 0"));
    let vast = Body::rigid(Shape::Sphere { radius_mm: 200.0 }, [0.0; 2]);
    assert!(refused(vast, [0.0, 0.0, -0.1]).contains("from its foot"));
}
