//! Tests of the effect of each option on a picture.

use hivtac_twin::{
    Contact, Creep, Discs, Frame, Lens, Load, Mechanics, Motion, Mounting, Options, Paint, Patch,
    Preset, Press, Projection, Room, Salt, Scene, Shutter, Specks,
};

fn scene(options: Options) -> Scene {
    let scene = Scene::preset("demo", Preset::Ov7725, 320, 240, 1).unwrap();
    scene.with_options(options).unwrap()
}

fn press() -> Load {
    Load::from_angles(0.1, 4.0, -3.0).unwrap()
}

fn rendered(options: Options) -> Frame {
    scene(options).render_load(&press(), 3).unwrap()
}

/// Returns options without noise and falloff.
fn clear() -> Options {
    Options {
        noise: 0.0,
        falloff: 0.0,
        ..Options::default()
    }
}

fn colour(frame: &Frame, x: usize, y: usize) -> [i32; 3] {
    let rgb = frame.to_rgb888();
    std::array::from_fn(|c| i32::from(rgb[3 * (y * frame.width as usize + x) + c]))
}

fn near(found: [i32; 3], expected: [i32; 3]) {
    let apart = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    assert!(apart.max() <= Some(5), "{found:?}, not {expected:?}");
}

/// Returns the redness per pixel, relative to the film.
fn redness(frame: &Frame) -> Vec<f64> {
    let rgb = frame.to_rgb888();
    let red = |p: &[u8]| f64::from(p[0]) - (f64::from(p[1]) + f64::from(p[2])) / 2.0 - 15.5;
    rgb.chunks_exact(3).map(red).collect()
}

/// Returns sum, centroid and variance along x of the redness around a marker.
fn spot(frame: &Frame, id: usize) -> [f64; 4] {
    let [x, y] = frame.truth.markers[id].unwrap().centroid_px;
    let weights = redness(frame);
    let mut sums = [0.0; 4];
    for (i, weight) in weights.iter().enumerate() {
        let (dx, dy) = ((i % 320) as f64 - x, (i / 320) as f64 - y);
        if dx.abs() < 24.0 && dy.abs() < 24.0 && weight.abs() > 8.0 {
            let parts = [1.0, dx, dy, dx * dx];
            sums = std::array::from_fn(|k| sums[k] + weight * parts[k]);
        }
    }
    let [sum, mx, my, mxx] = sums;
    [sum, mx / sum, my / sum, mxx / sum]
}

#[test]
fn haze_adds_light_and_balance_scales_channels() {
    let frame = rendered(Options {
        haze: 60.0,
        ..clear()
    });
    near(colour(&frame, 160, 120), [210, 201, 188]);
    let frame = rendered(Options {
        white_balance: [1.4, 0.7, 0.5],
        haze: 10.0,
        gain: 0.5,
        ..clear()
    });
    near(colour(&frame, 160, 120), [112, 53, 34]);
}

/// Returns options of a film that lets this part of the light through.
fn through(transmission: f64, room: Room) -> Options {
    Options {
        room: Room {
            transmission,
            ..room
        },
        ..clear()
    }
}

#[test]
fn a_film_that_lets_light_through_shows_the_room() {
    let bright = Room {
        brightness: 1.5,
        things: vec![Patch {
            centre_mm: [-2.0, 0.0],
            radius_mm: 1.0,
            paint: Paint::Blue,
        }],
        ..Room::default()
    };
    let near_to = |transmission, expected: [[i32; 3]; 2]| {
        let frame = rendered(through(transmission, bright.clone()));
        near(colour(&frame, 160, 120), expected[0]);
        // It stays where it was, although the film is pressed.
        near(colour(&frame, 125, 120), expected[1]);
    };
    near_to(0.0, [[150, 141, 128]; 2]);
    near_to(0.5, [[187, 176, 160], [97, 127, 154]]);
    near_to(1.0, [[225, 211, 192], [45, 112, 180]]);
}

#[test]
fn a_fingertip_is_seen_through_the_film_while_it_presses() {
    let room = Room {
        finger_mm: 3.0,
        brightness: 1.0,
        ..Room::default()
    };
    let seen = scene(through(0.5, room));
    let pressed = seen.render_load(&press(), 1).unwrap();
    near(colour(&pressed, 160, 120), [123, 102, 89]);
    let free = seen.render_load(&Load::REST, 1).unwrap();
    near(colour(&free, 160, 120), [150, 141, 128]);
}

