//! Tests on the simulated sensor's pictures, with and without a separating threshold.

use super::find::{Levels, find, limit};
use super::levels::Scale;
use super::*;
use crate::simulated::{device, device_of_eight, frame};
use hivtac_terms::threshold::{HsvBox, Mono, Yuv422};
use hivtac_twin::{Format, Options as Scene, Paint, Patch};
use hivtac_wire::message::{ModelIdentity, ModelSource};

/// A device whose model was made for this threshold.
fn device_for(threshold: Threshold) -> DeviceHello {
    let model = ModelIdentity {
        markers: 4,
        crc: 0,
        name: "model".try_into().unwrap(),
        simulated: true,
        threshold,
        source: ModelSource::BuiltIn,
    };
    DeviceHello {
        model: Some(model),
        ..device()
    }
}

fn found(change: impl Fn(&mut Scene)) -> Found {
    find(&[frame(change)], &device()).unwrap()
}

fn refused(change: impl Fn(&mut Scene)) -> String {
    find(&[frame(change)], &device()).unwrap_err()
}

/// Half way between grey film (Cr 132, luma 141) and red dots (Cr 191, luma 36), as the usual
/// thresholds are.
#[test]
fn it_lies_half_way_between_film_and_dots() {
    let yuv = found(|options| options.format = Format::Yuv422).chosen;
    let Threshold::Yuv422(Yuv422 { cr_low }) = yuv else {
        panic!("{yuv:?}")
    };
    assert!(cr_low.abs_diff(Yuv422::RED.cr_low) <= 2, "{cr_low}");
    let mono = found(|options| options.format = Format::Mono).chosen;
    let Threshold::Mono(Mono { low: 0, high }) = mono else {
        panic!("{mono:?}")
    };
    assert!(high.abs_diff(Mono::DARK.high) <= 2, "{high}");
}

#[test]
fn a_box_has_the_colours_of_the_dots() {
    let rgb = found(|_| ());
    let Threshold::Rgb565(chosen) = rgb.chosen else {
        panic!("{rgb:?}")
    };
    let limits = chosen.limits();
    let (levels, colour) = (rgb.levels, rgb.colour.unwrap());
    assert!(levels.film_high < limits[2] && limits[2] < levels.dots_low);
    assert!(limits[0] >= 160 && limits[1] <= 15, "red: {limits:?}");
    assert!(
        (1..=colour.value_low / 2).contains(&limits[4]),
        "{limits:?}"
    );
    assert!(rgb.span[0] < limits[2] && limits[2] < rgb.span[1]);
    assert_eq!(rgb.model, None, "this device has no model");
}

/// With a model for the usual threshold, and with one whose threshold misses the dots' saturation.
#[test]
fn the_models_is_taken_when_it_separates() {
    let picture = frame(|_| ());
    let usual = Threshold::Rgb565(HsvBox::RED);
    let of_usual = find(std::slice::from_ref(&picture), &device_for(usual)).unwrap();
    assert_eq!((of_usual.model, of_usual.wanted()), (Some(usual), usual));
    let narrow = Threshold::Rgb565(HsvBox {
        saturation_low: of_usual.levels.dots_low,
        ..HsvBox::RED
    });
    let of_narrow = find(std::slice::from_ref(&picture), &device_for(narrow)).unwrap();
    assert_eq!(
        (of_narrow.model, of_narrow.wanted()),
        (None, of_usual.chosen)
    );
    let other_format = Threshold::Yuv422(Yuv422::RED);
    let of_other = find(&[picture], &device_for(other_format)).unwrap();
    assert_eq!(of_other.model, None);
}

/// With half of the light, with warm light, and under a press.
#[test]
fn it_follows_the_light() {
    for change in [
        |options: &mut Scene| options.gain = 0.5,
        |options: &mut Scene| options.white_balance = [1.15, 1.0, 0.85],
        |options: &mut Scene| options.gradient = [0.5, 0.3],
    ] {
        let picture = frame(change);
        let found = find(std::slice::from_ref(&picture), &device()).unwrap();
        let arguments = AutoArguments {
            device: Device::default(),
            keep: false,
            dry_run: true,
            json: false,
        };
        let report = Report::new(&[picture], &device(), found, &arguments);
        assert!(
            (0.005..0.015).contains(&report.share()),
            "{}",
            report.text()
        );
    }
}

#[test]
fn what_does_not_separate_is_refused_with_the_reason() {
    let dark = refused(|options| options.gain = 0.05);
    assert!(dark.contains("the picture is dark"), "{dark}");
    let white = refused(|options| (options.gain, options.haze) = (4.0, 200.0));
    assert!(white.starts_with("the picture is white"), "{white}");
    let blue = refused(|options| options.markers = Paint::Blue);
    assert!(
        blue.contains("nothing in the picture has another colour"),
        "{blue}"
    );
    let pale = refused(|options| options.haze = 200.0);
    assert!(pale.contains("whole, equal markers"), "{pale}");
    let three = refused(|options| options.missing[2] = true);
    assert!(three.contains("3 of four markers are seen"), "{three}");
    let another = refused(|options| {
        options.patches.push(Patch {
            centre_mm: [0.0, 3.0],
            radius_mm: 0.5,
            paint: Paint::Red,
        });
    });
    assert!(another.contains("something else"), "{another}");
}

/// A limit lies as near to the middle of film and dots as the margins allow.
#[test]
fn a_limit_keeps_its_margins() {
    let of = |[film, film_high, dots_low, dots]: [u8; 4]| {
        let levels = Levels {
            film,
            film_high,
            dots_low,
            dots,
        };
        limit(Scale::Cr, &levels)
    };
    assert_eq!(of([130, 136, 186, 190]), Ok(160));
    assert_eq!(of([130, 136, 165, 190]), Ok(153));
    assert_eq!(of([130, 160, 186, 190]), Ok(172));
    let error = of([130, 150, 170, 190]).unwrap_err();
    assert!(
        error.contains("up to 150") && error.contains("down to 170"),
        "{error}"
    );
    assert!(error.contains("24 are needed between them"), "{error}");
}

/// Eight dots are found, and a missing one is reported.
#[test]
fn it_separates_eight_dots() {
    let eight = |missing: bool| {
        frame(|options| {
            options.layout = "8v".parse().unwrap();
            options.missing = hivtac_twin::film::Dots::from_fn(8, |dot| missing && dot == 5);
        })
    };
    let found = find(&[eight(false)], &device_of_eight()).unwrap();
    let Threshold::Rgb565(it) = found.chosen else {
        panic!("{:?}", found.chosen);
    };
    assert!((80..=160).contains(&it.saturation_low), "{it:?}");
    let seven = find(&[eight(true)], &device_of_eight()).unwrap_err();
    assert!(seven.contains("7 of eight markers are seen"), "{seven}");
}
