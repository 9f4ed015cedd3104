use crate::picture::{GREY, Pattern, Picture, RED, sensor, tared};
use crate::pipeline::{Measurement, Sensor};
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::marker::MarkerList;
use hivtac_terms::status::Status;
use proptest::prelude::*;
use std::boxed::Box;

const QVGA: Geometry = Geometry::preset(Preset::Ov7725, 320, 240);

/// The markers, if only the missing model forbids a force.
fn trusted(seen: &Measurement) -> Option<MarkerList> {
    let forbidden = seen.status.0 & Status::NO_FORCE.0;
    (forbidden == Status::MODEL_MISSING.0).then(|| seen.markers.unwrap())
}

fn names(seen: &Measurement) -> std::vec::Vec<&'static str> {
    seen.status.names().collect()
}

#[test]
fn every_preset_and_size_is_found_at_rest_and_pressed() {
    for preset in Preset::ALL {
        for (width, height) in [(160, 120), (320, 240), (640, 480), (800, 600)] {
            let geometry = Geometry::preset(preset, width, height);
            let mut sensor = tared(geometry);
            for (scale, tilt) in [(1.0, 0.0), (1.3, 10.0), (1.5, 16.0)] {
                let pattern = Pattern {
                    scale,
                    tilt,
                    ..Pattern::at_rest(geometry)
                };
                let seen = pattern.draw().feed(&mut sensor);
                let markers =
                    trusted(&seen).unwrap_or_else(|| panic!("{width}: {:?}", names(&seen)));
                assert!(pattern.error(&markers) < 0.3, "{preset:?} {width} {scale}");
            }
        }
    }
}

#[test]
fn identities_hold_when_the_picture_is_turned_and_shifted() {
    let mut sensor = sensor(QVGA, None);
    for turn in [-19.0, -7.0, 0.0, 12.0, 19.0] {
        for shift in [(0.0, 0.0), (25.0, -20.0), (-20.0, 15.0)] {
            let pattern = Pattern {
                turn,
                shift,
                ..Pattern::at_rest(QVGA)
            };
            let seen = pattern.draw().feed(&mut sensor);
            let error = pattern.error(&seen.markers.unwrap());
            assert!(
                error < 0.3,
                "turned by {turn}°, shifted by {shift:?}: off by {error} px"
            );
        }
    }
}

#[test]
fn a_pattern_turned_too_far_has_no_identities() {
    let mut sensor = sensor(QVGA, None);
    for turn in [-25.0, 30.0, 45.0, 60.0] {
        let seen = Pattern {
            turn,
            ..Pattern::at_rest(QVGA)
        }
        .draw()
        .feed(&mut sensor);
        assert_eq!(seen.markers, None, "{turn}");
    }
}

#[test]
fn three_markers_are_not_four() {
    let mut sensor = tared(QVGA);
    for missing in 0..4 {
        let mut picture = Picture::new(&QVGA);
        for identity in (0..4).filter(|identity| *identity != missing) {
            Pattern::at_rest(QVGA).draw_marker(&mut picture, identity);
        }
        let seen = picture.feed(&mut sensor);
        assert!(
            seen.status.contains(Status::MARKERS_MISSING),
            "{:?}",
            names(&seen)
        );
        assert_eq!(seen.markers, None);
    }
}

/// Dilation closes every second pixel in a marker's middle: mask and centroids are unchanged.
#[test]
fn a_marker_with_holes_is_refused_although_its_mask_is_whole() {
    for (width, height) in [(160, 120), (320, 240), (800, 600)] {
        let geometry = Geometry::preset(Preset::Ov7725, width, height);
        let mut sensor = tared(geometry);
        let pattern = Pattern::at_rest(geometry);
        let mut picture = pattern.draw();
        let whole = trusted(&picture.feed(&mut sensor)).unwrap();
        let (center, reach) = (pattern.center_of(2), pattern.diameters().0 / 3.0);
        picture.paint_near(GREY, center, reach, |x, y| {
            (x - center.0).hypot(y - center.1) < reach && x % 2.0 == 0.0 && y % 2.0 == 0.0
        });
        let seen = picture.feed(&mut sensor);
        assert_eq!(seen.markers, Some(whole), "{width}");
        let why = seen.status.contains(Status::MARKERS_IMPLAUSIBLE);
        assert!(why, "{width}: {:?}", names(&seen));
    }
}