#[test]
fn a_glossy_film_mirrors_the_boards_leds_next_to_the_markers() {
    let frame = rendered(Options {
        board_leds_mm: Some(12.0),
        ..clear()
    });
    let white = |pixel: &&u16| **pixel == 0xffff;
    let count = frame.pixels.iter().filter(white).count();
    assert!((120..600).contains(&count), "{count}");
}

#[test]
fn pixels_of_one_colour_keep_colours_and_blur_edges() {
    let bayer = Options {
        bayer: true,
        ..clear()
    };
    let (plain, interpolated) = (rendered(clear()), rendered(bayer));
    near(colour(&interpolated, 160, 120), [150, 141, 128]);
    let [plain, interpolated] = [plain, interpolated].map(|frame| spot(&frame, 0));
    assert!((plain[0] / interpolated[0] - 1.0).abs() < 0.02);
    assert!((plain[1] - interpolated[1]).abs() < 0.1);
    assert!(interpolated[3] > plain[3]);
}

#[test]
fn glare_is_white_however_dark() {
    let glare = Patch {
        centre_mm: [0.0; 2],
        radius_mm: 0.4,
        paint: Paint::Glare,
    };
    let frame = rendered(Options {
        gain: 0.3,
        patches: vec![glare],
        ..clear()
    });
    let bright = frame.pixels.iter().filter(|&&pixel| pixel == 0xffff);
    // 0.4 mm in the middle, where the press has brought the film nearer: a radius of about 10 px.
    assert!((150..700).contains(&bright.count()));
}

#[test]
fn salt_is_as_much_as_asked_for_and_elsewhere_in_each_frame() {
    let salted = scene(Options {
        salt: Salt {
            fraction: 0.05,
            paint: Paint::Red,
        },
        missing: [true; 4].into(),
        ..clear()
    });
    let red = |number| -> Vec<bool> {
        let frame = salted.render_load(&press(), number).unwrap();
        redness(&frame).iter().map(|r| *r > 50.0).collect()
    };
    let (first, second) = (red(1), red(2));
    let share = |set: &[bool]| set.iter().filter(|r| **r).count() as f64 / 76_800.0;
    assert!((share(&first) - 0.05).abs() < 0.003, "{}", share(&first));
    let both: Vec<bool> = first.iter().zip(&second).map(|(a, b)| *a && *b).collect();
    assert!((share(&both) - 0.0025).abs() < 0.0008, "{}", share(&both));
}

#[test]
fn specks_lie_on_the_film() {
    let frame = rendered(Options {
        specks: Specks {
            count: 200,
            radius_mm: 0.1,
        },
        missing: [true; 4].into(),
        ..clear()
    });
    let red = redness(&frame).iter().filter(|r| **r > 30.0).count();
    // 200 of about 7 px² each; a few are outside the picture or on one another.
    assert!((500..2500).contains(&red), "{red}");
}

#[test]
fn a_checkerboard_fills_the_picture() {
    let frame = rendered(Options {
        checkerboard_px: 4,
        missing: [true; 4].into(),
        ..clear()
    });
    near(colour(&frame, 1, 2), [150, 141, 128]);
    near(colour(&frame, 5, 2), [160, 36, 40]);
    near(colour(&frame, 5, 6), [150, 141, 128]);
}

#[test]
fn texture_stays_where_it_is() {
    let uneven = scene(Options {
        texture: 0.1,
        missing: [true; 4].into(),
        ..clear()
    });
    let frames = [1, 2].map(|number| uneven.render_load(&press(), number).unwrap());
    assert_eq!(frames[0].pixels, frames[1].pixels);
    let green = |pixel: &u16| f64::from(pixel >> 5 & 63) / 35.0 - 1.0;
    let corner = || {
        frames[0]
            .rows()
            .take(15)
            .flat_map(|row| &row[..320])
            .map(green)
    };
    let variance = corner().map(|part| part * part).sum::<f64>() / (15.0 * 320.0);
    assert!((variance.sqrt() - 0.1).abs() < 0.02, "{}", variance.sqrt());
}

