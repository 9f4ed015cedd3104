//! Tests on good and bad pictures of the simulated sensor.

use super::simulated::{device, device_of_eight, frame};
use super::*;
use hivtac_twin::Format;

/// The faults of a frame, in the order in which they are shown.
fn wrong(frame: &Frame) -> Vec<String> {
    wrong_of(frame, &device(), 4)
}

/// The same for a device with this many dots.
fn wrong_of(frame: &Frame, device: &DeviceHello, dots: usize) -> Vec<String> {
    let focus = Focus::of(frame, device).unwrap();
    let checks = focus.checks.iter();
    assert_eq!(focus.right, focus.wrong.is_empty());
    let all_right = checks.clone().all(|check| check.right) && checks.len() == 5 * dots + 3;
    assert_eq!(focus.right, all_right, "{}", focus.text());
    focus.wrong
}

/// Asserts that there is exactly one fault, whose text has these words.
fn assert_wrong(frame: &Frame, words: &[&str]) {
    let wrong = wrong(frame);
    assert_eq!(wrong.len(), 1, "{wrong:?}");
    for word in words {
        assert!(wrong[0].contains(word), "no {word}: {}", wrong[0]);
    }
}

#[test]
fn the_nominal_sensor_is_right_in_both_formats() {
    for format in [Format::Rgb565, Format::Yuv422] {
        let frame = frame(|options| options.format = format);
        assert_eq!(wrong(&frame), [""; 0]);
    }
}

/// A blur that loses no frame is right; one that loses most frames is a fault.
#[test]
fn a_blurred_picture_is_reported_by_its_rims() {
    for format in [Format::Rgb565, Format::Yuv422] {
        let blurred = |blur_px| {
            frame(|options| {
                options.format = format;
                options.lens.blur_px = blur_px;
            })
        };
        assert_eq!(wrong(&blurred(1.0)), [""; 0]);
        assert_wrong(
            &blurred(1.5),
            &["rim of marker 0, 1, 2, 3:", "turn the lens"],
        );
        assert_wrong(&blurred(2.5), &["rim of marker 0, 1, 2, 3:"]);
    }
}

/// A lens of F/2.8 that is focused too near.
#[test]
fn a_defocused_lens_is_reported() {
    let focused = |focus_mm| {
        frame(|options| {
            options.lens.aperture_mm = 0.75;
            options.lens.focus_mm = focus_mm;
        })
    };
    assert_eq!(wrong(&focused(10.0)), [""; 0]);
    assert_wrong(&focused(4.0), &["rim of marker"]);
}

#[test]
fn a_turned_camera_is_reported_with_the_way_back() {
    for (roll_deg, way) in [(8.0, " clockwise"), (-8.0, "counter-clockwise")] {
        let frame = frame(|options| options.mounting.roll_deg = roll_deg);
        assert_wrong(&frame, &["turn: ", way]);
    }
    assert_eq!(
        wrong(&frame(|options| options.mounting.roll_deg = 5.0)),
        [""; 0]
    );
}

#[test]
fn a_shifted_camera_is_reported_with_where_to() {
    let off = frame(|options| options.mounting.shift_px = [12.0, -5.0]);
    assert_wrong(
        &off,
        &["centre: 13.0 px", "12 px to the right", "5 px above"],
    );
    let little = frame(|options| options.mounting.shift_px = [-5.0, 6.0]);
    assert_eq!(wrong(&little), [""; 0]);
}

#[test]
fn too_little_and_too_much_light_are_reported() {
    assert_wrong(
        &frame(|options| options.gain = 0.45),
        &["brightness", "more light"],
    );
    let bright = wrong(&frame(|options| options.gain = 1.8));
    assert!(bright[0].starts_with("brightness of"), "{bright:?}");
    assert!(bright[0].contains("less light"), "{bright:?}");
    assert_eq!(wrong(&frame(|options| options.gain = 0.7)), [""; 0]);
    // Light from one side only.
    let aslant = frame(|options| {
        options.gain = 0.8;
        options.gradient = [1.0, 0.0];
    });
    assert_wrong(&aslant, &["brightness of marker 0, 3:"]);
}

