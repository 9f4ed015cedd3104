//! Tests of second looks. Disturbed frames keep their force within its stated uncertainty, too much
//! cover over a marker stays refused, and good frames get one look.

use hivtac_terms::status::Status;
use hivtac_tests::judged::{Contacts, Judged};
use hivtac_tests::models;
use hivtac_tests::pictures::Random;
use hivtac_tests::tared::TaredSensor;
use hivtac_twin::{Layout, MARKERS, Options, Paint, Patch, Preset, Salt, Scene, Shutter, Specks};

const PRESSES: Contacts = Contacts {
    force_n: [0.01, 0.15],
    ratio: 0.14,
    place_mm: 4.0,
};
const FRAMES: u64 = 60;

/// Returns the number of frames with a force from all four markers, and of those by the second
/// look. Asserts that no force is wrong.
fn kept(options: Options) -> (u32, u32) {
    let mut sensor = TaredSensor::of_model(models::anywhere(1)).unwrap();
    let mut in_bands = TaredSensor::of_model(models::anywhere(1)).unwrap();
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 7).unwrap();
    let scene = scene.with_options(options).unwrap();
    let mut random = Random::new(29);
    let (mut forces, mut second) = (0, 0);
    for number in 0..FRAMES {
        let load = PRESSES.draw(&mut random).unwrap();
        let frame = scene.render_load(&load, number).unwrap();
        let seen = sensor.sense(&frame);
        assert_eq!(seen, in_bands.sense_in_bands(&frame, 8), "{load:?}");
        if let Judged::Wrong(how) = Judged::of(&seen, &frame.truth) {
            panic!("{how}");
        }
        let is_whole = !seen.status.contains(Status::MARKER_LOST);
        let looked = seen.status.contains(Status::FRAME_DISTURBED);
        forces += u32::from(is_whole && seen.force.is_some());
        second += u32::from(looked && seen.force.is_some());
    }
    println!("{forces} of {FRAMES}, {second} second");
    (forces, second)
}

fn salt(fraction: f64) -> Options {
    let paint = Paint::Red;
    Options {
        salt: Salt { fraction, paint },
        ..Options::default()
    }
}

fn patched(far_mm: f64, radius_mm: f64, paint: Paint) -> Options {
    let [x, y] = MARKERS[2].centre_mm;
    Options {
        patches: vec![Patch {
            centre_mm: [x + far_mm, y],
            radius_mm,
            paint,
        }],
        ..Options::default()
    }
}

/// A force is measured ahead of a frame's last rows, and anew if something red follows. Both are
/// one frame for later frames.
#[test]
fn a_frame_that_is_measured_ahead_in_vain_counts_once() {
    let below = Patch {
        centre_mm: [0.0, 6.0],
        radius_mm: 0.3,
        paint: Paint::Red,
    };
    let shutter = Shutter {
        exposure_s: 0.004,
        readout_s: 0.0,
    };
    for (model, layout) in [
        (models::anywhere(1), Layout::default()),
        (models::eight_dots(), "8v".parse().unwrap()),
    ] {
        let scene = Scene::preset("demo", Preset::Ov7725, 320, 240, 7).unwrap();
        let options = Options {
            layout,
            noise: 6.0,
            ..Options::default()
        };
        let whole = scene.with_options(options.clone()).unwrap();
        let sensor = || TaredSensor::of_model_on(model.clone(), &whole).unwrap();
        let [mut sensor, mut in_bands] = [sensor(), sensor()];
        let patched = Options {
            patches: vec![below],
            ..options
        };
        let scene = whole.with_options(patched).unwrap();
        for number in 0..3 * FRAMES {
            let frame = scene.frame_by(&shutter, number, 0.6 + number as f64 / 156.0);
            let seen = sensor.sense_next(&frame);
            let other = in_bands.sense_next_in_bands(&frame, 8);
            assert_eq!(seen, other, "{number} of {layout:?}");
        }
    }
}

#[test]
fn good_frames_are_looked_at_once() {
    assert_eq!(kept(Options::default()), (FRAMES as u32, 0));
}

#[test]
fn salt_and_specks_are_taken_out() {
    let specks = Specks {
        count: 2000,
        radius_mm: 0.05,
    };
    let specks = Options {
        specks,
        ..Options::default()
    };
    for options in [salt(0.01), specks] {
        let (forces, second) = kept(options);
        assert!(forces >= 57 && second == forces, "{forces}");
    }
}

#[test]
fn markers_in_dim_light_are_found() {
    for gain in [0.28, 0.2] {
        let (forces, second) = kept(Options {
            gain,
            ..Options::default()
        });
        assert!(forces >= 57 && second == forces, "{gain}: {forces}");
    }
}

#[test]
fn what_hides_much_of_an_edge_or_grows_on_it_stays_refused() {
    for options in [
        patched(0.4, 0.25, Paint::Glare),
        patched(0.5, 0.5, Paint::Red),
        patched(0.5, 0.25, Paint::Red),
    ] {
        assert_eq!(kept(options), (0, 0));
    }
}
