//! Tests frames at the limits: full, empty, at every border, with the most runs and labels, the
//! largest.

use super::reference::{Mask, scan, settings};
use hivtac_sensor::markers::beside::Beside;
use hivtac_sensor::markers::blob::Blob;
use hivtac_sensor::markers::scanner::{
    MAX_DILATIONS, MAX_HEIGHT, MAX_WIDTH, ScanSettings, Scanner,
};
use hivtac_sensor::markers::tables::ByteTable;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, HsvBox};
use hivtac_terms::units::Px;

/// The blobs of a mask without dilation, after checking them against the reference.
fn checked<const BLOBS: usize>(mask: &Mask, min_area: u32) -> Vec<Blob> {
    let mut scanner = Scanner::<BLOBS>::new();
    let found = scan(&mut scanner, mask, 0, min_area);
    assert_eq!(found.status, Status::OK);
    assert_eq!(found.set_pixels, mask.set_pixels());
    assert_eq!(found.blobs, mask.blobs(min_area));
    found.blobs.to_vec()
}

/// The blob that fills a frame, by Gauss's sums.
fn full(width: u64, height: u64) -> Blob {
    let sum = |n: u64| n * (n - 1) / 2;
    let squares = |n: u64| n * (n - 1) * (2 * n - 1) / 6;
    Blob {
        area: (width * height) as u32,
        passed: (width * height) as u32,
        sum_x: sum(width) * height,
        sum_y: sum(height) * width,
        sum_xx: squares(width) * height,
        sum_xy: sum(width) * sum(height),
        sum_yy: squares(height) * width,
        sum_xxx: sum(width).pow(2) * height,
        sum_xxy: squares(width) * sum(height),
        sum_xyy: sum(width) * squares(height),
        sum_yyy: sum(height).pow(2) * width,
        weight: 0,
        weight_x: 0,
        weight_y: 0,
        beside: Beside::NONE,
        x0: 0,
        y0: 0,
        x1: width as u16 - 1,
        y1: height as u16 - 1,
    }
}

/// The same with pixels of the largest weight.
fn heaviest(width: u64, height: u64) -> Blob {
    let full = full(width, height);
    Blob {
        weight: 127 * full.area,
        weight_x: 127 * full.sum_x,
        weight_y: 127 * full.sum_y,
        ..full
    }
}

#[test]
fn an_all_red_frame_is_one_exact_blob() {
    let table = ByteTable::new(&HsvBox::RED, ByteOrder::Swapped).unwrap();
    let largest = (u64::from(MAX_WIDTH), u64::from(MAX_HEIGHT));
    for (width, height) in [(1, 1), (320, 240), (800, 600), largest] {
        for dilations in 0..=MAX_DILATIONS {
            let mut scanner = Scanner::<1>::new();
            let mask = Mask::from_fn(width as usize, height as usize, |_, _| true);
            let settings = ScanSettings {
                weighted: true,
                ..settings(&mask, dilations, 1)
            };
            scanner.begin(settings).unwrap();
            for _ in 0..height {
                scanner.push_row(&table, &vec![0x00f8; width as usize]);
            }
            let scan = scanner.finish(&table);
            assert_eq!(
                (scan.status, scan.set_pixels),
                (Status::OK, (width * height) as u32)
            );
            assert_eq!(scan.blobs, [heaviest(width, height)]);
        }
    }
}

#[test]
fn the_largest_full_frame_has_exact_derived_moments() {
    let blob = heaviest(u64::from(MAX_WIDTH), u64::from(MAX_HEIGHT));
    let (x, y) = blob.centroid();
    assert_eq!(blob.weighted_centroid(), Some((x, y)));
    assert_eq!((x, y), (Px(Px::ONE.0 * 799 / 2), Px(Px::ONE.0 * 799 / 2)));
    // A w × h rectangle: Σ(x − x̄)² = area · (w² − 1) / 12.
    let area = u64::from(blob.area);
    let variance = area * (area * (800 * 800 - 1) / 12);
    assert_eq!(area * blob.sum_xx - blob.sum_x.pow(2), variance);
    assert_eq!(area * blob.sum_yy - blob.sum_y.pow(2), variance);
    assert_eq!(area * blob.sum_xy, blob.sum_x * blob.sum_y);
}

