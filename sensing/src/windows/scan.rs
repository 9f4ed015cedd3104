//! Full scans of windows.

use super::{Blobs, list::Windows, lone::lone_blob, rectangle::Rectangle};
use crate::{
    blob::Blob,
    scanner::{ScanSettings, Scanner},
    status::Status,
    tables::Pixels,
};

/// A frame in memory and how to read and scan it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<'f, P> {
    pixels: &'f P,
    data: &'f [u16],
    settings: ScanSettings,
    row_length: usize,
}

impl<'f, P: Pixels> Frame<'f, P> {
    /// `None` when `data` is not `settings.height` rows of `settings.width` pixels, one after the other.
    pub fn new(pixels: &'f P, data: &'f [u16], settings: ScanSettings) -> Option<Self> {
        let row_length = pixels.row_length(settings.width);
        let fits = data.len() == row_length * usize::from(settings.height);
        fits.then_some(Frame {
            pixels,
            data,
            settings,
            row_length,
        })
    }

    /// How it is scanned.
    pub fn settings(&self) -> &ScanSettings {
        &self.settings
    }

    /// How it is read.
    pub fn pixels(&self) -> &'f P {
        self.pixels
    }

    /// All of it.
    pub fn rectangle(&self) -> Rectangle {
        Rectangle::of_frame(self.settings.width, self.settings.height)
    }

    /// `u16`s of a row.
    pub fn row_length(&self) -> usize {
        self.row_length
    }

    /// The part of the frame from the first pixel of a rectangle to its last one, as it lies in memory.
    pub fn part(&self, part: &Rectangle) -> &'f [u16] {
        let at = |x: u16, y: u16| usize::from(y) * self.row_length + self.pixels.row_length(x);
        let last = part.y1.saturating_sub(1);
        self.data
            .get(at(part.x0, part.y0)..at(part.x1, last))
            .unwrap_or_default()
    }

    /// [`margin`] of this frame.
    pub fn margin(&self) -> u16 {
        margin(&self.settings)
    }

    /// [`is_whole`] of this frame.
    pub fn is_whole(&self, blob: &Blob, window: &Rectangle) -> bool {
        is_whole(blob, window, &self.settings)
    }
}

/// Columns between a blob and its window's edge that make sure that it is whole: beyond the dilation's reach the
/// mask is the full scan's, and one column of that must be empty.
fn margin(settings: &ScanSettings) -> u16 {
    u16::from(settings.dilations) + 1
}

/// Whether a blob that was found in a window of a frame is the full scan's: far enough from the window's edges, but for
/// those that are the frame's.
pub(crate) fn is_whole(blob: &Blob, window: &Rectangle, settings: &ScanSettings) -> bool {
    let margin = margin(settings);
    let around = Rectangle::of_blob(blob);
    let inside = |edge: u16, near: u16, outer: u16| near == outer || edge.abs_diff(near) >= margin;
    inside(around.x0, window.x0, 0)
        && inside(around.y0, window.y0, 0)
        && inside(around.x1, window.x1, settings.width)
        && inside(around.y1, window.y1, settings.height)
}

/// How a window of a frame is scanned.
pub(crate) fn settings_within(frame: ScanSettings, window: &Rectangle) -> ScanSettings {
    ScanSettings {
        width: window.width(),
        height: window.height(),
        // Parts of cut blobs must be known as such.
        min_area: 1,
        ..frame
    }
}

/// How many pixels may be looked at in windows: half of the frame, in all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget(u32);

impl Budget {
    /// For a frame.
    pub fn of<P: Pixels>(frame: &Frame<'_, P>) -> Self {
        Budget(frame.rectangle().pixels() / 2)
    }

    /// `None` when it is spent.
    fn spend(&mut self, window: &Rectangle) -> Option<()> {
        self.0 = self.0.checked_sub(window.pixels())?;
        Some(())
    }
}

/// Scans a window, and calls `visit` with each blob as it lies in the frame, however small. `None` when there are too
/// many.
pub(crate) fn scan_window<P: Pixels, const BLOBS: usize>(
    scanner: &mut Scanner<BLOBS>,
    frame: &Frame<'_, P>,
    window: &Rectangle,
    budget: &mut Budget,
    mut visit: impl FnMut(Blob),
) -> Option<()> {
    budget.spend(window)?;
    if let Some(found) = lone_blob(frame, window) {
        found.into_iter().for_each(visit);
        return Some(());
    }
    let settings = settings_within(*frame.settings(), window);
    scanner.begin_at((window.x0, window.y0), settings).ok()?;
    let rows = usize::from(window.height());
    scanner.push_apart(frame.pixels(), frame.part(window), frame.row_length(), rows);
    let scan = scanner.finish(frame.pixels());
    if scan.status != Status::OK {
        return None;
    }
    scan.blobs.iter().copied().for_each(&mut visit);
    Some(())
}

/// Adds all whole blobs in and around windows to `found`: each window grows until it cuts none. `None` when that leads too far.
pub(crate) fn whole_blobs<P: Pixels, const BLOBS: usize>(
    scanner: &mut Scanner<BLOBS>,
    frame: &Frame<'_, P>,
    windows: &mut Windows,
    found: &mut Blobs,
) -> Option<()> {
    let mut budget = Budget::of(frame);
    let mut settled = Windows::default();
    let whole_frame = frame.rectangle();
    while let Some(window) = windows.pop() {
        let mut grown = window;
        let before = found.len();
        let mut full = false;
        scan_window(scanner, frame, &window, &mut budget, |blob| {
            if !frame.is_whole(&blob, &window) {
                grown = grown.joined(&room_for(&blob, frame));
            } else if blob.area >= frame.settings().min_area {
                full |= found.push(blob).is_err();
            }
        })?;
        if full {
            return None;
        }
        if grown == window {
            settled.add(window, whole_frame).ok()?;
            continue;
        }
        found.truncate(before);
        // What it has grown over is scanned again as its part.
        while let Some(other) = settled.take_overlapping(&grown.in_words(whole_frame)) {
            grown = grown.joined(&other);
        }
        found.retain(|blob| !grown.contains(&Rectangle::of_blob(blob)));
        windows.add(grown, whole_frame).ok()?;
    }
    Some(())
}

/// Where a cut blob probably ends: as far again as it is seen.
fn room_for<P: Pixels>(blob: &Blob, frame: &Frame<'_, P>) -> Rectangle {
    let seen = Rectangle::of_blob(blob);
    let more = seen.width().max(seen.height()) / 2 + frame.margin();
    seen.widened(more, more, frame.rectangle())
}
