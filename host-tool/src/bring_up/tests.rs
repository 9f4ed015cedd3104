//! Tests of the steps' judgements.

use super::colours::Middle;
use super::report::{Report, Step};
use super::{camera, clocks, colours, film, noise, press};
use hivtac_host::frame::Frame;
use hivtac_terms::fixed::Q;
use hivtac_terms::force::ContactList;
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{HsvBox, PixelFormat, Threshold};
use hivtac_terms::units::Px;
use hivtac_wire::message::{DifferentRegister, Inspection, Sample};
use serde_json::{Value, json};

/// The step's faults contain these words; without words it has no fault.
fn says(step: &Step, words: &[&str]) {
    assert_eq!(step.is_right(), words.is_empty(), "{}", step.text());
    let wrong = step.wrong().join("\n");
    for word in words {
        assert!(wrong.contains(word), "{wrong} has no {word}");
    }
}

fn inspection() -> Inspection {
    Inspection {
        silicon: 0x2003,
        camera_id: 0x7721,
        registers: 56,
        different: Default::default(),
        frame_time_us: 6_405,
        exposure_us: 4_000,
        longest_exposure_us: 6_405,
        gain_sixteenths: Q::from_bits(16),
    }
}

#[test]
fn a_register_that_lost_its_value_is_named() {
    says(&camera::judge(&inspection(), false), &[]);
    let mut lost = inspection();
    let green = DifferentRegister {
        address: 3,
        written: 0x40,
        found: 0,
    };
    lost.different.push(green).unwrap();
    says(
        &camera::judge(&lost, false),
        &["register 03 holds 00, 40 was written", "supply"],
    );
    let own = camera::judge(&lost, true);
    says(&own, &[]);
    let reported = "since its set-up register 03 holds 00, 40 was written";
    assert!(own.text().contains(reported), "{}", own.text());
}

#[test]
fn a_register_of_an_ov5640_has_an_address_of_two_bytes() {
    let mut lost = Inspection {
        camera_id: 0x5640,
        ..inspection()
    };
    let matrix = DifferentRegister {
        address: 0x5384,
        written: 0x0A,
        found: 0,
    };
    lost.different.push(matrix).unwrap();
    says(
        &camera::judge(&lost, false),
        &["register 5384 holds 00, 0a was written"],
    );
}

#[test]
fn light_that_asks_for_everything_the_camera_has_is_too_little() {
    let dim = Inspection {
        exposure_us: 6_382,
        gain_sixteenths: Q::from_bits(62),
        ..inspection()
    };
    says(&camera::judge(&dim, false), &["more light"]);
    let at_low_gain = Inspection {
        gain_sixteenths: Q::from_bits(32),
        ..dim
    };
    says(&camera::judge(&at_low_gain, false), &[]);
}

/// Samples of frames with this period.
fn samples(frame_us: u64) -> Vec<Sample> {
    let sample = |frame: u32| Sample {
        sequence: frame,
        frame,
        time_us: 1_000_000 + u64::from(frame) * frame_us,
        status: Status::MARKERS_MISSING,
        force: None,
        contacts: ContactList::default(),
        markers: MarkerList::default(),
    };
    (0..100).map(sample).collect()
}

#[test]
fn the_rate_is_what_the_camera_was_set_to() {
    let judge = |frame_us| clocks::judge(&samples(frame_us), 6_405, Vec::new());
    says(&judge(6_405), &[]);
    says(&judge(6_460), &[]);
    says(&judge(6_480), &["not what it should be"]);
    says(&judge(3_203), &["twice"]);
    says(&judge(12_810), &["half"]);
    let log = vec!["camera silent".to_owned()];
    says(
        &clocks::judge(&[], 6_405, log),
        &["camera silent", "no frames come"],
    );
}

/// A picture of one colour.
fn picture(pixel: u16) -> Frame {
    Frame {
        number: 1,
        time_us: 0,
        width: 320,
        height: 240,
        threshold: Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255])),
        bytes: pixel.to_be_bytes().repeat(320 * 240),
    }
}

#[test]
fn white_is_neutral_and_neither_dark_nor_saturated() {
    says(&colours::step(&picture(0xB596)), &[]);
    says(&colours::step(&picture(0x2104)), &["too dark"]);
    says(&colours::step(&picture(0xFFFF)), &["too bright"]);
    says(&colours::step(&picture(0xB48C)), &["white is not white"]);
}

#[test]
fn a_film_that_lets_light_through_is_reported() {
    let [free, same, brighter, redder] = [0x9492, 0x9492, 0x9CD3, 0xAC92].map(picture);
    let judge = |covered| film::judge(&Middle::of(&free), &Middle::of(covered));
    says(&judge(&same), &[]);
    says(&judge(&brighter), &["+5 %", "opaque film"]);
    says(&judge(&redder), &["+17 %"]);
}

/// Frames whose first marker jumps by `jump_px`.
fn jumping(jump_px: f64) -> Vec<MarkerList> {
    let marker = |x: f64| Marker {
        x: Px((x * 65_536.0) as i32),
        y: Px(100 << 16),
        area: 170,
    };
    let four = |index: u32| {
        let x = 100.0 + f64::from(index % 2) * jump_px;
        [marker(x), marker(200.0), marker(200.0), marker(100.0)].into()
    };
    (0..32).map(four).collect()
}

#[test]
fn markers_that_do_not_lie_still_are_pointed_out() {
    // One of eight coordinates by 0.1 px: 0.05 / √8 px.
    let judge = |frames: &[MarkerList]| noise::judge(frames, PixelFormat::Rgb565);
    says(&judge(&jumping(0.1)), &[]);
    says(&judge(&jumping(0.2)), &["3.9 times", "flickers"]);
    says(&judge(&jumping(0.0)[..4]), &["only 4 frames"]);
}

#[test]
fn a_press_tells_how_the_camera_is_mounted() {
    let judge = |right, below| press::judge(Some(right), Some(below));
    says(&judge([2.5, 0.4], [-0.3, 2.0]), &[]);
    says(&judge([-2.5, 0.4], [-0.3, -2.0]), &["upside down"]);
    says(&judge([-2.5, 0.4], [-0.3, 2.0]), &["mirrored"]);
    says(&judge([2.5, 0.4], [-0.3, -2.0]), &["mirrored"]);
    says(&judge([0.4, 2.5], [-2.0, 0.1]), &["90°"]);
    says(&judge([2.5, 0.4], [2.5, 0.1]), &["one axis"]);
    says(&judge([0.1, 0.4], [0.0, 2.0]), &["farther from the middle"]);
    says(&press::judge(None, None), &["no press was felt"]);
}

#[test]
fn the_report_says_what_was_not_looked_at() {
    let mut report = Report::new();
    let wrong = vec!["no answer".to_owned()];
    report
        .steps
        .push(Step::new("usb", "nothing".to_owned(), wrong, Value::Null));
    report.finish();
    let json: Value = serde_json::from_str(&report.json()).unwrap();
    assert_eq!(json["right"], json!(false));
    let rest = json!([
        "camera", "clocks", "white", "markers", "film", "noise", "press"
    ]);
    assert_eq!(json["not_done"], rest);
    assert_eq!(json["steps"][0]["wrong"], json!(["no answer"]));
    assert_eq!(report.wrong(), ["usb"]);
}
