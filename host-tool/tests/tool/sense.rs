//! Tests `hivtac sense` on pictures that are drawn here.

use crate::run::*;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::threshold::ByteOrder;
use hivtac_terms::units::Micrometres;
use hivtac_twin::{Frame, Load, MARKERS, Options, Paint, Patch, Preset, Scene};
use image::{Rgb, RgbImage};
use serde_json::{Value, json};
use tempfile::TempDir;

pub static MODEL: &[u8] = include_bytes!("../../../calibration/models/default.hvtm");

const BACKGROUND: Rgb<u8> = Rgb([66, 81, 90]);
const RED: Rgb<u8> = Rgb([206, 28, 33]);

/// A red disc: centre and radius, px.
type Disc = (f64, f64, f64);

fn picture(width: u32, height: u32, discs: &[Disc]) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let inside =
            |&(cx, cy, radius): &Disc| (f64::from(x) - cx).hypot(f64::from(y) - cy) <= radius;
        if discs.iter().any(inside) {
            RED
        } else {
            BACKGROUND
        }
    })
}

/// Discs with the positions and sizes of the built-in model's markers at rest.
fn at_rest() -> Vec<Disc> {
    let rest = Model::parse(MODEL).unwrap().rest;
    let areas = rest
        .areas
        .map(|area| (f64::from(area) / std::f64::consts::PI).sqrt() - 1.0);
    let markers = rest.features.centroids.into_iter().zip(areas);
    markers
        .map(|((x, y), radius)| (x.to_f64(), y.to_f64(), radius))
        .collect()
}

/// The rest position drawn larger and shifted, as under a slanted press.
fn pressed() -> Vec<Disc> {
    let push = |(x, y, radius): Disc| {
        (
            159.5 + (x - 159.5) * 1.1 + 1.0,
            119.5 + (y - 119.5) * 1.1,
            radius * 1.1,
        )
    };
    at_rest().into_iter().map(push).collect()
}

/// A frame of the simulated sensor, at rest or under a press away from the middle.
fn frame(is_pressed: bool) -> Frame {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
    let press = Load::from_angles(0.1, 4.0, -3.0).unwrap();
    let press = press.with_offset_mm([1.0, -0.5]).unwrap();
    let load = if is_pressed { press } else { Load::REST };
    scene.render_load(&load, 7).unwrap()
}

/// The untouched film with film colour over a quarter of a millimetre of every marker.
fn covered() -> Frame {
    let patch = |marker: &hivtac_twin::Disc| Patch {
        centre_mm: [marker.centre_mm[0] + 1.25, marker.centre_mm[1]],
        radius_mm: 1.0,
        paint: Paint::Film,
    };
    let options = Options {
        patches: MARKERS.iter().map(patch).collect(),
        ..Options::default()
    };
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
    let scene = scene.with_options(options).unwrap();
    scene.render_load(&Load::REST, 7).unwrap()
}

pub fn photograph(frame: &Frame) -> RgbImage {
    RgbImage::from_raw(frame.width, frame.height, frame.to_rgb888()).unwrap()
}

/// A folder for pictures, which is deleted with this value.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Folder {
        Folder(TempDir::new().unwrap())
    }

    pub fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    pub fn save(&self, name: &str, picture: &RgbImage) -> String {
        picture.save(self.path(name)).unwrap();
        self.path(name)
    }
}

pub fn json_of(run: &Finished) -> Value {
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(run.stdout.lines().count(), 1, "{run:?}");
    serde_json::from_str(&run.stdout).unwrap()
}

#[test]
fn every_blob_is_measured() {
    let folder = Folder::new();
    let mut image = picture(320, 240, &[]);
    for (x, y) in (20..30).flat_map(|x| (40..52).map(move |y| (x, y))) {
        image.put_pixel(x, y, RED);
    }
    let path = folder.save("square.png", &image);
    let found = json_of(&run(&["sense", "--json", &path]));
    let expected = json!({
        "image": path, "width": 320, "height": 240,
        "blobs": [{"no_marker": null, "area": 168, "cx": 24.5, "cy": 45.5, "x0": 19, "y0": 39, "x1": 30, "y1": 52}],
        "markers": null, "features": null, "force": null, "contact": null, "contacts": [],
        "status": ["markers_missing", "tare_missing", "not_calibrated"],
    });
    assert_eq!(found, expected);
}