#[test]
fn washed_out_colours_are_reported() {
    let hazy = wrong(&frame(|options| {
        options.gain = 0.6;
        options.haze = 120.0;
    }));
    assert!(
        hazy[0].starts_with("colour of marker 0, 1, 2, 3"),
        "{hazy:?}"
    );
}

/// With a film 13 mm away, everything is smaller.
#[test]
fn a_film_too_far_away_is_reported() {
    let small = wrong(&frame(|options| options.lens.pitch_um = Some(15.0)));
    assert!(small[0].starts_with("size: 0.8"), "{small:?}");
    assert!(small[0].contains("too far from the lens"), "{small:?}");
}

#[test]
fn a_picture_without_four_markers_is_reported() {
    let dark = wrong(&frame(|options| options.gain = 0.0));
    assert!(
        dark[0].contains("no marker is seen (image_dark"),
        "{dark:?}"
    );
    let three = wrong(&frame(|options| options.missing[2] = true));
    assert!(
        three[0].starts_with("3 of four markers are seen"),
        "{three:?}"
    );
}

/// A film of eight dots with some options changed.
fn eight(change: impl Fn(&mut hivtac_twin::Options)) -> Vec<String> {
    let frame = frame(|options| {
        options.layout = "8v".parse().unwrap();
        options.missing = hivtac_twin::film::Dots::defaults(8);
        change(options);
    });
    wrong_of(&frame, &device_of_eight(), 8)
}

#[test]
fn eight_dots_are_right_in_both_formats() {
    for format in [Format::Rgb565, Format::Yuv422] {
        assert_eq!(eight(|options| options.format = format), [""; 0]);
    }
}

#[test]
fn faults_of_a_film_of_eight_dots_are_reported() {
    let blurred = eight(|options| options.lens.blur_px = 2.0);
    assert!(blurred[0].starts_with("rim of marker 0, 1, 2, 3, 4, 5, 6, 7:"));
    let turned = eight(|options| options.mounting.roll_deg = 8.0);
    assert!(turned[0].starts_with("turn: 8."), "{turned:?}");
    let shifted = eight(|options| options.mounting.shift_px = [12.0, -5.0]);
    assert!(shifted[0].contains("12 px to the right"), "{shifted:?}");
    let seven = eight(|options| options.missing[5] = true);
    assert!(seven[0].starts_with("7 of eight markers"), "{seven:?}");
    let four = wrong_of(&frame(|_| {}), &device_of_eight(), 8);
    assert!(four[0].starts_with("4 of eight markers"), "{four:?}");
}

#[test]
fn a_layout_that_nobody_knows_is_refused() {
    let mut device = device_of_eight();
    device.model.as_mut().unwrap().markers = 5;
    let refused = Focus::of(&frame(|_| {}), &device).map(|_| ());
    let failure = refused.unwrap_err().to_string();
    assert!(failure.contains("model is for 5"), "{failure}");
}

#[test]
fn a_person_sees_a_table_with_the_limits() {
    let blurred = frame(|options| options.lens.blur_px = 1.5);
    let text = Focus::of(&blurred, &device()).unwrap().text();
    let lines: Vec<_> = text.lines().collect();
    assert_eq!(lines[0], "frame 7");
    assert!(lines[1].starts_with("  marker          rim, px"), "{text}");
    assert!(lines[2].starts_with("  0                  !4."), "{text}");
    assert!(lines[6].starts_with("  right             ≤ 3.5 "), "{text}");
    assert!(
        lines[7].starts_with("  pattern  centre 0.0 px (≤ 9), turn "),
        "{text}"
    );
    assert!(lines[8].starts_with("  wrong    rim of marker"), "{text}");
}

/// LEDs of the camera's own board, on the markers and next to them.
#[test]
fn leds_that_the_film_mirrors_are_reported() {
    for board_mm in [5.0, 7.0, 9.0, 12.0, 18.0] {
        for format in [Format::Rgb565, Format::Yuv422] {
            let frame = frame(|options| {
                options.format = format;
                options.board_leds_mm = Some(board_mm);
            });
            let focus = Focus::of(&frame, &device()).unwrap();
            assert!(
                !focus.right && focus.wrong[0].contains("LEDs off"),
                "{}",
                focus.text()
            );
        }
    }
}
