//! Every n-th row first.

use super::{
    Blobs,
    list::Windows,
    rectangle::Rectangle,
    scan::{Frame, whole_blobs},
};
use crate::{
    geometry::Geometry,
    mask::{MAX_WORDS, any_set, words_of},
    runs::{Run, for_each_run},
    scanner::Scanner,
    tables::Pixels,
    units::Px,
};

/// A marker at rest is at least so many steps across: smaller ones, near the edge or foreshortened, are hit, too.
const STEPS_ACROSS: u32 = 3;
/// The longest step, rows.
const LONGEST_STEP: u32 = 4;

/// From one row that is looked at to the next: 4 at 800 × 600 and at 320 × 240, 2 at 160 × 120.
///
/// Every blob that is at least so many rows high before dilation is hit.
pub(crate) fn step(geometry: &Geometry) -> u16 {
    // Diameter of a disc: √(4/π · area).
    let across = (geometry.rest_area(Px(0)).saturating_mul(14) / 11).isqrt();
    (across / STEPS_ACROSS).clamp(1, LONGEST_STEP) as u16
}

/// Adds the whole blobs of a frame that every `step`-th row hits, each of at least the minimum area, and perhaps others, to
/// `found`. `None` when a full scan is no slower.
pub(crate) fn coarse_blobs<P: Pixels, const BLOBS: usize>(
    scanner: &mut Scanner<BLOBS>,
    frame: &Frame<'_, P>,
    step: u16,
    found: &mut Blobs,
) -> Option<()> {
    let mut windows = Windows::default();
    hits(frame, step, &mut windows)?;
    whole_blobs(scanner, frame, &mut windows, found)
}

/// Adds windows around all that the coarse rows hit; `None` when there are too many.
fn hits<P: Pixels>(frame: &Frame<'_, P>, step: u16, windows: &mut Windows) -> Option<()> {
    let width = frame.settings().width;
    let mut room = Ok(());
    let mut mask = [0; MAX_WORDS];
    for y in (step / 2..frame.settings().height).step_by(usize::from(step)) {
        let row = Rectangle {
            y0: y,
            y1: y + 1,
            ..frame.rectangle()
        };
        let mask = mask.get_mut(..words_of(width))?;
        frame.pixels().mask_row(frame.part(&row), mask);
        if !any_set(mask) {
            continue;
        }
        for_each_run(mask, |run| {
            if room.is_ok() {
                room = windows.add(around(run, y, step, frame), frame.rectangle());
            }
        });
        room.ok()?;
    }
    Some(())
}

/// A blob that is hit in this run goes on at most so far, when it is a disc: to just before the next coarse rows, and
/// little farther to the sides.
fn around<P: Pixels>(run: Run, y: u16, step: u16, frame: &Frame<'_, P>) -> Rectangle {
    let hit = Rectangle {
        x0: run.x0,
        y0: y,
        x1: run.x1 + 1,
        y1: y + 1,
    };
    // What the dilation adds on top of the margin that a whole blob needs.
    let margin = 2 * frame.margin();
    hit.widened(margin + 1, step + margin, frame.rectangle())
}