#[test]
fn small_blobs_are_shown_on_request() {
    let folder = Folder::new();
    let mut image = picture(320, 240, &[]);
    image.put_pixel(7, 9, RED);
    let path = folder.save("dot.png", &image);
    let blobs = |arguments: &[&str]| {
        let arguments = [&["sense", "--json", &path], arguments].concat();
        json_of(&run(&arguments))["blobs"].as_array().unwrap().len()
    };
    assert_eq!((blobs(&[]), blobs(&["--min-area", "1"])), (0, 1));
}

/// A blob says why it is no marker.
#[test]
fn a_blob_that_is_no_marker_says_why() {
    let folder = Folder::new();
    let mut image = picture(320, 240, &[]);
    let mut fill = |x: std::ops::Range<u32>, y: std::ops::Range<u32>| {
        for (x, y) in x.flat_map(|x| y.clone().map(move |y| (x, y))) {
            image.put_pixel(x, y, RED);
        }
    };
    fill(0..12, 60..72);
    fill(40..46, 20..22);
    fill(100..220, 100..180);
    // An L.
    fill(250..254, 40..60);
    fill(254..270, 56..60);
    let path = folder.save("things.png", &image);
    let found = run(&["sense", "--min-area", "10", &path]);
    for why in [
        "fewer than",
        "cut by the picture's border",
        "more than",
        "two things",
    ] {
        assert!(found.stdout.contains(why), "{why}: {found:?}");
    }
    assert_eq!(
        found.stdout.matches("; no marker: ").count(),
        4,
        "{found:?}"
    );
}

/// A fifth dot next to the film is left out by a region, and by a mask.
#[test]
fn what_is_not_looked_at_is_left_out() {
    let folder = Folder::new();
    let mut image = photograph(&frame(false));
    let clean = folder.save("clean.png", &image);
    for (x, y) in (300..312).flat_map(|x| (6..18).map(move |y| (x, y))) {
        image.put_pixel(x, y, RED);
    }
    let mask = RgbImage::from_fn(320, 240, |x, _| {
        image::Rgb([if x < 290 { 255 } else { 0 }; 3])
    });
    let (path, mask) = (
        folder.save("five.png", &image),
        folder.save("mask.png", &mask),
    );
    let found = |path: &str, arguments: &[&str]| {
        let mut found = json_of(&run(&[&["sense", "--json", path], arguments].concat()));
        found["image"] = "".into();
        found
    };
    let blobs = |found: &Value| found["blobs"].as_array().unwrap().len();
    assert_eq!(
        (blobs(&found(&path, &[])), blobs(&found(&clean, &[]))),
        (5, 4)
    );
    for arguments in [["--region", "0,0,290,240"], ["--mask", &mask]] {
        assert_eq!(
            found(&path, &arguments),
            found(&clean, &[]),
            "{arguments:?}"
        );
    }
    let refused = run(&["sense", &path, "--region", "100,0,221,240"]);
    assert!(
        refused.stderr.contains("--region goes beyond the picture"),
        "{refused:?}"
    );
    let refused = run(&["sense", &path, "--region", "1,2,0,4"]);
    assert!(refused.stderr.contains("four whole numbers"), "{refused:?}");
    let small = folder.save("small.png", &picture(10, 10, &[]));
    let refused = run(&["sense", &path, "--mask", &small]);
    assert!(
        refused.stderr.contains("the mask has 10 × 10 px"),
        "{refused:?}"
    );
}

/// Measures a frame with the sensing code and this shape of what presses.
fn measured(frame: &Frame, shape: ContactShape) -> Measurement {
    let model = Model::parse(MODEL).unwrap();
    let mut sensor: Box<Sensor> = Box::default();
    sensor
        .configure(model.conditions.settings(ByteOrder::Native), Some(model))
        .unwrap();
    sensor.set_contact_shape(shape);
    sensor.measure_frame(&frame.to_rgb565())
}

/// The numbers are those of the sensing code on the same pixels, to the last digit.
#[test]
fn the_force_is_that_of_the_sensing_code() {
    let folder = Folder::new();
    let frame = frame(true);
    let picture = folder.save("pressed.png", &photograph(&frame));
    for (options, shape) in [
        (&[][..], ContactShape::Unknown),
        (&["--contact", "needle"], ContactShape::Needle),
        (
            &["--contact", "flat:2"],
            ContactShape::Flat(Micrometres(2_000)),
        ),
    ] {
        let found = json_of(&run(&[&["sense", "--json", &picture], options].concat()));
        check_found(&found, &measured(&frame, shape));
    }
    let refused = run(&["sense", "--contact", "round:9", &picture]);
    assert_eq!(refused.code, Some(2));
    assert!(
        refused.stderr.contains("0.25 to 4 mm"),
        "{}",
        refused.stderr
    );
}

