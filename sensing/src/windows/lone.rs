//! Windows that show one plain blob, as those around a marker do: scanned without labels.

use super::{
    rectangle::{Rectangle, WORD},
    scan::Frame,
};
use crate::{blob::Blob, moments::Moments, runs::Run, tables::Pixels};

/// Rows of the highest window that is looked at.
const MOST_ROWS: usize = 96;

/// What a window shows, when that is nothing or one blob with one run in each of its rows. It is what a
/// [`Scanner`](crate::scanner::Scanner) would find there. `None` when it may be something else, or is not a few whole words wide.
pub(super) fn lone_blob<P: Pixels>(
    frame: &Frame<'_, P>,
    window: &Rectangle,
) -> Option<Option<Blob>> {
    if frame.settings().dilations != 1 || !window.width().is_multiple_of(WORD) {
        return None;
    }
    match window.width() / WORD {
        1 => lone_blob_in::<P, 1>(frame, window),
        2 => lone_blob_in::<P, 2>(frame, window),
        3 => lone_blob_in::<P, 3>(frame, window),
        _ => None,
    }
}

/// The same for a window of `WORDS` words.
fn lone_blob_in<P: Pixels, const WORDS: usize>(
    frame: &Frame<'_, P>,
    window: &Rectangle,
) -> Option<Option<Blob>> {
    let (data, row_length) = (frame.part(window), frame.row_length());
    let height = usize::from(window.height());
    // With an empty row above and below.
    let mut mask = [[0; WORDS]; MOST_ROWS + 2];
    let rows = mask[1..].get_mut(..height)?.as_flattened_mut();
    frame
        .pixels()
        .mask_rows(data, row_length, window.width(), rows);
    let mut moments: Option<Moments> = None;
    let plain = for_each_run(mask.get(..height + 2)?, |y, run, passed| {
        let (row, placed) = (y + window.y0, run.moved(window.x0));
        let moments = match &mut moments {
            Some(moments) => {
                moments.add_run(placed, row);
                moments
            }
            none => none.insert(Moments::of_run(placed, row)),
        };
        moments.passed += passed;
        if frame.settings().weighted {
            let pixels = data.get(usize::from(y) * row_length..);
            let weights = frame.pixels().weigh(pixels.unwrap_or_default(), run);
            moments.weigh(weights.moved(window.x0), row);
        }
    });
    plain.then(|| moments.map(|moments| moments.blob()))
}

/// Dilates rows, the first and the last of which are not of the window, and calls `visit` with the number and the run of each, and how
/// many pixels of it were set before. Gives false, sooner or later, when these make something else than one plain blob.
#[inline(always)]
fn for_each_run<const WORDS: usize>(
    mask: &[[u32; WORDS]],
    mut visit: impl FnMut(u16, Run, u32),
) -> bool {
    let mut before = None;
    let mut ended = false;
    for (y, [above, here, below]) in (0..).zip(mask.array_windows()) {
        let mut columns = [0; WORDS];
        for (i, all) in columns.iter_mut().enumerate() {
            *all = above[i] | here[i] | below[i];
        }
        if columns.iter().fold(0, |any, word| any | word) == 0 {
            ended |= before.is_some();
            continue;
        }
        let Some(run) = only_run(&columns).filter(|_| !ended) else {
            return false;
        };
        let touches = |above: Run| above.x0 <= run.x1 + 1 && run.x0 <= above.x1 + 1;
        if !before.is_none_or(touches) {
            return false;
        }
        visit(y, run, here.iter().map(|word| word.count_ones()).sum());
        before = Some(run);
    }
    true
}