#[test]
fn blur_widens_markers_and_leaves_them_in_place() {
    let sharp = rendered(clear());
    for (lens, sigma) in [
        (
            Lens {
                blur_px: 2.0,
                ..Lens::default()
            },
            2.0..2.01,
        ),
        // Out of focus by 175 px · 1 mm · (1/4 − 1/Z)/mm / 4, with Z between 5 and 8 mm.
        (
            Lens {
                aperture_mm: 1.0,
                focus_mm: 4.0,
                ..Lens::default()
            },
            2.1..5.5,
        ),
    ] {
        let soft = rendered(Options { lens, ..clear() });
        assert_eq!(soft.truth, sharp.truth);
        for id in 0..4 {
            let (a, b) = (spot(&sharp, id), spot(&soft, id));
            assert!((a[0] / b[0] - 1.0).abs() < 0.1, "{a:?} {b:?}");
            assert!((a[1] - b[1]).abs() < 0.1 && (a[2] - b[2]).abs() < 0.1);
            let added = (b[3] - a[3]).sqrt();
            // The steps of RGB565 lose the outermost levels.
            assert!((0.75 * sigma.start..sigma.end).contains(&added), "{added}");
        }
    }
}

#[test]
fn a_rolling_shutter_sees_lower_markers_later() {
    let readout_s = 0.024;
    let rolling = scene(Options {
        shutter: Shutter {
            exposure_s: 0.0,
            readout_s,
        },
        ..clear()
    });
    let global = scene(clear());
    let time_s = 0.3;
    let truth = rolling.truth(time_s);
    assert_eq!(truth.force, global.truth(time_s).force);
    for id in 0..4 {
        let [x, y] = truth.markers[id].unwrap().centroid_px;
        let after_s = (y - 119.5) / 240.0 * readout_s;
        let then = global.truth(time_s + after_s).markers[id].unwrap();
        let [then_x, then_y] = then.centroid_px;
        assert!((x - then_x).abs() < 0.02 && (y - then_y).abs() < 0.02);
        let [now_x, now_y] = global.truth(time_s).markers[id].unwrap().centroid_px;
        assert!((x - now_x).abs() + (y - now_y).abs() > 0.05, "it has moved");
    }
}

#[test]
fn an_exposure_smears_what_moves() {
    let options = |exposure_s| Options {
        shutter: Shutter {
            exposure_s,
            readout_s: 0.0,
        },
        ..clear()
    };
    let frame = |exposure_s| scene(options(exposure_s)).frame(1, 0.3);
    let (sharp, smeared) = (frame(0.0), frame(0.05));
    let area = |frame: &Frame| frame.truth.markers[1].unwrap().area_px2;
    assert!((area(&sharp) / area(&smeared) - 1.0).abs() < 0.05);
    assert!(spot(&smeared, 1)[3] > spot(&sharp, 1)[3] + 0.1);
    // Under a constant load the film does not move.
    let still = |exposure_s| scene(options(exposure_s)).render_load(&press(), 1).unwrap();
    assert_eq!(still(0.05).pixels, still(0.0).pixels);
}

#[test]
fn pitch_and_projection_scale_the_picture() {
    let at = |lens: Lens| {
        let scene = scene(Options { lens, ..clear() });
        let frame = scene.render_load(&Load::REST, 0).unwrap();
        frame.truth.markers[2].unwrap().centroid_px[0] - 159.5
    };
    let usual = at(Lens::default());
    let coarse = at(Lens {
        pitch_um: Some(24.0),
        ..Lens::default()
    });
    assert!((coarse - usual / 2.0).abs() < 1e-9);
    let pinhole = at(Lens {
        projection: Projection::Pinhole,
        ..Lens::default()
    });
    // 175 px · 0.3717. The far half of the disc weighs as much as its near one.
    assert!((pinhole - 65.05).abs() < 0.05, "{pinhole}");
    let by_centre = at(Lens {
        discs: Discs::ByCentre,
        ..Lens::default()
    });
    assert!(
        (by_centre - usual - 0.08).abs() < 0.03,
        "{by_centre} {usual}"
    );
}