#[test]
fn an_all_black_frame_has_no_blob() {
    for dilations in 0..=MAX_DILATIONS {
        let mask = Mask::from_fn(800, 600, |_, _| false);
        let mut scanner = Scanner::<1>::new();
        let scan = scan(&mut scanner, &mask, dilations, 0);
        assert_eq!((scan.status, scan.set_pixels), (Status::OK, 0));
        assert!(scan.blobs.is_empty());
    }
}

#[test]
fn one_pixel_counts_wherever_it_lies() {
    let (width, height) = (67, 9);
    for i in 0..width * height {
        let mask = Mask::from_fn(width, height, |x, y| y * width + x == i);
        for dilations in 0..=MAX_DILATIONS {
            let mut scanner = Scanner::<2>::new();
            let scan = scan(&mut scanner, &mask, dilations, 1);
            assert_eq!(scan.status, Status::OK);
            assert_eq!(scan.blobs, mask.dilated(dilations).blobs(1));
        }
    }
}

#[test]
fn blobs_on_every_border_and_corner_of_the_largest_frame() {
    let near = |v: usize, last: usize| [0, last / 2, last].iter().any(|at| v.abs_diff(*at) < 7);
    let mask = Mask::from_fn(800, 800, |x, y| near(x, 799) && near(y, 799));
    let blobs = checked::<9>(&mask, 1);
    assert_eq!(blobs.len(), 9);
    assert_eq!(blobs[0].area, 7 * 7);
    assert_eq!(blobs[8].centroid(), (Px::from_int(796), Px::from_int(796)));
}

#[test]
fn checkerboards_hang_together_by_their_corners() {
    for (cell, width, height) in [(1, 320, 240), (2, 320, 240), (1, 799, 599), (1, 800, 600)] {
        let mask = Mask::from_fn(width, height, |x, y| (x / cell + y / cell) % 2 == 0);
        assert_eq!(checked::<1>(&mask, 1).len(), 1);
    }
}

#[test]
fn a_lattice_of_dots_overflows_or_is_dropped_by_area() {
    let mask = Mask::from_fn(800, 600, |x, y| x % 2 == 0 && y % 2 == 0);
    let mut scanner = Scanner::<64>::new();
    let overflowing = scan(&mut scanner, &mask, 0, 1);
    assert_eq!(overflowing.status, Status::BLOB_OVERFLOW);
    assert_eq!(overflowing.set_pixels, 400 * 300);
    // The same storage is enough when the dots are too small, and for one blob among them.
    assert!(checked::<64>(&mask, 2).is_empty());
    let with_disc = Mask::from_fn(800, 600, |x, y| {
        mask.get(x, y) || x.abs_diff(400) + y.abs_diff(300) < 20
    });
    assert_eq!(checked::<1>(&with_disc, 2).len(), 1);
    // Dilation joins them all.
    let mut joined = Scanner::<1>::new();
    let all = Blob {
        passed: 400 * 300,
        ..full(800, 600)
    };
    assert_eq!(scan(&mut joined, &mask, 1, 1).blobs, [all]);
}

#[test]
fn a_full_house_is_no_overflow() {
    let mask = Mask::from_fn(15, 3, |x, y| x % 2 == 0 && y == 1);
    assert_eq!(checked::<8>(&mask, 1).len(), 8);
    let mut scanner = Scanner::<7>::new();
    assert_eq!(
        scan(&mut scanner, &mask, 0, 1).status,
        Status::BLOB_OVERFLOW
    );
    // The next frame is not affected.
    assert_eq!(scan(&mut scanner, &mask, 0, 2).status, Status::OK);
}

#[test]
fn combs_open_the_most_labels_and_join_them() {
    let down = Mask::from_fn(800, 600, |x, y| x % 2 == 0 || y == 599);
    let up = Mask::from_fn(800, 600, |x, y| x % 2 == 0 || y == 0);
    let both = Mask::from_fn(799, 600, |x, y| {
        x % 2 == 0 && y != 300 || y == 599 || y == 0
    });
    assert_eq!(checked::<1>(&down, 1).len(), 1);
    assert_eq!(checked::<1>(&up, 1).len(), 1);
    assert_eq!(checked::<2>(&both, 1).len(), 2);
}