#[test]
fn all_red_and_nothing_red() {
    let mut sensor = tared(QVGA);
    let mut picture = Picture::new(&QVGA);
    assert!(
        picture
            .feed(&mut sensor)
            .status
            .contains(Status::IMAGE_DARK)
    );
    picture.paint(RED, |_, _| true);
    assert!(
        picture
            .feed(&mut sensor)
            .status
            .contains(Status::IMAGE_SATURATED)
    );
}

#[test]
fn a_crowd_is_ambiguous() {
    let mut picture = Picture::new(&QVGA);
    for column in 0..5 {
        for row in 0..4 {
            let at = (
                40.0 + 60.0 * f64::from(column),
                30.0 + 60.0 * f64::from(row),
            );
            picture.disc(RED, at, 17.0);
        }
    }
    let seen = picture.feed(&mut tared(QVGA));
    assert!(
        seen.status.contains(Status::MARKERS_AMBIGUOUS),
        "{:?}",
        names(&seen)
    );
}

#[test]
fn a_fifth_disc_of_any_size_does_not_hide_the_four() {
    let pattern = Pattern::at_rest(QVGA);
    for diameter in [8.0, 19.0, 30.0, 60.0] {
        let mut picture = pattern.draw();
        picture.disc(RED, (159.5, 119.5), diameter);
        let seen = picture.feed(&mut shared());
        let markers = trusted(&seen).unwrap_or_else(|| panic!("{diameter}: {:?}", names(&seen)));
        assert!(pattern.error(&markers) < 0.3, "{diameter}");
    }
}

