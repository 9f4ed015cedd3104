//! Tests of the pictures: discs are at the true places, and the default threshold separates their
//! colour from the film's.

use hivtac_twin::film::Film;
use hivtac_twin::{Format, Frame, Load, Options, Paint, Patch, Preset, Scene};

const PRESETS: [Preset; 2] = [Preset::Paper, Preset::Ov7725];
const SIZES: [(u32, u32); 2] = [(320, 240), (800, 600)];

fn rendered(preset: Preset, (w, h): (u32, u32), options: &Options, load: &Load) -> Frame {
    let scene = Scene::preset("rest", preset, w, h, 1).unwrap();
    let scene = scene.with_options(options.clone()).unwrap();
    scene.render_load(load, 5).unwrap()
}

/// Returns the 8-bit channels of an RGB565 pixel; the upper bits are repeated in the low ones.
fn channels(pixel: u16) -> [i32; 3] {
    let [r, g, b] = [pixel >> 11, (pixel >> 5) & 63, pixel & 31].map(i32::from);
    [
        (r << 3) | (r >> 2),
        (g << 2) | (g >> 4),
        (b << 3) | (b >> 2),
    ]
}

fn redness(pixel: u16) -> f64 {
    let [r, g, b] = channels(pixel);
    f64::from(r) - f64::from(g + b) / 2.0
}

/// The default threshold: H ≤ 10 or ≥ 170 (of 180), S ≥ 100, V ≥ 45.
fn is_red(pixel: u16) -> bool {
    let [r, g, b] = channels(pixel);
    let (value, least) = (r.max(g).max(b), r.min(g).min(b));
    if value < 45 || r < value || 255 * (value - least) < 100 * value {
        return false;
    }
    // Hue 30 · (g − b) / (value − least), within ±10 if red is the largest.
    30 * (g - b).abs() <= 10 * (value - least)
}

/// Returns loads over the calibrated range and its corners.
fn loads() -> Vec<Load> {
    let angles = [(0.0, 0.0), (10.0, 8.0), (-10.0, 8.0), (3.3, -7.1)];
    let forces = [0.0, 0.013, 0.05, 0.117, 0.2];
    let pairs = forces
        .iter()
        .flat_map(|f| angles.iter().map(move |(a, b)| (*f, *a, *b)));
    pairs
        .map(|(f, a, b)| Load::from_angles(f, a, b).unwrap())
        .collect()
}

/// Options without noise, which the truth does not include. There is no falloff either: it shifts
/// the centroid's weight, and the border between two codes of RGB565 across a disc.
fn clear() -> Options {
    Options {
        noise: 0.0,
        falloff: 0.0,
        ..Options::default()
    }
}

/// Returns the largest distance of a rendered marker's redness-weighted centroid from the truth,
/// px. The difference from the frame without markers separates each marker from the film.
fn worst_centroid_error(preset: Preset, size: (u32, u32), options: &Options) -> f64 {
    let bare = Options {
        missing: [true; 4].into(),
        ..options.clone()
    };
    let mut worst = 0.0_f64;
    for load in loads() {
        let film = rendered(preset, size, &bare, &load);
        let frame = rendered(preset, size, options, &load);
        for id in 0..4 {
            let [x, y] = quadrant_centroid(&frame, &film, id);
            let [tx, ty] = frame.truth.markers[id].unwrap().centroid_px;
            worst = worst.max((x - tx).abs()).max((y - ty).abs());
        }
    }
    worst
}

fn quadrant_centroid(frame: &Frame, film: &Frame, id: usize) -> [f64; 2] {
    let (w, h) = (frame.width as usize, frame.height as usize);
    let (right, lower) = ([1, 2].contains(&id), id >= 2);
    let mut sums = [0.0; 3];
    for (i, (pixel, bare)) in frame.pixels.iter().zip(&film.pixels).enumerate() {
        let (x, y) = (i % w, i / w);
        if (x >= w / 2) == right && (y >= h / 2) == lower {
            let weight = redness(*pixel) - redness(*bare);
            sums[0] += weight;
            sums[1] += weight * x as f64;
            sums[2] += weight * y as f64;
        }
    }
    [sums[1] / sums[0], sums[2] / sums[0]]
}

