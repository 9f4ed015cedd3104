//! Compares the scanner with a pixel-by-pixel reference on random masks.

use super::reference::{Mask, scan, settings};
use hivtac_sensor::markers::scanner::{ScanSettings, Scanner};
use hivtac_sensor::markers::tables::{ByteTable, Pixels, Table};
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, HsvBox};
use proptest::{collection::vec, prelude::*};

/// Enough for every blob of the masks here: a blob needs a 2×2 cell of its own.
const ALL: usize = 100 * 30 / 4 + 200;

thread_local!(static TABLE: Box<ByteTable> =
    Box::new(ByteTable::new(&HsvBox::RED, ByteOrder::Swapped).unwrap()));

/// Masks of any width around the borders of words, from sparse to dense. Near a density of 0.4,
/// where blobs percolate, labels join in the most tangled ways.
fn masks() -> impl Strategy<Value = Mask> {
    (1..=100_usize, 1..=30_usize, 0.02..0.98_f64).prop_flat_map(|(width, height, density)| {
        vec(prop::bool::weighted(density), width * height)
            .prop_map(move |bits| Mask::from_bits(width, bits))
    })
}

/// Masks whose pixels come in blocks, so that runs are long and blobs large.
fn coarse_masks() -> impl Strategy<Value = Mask> {
    (masks(), 1..=4_usize, 1..=3_usize).prop_map(|(mask, across, down)| {
        let width = (mask.width * across).min(100);
        let height = (mask.height * down).min(30);
        Mask::from_fn(width, height, |x, y| mask.get(x / across, y / down))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn blobs_are_those_of_a_flood_fill(
        mask in prop_oneof![masks(), coarse_masks()],
        dilations in 0..=3_u8,
        min_area in prop_oneof![0..3_u32, 0..60_u32],
    ) {
        let mut scanner = Scanner::<ALL>::new();
        let scan = scan(&mut scanner, &mask, dilations, min_area);
        let expected = mask.dilated(dilations).blobs(min_area);
        prop_assert_eq!(scan.status, Status::OK);
        prop_assert_eq!(scan.set_pixels, mask.set_pixels());
        prop_assert_eq!(scan.blobs, expected.as_slice());
    }

    #[test]
    fn overflow_is_said_exactly_when_blobs_are_missing(mask in masks(), min_area in 0..4_u32) {
        let mut scanner = Scanner::<8>::new();
        let scan = scan(&mut scanner, &mask, 0, min_area);
        let expected = mask.blobs(min_area);
        let overflows = expected.len() > 8;
        prop_assert_eq!(scan.status.contains(Status::BLOB_OVERFLOW), overflows);
        prop_assert_eq!(scan.blobs, &expected[..expected.len().min(8)]);
    }

    /// Rows in which nearly every second pixel is set hold the most runs and labels there can be.
    #[test]
    fn labels_suffice_for_the_busiest_rows(
        width in 790..=800_usize,
        flips in vec((0..800_usize, 0..12_usize), 0..200),
        phases in vec(0..4_usize, 12),
    ) {
        let mask = Mask::from_fn(width, 12, |x, y| {
            let dots = phases[y] < 2 && x % 2 == phases[y];
            dots != flips.contains(&(x, y))
        });
        let mut scanner = Scanner::<2400>::new();
        let scan = scan(&mut scanner, &mask, 0, 1);
        prop_assert_eq!(scan.status, Status::OK);
        prop_assert_eq!(scan.blobs.to_vec(), mask.blobs(1));
    }

    #[test]
    fn a_scanner_remembers_nothing_of_the_frame_before(
        before in masks(),
        mask in masks(),
        rows in 0..30_usize,
        dilations in [0..=3_u8, 0..=3_u8],
    ) {
        let mut scanner = Scanner::<ALL>::new();
        scanner.begin(settings(&before, dilations[0], 1)).unwrap();
        for _ in 0..rows.min(before.height) {
            scanner.push_mask_row(&vec![0x5f31_ffff; before.width.div_ceil(32)]);
        }
        let mut fresh = Scanner::<ALL>::new();
        let expected = scan(&mut fresh, &mask, dilations[1], 1);
        prop_assert_eq!(scan(&mut scanner, &mask, dilations[1], 1), expected);
    }

    #[test]
    fn pixels_count_as_the_table_says(
        width in 1..=100_usize,
        pixels in vec(any::<u16>(), 100..2000),
        swapped in any::<bool>(),
    ) {
        let order = if swapped { ByteOrder::Swapped } else { ByteOrder::Native };
        let table = ByteTable::new(&HsvBox::RED, order).unwrap();
        let rows: Vec<&[u16]> = pixels.chunks_exact(width).take(800).collect();
        let mask = Mask::from_fn(width, rows.len(), |x, y| table.accepts(rows[y][x]));
        let mut scanner = Scanner::<ALL>::new();
        scanner.begin(settings(&mask, 1, 1)).unwrap();
        rows.iter().for_each(|row| scanner.push_row(&table, row));
        let mut by_mask = Scanner::<ALL>::new();
        prop_assert_eq!(scanner.finish(&table), scan(&mut by_mask, &mask, 1, 1));
    }

    /// For any bands in which rows arrive.
    #[test]
    fn weights_are_those_of_the_blobs_pixels(
        width in 1..=70_usize,
        height in 1..=12_usize,
        seeds in vec((any::<u16>(), prop::bool::weighted(0.3)), 70 * 12),
        dilations in 0..=3_u8,
        bands in vec(1..=5_usize, 12),
    ) {
        let pixels: Vec<u16> = seeds
            .iter()
            .map(|(value, red)| if *red { 0x00d8 | value & 0x20e7 } else { *value })
            .collect();
        let pixels = &pixels[..width * height];
        let table = TABLE.with(Clone::clone);
        let mask = Mask::from_fn(width, height, |x, y| table.accepts(pixels[y * width + x]));
        let weight = |x, y| table.weight(&pixels[y * width..], x as u16);
        let expected = mask.dilated(dilations).weighted_blobs(1, weight);
        let settings = ScanSettings { weighted: true, ..settings(&mask, dilations, 1) };
        let mut scanner = Scanner::<ALL>::new();
        scanner.begin(settings).unwrap();
        pixels.chunks(width).for_each(|row| scanner.push_row(&*table, row));
        prop_assert_eq!(scanner.finish(&*table).blobs, expected.as_slice());
        scanner.begin(settings).unwrap();
        let mut rest = pixels;
        for band in bands.iter().map(|rows| rows * width) {
            let (rows, below) = rest.split_at(band.min(rest.len()));
            scanner.push_rows(&*table, rows);
            rest = below;
        }
        let scan = scanner.finish(&*table);
        prop_assert_eq!(scan.status, Status::OK);
        prop_assert_eq!(scan.blobs, expected.as_slice());
        // Rows that stay in memory, all of them or just enough.
        for enough in [height, usize::from(dilations)] {
            scanner.begin(settings).unwrap();
            let mut y = 0;
            for rows in &bands {
                let next = height.min(y + rows);
                let above = &pixels[y.saturating_sub(enough) * width..y * width];
                scanner.push_rows_below(&*table, above, &pixels[y * width..next * width]);
                y = next;
            }
            let scan = scanner.finish(&*table);
            prop_assert_eq!(scan.status, Status::OK);
            prop_assert_eq!(scan.blobs, expected.as_slice());
        }
    }
}