fn check_found(found: &Value, measurement: &Measurement) {
    let force = measurement.force.unwrap_or_else(|| panic!("{found}"));
    let micro = |number: i32| f64::from(number) / 1e6;
    let milli = |number: i32| f64::from(number) / 1e3;
    let [x, y, z] = force.cartesian.map(|component| component.0);
    let place = force.place.unwrap();
    assert_eq!(
        found["force"],
        json!({
            "alpha_deg": milli(force.alpha.0), "beta_deg": milli(force.beta.0),
            "magnitude_n": micro(force.magnitude.0),
            "x_n": micro(x), "y_n": micro(y), "z_n": micro(z),
            "direction_sigma_deg": milli(force.direction_sigma.0 as i32),
            "magnitude_sigma_n": micro(force.magnitude_sigma.0 as i32),
            "place_x_mm": milli(place.x.0), "place_y_mm": milli(place.y.0),
            "place_sigma_mm": f64::from(place.sigma.0) / 1e3,
            "torque_z_nm": force.torque.map(|torque| f64::from(torque.z.0) / 1e9),
            "torque_sigma_nm": force.torque.map(|torque| f64::from(torque.sigma.0) / 1e9),
        })
    );
    assert_eq!(found["contact"], true, "{force:?}");
    let features: Vec<Value> = measurement
        .features
        .unwrap()
        .to_array()
        .iter()
        .map(|n| json!(n.to_f64()))
        .collect();
    assert_eq!(found["features"], Value::from(features));
    assert_eq!(found["markers"][2]["id"], 2);
    assert_eq!(
        found["status"],
        json!(measurement.status.names().collect::<Vec<_>>())
    );
}

#[test]
fn png_and_ppm_give_the_same_and_jpeg_is_read() {
    let folder = Folder::new();
    let image = picture(320, 240, &at_rest());
    let mut found = ["a.png", "a.ppm"]
        .map(|name| json_of(&run(&["sense", "--json", &folder.save(name, &image)])));
    for object in &mut found {
        object["image"].take();
    }
    assert_eq!(found[0], found[1]);
    let jpeg = json_of(&run(&["sense", "--json", &folder.save("a.jpg", &image)]));
    assert_eq!(jpeg["blobs"].as_array().unwrap().len(), 4);
}

/// A mono camera's model takes grey pictures, and colours by their luma.
#[test]
fn a_mono_cameras_model_reads_grey_and_coloured_pictures_by_luma() {
    const MODEL: &str = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../calibration/models/mt9v034/default.hvtm"
    );
    let folder = Folder::new();
    let scene = Scene::preset("rest", Preset::Mt9v034, 160, 120, 1).unwrap();
    let colours = photograph(&scene.render_load(&Load::REST, 7).unwrap());
    let grey = image::DynamicImage::from(colours.clone()).into_luma8();
    let [grey_path, path] = [
        folder.path("grey.png"),
        folder.save("colours.bmp", &colours),
    ];
    grey.save(&grey_path).unwrap();
    let found = [&grey_path, &path].map(|path| {
        let mut found = json_of(&run(&["sense", "--json", "--model", MODEL, path]));
        found["image"].take();
        found
    });
    assert_eq!(
        found[0]["markers"].as_array().unwrap().len(),
        4,
        "{}",
        found[0]
    );
    assert_eq!(found[0], found[1]);
}

/// Nothing passes the threshold in either, but the remedies differ.
#[test]
fn a_white_picture_is_not_called_dark() {
    let folder = Folder::new();
    for (level, words) in [
        (255, "the picture is white: less light"),
        (
            128,
            "the picture is not dark, but no pixel has the markers' colours",
        ),
        (2, "the picture is dark: cap off"),
    ] {
        let image = RgbImage::from_pixel(320, 240, Rgb([level; 3]));
        let found = run(&["sense", &folder.save("a.png", &image)]);
        assert!(found.stdout.contains(words), "{found:?}");
    }
}