#[test]
fn a_marker_can_leave_the_frame() {
    let visible = |dy| {
        let mounting = Mounting {
            shift_px: [0.0, dy],
            roll_deg: 0.0,
        };
        let frame = rendered(Options {
            mounting,
            ..clear()
        });
        frame.truth.markers[2].map(|marker| marker.visible)
    };
    assert_eq!(visible(0.0), Some(1.0));
    let parts: Vec<Option<f64>> = (30..70).map(|dy| visible(f64::from(dy))).collect();
    assert!(parts.iter().flatten().any(|part| (0.3..0.7).contains(part)));
    assert_eq!(parts.last(), Some(&None));
}

#[test]
fn patches_far_larger_than_the_frame_cost_no_more_than_it() {
    let frame = scene(Options {
        lens: Lens {
            projection: Projection::Pinhole,
            pitch_um: Some(1.0),
            blur_px: 20.0,
            ..Lens::default()
        },
        patches: vec![Patch {
            centre_mm: [0.0; 2],
            radius_mm: 10.0,
            paint: Paint::Red,
        }],
        ..clear()
    });
    let frame = frame.render_load(&press(), 0).unwrap();
    assert!(redness(&frame).iter().all(|red| *red > 50.0));
}

#[test]
fn the_truth_tells_which_point_of_the_film_the_tip_is_on() {
    let scene = scene(clear());
    let touches = |load: Load| scene.truth_under(&load).unwrap().touches_mm;
    assert_eq!(touches(Load::REST), None);
    let beside = press().with_offset_mm([0.2, -0.1]).unwrap();
    assert_eq!(touches(beside), Some([0.2, -0.1]));
    let tilted = Load::from_angles(0.1, 10.0, 0.0).unwrap();
    let slips = tilted.with_contact(Contact::Slip { mu: 0.05 }).unwrap();
    let [x, y] = touches(slips).unwrap();
    assert!(x > 0.05 && y.abs() < 1e-9, "it slid to ({x}, {y})");
}

/// Returns the distance of the first marker's images in two scenes, px.
fn apart(one: &Scene, other: &Scene, time_s: f64) -> f64 {
    let [a, b] = [one, other].map(|scene| scene.truth(time_s).markers[0].unwrap().centroid_px);
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

#[test]
fn creep_moves_markers_and_not_the_truth() {
    let film = |creep| Mechanics {
        creep,
        offset_mm: [1.0, -1.0],
        ..Mechanics::default()
    };
    let with = |creep, shutter| {
        let options = Options {
            film: film(creep),
            shutter,
            ..clear()
        };
        let press = Motion::Press(Press {
            force_n: 0.1,
            hold_s: 10.0,
            ..Press::default()
        });
        scene(options).with_motion(press).unwrap()
    };
    let still = Shutter::default();
    let [elastic, creeping] = [Creep::default(), Creep::of(0.1)].map(|creep| with(creep, still));
    assert_eq!(elastic.truth(0.05), creeping.truth(0.05), "nothing pressed");
    let [soon, late] = [0.5, 10.0].map(|time_s| apart(&elastic, &creeping, time_s));
    assert!(0.1 < soon && soon < late, "{soon} px, {late} px");
    let (truth, known) = (creeping.truth(5.0), elastic.truth(5.0));
    assert_eq!(
        (truth.force, truth.on_film_n),
        (known.force, known.on_film_n)
    );
    assert_eq!(truth.touches_mm, Some([1.0, -1.0]));
    assert!(truth.tip_mm[2] < known.tip_mm[2]);
    // After the release the rest of the motion dies away.
    let [left, less] = [11.0, 60.0].map(|time_s| apart(&elastic, &creeping, time_s));
    assert!(less > 0.02 && left > 2.0 * less, "{left} px, {less} px");
    assert_eq!(creeping.truth(11.0).force.magnitude_n(), 0.0);
    assert_eq!(creeping.truth(11.0).touches_mm, None);
    // A shutter does not change the film.
    let rolling = Shutter {
        exposure_s: 0.0,
        readout_s: 0.02,
    };
    let rolled = with(Creep::of(0.1), rolling);
    assert!(apart(&rolled, &creeping, 8.0) < 0.001);
}
