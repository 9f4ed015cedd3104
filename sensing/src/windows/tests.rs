//! What windows find is what the full scan finds.

use super::{Tracks, coarse_step};
use crate::{
    geometry::{Geometry, Preset},
    model::CentroidEstimator,
    picture::{Pattern, Picture, RED, sensor},
    pipeline::Sensor,
    settings::Settings,
    tables::{BitTable, Pixels, Table},
    threshold::{ByteOrder, HsvBox, ThresholdError},
};
use proptest::prelude::*;
use std::{boxed::Box, cell::Cell, vec::Vec};

const SMALL: Geometry = Geometry::preset(Preset::Ov7725, 320, 240);
const LARGE: Geometry = Geometry::preset(Preset::Paper, 800, 600);

/// A sensor that weighs pixels, dilates so often, and keeps blobs of every size.
fn weighing(geometry: Geometry, dilations: u8) -> Box<Sensor<'static>> {
    let mut sensor = Box::new(Sensor::new());
    let settings = Settings {
        dilations,
        centroid: CentroidEstimator::RednessWeighted,
        ..Settings::usual(geometry, ByteOrder::Native)
    };
    sensor.configure(settings, None).unwrap();
    sensor
}

fn pattern(geometry: Geometry) -> impl Strategy<Value = Pattern> {
    let shift = (-15.0..15.0, -15.0..15.0);
    let displaced = prop::array::uniform4((-3.0..3.0, -3.0..3.0));
    (shift, 0.85..1.2, -8.0..8.0, displaced).prop_map(move |(shift, scale, turn, displaced)| {
        Pattern {
            shift,
            scale,
            turn,
            displaced,
            ..Pattern::at_rest(geometry)
        }
    })
}

/// A red rectangle: place in parts of the picture, size in px.
type Speck = ((f64, f64), (usize, usize));

fn specks(most: usize, largest: usize) -> impl Strategy<Value = Vec<Speck>> {
    let place = (0.0..1.0, 0.0..1.0);
    prop::collection::vec((place, (1..=largest, 1..=largest)), 0..=most)
}

fn draw(pattern: &Pattern, specks: &[Speck]) -> Picture {
    let mut picture = pattern.draw();
    for ((x, y), (columns, rows)) in specks {
        let (left, top) = (
            (x * picture.width as f64) as usize,
            (y * picture.height as f64) as usize,
        );
        for row in top..(top + rows).min(picture.height) {
            for column in left..(left + columns).min(picture.width) {
                picture.pixels[row * picture.width + column] = RED;
            }
        }
    }
    picture
}

/// Measures coarsely and fully; asserts that markers of the full scan are found. Answers whether there were any.
fn same_as_full(sensor: &mut Sensor<'_>, picture: &Picture) -> bool {
    let full = picture.feed(sensor);
    let coarse = sensor.measure_frame(&picture.pixels);
    if full.markers.is_some() || coarse.markers.is_none() {
        assert_eq!(coarse, full);
    }
    full.markers.is_some()
}

#[test]
fn steps_are_at_most_a_third_of_a_marker() {
    let tiny = Geometry::preset(Preset::Ov7725, 160, 120);
    assert_eq!([LARGE, SMALL, tiny].map(|g| coarse_step(&g)), [4, 4, 2]);
}

#[test]
fn a_frame_of_another_size_is_incomplete() {
    use crate::status::Status;
    let mut sensor = sensor(SMALL, None);
    let picture = Pattern::at_rest(SMALL).draw();
    let short = &picture.pixels[..picture.pixels.len() - 1];
    let measurement = sensor.measure_frame(short);
    assert!(measurement.status.contains(Status::FRAME_INCOMPLETE));
}

#[test]
fn a_dark_and_an_all_red_frame_are_the_full_scans() {
    let mut sensor = sensor(SMALL, None);
    for color in [crate::picture::GREY, RED] {
        let mut picture = Picture::new(&SMALL);
        picture.paint(color, |_, _| true);
        let full = picture.feed(&mut sensor);
        assert_eq!(sensor.measure_frame(&picture.pixels), full);
    }
}