/// Four things that each could be a marker, but do not lie as markers do.
#[test]
fn the_rule_is_reported_by_which_blobs_are_no_markers() {
    let folder = Folder::new();
    let mut image = RgbImage::from_pixel(320, 240, Rgb([128; 3]));
    for [left, top] in [[40, 60], [70, 60], [200, 150], [230, 60]] {
        for (x, y) in (0..18).flat_map(|x| (0..18).map(move |y| (x, y))) {
            if (x - 9) * (x - 9) + (y - 9) * (y - 9) < 70 {
                let (x, y): (i32, i32) = (left + x, top + y);
                image.put_pixel(x as u32, y as u32, Rgb([200, 10, 10]));
            }
        }
    }
    let found = run(&["sense", &folder.save("a.png", &image)]);
    assert!(found.stdout.contains("markers_ambiguous"), "{found:?}");
    let words = "lie as dots do: a square around the picture's middle";
    assert!(found.stdout.contains(words), "{found:?}");
    assert!(found.stdout.contains("turned by at most 20°"), "{found:?}");
}

/// Decoders paint the missing part of a JPEG file grey.
#[test]
fn a_jpeg_that_was_cut_anywhere_is_refused() {
    let folder = Folder::new();
    let whole = std::fs::read(folder.save("a.jpg", &picture(320, 240, &at_rest()))).unwrap();
    let cut = folder.path("cut.jpg");
    for part in [0.3, 0.5, 0.8, 0.99] {
        std::fs::write(&cut, &whole[..(part * whole.len() as f64) as usize]).unwrap();
        let found = run(&["sense", &cut]);
        assert_eq!(found.code, Some(1), "{part}");
        assert!(
            found.stderr.contains("cannot read the picture"),
            "{}",
            found.stderr
        );
    }
}

/// EXIF data of one entry, the orientation: 6 is a quarter turn to the right.
const TURNED: &[u8] = b"\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\
    \x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";

/// Of a camera that was held sideways: the lower left was the upper left.
#[test]
fn a_picture_is_turned_as_its_exif_data_say() {
    let folder = Folder::new();
    let path = folder.save("turned.jpg", &picture(120, 160, &[(60.0, 120.0, 8.0)]));
    let jpeg = std::fs::read(&path).unwrap();
    std::fs::write(&path, [&jpeg[..2], TURNED, &jpeg[2..]].concat()).unwrap();
    let found = json_of(&run(&["sense", "--json", &path]));
    assert_eq!(
        (&found["width"], &found["height"]),
        (&json!(160), &json!(120))
    );
    let [x, y] = ["cx", "cy"].map(|part| found["blobs"][0][part].as_f64().unwrap().round());
    assert_eq!([x, y], [39.0, 60.0], "{found}");
}

/// A model file without an end.
#[test]
fn a_model_file_is_read_no_farther_than_a_model_can_be_long() {
    let folder = Folder::new();
    let image = folder.save("a.png", &picture(320, 240, &[]));
    let endless = run(&["sense", "--model", "/dev/zero", &image]);
    assert_eq!(endless.code, Some(1));
    assert!(
        endless.stderr.contains("which no model has"),
        "{}",
        endless.stderr
    );
}

#[test]
fn a_tare_takes_its_status_bit_away() {
    let folder = Folder::new();
    let rest = folder.save("rest.png", &photograph(&frame(false)));
    let press = folder.save("press.png", &photograph(&frame(true)));
    let found = json_of(&run(&["sense", "--json", "--tare", &rest, &press]));
    let status = found["status"].as_array().unwrap();
    assert!(!status.contains(&json!("tare_missing")), "{found}");
    assert!(found["force"].is_object(), "{found}");
    let covered = folder.save("covered.png", &photograph(&covered()));
    let failed = run(&["sense", "--tare", &covered, &press]);
    assert_eq!(failed.code, Some(1));
    let why = "does not show four whole, equal markers";
    assert!(failed.stderr.contains(why), "{}", failed.stderr);
    let empty = folder.save("empty.png", &picture(320, 240, &[]));
    let failed = run(&["sense", "--tare", &empty, &press]);
    assert_eq!(failed.code, Some(1));
    assert!(
        failed
            .stderr
            .contains("does not show all markers (image_dark "),
        "{}",
        failed.stderr
    );
    let large = folder.save("large.png", &picture(640, 480, &[]));
    let failed = run(&["sense", "--tare", &rest, &large]);
    assert!(
        failed
            .stderr
            .contains("has 640 × 480 px, but the tare's has 320 × 240 px"),
        "{}",
        failed.stderr
    );
}