#[test]
fn discs_lie_where_the_truth_says() {
    for preset in PRESETS {
        for size in SIZES {
            let error = worst_centroid_error(preset, size, &clear());
            assert!(error <= 0.02, "{preset} {size:?}: {error} px");
        }
    }
}

#[test]
fn the_default_threshold_passes_discs_and_nothing_else() {
    for preset in PRESETS {
        for size in SIZES {
            for load in loads() {
                let frame = rendered(preset, size, &Options::default(), &load);
                let red = frame.pixels.iter().filter(|&&p| is_red(p)).count() as f64;
                let markers = frame.truth.markers.iter().flatten();
                let discs: f64 = markers.map(|marker| marker.area_px2).sum();
                assert!(
                    (red / discs - 1.0).abs() < 0.15,
                    "{preset} {size:?}: {red} of {discs}"
                );
            }
            let bare = Options {
                missing: [true; 4].into(),
                ..Options::default()
            };
            let film = rendered(preset, size, &bare, &Load::REST);
            assert!(!film.pixels.iter().any(|&p| is_red(p)), "{preset} {size:?}");
        }
    }
}

#[test]
fn darkness_is_a_cliff() {
    let red_at = |gain| {
        let options = Options {
            gain,
            ..Options::default()
        };
        let frame = rendered(Preset::Ov7725, (320, 240), &options, &Load::REST);
        frame.pixels.iter().filter(|&&p| is_red(p)).count() as f64
    };
    let nominal = red_at(1.0);
    let kept = [0.4, 0.28, 0.2].map(|gain| red_at(gain) / nominal);
    assert!(kept[0] > 0.9, "{kept:?}");
    assert!((0.1..0.8).contains(&kept[1]), "{kept:?}");
    assert!(kept[2] < 0.02, "{kept:?}");
}

#[test]
fn a_gradient_brightens_one_side() {
    let options = Options {
        gradient: [0.6, 0.0],
        falloff: 0.0,
        noise: 0.0,
        ..Options::default()
    };
    let frame = rendered(Preset::Ov7725, (320, 240), &options, &Load::REST);
    let green = |x: usize| f64::from(channels(frame.pixels[100 * 320 + x])[1]);
    assert!((green(0) - 0.4 * 141.0).abs() < 3.0);
    assert!((green(319) - 1.6 * 141.0).abs() < 3.0);
}

#[test]
fn patches_add_and_take_away_red() {
    let red_with = |patches: Vec<Patch>| {
        let options = Options {
            patches,
            ..Options::default()
        };
        let frame = rendered(Preset::Ov7725, (320, 240), &options, &Load::REST);
        frame.pixels.iter().filter(|&&p| is_red(p)).count() as f64
    };
    let patch = |x: f64, y: f64, paint| Patch {
        centre_mm: [x, y],
        radius_mm: 0.5,
        paint,
    };
    let plain = red_with(vec![]);
    // In the middle the lens magnifies more: 17.5 px/mm.
    let disc = std::f64::consts::PI * 8.75 * 8.75;
    let fifth = red_with(vec![patch(0.0, 0.0, Paint::Red)]) - plain;
    assert!((fifth / disc - 1.0).abs() < 0.1, "{fifth} of {disc}");
    let covered = plain - red_with(vec![patch(3.717, 3.717, Paint::Film)]);
    assert!(
        (covered / plain - 0.25).abs() < 0.02,
        "{covered} of {plain}"
    );
}

#[test]
fn extremes_render() {
    for (gain, noise) in [(0.0, 0.0), (4.0, 64.0), (0.0, 64.0)] {
        let options = Options {
            gain,
            noise,
            gradient: [-1.0, 1.0],
            falloff: 1.0,
            ..Options::default()
        };
        let frame = rendered(Preset::Paper, (160, 120), &options, &Load::REST);
        assert_eq!(frame.pixels.len(), 160 * 120);
        let black = frame.pixels.iter().all(|&p| p == 0);
        assert_eq!(black, gain == 0.0 && noise == 0.0);
    }
    let hidden = Options {
        patches: vec![Patch {
            centre_mm: [0.0, 0.0],
            radius_mm: 10.0,
            paint: Paint::Red,
        }],
        ..Options::default()
    };
    let deepest = Load::from_angles(0.25, 0.0, 0.0).unwrap();
    let frame = rendered(Preset::Ov7725, (160, 120), &hidden, &deepest);
    let middle = &frame.pixels[60 * 160..][..160];
    assert!(middle.iter().all(|&p| is_red(p)), "red from side to side");
}

