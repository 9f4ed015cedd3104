//! Verifies mounted films: stretched, of rubber, heavy, uneven.

use super::*;
use crate::point::{Law, WEIGHT_N_PER_MM3};
use crate::{Contact, Design, Equilibrium, Film};

const RUBBER: Law = Law {
    neo_hooke: 1.0,
    stiffening: 0.2,
};
const SHEET: Material = Material {
    youngs_mpa: 1.0,
    poisson: 0.49,
    thickness_mm: 0.01,
};

/// Returns a strip [0, a] × [0, 1] with held ends and no motion along y.
fn strip(sheet: &Sheet, length: f64, cells: usize) -> Shell {
    let mut shell = sheet_rectangle([length, 1.0], [cells, 1], sheet);
    for k in 0..shell.grid().unknowns() / 3 {
        shell.pin(3 * k + 1, PIN_N_PER_MM);
        if depth(&shell, k)[0] == 0 {
            shell.pin(3 * k, PIN_N_PER_MM);
            shell.pin(3 * k + 2, PIN_N_PER_MM);
        }
    }
    shell
}

/// Returns the tension, N/mm, of rubber stretched by (λ, μ), across a line of the unstretched film.
fn rubber_n_per_mm(law: Law, x: f64, y: f64) -> f64 {
    let i = x * x + y * y + (x * y).powi(-2) - 3.0;
    let c1 = SHEET.youngs_mpa / 6.0;
    let slope = c1 * (1.0 + 2.0 * law.stiffening * i);
    2.0 * SHEET.thickness_mm * slope * (x - x.powi(-3) * y.powi(-2))
}

/// A stretched strip acts as a string with the stiffness T/L. Pushed aside in the middle by a small
/// line force F, it yields by F L / (4 T).
#[test]
fn a_stretched_strip_is_a_string() {
    let length = 10.0;
    for law in [Law::default(), RUBBER] {
        let stretch = [0.04, 0.02];
        let sheet = Sheet {
            law,
            stretch,
            ..Sheet::of(&SHEET)
        };
        let shell = strip(&sheet, length, 40);
        let [x, y] = sheet.scales();
        // Across a line of the mounted film, which was shorter before.
        let tension = match law.neo_hooke {
            0.0 => {
                let [e1, e2] = [x, y].map(|part| (part * part - 1.0) / 2.0);
                SHEET.membrane_n_per_mm() * (e1 + SHEET.poisson * e2) * x
            }
            _ => rubber_n_per_mm(law, x, y),
        } / y;
        let force = 1e-6;
        let mut load = vec![0.0; shell.grid().unknowns()];
        for (k, part) in pressure(&shell, 1.0, 2).into_iter().enumerate() {
            load[k] = force * part / length;
        }
        let w = displacement(&shell, &linear(&shell, load), [length / 2.0, 0.5])[2];
        // The force is spread evenly: w = F L / (8 T).
        let exact = force * length / (8.0 * tension);
        println!("stretched strip: {w:.6e} mm, string {exact:.6e} mm");
        assert!((w / exact - 1.0).abs() < 2e-3, "{w} {exact}");
    }
}

/// Rubber's tension from the energy's slope: the force that holds the ends of a mounted strip.
#[test]
fn a_mounted_strip_pulls_with_rubbers_tension() {
    let sheet = Sheet {
        law: RUBBER,
        stretch: [0.05, -0.01],
        ..Sheet::of(&SHEET)
    };
    let shell = sheet_rectangle([8.0, 3.0], [5, 4], &sheet);
    let (_, gradient) = shell.first(&vec![0.0; shell.grid().unknowns()]);
    let columns = shell.grid().functions()[0];
    let pull: f64 = gradient
        .chunks(3)
        .enumerate()
        .filter(|(k, _)| k % columns == 0)
        .map(|(_, force)| -force[0])
        .sum();
    let [x, y] = sheet.scales();
    let exact = rubber_n_per_mm(RUBBER, x, y) * 3.0 / y;
    assert!((pull / exact - 1.0).abs() < 1e-12, "{pull} {exact}");
}