/// Conditions other than the model's give no force, and a message.
#[test]
fn other_conditions_give_no_force() {
    let folder = Folder::new();
    let image = picture(320, 240, &pressed());
    let path = folder.save("press.png", &image);
    let doubled: Vec<_> = pressed()
        .iter()
        .map(|(x, y, r)| (2.0 * x + 0.5, 2.0 * y + 0.5, 2.0 * r))
        .collect();
    let large = folder.save("large.png", &picture(640, 480, &doubled));
    for arguments in [
        &["sense", "--json", &path, "--preset", "paper"][..],
        &[
            "sense",
            "--json",
            &path,
            "--threshold",
            "170,10,101,255,45,255",
        ],
        &["sense", "--json", &large],
    ] {
        let found = json_of(&run(arguments));
        assert_eq!(found["blobs"].as_array().unwrap().len(), 4, "{found}");
        assert_eq!(found["force"], Value::Null, "{found}");
        let status = found["status"].as_array().unwrap();
        assert!(status.contains(&json!("model_mismatch")), "{found}");
    }
}

#[test]
fn a_person_sees_every_stage() {
    let folder = Folder::new();
    let path = folder.save("press.png", &photograph(&frame(true)));
    let found = run(&["sense", &path]);
    let lines: Vec<_> = found.stdout.lines().collect();
    assert_eq!(
        lines[0],
        format!("{path}: 320 × 240 px, taken with a focal length of 175.00 px")
    );
    assert_eq!(lines[1], "  blobs     4");
    assert_eq!(lines[2], "      area              centroid  box");
    assert!(
        lines[7].starts_with("  marker 0  upper left   ("),
        "{}",
        lines[7]
    );
    assert!(lines[11].starts_with("  features  "), "{}", lines[11]);
    assert!(lines[12].starts_with("  force     α "), "{}", lines[12]);
    assert!(lines[13].starts_with("  place     ("), "{}", lines[13]);
    assert_eq!(lines[14], "  contact   yes");
    assert!(lines[15].starts_with("  status    "), "{}", lines[15]);
    assert!(
        lines[15].ends_with("tare_missing not_calibrated"),
        "{}",
        lines[15]
    );
    assert_eq!(lines.len(), 16);
}

#[test]
fn bad_pictures_are_named_and_the_others_looked_at() {
    let folder = Folder::new();
    let good = folder.save("good.png", &picture(320, 240, &[]));
    let big = folder.save("big.png", &picture(801, 2, &[]));
    let text = folder.path("text.png");
    std::fs::write(&text, "no picture").unwrap();
    let cut = folder.path("cut.png");
    std::fs::write(&cut, &std::fs::read(&good).unwrap()[..60]).unwrap();
    let found = run(&["sense", "--json", "/nowhere.png", &big, &text, &cut, &good]);
    assert_eq!(found.code, Some(1));
    assert_eq!(found.stdout.lines().count(), 1);
    let lines: Vec<_> = found.stderr.lines().collect();
    assert!(
        lines[0].starts_with("hivtac: cannot read the picture /nowhere.png: "),
        "{}",
        lines[0]
    );
    assert_eq!(
        lines[1],
        format!(
            "hivtac: the picture {big} has 801 × 2 px, more than the 800 × 800 px of the largest \
             frame; scale it down, for example to 640 px wide"
        )
    );
    assert_eq!(
        lines[2],
        format!("hivtac: cannot read the picture {text}: it is no PNG, JPEG, BMP or PPM file")
    );
    assert!(
        lines[3].starts_with(&format!("hivtac: cannot read the picture {cut}: ")),
        "{}",
        lines[3]
    );
    assert_eq!(lines[4], "hivtac: 4 of 5 pictures could not be used");
}

#[test]
fn a_bad_model_file_is_named() {
    let folder = Folder::new();
    let image = folder.save("a.png", &picture(320, 240, &[]));
    let model = folder.path("model.hvtm");
    let mut bytes = MODEL.to_vec();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(&model, bytes).unwrap();
    let bad = run(&["sense", "--model", &model, &image]);
    assert_eq!(bad.code, Some(1));
    let start = format!("hivtac: {model} is no usable model: ");
    assert!(bad.stderr.starts_with(&start), "{}", bad.stderr);
    std::fs::write(&model, MODEL).unwrap();
    assert_eq!(run(&["sense", "--model", &model, &image]).code, Some(0));
    let missing = run(&["sense", "--model", "/nowhere.hvtm", &image]);
    assert!(
        missing
            .stderr
            .starts_with("hivtac: cannot read the model /nowhere.hvtm: "),
        "{}",
        missing.stderr
    );
}