#[test]
fn merged_markers_give_no_force() {
    let mut sensor = tared(QVGA);
    let rest = Pattern::at_rest(QVGA);
    for (a, b) in [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)] {
        let ((ax, ay), (bx, by)) = (rest.center_of(a), rest.center_of(b));
        let mut picture = rest.draw();
        // A bridge three pixels wide.
        let length = (bx - ax).hypot(by - ay);
        picture.paint(RED, |x, y| {
            let along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length;
            let aside = ((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length;
            (0.0..=length).contains(&along) && aside.abs() <= 1.5
        });
        assert_eq!(trusted(&picture.feed(&mut sensor)), None, "{a} and {b}");
    }
}

#[test]
fn a_marker_on_the_border_is_cut() {
    let mut sensor = sensor(QVGA, None);
    let rest = Pattern::at_rest(QVGA);
    let reach = 119.5 - (rest.center_of(2).1 - 119.5);
    for beyond in 0..20 {
        let shift = (0.0, reach - 9.0 + f64::from(beyond));
        let pattern = Pattern { shift, ..rest };
        let seen = pattern.draw().feed(&mut sensor);
        if let Some(markers) = seen.markers {
            assert!(pattern.error(&markers) < 0.3, "{beyond}");
        } else {
            assert!(seen.status.contains(Status::MARKERS_MISSING) || beyond < 1);
        }
    }
}

fn moving() -> impl Strategy<Value = Pattern> {
    let shift = (-8.0..8.0f64, -8.0..8.0f64);
    let parts = (shift, 1.0..1.4f64, -4.0..4.0f64, -2.0..15.0f64);
    parts.prop_map(|(shift, scale, turn, tilt)| Pattern {
        shift,
        scale,
        turn,
        tilt,
        ..Pattern::at_rest(QVGA)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Discs of whole pixels come out implausible in fewer than 1 of 10,000 patterns.
    #[test]
    fn moving_patterns_are_found(patterns in proptest::collection::vec(moving(), 40)) {
        let mut refused = 0;
        for pattern in patterns {
            let seen = pattern.draw().feed(&mut shared());
            match trusted(&seen) {
                Some(markers) => prop_assert!(pattern.error(&markers) < 0.35),
                None => {
                    let is_implausible = seen.status.contains(Status::MARKERS_IMPLAUSIBLE);
                    prop_assert!(is_implausible, "{:?}", names(&seen));
                    refused += 1;
                }
            }
        }
        prop_assert!(refused <= 1, "{} of 40", refused);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// A disc next to the four, larger, smaller or of their size, never moves them.
    #[test]
    fn a_fifth_disc_is_distinguished_or_refused(
        x in 0.0..320.0f64,
        y in 0.0..240.0f64,
        diameter in 3.0..60.0f64,
    ) {
        let pattern = Pattern::at_rest(QVGA);
        let mut picture = pattern.draw();
        picture.disc(RED, (x, y), diameter);
        if let Some(markers) = trusted(&picture.feed(&mut shared())) {
            prop_assert!(pattern.error(&markers) < 0.8, "{}", pattern.error(&markers));
        }
    }

    /// A disc in place of a hidden marker is refused, unless it covers most of the marker's place
    /// and has its size.
    #[test]
    fn a_stand_in_is_refused(
        hidden in 0usize..4,
        dx in -25.0..25.0f64,
        dy in -25.0..25.0f64,
        diameter in 8.0..40.0f64,
        scale in 1.0..1.4f64,
    ) {
        let pattern = Pattern { scale, ..Pattern::at_rest(QVGA) };
        let mut picture = Picture::new(&QVGA);
        for identity in (0..4).filter(|identity| *identity != hidden) {
            pattern.draw_marker(&mut picture, identity);
        }
        let (x, y) = pattern.center_of(hidden);
        picture.disc(RED, (x + dx, y + dy), diameter);
        if trusted(&picture.feed(&mut shared())).is_some() {
            let (across, _) = pattern.diameters();
            prop_assert!(dx.hypot(dy) < 6.0 * scale, "{} px away", dx.hypot(dy));
            prop_assert!((diameter / across - 1.0).abs() < 0.15, "{diameter} px for {across}");
        }
    }

    /// One marker cut straight, from any side.
    #[test]
    fn a_cut_marker_is_refused_or_hardly_moved(
        cut in 0usize..4,
        direction in 0.0..360.0f64,
        depth in 0.0..16.0f64,
        scale in 1.0..1.4f64,
    ) {
        let pattern = Pattern { scale, ..Pattern::at_rest(QVGA) };
        let mut picture = pattern.draw();
        let (cx, cy) = pattern.center_of(cut);
        let (sin, cos) = direction.to_radians().sin_cos();
        let edge = pattern.diameters().0 / 2.0 - depth;
        picture.paint_near(GREY, (cx, cy), 30.0, |x, y| {
            let (dx, dy) = (x - cx, y - cy);
            dx.hypot(dy) < 30.0 && dx * cos + dy * sin > edge
        });
        if let Some(markers) = trusted(&picture.feed(&mut shared())) {
            prop_assert!(pattern.error(&markers) < 0.9, "{} px", pattern.error(&markers));
        }
    }

    /// All edges equally eaten or swollen: sizes then do not fit the distance.
    #[test]
    fn eaten_and_swollen_edges_are_refused(swollen in -8.0..8.0f64, scale in 1.0..1.4f64) {
        let pattern = Pattern { swollen, scale, ..Pattern::at_rest(QVGA) };
        let seen = pattern.draw().feed(&mut shared());
        prop_assert!(trusted(&seen).is_none() || swollen.abs() < 2.2, "{swollen}");
        prop_assert!(trusted(&seen).is_some() || swollen.abs() > 0.5, "{swollen}");
    }

    /// One side of all markers in shadow: the remainders are all shifted in the same direction.
    #[test]
    fn a_shadow_on_one_side_of_all_is_refused(direction in 0.0..360.0f64, depth in 2.5..14.0f64) {
        let pattern = Pattern::at_rest(QVGA);
        let mut picture = pattern.draw();
        let (sin, cos) = direction.to_radians().sin_cos();
        let edge = pattern.diameters().0 / 2.0 - depth;
        for identity in 0..4 {
            let (cx, cy) = pattern.center_of(identity);
            picture.paint_near(GREY, (cx, cy), 30.0, |x, y| {
                let (dx, dy) = (x - cx, y - cy);
                dx.hypot(dy) < 30.0 && dx * cos + dy * sin > edge
            });
        }
        if let Some(markers) = trusted(&picture.feed(&mut shared())) {
            prop_assert!(pattern.error(&markers) < 0.9, "{} px", pattern.error(&markers));
        }
    }

    #[test]
    fn one_displaced_marker_strains_the_pattern(
        identity in 0usize..4,
        direction in 0.0..360.0f64,
        far in 6.5..60.0f64,
    ) {
        let mut pattern = Pattern::at_rest(QVGA);
        let (sin, cos) = direction.to_radians().sin_cos();
        pattern.displaced[identity] = (far * cos, far * sin);
        prop_assert_eq!(trusted(&pattern.draw().feed(&mut shared())), None);
    }
}

/// A copy of one sensor, because taring one takes longer than a test case.
fn shared() -> Box<Sensor<'static>> {
    std::thread_local!(static TARED: Box<Sensor<'static>> = tared(QVGA));
    TARED.with(Clone::clone)
}