/// Returns the area that passes each format's counterpart of the default threshold, as a share of
/// the true discs.
fn markers_found(format: Format, passes: impl Fn(&Frame, usize) -> bool) -> f64 {
    let options = Options {
        format,
        ..Options::default()
    };
    let frame = rendered(Preset::Ov7725, (320, 240), &options, &Load::REST);
    let markers = frame.truth.markers.iter().flatten();
    let discs: f64 = markers.map(|marker| marker.area_px2).sum();
    let found = (0..320 * 240).filter(|&pixel| passes(&frame, pixel));
    found.count() as f64 / discs
}

#[test]
fn every_format_tells_the_markers_from_the_film() {
    let yuv = markers_found(Format::Yuv422, |frame, pixel| {
        // Cr of the pair, in the top byte of its second word.
        frame.pixels[pixel | 1] >> 8 > 160
    });
    assert!((0.8..1.2).contains(&yuv), "yuv422: {yuv}");
    let mono = markers_found(Format::Mono, |frame, pixel| frame.mono[pixel] < 80);
    assert!((0.8..1.2).contains(&mono), "mono: {mono}");
    let jpeg = markers_found(Format::Jpeg { quality: 85 }, |frame, pixel| {
        is_red(frame.pixels[pixel])
    });
    assert!((0.8..1.3).contains(&jpeg), "jpeg: {jpeg}");
}

#[test]
fn every_format_has_its_rows_and_shows_the_same_picture() {
    let options = |format| Options { format, ..clear() };
    let film = |format| {
        let frame = rendered(Preset::Ov7725, (320, 240), &options(format), &Load::REST);
        let middle = 3 * (120 * 320 + 160);
        (
            frame.rows().count(),
            frame.mono_rows().count(),
            frame.to_rgb888()[middle..][..3].to_vec(),
        )
    };
    let near = |a: u8, b: u8| a.abs_diff(b) <= 5;
    for format in [Format::Rgb565, Format::Yuv422, Format::Jpeg { quality: 90 }] {
        let (rows, mono_rows, colour) = film(format);
        assert_eq!((rows, mono_rows), (240, 0), "{format}");
        let same = near(colour[0], 150) && near(colour[1], 141) && near(colour[2], 128);
        assert!(same, "{format}: {colour:?}");
    }
    assert_eq!(film(Format::Mono), (0, 240, vec![141; 3]));
    for format in [Format::Rgb565, Format::Yuv422] {
        let frame = rendered(Preset::Ov7725, (320, 240), &options(format), &Load::REST);
        let pixels = frame.to_rgb565();
        let middle = channels(pixels[120 * 320 + 160]).map(|c| c as u8);
        assert!(near(middle[0], 150) && near(middle[2], 128), "{middle:?}");
    }
}

#[test]
fn a_film_given_by_its_points_is_drawn_as_by_its_discs_and_may_curve_them() {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
    let load = Load::from_angles(0.2, 4.0, -3.0).unwrap();
    let pressed = Film::default().press(&load);
    let by_discs = scene.render_pressed(pressed, &load, 5);
    let by_points = scene.render_film(|rest| pressed.displacement(rest), &load, 5);
    assert_eq!(by_points.pixels, by_discs.pixels);
    let curved = |[x, y]: [f64; 2]| {
        let [dx, dy, dz] = pressed.displacement([x, y]);
        [dx, dy, dz - 0.3 * (x * x + y * y - 27.0)]
    };
    let curved = scene.render_film(curved, &load, 5);
    let area = |frame: &Frame| frame.truth.markers[0].unwrap().area_px2;
    assert!((area(&curved) - area(&by_discs)).abs() > 1.0);
}
