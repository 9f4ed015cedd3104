//! Scenes of films with other dots than the nominal four.

use hivtac_twin::film::reduced::Unit;
use hivtac_twin::{Layout, Load, Mechanics, Options, Preset, Scene};

fn scene(options: Options) -> Scene {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
    scene.with_options(options).unwrap()
}

fn eight() -> Options {
    Options {
        layout: "8v".parse().unwrap(),
        noise: 0.0,
        ..Options::default()
    }
}

fn press(force_n: f64, alpha_deg: f64, place_mm: [f64; 2]) -> Load {
    let load = Load::from_angles(force_n, alpha_deg, 0.0).unwrap();
    load.with_offset_mm(place_mm).unwrap()
}

/// Returns the number of red pixels.
fn red(scene: &Scene, load: &Load) -> usize {
    let frame = scene.render_load(load, 0).unwrap();
    let levels = frame.to_rgb888();
    let pixels = levels.as_chunks::<3>().0.iter();
    pixels
        .filter(|[r, g, _]| u16::from(*r) > 2 * u16::from(*g))
        .count()
}

#[test]
fn eight_dots_are_seen_whole_at_rest_and_pressed() {
    let scene = scene(eight());
    for load in [
        Load::REST,
        press(0.05, 3.0, [0.0; 2]),
        press(0.2, -5.0, [5.0, -3.0]),
    ] {
        let truth = scene.truth_under(&load).unwrap();
        assert_eq!(truth.markers.len(), 8);
        let mut area = 0.0;
        for marker in truth.markers {
            let marker = marker.unwrap();
            assert!(marker.visible > 0.999, "{load:?}: {marker:?}");
            area += marker.area_px2;
        }
        let red = red(&scene, &load) as f64;
        assert!((red - area).abs() < 0.1 * area, "{red} {area} px²");
    }
}

#[test]
fn rest_images_are_where_the_lens_has_the_dots() {
    let seen = scene(eight()).truth(0.0).markers;
    // A point at r mm from the axis is at 175 · atan(r / 10) px.
    for (id, x, y) in [(2, 102.2, 65.7), (6, 42.9, 0.0), (7, 0.0, 41.2)] {
        let [a, b] = seen[id].unwrap().centroid_px;
        let [a, b] = [a - 159.5, b - 119.5];
        assert!((a - x).abs() < 0.6 && (b - y).abs() < 0.6, "{id}: {a} {b}");
    }
}

#[test]
fn a_dot_moves_the_same_in_every_layout() {
    let centres = [[-6.0, 2.0], [3.0, 1.0], [7.0, -4.5], [0.0, 2.4], [2.5, 0.0]];
    let five = scene(Options {
        layout: Layout::new(&centres, 1.0).unwrap(),
        ..eight()
    });
    let load = press(0.15, 4.0, [1.0, 3.0]);
    let [a, b] = [&five, &scene(eight())].map(|scene| scene.truth_under(&load).unwrap().markers);
    for (one, other) in [(2, 1), (3, 7), (4, 6)] {
        assert_eq!(a[one], b[other]);
    }
}

#[test]
fn glue_and_stiffness_are_exact() {
    let shift = [0.3, -0.2];
    let [moved, glued] = [
        Options {
            layout: Layout::new(&[[-6.0, 2.0], [3.0, 1.0], [5.0, -3.0], [2.8, -0.2]], 1.0).unwrap(),
            ..eight()
        },
        Options {
            layout: Layout::new(&[[-6.0, 2.0], [3.0, 1.0], [5.0, -3.0], [2.5, 0.0]], 1.0).unwrap(),
            glued_mm: [[0.0; 2], [0.0; 2], [0.0; 2], shift].into(),
            ..eight()
        },
    ];
    let load = press(0.1, 4.0, [1.0, 3.0]);
    let place = |options: &Options, load: &Load| {
        let truth = scene(options.clone()).truth_under(load).unwrap();
        truth.markers[3].unwrap().centroid_px
    };
    let [a, b] = [place(&moved, &load), place(&glued, &load)];
    assert!(libm::hypot(a[0] - b[0], a[1] - b[1]) < 1e-9);
    let stiffer = Options {
        film: Mechanics {
            unit: Unit {
                stiffness: 1.5,
                // The posts of a stiffer film hold it as well if they are stiffer, too.
                grip: 1.5,
                ..Unit::default()
            },
            ..Mechanics::default()
        },
        ..moved.clone()
    };
    let [c, d] = place(&stiffer, &press(0.15, 4.0, [1.0, 3.0]));
    assert!(libm::hypot(a[0] - c, a[1] - d) < 1e-9);
}

