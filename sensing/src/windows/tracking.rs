//! Windows that follow the markers from frame to frame.

use super::{
    Blobs,
    list::Windows,
    rectangle::{Rectangle, WORD},
    scan::{Budget, Frame, scan_window},
};
use crate::{markers::Marker, scanner::Scanner, tables::Pixels};

/// A marker moves at most so much of its diameter from one frame to the next: one part in this many. At 320 × 240 and 39
/// frames a second that is 4 px, or some 10 mm/s of the film.
const MOTION_PART: u32 = 4;
/// A marker's area changes from one frame to the next by at most one part in this many.
const AREA_PART: u32 = 4;

/// Where the markers were.
#[derive(Clone, Debug, Default)]
pub struct Tracks {
    before: Option<[Marker; 4]>,
    tally: Tally,
}

/// How frames were looked at, since the start. Saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Tally {
    /// Only at the markers' windows.
    pub tracked: u32,
    /// At the windows, and then at the whole frame, or the next one: a marker at a window's edge, a jump of its area, a
    /// status.
    pub fallen_back: u32,
    /// At the whole frame at once, as it was not known where the markers were.
    pub searched: u32,
}

impl Tracks {
    /// Before the first frame.
    pub const fn new() -> Self {
        Tracks {
            before: None,
            tally: Tally {
                tracked: 0,
                fallen_back: 0,
                searched: 0,
            },
        }
    }

    /// How frames were looked at.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The smallest rectangle around all windows of the next frame, for a camera interface that crops; `None` when the
    /// whole frame is wanted.
    pub fn rectangle(&self, width: u16, height: u16, dilations: u8) -> Option<Rectangle> {
        let frame = Rectangle::of_frame(width, height);
        let window = |marker: &Marker| window(marker, dilations, frame);
        let windows = self.before.as_ref()?.iter().map(window);
        let all = windows.reduce(|all, one| all.joined(&one))?;
        Some(all.in_columns(frame))
    }

    /// Adds the whole blobs in the markers' windows to `found`; `None` when it is not known where the markers were, or one is
    /// cut.
    pub(crate) fn blobs<P: Pixels, const BLOBS: usize>(
        &self,
        scanner: &mut Scanner<BLOBS>,
        frame: &Frame<'_, P>,
        found: &mut Blobs,
    ) -> Option<()> {
        let mut windows = Windows::default();
        for marker in self.before.as_ref()? {
            let window = window(marker, frame.settings().dilations, frame.rectangle());
            windows.add(window, frame.rectangle()).ok()?;
        }
        let mut budget = Budget::of(frame);
        let mut all_whole = true;
        while let Some(window) = windows.pop() {
            scan_window(scanner, frame, &window, &mut budget, |blob| {
                let whole = frame.is_whole(&blob, &window);
                if blob.area >= frame.settings().min_area || !whole {
                    all_whole &= whole && found.push(blob).is_ok();
                }
            })?;
        }
        all_whole.then_some(())
    }

    /// Whether markers that were found in the windows are those of the frame before.
    pub(crate) fn fit(&self, markers: &[Marker; 4]) -> bool {
        let Some(before) = &self.before else {
            return false;
        };
        let steady = |(marker, before): (&Marker, &Marker)| {
            marker.area.abs_diff(before.area) <= before.area / AREA_PART
        };
        markers.iter().zip(before).all(steady)
    }

    /// The frame was measured by its windows alone.
    pub(crate) fn tracked(&mut self, markers: &[Marker; 4]) {
        self.before = Some(*markers);
        self.tally.tracked = self.tally.tracked.saturating_add(1);
    }

    /// The windows did not show the markers, and there is no more of this frame.
    pub(crate) fn lost(&mut self) {
        self.tally.fallen_back = self.tally.fallen_back.saturating_add(1);
        self.before = None;
    }

    /// The whole frame was looked at, as by [`Sensor::push_rows`](crate::pipeline::Sensor::push_rows); `markers` are what
    /// was found there.
    pub fn measured_whole(&mut self, markers: Option<&[Marker; 4]>) {
        let count = match self.before {
            Some(_) => &mut self.tally.fallen_back,
            None => &mut self.tally.searched,
        };
        *count = count.saturating_add(1);
        self.before = markers.copied();
    }
}

/// Where a marker may be in the next frame: 4 columns at most are given up so that all fit a word.
fn window(marker: &Marker, dilations: u8, frame: Rectangle) -> Rectangle {
    // √(4/π · area); for an ellipse, half of it is somewhat more.
    let across = (marker.area.saturating_mul(14) / 11).isqrt();
    let reach = across * 9 / 16 + across / MOTION_PART + u32::from(dilations) + 1;
    let reach = u16::try_from(reach).unwrap_or(u16::MAX);
    let pixel = |at: i32, end: u16| (at >> 16).clamp(0, i32::from(end) - 1) as u16;
    let (x, y) = (pixel(marker.x.0, frame.x1), pixel(marker.y.0, frame.y1));
    let center = Rectangle {
        x0: x,
        y0: y,
        x1: x + 1,
        y1: y + 1,
    };
    let window = center.widened(reach, reach, frame);
    if window.width() <= WORD || window.width() > WORD + 4 {
        return window;
    }
    let x0 = x.saturating_sub(WORD / 2 - 1) & !1;
    Rectangle {
        x0,
        x1: (x0 + WORD).min(frame.x1),
        ..window
    }
}
