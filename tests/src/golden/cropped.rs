//! Frames of which the camera interface passes only a rectangle, as the firmware has it with its feature `tracking`.

use hivtac_sensing::pipeline::{Measurement, Sensor};
use hivtac_sensing::windows::{Rectangle, Tracks};

use super::marks::{counting_begins, counting_ends, last_band_begins};
use super::{BAND_ROWS, BLOBS};

/// Columns in which the firmware's rectangle begins and ends (`hivtac-capture`, `window.rs`).
const COLUMNS: u16 = 16;

/// What the firmware would capture of the next frame: the rectangle around the markers' windows, in its steps; `None` for
/// everything, when it is not known where they are. Columns and rows of a frame are multiples of the steps.
pub(super) fn window(sensor: &Sensor<'_, BLOBS>, tracks: &Tracks) -> Option<Rectangle> {
    let settings = sensor.settings();
    let (width, height) = (settings.geometry.width, settings.geometry.height);
    let around = tracks.rectangle(width, height, settings.dilations)?;
    Some(Rectangle {
        x0: around.x0 / COLUMNS * COLUMNS,
        y0: around.y0 / BAND_ROWS * BAND_ROWS,
        x1: around.x1.next_multiple_of(COLUMNS),
        y1: around.y1.next_multiple_of(BAND_ROWS),
    })
}

/// The rectangle's rows, one after the other, where the frame of so many columns was.
pub(super) fn crop<'f>(frame: &'f mut [u16], width: u16, window: &Rectangle) -> &'f [u16] {
    let columns = usize::from(window.x1 - window.x0);
    let mut end = 0;
    for y in window.y0..window.y1 {
        let start = usize::from(y) * usize::from(width) + usize::from(window.x0);
        frame.copy_within(start..start + columns, end);
        end += columns;
    }
    &frame[..end]
}

/// Measures the rectangle's rows as they arrive, in bands; `counted` by the instruction counter or not.
pub(super) fn measure(
    sensor: &mut Sensor<'_, BLOBS>,
    tracks: &mut Tracks,
    rows: &[u16],
    window: &Rectangle,
    counted: bool,
) -> Measurement {
    let band_pixels = usize::from(BAND_ROWS) * usize::from(window.x1 - window.x0);
    let mut bands = rows.chunks(band_pixels).peekable();
    if counted {
        counting_begins();
    }
    sensor.begin_cropped(*window);
    let mut above: &[u16] = &[];
    while let Some(band) = bands.next() {
        if bands.peek().is_none() {
            last_band_begins();
        }
        sensor.push_rows_below(above, band);
        above = band;
    }
    let measurement = sensor.finish_cropped(tracks, *window);
    counting_ends();
    measurement
}