/// Counts the pixels that are looked up.
struct Counting(BitTable, Cell<u32>);

impl Table for Counting {
    const CLOSED: Self = Counting(BitTable::CLOSED, Cell::new(0));

    fn set(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> Result<(), ThresholdError> {
        self.0.set(hsv_box, order)
    }

    fn accepts(&self, raw: u16) -> bool {
        self.0.accepts(raw)
    }
}

impl Pixels for Counting {
    fn row_length(&self, width: u16) -> usize {
        self.0.row_length(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) {
        self.1.set(self.1.get() + row.len() as u32);
        self.0.mask_row(row, mask);
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        self.0.weight(row, column)
    }
}

#[test]
fn few_pixels_are_looked_at() {
    for (geometry, coarse, tracked) in [(LARGE, 29, 4), (SMALL, 56, 8)] {
        let mut sensor = Box::new(Sensor::<64, Counting>::new());
        let settings = Settings::usual(geometry, ByteOrder::Native);
        sensor.configure(settings, None).unwrap();
        let picture = Pattern::at_rest(geometry).draw();
        let mut tracks = Tracks::new();
        let mut percent = || {
            sensor.table().1.set(0);
            let seen = sensor.measure_tracked(&mut tracks, &picture.pixels);
            assert!(seen.markers.is_some());
            sensor.table().1.get() * 100 / picture.pixels.len() as u32
        };
        let percent = [percent(), percent()];
        assert!(percent[0] <= coarse && percent[1] <= tracked, "{percent:?}");
    }
}

/// A sweep over how fast the pattern moves to and fro, px per frame along x.
#[test]
fn tracking_falls_back_when_markers_leave_their_windows() {
    let mut tracked_at = Vec::new();
    for speed in [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0] {
        let mut sensor = weighing(SMALL, 1);
        let mut tracks = Tracks::new();
        for frame in 0..8 {
            let shift = (speed * f64::from(frame % 2), 0.3 * f64::from(frame));
            let picture = Pattern {
                shift,
                ..Pattern::at_rest(SMALL)
            }
            .draw();
            let full = picture.feed(&mut sensor);
            let seen = sensor.measure_tracked(&mut tracks, &picture.pixels);
            assert_eq!(seen, full, "{speed} px a frame");
        }
        let tally = tracks.tally();
        assert_eq!(tally.searched, 1);
        assert_eq!(tally.tracked + tally.fallen_back, 7);
        tracked_at.push(tally.tracked);
    }
    assert_eq!(
        tracked_at[..5],
        [7; 5],
        "up to 4 px a frame: {tracked_at:?}"
    );
    assert_eq!(tracked_at[7], 0, "12 px a frame: {tracked_at:?}");
}

#[test]
fn tracking_searches_after_markers_were_lost() {
    let mut sensor = sensor(SMALL, None);
    let mut tracks = Tracks::new();
    let (seen, dark) = (Pattern::at_rest(SMALL).draw(), Picture::new(&SMALL));
    for (picture, expected) in [
        (&seen, (0, 0, 1)),
        (&seen, (1, 0, 1)),
        (&dark, (1, 1, 1)),
        (&dark, (1, 1, 2)),
        (&seen, (1, 1, 3)),
        (&seen, (2, 1, 3)),
    ] {
        let full = picture.feed(&mut sensor);
        assert_eq!(sensor.measure_tracked(&mut tracks, &picture.pixels), full);
        let tally = tracks.tally();
        assert_eq!((tally.tracked, tally.fallen_back, tally.searched), expected);
    }
}

/// As with a camera interface that crops: only the rectangle comes.
#[test]
fn cropped_frames_give_what_whole_ones_give() {
    let mut sensor = weighing(SMALL, 1);
    let mut tracks = Tracks::new();
    for frame in 0..12 {
        let step = f64::from(frame);
        let jump = if frame == 8 { 40.0 } else { 0.0 };
        let shift = (1.5 * step - 10.0 + jump, 4.0 - step);
        let picture = Pattern {
            shift,
            ..Pattern::at_rest(SMALL)
        }
        .draw();
        let full = picture.feed(&mut sensor);
        let Some(window) = tracks.rectangle(320, 240, 1) else {
            tracks.measured_whole(full.markers.as_ref());
            assert!(frame == 0 || frame == 9);
            continue;
        };
        sensor.begin_cropped(window);
        for y in window.y0..window.y1 {
            let row = usize::from(y) * 320;
            let columns = row + usize::from(window.x0)..row + usize::from(window.x1);
            sensor.push_row(&picture.pixels[columns]);
        }
        let cropped = sensor.finish_cropped(&mut tracks, window);
        if frame == 8 {
            assert!(cropped.force.is_none() && cropped.markers.is_none());
        } else {
            assert_eq!(cropped, full, "frame {frame}");
        }
    }
    let tally = tracks.tally();
    assert_eq!(
        (tally.tracked, tally.fallen_back, tally.searched),
        (9, 1, 2)
    );
}

#[test]
fn the_rectangle_to_crop_to_holds_all_markers() {
    let mut sensor = sensor(SMALL, None);
    let mut tracks = Tracks::new();
    assert_eq!(tracks.rectangle(320, 240, 1), None);
    let measured = sensor.measure_tracked(&mut tracks, &Pattern::at_rest(SMALL).draw().pixels);
    let around = tracks.rectangle(320, 240, 1).unwrap();
    assert!(around.pixels() < 320 * 240 * 6 / 10, "{around:?}");
    for marker in measured.markers.unwrap() {
        let (x, y) = (marker.x.to_f64() as u16, marker.y.to_f64() as u16);
        assert!((around.x0 + 12..around.x1 - 12).contains(&x));
        assert!((around.y0 + 12..around.y1 - 12).contains(&y));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn coarse_finds_what_the_full_scan_finds(
        pattern in pattern(SMALL), specks in specks(30, 9), dilations in 0..=3_u8,
    ) {
        same_as_full(&mut weighing(SMALL, dilations), &draw(&pattern, &specks));
    }

    #[test]
    fn coarse_finds_clean_markers(pattern in pattern(LARGE)) {
        prop_assert!(same_as_full(&mut sensor(LARGE, None), &pattern.draw()));
    }

    /// Salt of the markers' own red.
    #[test]
    fn salt_ends_as_in_the_full_scan(seed in any::<u32>(), part in 1..60_u32) {
        let mut picture = Pattern::at_rest(SMALL).draw();
        let mut state = seed | 1;
        for pixel in &mut picture.pixels {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if (state >> 16) % 1000 < part {
                *pixel = RED;
            }
        }
        same_as_full(&mut weighing(SMALL, 1), &picture);
    }

    /// Markers within their windows are the full scan's, whatever else there is.
    #[test]
    fn tracking_gives_what_the_full_scan_gives(
        pattern in pattern(SMALL), steps in prop::collection::vec((-6.0..6.0, -6.0..6.0), 1..6), specks in specks(8, 6),
    ) {
        let mut sensor = weighing(SMALL, 1);
        let mut tracks = Tracks::new();
        let mut pattern = pattern;
        for (dx, dy) in steps {
            pattern.shift = (pattern.shift.0 + dx, pattern.shift.1 + dy);
            let picture = draw(&pattern, &specks);
            let full = picture.feed(&mut sensor);
            let seen = sensor.measure_tracked(&mut tracks, &picture.pixels);
            if full.markers.is_some() || seen.markers.is_none() {
                prop_assert_eq!(seen, full);
            }
        }
    }
}
