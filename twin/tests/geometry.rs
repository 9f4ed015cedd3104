//! Tests of the markers' places in the picture, and of their change with the load.

use proptest::prelude::*;

use hivtac_twin::{
    Camera, Dots, FILM_DISTANCE_MM, FOCAL_LENGTH_MM, Load, MARKER_REST_MM, Mounting, Options,
    Preset, Scene, SceneError,
};

const PRESETS: [Preset; 2] = [Preset::Paper, Preset::Ov7725];
const SIZES: [(u32, u32); 2] = [(320, 240), (800, 600)];

fn scene(preset: Preset, (width, height): (u32, u32)) -> Scene {
    Scene::preset("rest", preset, width, height, 1).unwrap()
}

fn press(force_n: f64, alpha_deg: f64, beta_deg: f64) -> Load {
    Load::from_angles(force_n, alpha_deg, beta_deg).unwrap()
}

/// Returns the true centroids relative to the picture's middle, px.
fn centroids(scene: &Scene, load: Load) -> [[f64; 2]; 4] {
    let camera = *scene.camera();
    let truth = scene.clone().with_load(load).unwrap().truth(0.0);
    truth.markers.array::<4>().map(|marker| {
        let [x, y] = marker.expect("in the frame").centroid_px;
        [
            x - f64::from(camera.width() - 1) / 2.0,
            y - f64::from(camera.height() - 1) / 2.0,
        ]
    })
}