/// The four dots by tables of their own: each difference moves them as much in both.
#[test]
fn units_and_tips_differ_as_with_the_nominal_dots() {
    // A fifth dot makes another layout of the same four.
    let mut centres = hivtac_twin::film::MARKER_CENTRES_MM.to_vec();
    centres.push([0.0, 7.0]);
    let layout = Layout::new(&centres, 1.0).unwrap();
    let load = press(0.12, 5.0, [1.3, -2.1]);
    let change = |change: &dyn Fn(&mut Mechanics)| {
        let mut film = Mechanics::default();
        change(&mut film);
        let seen = [layout, Layout::default()].map(|layout| {
            let of = |film: Mechanics| {
                let options = Options {
                    layout,
                    film,
                    ..Options::default()
                };
                scene(options).with_load(load).unwrap().truth(0.0).markers
            };
            let pairs = of(film)
                .array::<4>()
                .into_iter()
                .zip(of(Mechanics::default()).array::<4>());
            pairs.map(|(changed, usual)| {
                let [a, b] = [changed, usual].map(|marker| marker.unwrap().centroid_px);
                [a[0] - b[0], a[1] - b[1]]
            })
        });
        let [whole, own] = seen.map(|moves| moves.collect::<Vec<_>>());
        let size = own
            .iter()
            .flatten()
            .fold(0.0, |most: f64, part| most.max(part.abs()));
        assert!(size > 0.1, "{own:?}");
        for (a, b) in whole.iter().flatten().zip(own.iter().flatten()) {
            assert!((a - b).abs() < 0.02 + 0.02 * size, "{whole:?} {own:?}");
        }
    };
    change(&|film| film.unit.thickness = 1.1);
    change(&|film| film.unit.grip = 1.6);
    change(&|film| film.unit.posts_mm[0] = [0.3, 0.0]);
    change(&|film| film.unit.posts_mm[1] = [0.0, 0.3]);
    change(&|film| film.unit.posts_mm[2] = [0.2, -0.3]);
    change(&|film| film.unit.posts_mm[3] = [-0.2, 0.1]);
    change(&|film| film.tip_radius_mm = 2.0);
}

#[test]
fn what_other_layouts_do_not_have_is_refused_by_name() {
    let refused = |change: &dyn Fn(&mut Options)| {
        let mut options = eight();
        change(&mut options);
        let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
        scene.with_options(options).unwrap_err().to_string()
    };
    assert!(refused(&|o| o.film.down = Some([0.0, 0.0, 1.0])).contains("weight"));
    assert!(refused(&|o| o.film.tip_radius_mm = 2.5).contains("radius"));
    assert!(refused(&|o| o.film.stiffness = hivtac_twin::Stiffness::Linear).contains("linear"));
    let far = scene(eight()).truth_under(&press(0.1, 0.0, [8.1, 0.0]));
    assert!(far.unwrap_err().to_string().contains("offset is 8.1"));
    assert!(
        scene(eight())
            .truth_under(&press(0.1, 0.0, [8.0, -8.0]))
            .is_ok()
    );
}

#[test]
fn files_choose_layouts_by_name_or_by_places() {
    let read = |text: &str| Scene::from_toml(text).map(|scene| scene.options().layout);
    assert_eq!(read("").unwrap(), Layout::default());
    assert_eq!(read("layout = \"8v\"").unwrap(), "8v".parse().unwrap());
    let own = "[layout]\ndots_mm = [[-5, 0], [5, 0], [0, 3], [0.0, -3.0], [0, 0]]\n";
    let expected = [[-5.0, 0.0], [5.0, 0.0], [0.0, 3.0], [0.0, -3.0], [0.0, 0.0]];
    assert_eq!(read(own).unwrap(), Layout::new(&expected, 1.0).unwrap());
    let small = format!("{own}diameter_mm = 0.8\n[marks]\nmissing = [4]");
    assert_eq!(read(&small).unwrap(), Layout::new(&expected, 0.8).unwrap());
    for (text, parts) in [
        ("layout = \"9\"", ["line 1", "8v"]),
        ("[layout]\ndots_mm = [[0, 0]]", ["1 dots", "4 to 16"]),
        ("[layout]\nplaces = []", ["name", "dots_mm"]),
        (
            "layout = \"8v\"\n[marks]\nmissing = [8]",
            ["marks.missing", "0 to 7"],
        ),
        (
            "layout = \"8v\"\n[marks]\nglued_mm = [[0, 0]]",
            ["marks.glued_mm", "8 dots"],
        ),
        (
            "layout = \"8v\"\n[film]\ndown = [0, 0, 1]",
            ["weight", "layout 4"],
        ),
    ] {
        let said = read(text).unwrap_err().to_string();
        assert!(
            parts.iter().all(|part| said.contains(part)),
            "{text}: {said}"
        );
    }
}