/// The run of a row, whose undilated words these are, when it has just one.
#[inline(always)]
fn only_run<const WORDS: usize>(columns: &[u32; WORDS]) -> Option<Run> {
    let mut found: Option<Run> = None;
    let (mut left, mut before) = (0, 0);
    for (i, &word) in columns.iter().enumerate() {
        let right = columns.get(i + 1).copied().unwrap_or(0);
        let row = word | word << 1 | word >> 1 | left >> 31 | right << 31;
        let starts = row & !(row << 1 | before);
        (left, before) = (word, row >> 31);
        if starts != 0 {
            if found.is_some() || starts & (starts - 1) != 0 {
                return None;
            }
            let x0 = (32 * i as u32 + starts.trailing_zeros()) as u16;
            found = Some(Run { x0, x1: x0 });
        }
        if let Some(run) = found.as_mut().filter(|_| row != 0) {
            run.x1 = (32 * i as u32 + 31 - row.leading_zeros()) as u16;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::{boxed::Box, vec, vec::Vec};

    use super::*;
    use crate::{
        picture::RED,
        scanner::{ScanSettings, Scanner},
        tables::BitTable,
        threshold::{ByteOrder, HsvBox},
        windows::settings_within,
    };

    const WIDTH: u16 = 130;
    const HEIGHT: u16 = 110;

    /// The blobs of a window by both ways.
    fn both(
        picture: &[u16],
        window: Rectangle,
        weighted: bool,
    ) -> (Option<Option<Blob>>, Vec<Blob>) {
        std::thread_local!(static TABLE: BitTable = BitTable::new(&HsvBox::RED, ByteOrder::Native).unwrap());
        let settings = ScanSettings {
            width: WIDTH,
            height: HEIGHT,
            dilations: 1,
            min_area: 1,
            weighted,
            max_runs: u32::MAX,
        };
        TABLE.with(|table| {
            let frame = Frame::new(table, picture, settings).unwrap();
            let mut scanner = Box::new(Scanner::<64>::new());
            let origin = (window.x0, window.y0);
            scanner
                .begin_at(origin, settings_within(settings, &window))
                .unwrap();
            let rows = usize::from(window.height());
            scanner.push_apart(table, frame.part(&window), frame.row_length(), rows);
            let blobs = scanner.finish(table).blobs.to_vec();
            (lone_blob(&frame, &window), blobs)
        })
    }

    fn window(x0: u16, y0: u16, words: u16, height: u16) -> Rectangle {
        Rectangle {
            x0,
            y0,
            x1: x0 + words * WORD,
            y1: y0 + height,
        }
    }

    proptest! {
        /// An ellipse, cut or whole, and at times a few pixels more.
        #[test]
        fn it_is_what_a_scanner_finds(
            (x, y) in (0.0..130.0_f64, 0.0..110.0_f64),
            (a, b) in (0.5..40.0_f64, 0.5..50.0_f64),
            more in prop::collection::vec((0..130_usize, 0..110_usize), 0..3),
            few in any::<bool>(),
            (left, top, words, height) in (0..=34_u16, 0..=14_u16, 1..=3_u16, 1..=96_u16),
            shade in any::<u16>(),
            weighted in any::<bool>(),
        ) {
            let mut picture = vec![0; usize::from(WIDTH) * usize::from(HEIGHT)];
            for (i, pixel) in picture.iter_mut().enumerate() {
                let (px, py) = ((i % 130) as f64, (i / 130) as f64);
                if ((px - x) / a).hypot((py - y) / b) <= 1.0 {
                    *pixel = RED ^ (shade.rotate_left(i as u32) & 0x0821);
                }
            }
            for (x, y) in more.into_iter().filter(|_| few) {
                picture[y * 130 + x] = RED;
            }
            let (lone, blobs) = both(&picture, window(left, top, words, height), weighted);
            match lone {
                Some(blob) => prop_assert_eq!(blob.as_slice(), blobs),
                None => prop_assert!(few, "an ellipse is plain"),
            }
        }

        #[test]
        fn whatever_it_takes_is_what_a_scanner_finds(
            bits in prop::collection::vec(prop::bool::weighted(0.01), 130 * 110),
            (words, height) in (1..=3_u16, 1..=12_u16),
        ) {
            let picture: Vec<u16> = bits.into_iter().map(|bit| if bit { RED } else { 0 }).collect();
            let (lone, blobs) = both(&picture, window(7, 5, words, height), false);
            if let Some(blob) = lone {
                prop_assert_eq!(blob.as_slice(), blobs);
            }
        }
    }

    #[test]
    fn a_full_window_is_one_blob() {
        let picture = vec![RED; usize::from(WIDTH) * usize::from(HEIGHT)];
        let (lone, blobs) = both(&picture, window(0, 0, 3, 96), true);
        assert_eq!(lone.unwrap().as_slice(), blobs);
        assert_eq!(blobs[0].area, 96 * 96);
    }

    #[test]
    fn a_disc_is_taken_and_two_are_not() {
        let mut picture = vec![0; usize::from(WIDTH) * usize::from(HEIGHT)];
        let mut disc = |x: usize, y: usize| {
            for (row, column) in (0..9).flat_map(|row| (0..9).map(move |column| (row, column))) {
                if (row as i32 - 4).pow(2) + (column as i32 - 4).pow(2) <= 18 {
                    picture[(y + row) * usize::from(WIDTH) + x + column] = RED;
                }
            }
            both(&picture, window(4, 4, 1, 40), false).0
        };
        assert!(disc(10, 8).unwrap().is_some());
        assert_eq!(disc(22, 24), None);
    }
}