/// Teeth that join two by two, then four by four, and so on: paths in the forest grow at every
/// level.
#[test]
fn a_tournament_of_teeth_ends_in_one_blob() {
    let mask = Mask::from_fn(512, 40, |x, y| {
        let level = y / 4;
        let tooth = x % 2 == 0 && x % (1 << level.max(1)) == 0;
        let bar = y % 4 == 3 && x % (2 << level.max(1)) <= 1 << level.max(1);
        tooth || bar
    });
    checked::<512>(&mask, 1);
}

/// A one-pixel spiral with one-pixel gaps, from the outer corner inwards.
fn spiral(size: usize) -> Mask {
    let ring = |x: usize, y: usize| x.min(y).min(size - 1 - x).min(size - 1 - y);
    Mask::from_fn(size, size, |x, y| {
        let k = ring(x, y);
        // The left side opens one pixel below each ring's upper left corner, and a bridge leads
        // inwards there.
        let gap = x == k && y == k + 1 && k.is_multiple_of(2);
        let bridge = x == k && y == k + 1 && !k.is_multiple_of(2);
        (k.is_multiple_of(2) && !gap) || bridge
    })
}

#[test]
fn spirals_and_nested_rings_keep_their_blobs_apart() {
    checked::<512>(&spiral(399), 1);
    let rings = Mask::from_fn(400, 400, |x, y| x.min(y).min(399 - x).min(399 - y) % 2 == 0);
    assert_eq!(checked::<100>(&rings, 1).len(), 100);
    let cups = Mask::from_fn(399, 200, |x, y| {
        let side = x.min(398 - x);
        side % 2 == 0 && y + side < 200 || (199 - y) % 2 == 0 && side >= 199 - y
    });
    checked::<512>(&cups, 1);
}

#[test]
fn a_spiral_by_hand() {
    let mask = Mask::from_text(&[
        "#########",
        "........#",
        "#######.#",
        "#.....#.#",
        "#.###.#.#",
        "#.#...#.#",
        "#.#####.#",
        "#.......#",
        "#########",
    ]);
    assert_eq!(checked::<1>(&mask, 1).len(), 1);
}

#[test]
fn salt_does_not_fill_the_storage() {
    let salt = |x: usize, y: usize| {
        (x as u32 ^ (y as u32) << 10).wrapping_mul(0x9e37_79b1) >> 16 & 31 == 0
    };
    let disc = |x: usize, y: usize| {
        [(200, 150), (600, 150), (600, 450), (200, 450)]
            .iter()
            .any(|&(cx, cy)| x.abs_diff(cx).pow(2) + y.abs_diff(cy).pow(2) < 256)
    };
    let mask = Mask::from_fn(800, 600, |x, y| salt(x, y) || disc(x, y));
    assert!(mask.blobs(1).len() > 5000);
    assert_eq!(checked::<4>(&mask, 200).len(), 4);
}

/// A frame with exactly the allowed number of runs is scanned whole; one more run ends it, and the
/// next frame is not affected.
#[test]
fn a_frame_of_more_runs_than_it_may_have_is_left() {
    let mask = Mask::from_fn(64, 20, |x, _| x % 2 == 0);
    let mut scanner = Scanner::<64>::new();
    // The row that exceeds the number of runs is the last one that is scanned.
    for (max_runs, status, set_pixels) in [
        (640, Status::OK, 640),
        (639, Status::BLOB_OVERFLOW, 640),
        (0, Status::BLOB_OVERFLOW, 32),
        (u32::MAX, Status::OK, 640),
    ] {
        let settings = ScanSettings {
            max_runs,
            ..settings(&mask, 0, 1)
        };
        scanner.begin(settings).unwrap();
        (0..20).for_each(|y| scanner.push_mask_row(&mask.words(y)));
        let found = scanner.finish(&());
        assert_eq!(
            (found.status, found.set_pixels),
            (status, set_pixels),
            "{max_runs}"
        );
        if status == Status::OK {
            assert_eq!(found.blobs, mask.blobs(1));
        }
    }
}