fn radius([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

fn everywhere(mut check: impl FnMut(&Scene)) {
    for preset in PRESETS {
        for size in SIZES {
            check(&scene(preset, size));
        }
    }
}

#[test]
fn at_rest_markers_are_where_the_lens_puts_them() {
    everywhere(|scene| {
        let rho = MARKER_REST_MM * 2.0_f64.sqrt();
        let of_centre = scene.camera().focal_px() * libm::atan(rho / FILM_DISTANCE_MM);
        for marker in centroids(scene, Load::REST) {
            // A disc's centroid is a little nearer to the middle than the image of its centre; in
            // pixels the difference grows with the frame.
            let nearer = (of_centre - radius(marker)) / scene.camera().focal_px();
            assert!((0.0007..0.0010).contains(&nearer), "{nearer} focal lengths");
        }
    });
}

#[test]
fn presets_are_those_of_the_documentation() {
    let rest_radius = |preset| radius(centroids(&scene(preset, (320, 240)), Load::REST)[0]);
    assert!((rest_radius(Preset::Ov7725) - 84.55).abs() < 0.01);
    assert!((rest_radius(Preset::Paper) - 73.82).abs() < 0.01);
    let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
    assert!((camera.focal_px() - FOCAL_LENGTH_MM / 0.012).abs() < 1e-9);
}

#[test]
fn identities_go_round_from_the_upper_left() {
    everywhere(|scene| {
        let signs = centroids(scene, Load::REST).map(|marker| marker.map(f64::signum));
        assert_eq!(signs, [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]);
    });
}

#[test]
fn a_straight_press_moves_all_markers_outwards_alike() {
    everywhere(|scene| {
        let mut before = [0.0; 4];
        for step in 0..=50 {
            let seen = centroids(scene, press(f64::from(step) * 0.005, 0.0, 0.0));
            let radii = seen.map(radius);
            for (id, (now, then)) in radii.iter().zip(before).enumerate() {
                assert!(*now > then, "marker {id} at step {step}");
                assert!((now - radii[0]).abs() < 1e-9, "marker {id} at step {step}");
            }
            before = radii;
        }
    });
}

#[test]
fn a_tilted_force_shifts_markers_its_way() {
    everywhere(|scene| {
        let straight = centroids(scene, press(0.1, 0.0, 0.0));
        let right = centroids(scene, press(0.1, 6.0, 0.0));
        let down = centroids(scene, press(0.1, 0.0, 6.0));
        let mean =
            |seen: [[f64; 2]; 4], axis: usize| seen.iter().map(|m| m[axis]).sum::<f64>() / 4.0;
        for id in 0..4 {
            assert!(right[id][0] > straight[id][0], "x of marker {id}");
            assert!(down[id][1] > straight[id][1], "y of marker {id}");
        }
        assert!(mean(right, 1).abs() < 1e-9 && mean(down, 0).abs() < 1e-9);
    });
}

#[test]
fn mirrored_loads_give_mirrored_pictures() {
    everywhere(|scene| {
        let seen = centroids(scene, press(0.15, 7.0, -4.0));
        let mirrored = centroids(scene, press(0.15, -7.0, -4.0));
        for (id, partner) in [(0, 1), (1, 0), (2, 3), (3, 2)] {
            let [x, y] = seen[id];
            let [mx, my] = mirrored[partner];
            assert!(
                (x + mx).abs() < 1e-9 && (y - my).abs() < 1e-9,
                "marker {id}"
            );
        }
    });
}

#[test]
fn mounting_shifts_and_turns_the_picture() {
    let straight = scene(Preset::Ov7725, (320, 240));
    let mounting = Mounting {
        shift_px: [5.0, -3.0],
        roll_deg: 30.0,
    };
    let options = Options {
        mounting,
        ..Options::default()
    };
    let turned = straight.clone().with_options(options).unwrap();
    let (sin, cos) = libm::sincos(std::f64::consts::PI / 6.0);
    let before = centroids(&straight, press(0.1, 3.0, 2.0));
    let after = centroids(&turned, press(0.1, 3.0, 2.0));
    for ([x, y], [tx, ty]) in before.into_iter().zip(after) {
        assert!((tx - 5.0 - (x * cos - y * sin)).abs() < 1e-9);
        assert!((ty + 3.0 - (x * sin + y * cos)).abs() < 1e-9);
    }
}

#[test]
fn truth_says_what_is_missing_cut_or_gone() {
    let scene = scene(Preset::Ov7725, (320, 240));
    let under = |options: Options, load: Load| {
        let scene = scene.clone().with_options(options).unwrap();
        scene.with_load(load).unwrap().truth(0.0).markers
    };
    let missing = Options {
        missing: [false, true, false, false].into(),
        ..Options::default()
    };
    assert_eq!(
        under(missing, Load::REST).map(|m| m.is_some()),
        [true, false, true, true]
    );

    let shifted = |shift_px| Options {
        mounting: Mounting {
            shift_px,
            roll_deg: 0.0,
        },
        ..Options::default()
    };
    // At 0.2 N markers are 91 px from the middle. The upper and the lower border each cut two of
    // them.
    let cut = |down| under(shifted([0.0, down]), press(0.2, 0.0, 0.0)).map(|m| m.unwrap().visible);
    let is_cut = |parts: Dots<f64>| parts.map(|part| (0.1..0.9).contains(&part));
    assert_eq!(is_cut(cut(-24.0)), [true, true, false, false]);
    assert_eq!(is_cut(cut(24.0)), [false, false, true, true]);
    let whole = under(Options::default(), press(0.2, 0.0, 0.0)).map(|m| m.unwrap().visible);
    assert!(
        whole.iter().all(|part| (part - 1.0).abs() < 1e-9),
        "{whole:?}"
    );

    assert_eq!(
        under(shifted([120.0, 0.0]), Load::REST).map(|m| m.is_some()),
        [true, false, false, true]
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn truth_is_sound_for_any_load_and_mounting(
        force_n in 0.0..0.3, alpha in -35.0..35.0, beta in -35.0..35.0,
        dx in -200.0..200.0, dy in -200.0..200.0, roll_deg in -45.0..45.0,
    ) {
        let mounting = Mounting { shift_px: [dx, dy], roll_deg };
        let options = Options { mounting, ..Options::default() };
        let scene = scene(Preset::Ov7725, (160, 120)).with_options(options).unwrap();
        let Ok(frame) = scene.render_load(&press(force_n, alpha, beta), 0) else {
            let [x, y, z] = press(force_n, alpha, beta).vector_n();
            prop_assert!(force_n > 0.25 || libm::hypot(x, y) > -0.8 * z, "{force_n} N is refused");
            return Ok(());
        };
        for marker in frame.truth.markers.into_iter().flatten() {
            prop_assert!(marker.visible > 0.0 && marker.visible <= 1.0);
            prop_assert!(
                marker.area_px2 > 0.0 && marker.area_px2 < 200.0,
                "{} px²",
                marker.area_px2
            );
            let [x, y] = marker.centroid_px;
            prop_assert!((-40.0..200.0).contains(&x) && (-40.0..160.0).contains(&y), "{x}, {y}");
        }
    }
}

#[test]
fn what_the_film_cannot_take_is_refused() {
    let scene = scene(Preset::Ov7725, (320, 240));
    let too_much = press(1.0, 0.0, 0.0);
    assert!(matches!(
        scene.render_load(&too_much, 0),
        Err(SceneError::Film(_))
    ));
    assert!(matches!(
        scene.with_load(too_much),
        Err(SceneError::Film(_))
    ));
}

#[test]
fn what_there_is_not_is_named() {
    let size = Scene::preset("demo", Preset::Paper, 1024, 768, 1).unwrap_err();
    assert!(size.to_string().contains("1024×768"));
    let name = Scene::preset("dance", Preset::Paper, 320, 240, 1).unwrap_err();
    assert!(name.to_string().contains("dance") && name.to_string().contains("demo"));
}