/// A strip of rubber between two held ends under its own large weight. It is a string that
/// stretches, with the vertical force q X of its weight before it was stretched.
#[test]
fn a_heavy_strip_is_a_catenary_that_stretches() {
    let (length, stretch) = (10.0, 1.01);
    // Soft: its weight is that of rubber a hundred times as stiff.
    let soft = Material {
        youngs_mpa: 1e-3,
        ..SHEET
    };
    let law = Law {
        neo_hooke: 1.0,
        stiffening: 0.1,
    };
    let sheet = Sheet {
        law,
        stretch: [stretch - 1.0, 0.0],
        down: [0.0, 0.0, -1.0],
        ..Sheet::of(&soft)
    };
    let shell = strip(&sheet, length, 40);
    let u = ramped(&shell, &vec![0.0; shell.grid().unknowns()], 1);
    let depth = -displacement(&shell, &u, [length / 2.0, 0.5])[2];

    let half = length / stretch / 2.0;
    let q = WEIGHT_N_PER_MM3 * soft.thickness_mm;
    let stretched = |tension: f64| {
        let (mut low, mut high) = (1.0, 10.0);
        for _ in 0..80 {
            let middle = (low + high) / 2.0;
            let pull = rubber_n_per_mm(law, middle, 1.0) * soft.youngs_mpa / SHEET.youngs_mpa;
            if pull < tension {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    };
    let integrals = |h: f64| {
        let (mut across, mut down) = (0.0, 0.0);
        let n = 2000;
        for i in 0..n {
            let vertical = q * half * (i as f64 + 0.5) / n as f64;
            let tension = h.hypot(vertical);
            let part = stretched(tension) / tension * half / n as f64;
            across += part * h;
            down += part * vertical;
        }
        (across, down)
    };
    let (mut low, mut high) = (1e-12, 1e-4);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if integrals(middle).0 < length / 2.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let exact = integrals(low).1;
    println!("heavy strip: {depth:.6} mm deep, string {exact:.6} mm");
    assert!(exact > 0.2, "{exact}");
    assert!((depth / exact - 1.0).abs() < 2e-3, "{depth} {exact}");
}

fn film(design: Design) -> (Film, Equilibrium) {
    let film = Film::new(&design).unwrap();
    let rest = film.rest();
    (film, rest)
}

/// All properties at once, on the coarsest mesh.
fn mounted() -> Design {
    Design {
        fineness: 0.25,
        overhang_mm: 5.0,
        post_radius_mm: 2.0,
        stretch: [0.015, 0.005],
        law: RUBBER,
        thickness_slope: [0.1, -0.05],
        thickness_curve: [0.05, 0.03, -0.08],
        down: [0.5, 0.3, 0.8],
        dot_stiffening: 1.0,
        ..Design::default()
    }
}

#[test]
fn posts_carry_the_weight() {
    let design = Design {
        stretch: [0.012, -0.002],
        down: [0.1, -0.2, -1.0],
        fineness: 0.4,
        overhang_mm: 2.0,
        thickness_slope: [0.2, 0.1],
        ..Design::default()
    };
    let (film, rest) = film(design.clone());
    let area = 32.0f64.powi(2) / (1.012 * 0.998);
    // Slopes are odd functions and add no weight.
    let weight = WEIGHT_N_PER_MM3 * 0.5 * area;
    for c in 0..3 {
        let lifted = rest.reaction_n[c] + weight * design.down[c];
        assert!(lifted.abs() < 1e-9, "{c}: {lifted}");
    }
    let force = [0.01, 0.02, -0.1];
    let state = film.press(Contact::Force(force), &rest).unwrap();
    for c in 0..3 {
        let left = state.reaction_n[c] + force[c] + weight * design.down[c];
        assert!(left.abs() < 1e-9, "{c}: {left}");
    }
}

#[test]
#[ignore = "10 s: full solutions"]
fn everything_at_once_rests_at_every_fineness() {
    for fineness in [0.25, 0.3, 0.5] {
        for overhang_mm in [0.0, 8.0] {
            for post_radius_mm in [1.0, 3.0] {
                let design = Design {
                    fineness,
                    overhang_mm,
                    post_radius_mm,
                    ..mounted()
                };
                let (film, rest) = film(design);
                let state = film.press(Contact::Force([0.02, 0.01, -0.2]), &rest);
                assert!(state.unwrap().tip_mm[2] < -2.0);
            }
        }
    }
}

/// The edges of a stretched film that is held at its posts curve inwards, as on the paper's
/// photographs.
#[test]
fn a_stretched_film_draws_its_edges_in() {
    let design = Design {
        fineness: 0.5,
        stretch: [0.012; 2],
        ..Design::default()
    };
    let (film, rest) = film(design);
    let [x, y, z] = film.displacement(&rest, [0.0, 14.0]);
    assert!(
        x.abs() < 1e-7 && z.abs() < 1e-7 && (-0.3..-0.03).contains(&y),
        "{y}"
    );
    let corner = film.displacement(&rest, [14.0, 14.0]);
    assert!(corner.iter().all(|part| part.abs() < 0.1), "{corner:?}");
}

#[test]
#[ignore = "10 s: full solutions"]
fn slack_films_bulge_where_they_are_drawn() {
    for fineness in [0.25, 0.5] {
        for (down, way) in [(0.0, -1.0), (1.0, 1.0), (-1.0, -1.0)] {
            for part in [-0.003, -0.001] {
                let design = Design {
                    fineness,
                    stretch: [part; 2],
                    down: [0.0, 0.0, down],
                    ..Design::default()
                };
                let (film, rest) = film(design);
                let z = film.displacement(&rest, [0.0; 2])[2];
                println!(
                    "slack {part}, down {down}: {z:.4} mm in {} steps",
                    rest.steps
                );
                // A tenth of a percent is below the buckling strain of a weightless film.
                let flat = down == 0.0 && part > -0.002;
                assert!(flat || z * way > 0.05, "{fineness} {part} {down}: {z}");
                assert!(film.linearize(&rest, &[]).is_ok(), "a stable branch");
                let state = film
                    .press(Contact::Force([0.0, 0.0, -0.05]), &rest)
                    .unwrap();
                assert!(state.tip_mm[2] < -1.0);
            }
        }
    }
}

#[test]
fn points_of_the_film_are_found_again() {
    let (film, rest) = film(mounted());
    for lab in [[3.7, -3.7], [0.0, 0.0], [-9.0, 8.0]] {
        let point = film.material_point(&rest, lab);
        let back = film.lab_place(&rest, point);
        assert!((back[0] - lab[0]).hypot(back[1] - lab[1]) < 1e-11);
    }
}

/// Two points are as good as three: as near to the solution of a finer mesh as the mesh itself
/// allows.
#[test]
#[ignore = "10 s: full solutions"]
fn two_points_are_as_near_as_three() {
    let depth = |fineness, gauss_points| {
        let (film, rest) = film(Design {
            fineness,
            gauss_points,
            ..mounted()
        });
        let state = film
            .press(Contact::Force([0.02, 0.0, -0.2]), &rest)
            .unwrap();
        film.displacement(&state, [3.7, 3.7])[2]
    };
    let exact = depth(1.0, 3);
    for fineness in [0.25, 0.4] {
        let [two, three] = [2, 3].map(|points| depth(fineness, points) - exact);
        println!("fineness {fineness}: off by {two:.5} mm of 2 points, {three:.5} of 3");
        assert!(two.abs() < 1.1 * three.abs() + 1e-3, "{two} {three}");
    }
}

/// The stiffening by dots follows their share of the film's area, wherever the cells are.
#[test]
fn dots_stiffen_by_their_area() {
    let sheet = |dots_mm: Vec<[f64; 2]>| Sheet {
        dots_mm,
        dot_stiffening: 2.0,
        ..Sheet::of(&SHEET)
    };
    let energy = |sheet: &Sheet| {
        let shell = sheet_rectangle([6.0, 4.0], [4, 3], sheet);
        shell.energy(&coefficients(&shell, |x, y| [0.01 * x, 0.02 * y, 0.0]))
    };
    let plain = energy(&sheet(Vec::new()));
    let dotted = energy(&sheet(vec![[1.4, 1.3], [4.0, 2.2]]));
    let part = 2.0 * 2.0 * std::f64::consts::PI * 0.25 / 24.0;
    assert!((dotted / plain - 1.0 - part).abs() < 1e-12);
}

/// A wedge bends with the cube of its mean thickness.
#[test]
fn uneven_films_have_their_membrane_and_bending() {
    let terms = [0.1, -0.2, 0.15, 0.1, -0.1];
    let sheet = Sheet {
        terms,
        ..Sheet::of(&SHEET)
    };
    let shell = sheet_rectangle([6.0, 4.0], [12, 8], &sheet);
    let mean = |power: i32| {
        let n = 200;
        let at = |k: usize, length: f64| length * (k as f64 + 0.5) / n as f64;
        let all = (0..n).flat_map(|i| (0..n).map(move |j| [at(i, 6.0), at(j, 4.0)]));
        all.map(|point| sheet.relative(point).powi(power))
            .sum::<f64>()
            / (n * n) as f64
    };
    let e = (1.01f64.powi(2) - 1.0) / 2.0;
    let stretched = shell.energy(&coefficients(&shell, |x, _| [0.01 * x, 0.0, 0.0]));
    let exact = 24.0 * 0.5 * SHEET.membrane_n_per_mm() * e * e * mean(1);
    assert!((stretched / exact - 1.0).abs() < 1e-5);
    let [x, y] = &shell.grid().axes;
    let xs: Vec<f64> = x.greville().collect();
    let twist = 1e-6;
    let twisted: Vec<f64> = y
        .greville()
        .flat_map(|y| xs.iter().flat_map(move |x| [0.0, 0.0, twist * x * y]))
        .collect();
    let density = SHEET.bending_n_mm() * (1.0 - SHEET.poisson) * twist * twist;
    let exact = 24.0 * density * mean(3);
    assert!((shell.energy(&twisted) / exact - 1.0).abs() < 1e-4);
}

/// A state is a valid start for a similar film, and threads can share one film.
#[test]
fn films_of_as_many_cells_share_their_states() {
    fn shared<T: Send + Sync>(_: &T) {}
    let (film, rest) = film(mounted());
    shared(&film);
    let contact = Contact::Force([0.0, 0.02, -0.15]);
    let state = film.press(contact, &rest).unwrap();
    let other = Design {
        overhang_mm: 6.5,
        post_radius_mm: 1.7,
        stretch: [0.012, 0.006],
        ..mounted()
    };
    let there = film.changed(&other).unwrap();
    let near = there.press(contact, &state).unwrap();
    let far = there.press(contact, &there.rest()).unwrap();
    for c in 0..3 {
        assert!((near.tip_mm[c] - far.tip_mm[c]).abs() < 1e-8);
    }
    let again = there.press_at([0.0; 2], 0.5, contact, &near).unwrap();
    assert_eq!(again.steps, 0);
    let finer = Film::new(&Design {
        fineness: 0.5,
        ..mounted()
    });
    let refused = finer.unwrap().press(contact, &state).unwrap_err();
    assert!(refused.to_string().contains("as many cells"), "{refused}");
    let aside = film.press_at([1.0, -2.0], 0.7, contact, &state).unwrap();
    let mut moved = Film::new(&mounted()).unwrap();
    moved.move_tip([1.0, -2.0], 0.7).unwrap();
    let same = moved.press(contact, &moved.rest()).unwrap();
    for c in 0..3 {
        assert!((same.tip_mm[c] - aside.tip_mm[c]).abs() < 1e-8);
    }
}
