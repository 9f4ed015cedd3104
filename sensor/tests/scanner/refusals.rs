//! Tests frames, settings and boxes that do not fit: they are reported, never guessed.

use hivtac_sensor::markers::scanner::{ScanError, ScanSettings, Scanner};
use hivtac_sensor::markers::tables::{ByteTable, Table};
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, HsvBox, ThresholdError};

use super::reference::{Mask, scan, settings};

#[test]
fn missing_extra_and_wrong_rows_make_a_frame_incomplete() {
    let settings = ScanSettings {
        width: 40,
        height: 4,
        dilations: 1,
        min_area: 1,
        weighted: false,
        max_runs: u32::MAX,
        cleaned: false,
    };
    let status = |rows: &[usize]| {
        let mut scanner = Scanner::<4>::new();
        scanner.begin(settings).unwrap();
        rows.iter()
            .for_each(|words| scanner.push_mask_row(&vec![1; *words]));
        scanner.finish(&()).status
    };
    assert_eq!(status(&[2; 4]), Status::OK);
    for rows in [
        &[] as &[usize],
        &[2; 3],
        &[2; 5],
        &[2, 2, 1, 2],
        &[2, 3, 2, 2, 2],
        &[2, 0, 2, 2, 2],
    ] {
        assert_eq!(status(rows), Status::FRAME_INCOMPLETE, "{rows:?}");
    }
}

#[test]
fn pixel_rows_of_another_width_make_a_frame_incomplete() {
    let table = ByteTable::new(&HsvBox::RED, ByteOrder::Native).unwrap();
    for width in [0, 39, 41, 801, 70_000] {
        let mut scanner = Scanner::<4>::new();
        let mask = Mask::from_fn(40, 1, |_, _| false);
        scanner.begin(settings(&mask, 0, 1)).unwrap();
        scanner.push_row(&table, &vec![0xf800; width]);
        let scan = scanner.finish(&());
        assert_eq!(
            (scan.status, scan.set_pixels),
            (Status::FRAME_INCOMPLETE, 0)
        );
        assert!(scan.blobs.is_empty());
    }
}

#[test]
fn a_row_to_be_weighed_that_did_not_stay_in_memory_makes_a_frame_incomplete() {
    let table = ByteTable::new(&HsvBox::RED, ByteOrder::Native).unwrap();
    let mut pixels = [0; 40 * 6];
    pixels[40 * 3 + 7] = 0xf800;
    let (above, below) = pixels.split_at(40 * 3);
    for dilations in 0..=3 {
        let mask = Mask::from_fn(40, 6, |_, _| false);
        let settings = ScanSettings {
            weighted: true,
            ..settings(&mask, dilations, 1)
        };
        let mut scanner = Scanner::<4>::new();
        let mut status = |stayed: &[u16]| {
            scanner.begin(settings).unwrap();
            scanner.push_rows_below(&table, &[], above);
            scanner.push_rows_below(&table, stayed, below);
            scanner.finish(&table).status
        };
        assert_eq!(status(above), Status::OK);
        assert_eq!(
            status(&above[40 * (3 - usize::from(dilations))..]),
            Status::OK
        );
        if dilations > 0 {
            assert_eq!(
                status(&above[40 * (4 - usize::from(dilations))..]),
                Status::FRAME_INCOMPLETE
            );
        }
    }
}

#[test]
fn rows_without_a_frame_are_refused() {
    let mut scanner = Scanner::<4>::new();
    scanner.push_mask_row(&[]);
    scanner.push_mask_row(&[1]);
    assert_eq!(scanner.finish(&()).status, Status::FRAME_INCOMPLETE);
    let mask = Mask::from_fn(3, 1, |_, _| true);
    assert_eq!(scan(&mut scanner, &mask, 0, 1).status, Status::OK);
    let again = scanner.finish(&());
    assert_eq!((again.status, again.blobs.len()), (Status::OK, 1));
    scanner.push_mask_row(&[1]);
    assert_eq!(scanner.finish(&()).status, Status::FRAME_INCOMPLETE);
}

#[test]
fn bits_beyond_the_width_are_ignored() {
    let mut scanner = Scanner::<4>::new();
    let mask = Mask::from_fn(33, 1, |_, _| true);
    scanner.begin(settings(&mask, 0, 1)).unwrap();
    scanner.push_mask_row(&[u32::MAX, u32::MAX]);
    let scan = scanner.finish(&());
    assert_eq!((scan.status, scan.set_pixels), (Status::OK, 33));
    assert_eq!(scan.blobs, mask.blobs(1));
}

#[test]
fn settings_out_of_range_are_named() {
    let good = ScanSettings {
        width: 800,
        height: 800,
        dilations: 3,
        min_area: 0,
        weighted: false,
        max_runs: u32::MAX,
        cleaned: false,
    };
    let mut scanner = Scanner::<1>::new();
    assert_eq!(scanner.begin(good), Ok(()));
    for (bad, error) in [
        (ScanSettings { width: 0, ..good }, ScanError::Width(0)),
        (ScanSettings { width: 801, ..good }, ScanError::Width(801)),
        (ScanSettings { height: 0, ..good }, ScanError::Height(0)),
        (
            ScanSettings {
                height: 801,
                ..good
            },
            ScanError::Height(801),
        ),
        (
            ScanSettings {
                dilations: 4,
                ..good
            },
            ScanError::Dilations(4),
        ),
    ] {
        assert_eq!(scanner.begin(bad), Err(error));
        scanner.push_mask_row(&[1; 25]);
        let scan = scanner.finish(&());
        assert_eq!(
            (scan.status, scan.set_pixels),
            (Status::FRAME_INCOMPLETE, 0)
        );
    }
}

#[test]
fn boxes_without_meaning_are_named_and_change_nothing() {
    let red = HsvBox::RED;
    let mut table = ByteTable::new(&red, ByteOrder::Native).unwrap();
    let before = table.clone();
    for (bad, error) in [
        (
            HsvBox {
                hue_low: 180,
                ..red
            },
            ThresholdError::HueOutOfRange(180),
        ),
        (
            HsvBox {
                hue_high: 255,
                ..red
            },
            ThresholdError::HueOutOfRange(255),
        ),
        (
            HsvBox {
                saturation_low: 9,
                saturation_high: 8,
                ..red
            },
            ThresholdError::SaturationEmpty { low: 9, high: 8 },
        ),
        (
            HsvBox {
                value_low: 9,
                value_high: 8,
                ..red
            },
            ThresholdError::ValueEmpty { low: 9, high: 8 },
        ),
    ] {
        assert_eq!(table.set(&bad, ByteOrder::Native), Err(error));
        assert_eq!(table, before);
    }
}
