//! Rows in, blobs out: threshold, dilation, runs and labels, without a frame in memory.

use core::fmt;

use crate::markers::blob::Blob;
use crate::markers::dilate::{Dilation, MAX_ROWS};
use crate::markers::history::{Band, History};
use crate::markers::label::Labeller;
use crate::markers::majority::Majority;
use crate::markers::mask::{any_set, last_word_bits, words_of};
use crate::markers::tables::Pixels;
use hivtac_terms::status::Status;

pub use crate::markers::{dilate::MAX_DILATIONS, mask::MAX_WIDTH};

/// Most rows of a frame: the moments of [`Blob`] are proven for it.
pub const MAX_HEIGHT: u16 = 800;

/// What a frame looks like and what to make of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ScanSettings {
    /// Columns, 1 to [`MAX_WIDTH`].
    pub width: u16,
    /// Rows, 1 to [`MAX_HEIGHT`].
    pub height: u16,
    /// How often the mask is dilated by 3×3, 0 to [`MAX_DILATIONS`].
    pub dilations: u8,
    /// Blobs of fewer pixels, after dilation, are dropped.
    pub min_area: u32,
    /// Whether the pixels of blobs are weighed: their weighted centroids are wanted.
    pub weighted: bool,
    /// A frame of more runs is not looked at to its end: [`Status::BLOB_OVERFLOW`]. It bounds the
    /// time that noise takes.
    pub max_runs: u32,
    /// Whether the mask is of the pixels that a marker covers at least half, whatever the light
    /// ([`Pixels::mask_covered_rows`]), and only where the majority of 3×3 of them are: of a frame
    /// with specks or little light.
    pub cleaned: bool,
}

/// Why a frame cannot be scanned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScanError {
    /// This width is not 1 to [`MAX_WIDTH`].
    Width(u16),
    /// This height is not 1 to [`MAX_HEIGHT`].
    Height(u16),
    /// This number of dilations is above [`MAX_DILATIONS`].
    Dilations(u8),
}

impl fmt::Display for ScanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ScanError::Width(width) => {
                write!(
                    f,
                    "frame width {width} is out of range: use 1 to {MAX_WIDTH} columns"
                )
            }
            ScanError::Height(height) => {
                write!(
                    f,
                    "frame height {height} is out of range: use 1 to {MAX_HEIGHT} rows"
                )
            }
            ScanError::Dilations(n) => {
                write!(f, "{n} dilations are too many: use 0 to {MAX_DILATIONS}")
            }
        }
    }
}

impl core::error::Error for ScanError {}

impl ScanSettings {
    /// Says whether such a frame can be scanned.
    ///
    /// # Errors
    /// A width, height or number of dilations out of range.
    pub const fn check(&self) -> Result<(), ScanError> {
        if self.width == 0 || self.width > MAX_WIDTH {
            return Err(ScanError::Width(self.width));
        }
        if self.height == 0 || self.height > MAX_HEIGHT {
            return Err(ScanError::Height(self.height));
        }
        if self.dilations > MAX_DILATIONS {
            return Err(ScanError::Dilations(self.dilations));
        }
        Ok(())
    }
}

/// What one frame gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scan<'a> {
    /// The blobs of at least the minimum area, ordered by their lowest row, then by where they
    /// begin in it.
    pub blobs: &'a [Blob],
    /// Pixels that passed the threshold, before dilation; of a frame of too many runs, as far as it
    /// was looked at.
    pub set_pixels: u32,
    /// Set pixels that [cleaning](ScanSettings::cleaned) took out.
    pub specks: u32,
    /// Unset ones that it filled.
    pub holes: u32,
    /// [`Status::FRAME_INCOMPLETE`] when rows were missing, too many or of another width,
    /// [`Status::BLOB_OVERFLOW`] when there were more than `BLOBS` blobs or
    /// [`ScanSettings::max_runs`] runs; either means that `blobs` is not the whole truth.
    pub status: Status,
}

/// Scans frames row by row and keeps up to `BLOBS` blobs of each.
///
/// For each frame: [`begin`](Self::begin), [`push_rows`](Self::push_rows) with all rows from the
/// top, one or more at a time as they arrive, and [`finish`](Self::finish). It holds a few rows of
/// mask and of pixels and the sums of the blobs that the current row may still touch: below 68 KiB
/// with 64 blobs, whatever the height, and 112 bytes for each blob more.
#[derive(Clone, Debug)]
pub struct Scanner<const BLOBS: usize> {
    settings: ScanSettings,
    majority: Majority,
    dilation: Dilation,
    labels: Labeller<BLOBS>,
    /// The pixels of rows that the dilation still holds, when they are weighed and may not stay
    /// where they are.
    history: History,
    /// Rows taken so far.
    rows_in: u16,
    set_pixels: u32,
    status: Status,
    /// Between `begin` and `finish`.
    active: bool,
}

impl<const BLOBS: usize> Scanner<BLOBS> {
    /// A scanner that waits for its first frame; suits a `static`.
    pub const fn new() -> Self {
        Scanner {
            settings: ScanSettings {
                width: 0,
                height: 0,
                dilations: 0,
                min_area: 0,
                weighted: false,
                max_runs: u32::MAX,
                cleaned: false,
            },
            majority: Majority::new(),
            dilation: Dilation::new(),
            labels: Labeller::new(),
            history: History::new(),
            rows_in: 0,
            set_pixels: 0,
            status: Status::FRAME_INCOMPLETE,
            active: false,
        }
    }

    /// Starts a frame and forgets the one before.
    ///
    /// # Errors
    /// Those of [`ScanSettings::check`]; there is then no frame to push rows to.
    pub fn begin(&mut self, settings: ScanSettings) -> Result<(), ScanError> {
        self.active = false;
        self.status = Status::FRAME_INCOMPLETE;
        self.rows_in = 0;
        self.set_pixels = 0;
        self.labels.begin(settings.min_area, settings.max_runs);
        settings.check()?;
        self.settings = settings;
        self.dilation.begin(settings.width, settings.dilations);
        if settings.cleaned {
            self.majority.begin();
        }
        self.history.clear();
        self.status = Status::OK;
        self.active = true;
        Ok(())
    }

    /// Takes the next row of pixels, as they lie in memory. A row of another length, or one too
    /// many, is left out and makes the frame incomplete.
    pub fn push_row(&mut self, pixels: &impl Pixels, row: &[u16]) {
        let length = pixels.row_length(self.settings.width);
        if row.len() == length {
            let band = self.band(pixels, row);
            self.push_band(pixels, &band, 1, Stay::Gone);
        } else {
            self.status |= Status::FRAME_INCOMPLETE;
        }
    }

    /// Takes the next rows of pixels, as they lie in memory one after the other. What is no whole
    /// row, or too many, is left out and makes the frame incomplete. The more rows at a time, the
    /// less each of them costs.
    ///
    /// Where pixels are weighed, as many rows as there are dilations are copied, as the next ones
    /// may need them.
    pub fn push_rows(&mut self, pixels: &impl Pixels, rows: &[u16]) {
        self.push_whole(pixels, &[], rows, Stay::Gone);
    }

    /// The same without copying: the rows that came last are still in memory when the next ones
    /// come, and are then `above`: all of the frame, or at least as many as there are dilations,
    /// one after the other; one more in a frame that is [cleaned](ScanSettings::cleaned). With
    /// fewer, a frame whose pixels are weighed becomes incomplete where one of them would have been
    /// needed.
    pub fn push_rows_below(&mut self, pixels: &impl Pixels, above: &[u16], rows: &[u16]) {
        self.push_whole(pixels, above, rows, Stay::Here);
    }

    fn push_whole(&mut self, pixels: &impl Pixels, above: &[u16], rows: &[u16], stay: Stay) {
        let length = pixels.row_length(self.settings.width).max(1);
        let count = rows.len() / length;
        if count * length < rows.len() {
            self.status |= Status::FRAME_INCOMPLETE;
        }
        let band = Band {
            above,
            ..self.band(pixels, rows)
        };
        self.push_band(pixels, &band, count, stay);
    }

    /// The next rows.
    fn band<'p>(&self, pixels: &impl Pixels, rows: &'p [u16]) -> Band<'p> {
        Band {
            first: self.rows_in,
            row_length: pixels.row_length(self.settings.width),
            pixels: rows,
            above: &[],
        }
    }

    /// Takes the first `count` rows of a band.
    fn push_band(&mut self, pixels: &impl Pixels, band: &Band<'_>, count: usize, stay: Stay) {
        let room = self.room();
        if count > room {
            self.status |= Status::FRAME_INCOMPLETE;
        }
        let mut left = count.min(room);
        while left > 0 {
            let rows = left.min(MAX_ROWS);
            let mut any = false;
            if !self.labels.is_exhausted() {
                let (part, width) = (band.part(self.rows_in, rows), self.settings.width);
                let incoming = self.dilation.incoming(rows);
                any = if self.settings.cleaned {
                    pixels.mask_covered_rows(part, width, incoming);
                    self.majority.filter(incoming, width)
                } else {
                    pixels.mask_rows(part, width, incoming)
                };
            }
            self.take(pixels, band, rows, any);
            left -= rows;
        }
        // What ends a frame is weighed when it is finished.
        let ends = |scanner: &Self| {
            let settings = &scanner.settings;
            scanner.rows_in == settings.height && (settings.cleaned || !scanner.is_quiet())
        };
        if self.settings.weighted && (stay == Stay::Gone || ends(self)) {
            self.history.keep(band, self.rows_in, self.late());
        }
    }

    /// Takes the next row as its mask: ⌈width / 32⌉ words; bits beyond the width are ignored. Its
    /// pixels are unknown, so that nothing of it is weighed. Otherwise as
    /// [`push_row`](Self::push_row).
    pub fn push_mask_row(&mut self, words: &[u32]) {
        if self.room() == 0 || words.len() != words_of(self.settings.width) {
            self.status |= Status::FRAME_INCOMPLETE;
            return;
        }
        let incoming = self.dilation.incoming(1);
        incoming.copy_from_slice(words);
        if let Some(last) = incoming.last_mut() {
            *last &= last_word_bits(self.settings.width);
        }
        let any = if self.settings.cleaned {
            self.majority.filter(incoming, self.settings.width)
        } else {
            any_set(incoming)
        };
        self.take(&(), &Band::WITHOUT_PIXELS, 1, any);
    }

    /// Ends the frame, whose rows were `pixels`; `()` when they came as masks. Without a frame (no
    /// successful `begin` since the last `finish`), it repeats the last result.
    pub fn finish(&mut self, pixels: &impl Pixels) -> Scan<'_> {
        if self.active {
            self.active = false;
            self.flush(pixels);
        }
        Scan {
            blobs: self.blobs(),
            set_pixels: self.set_pixels,
            specks: self.majority.specks(),
            holes: self.majority.holes(),
            status: self.status,
        }
    }

    /// The blobs that are complete: after [`finish`](Self::finish) all of the frame, as in
    /// [`Scan::blobs`].
    pub fn blobs(&self) -> &[Blob] {
        self.labels.kept()
    }

    /// Whether no blob is open: the rows so far may have shown all that the frame has.
    #[inline(always)]
    pub fn is_settled(&self) -> bool {
        self.labels.is_idle()
    }

    /// Rows that come out behind those that come in.
    #[inline(always)]
    fn late(&self) -> u8 {
        self.dilation.radius() + u8::from(self.settings.cleaned)
    }

    /// How many rows are still missing.
    fn room(&self) -> usize {
        let missing = self.settings.height.saturating_sub(self.rows_in);
        if self.active { usize::from(missing) } else { 0 }
    }

    /// Takes the rows that were written to the dilation; `any` says whether a bit of them is set.
    fn take(&mut self, pixels: &impl Pixels, band: &Band<'_>, rows: usize, any: bool) {
        if !self.labels.is_exhausted() {
            if any {
                self.dilation.look(rows);
            }
            if !self.is_quiet() {
                self.label(pixels, band, rows);
            }
        }
        self.rows_in += rows as u16;
    }

    /// Whether nothing is set nearby and no blob is open, as with most rows.
    #[inline(always)]
    fn is_quiet(&self) -> bool {
        self.dilation.is_empty() && self.labels.is_idle()
    }

    /// Passes rows through the dilation to the labels, where the pixels of their runs are weighed.
    fn label(&mut self, pixels: &impl Pixels, band: &Band<'_>, rows: usize) {
        let late = u16::from(self.late());
        let near = self.dilation.near();
        // Nothing of the frame lies above its first row.
        let above = usize::from(late.saturating_sub(self.rows_in));
        for i in above.min(rows)..rows {
            let y = self.rows_in + i as u16 - late;
            if self.labels.is_idle() && self.dilation.is_empty_row(i) {
                continue;
            }
            self.set_pixels += self.labels.push(y, &self.dilation, i, &near);
            if self.settings.weighted && !self.labels.is_idle() {
                match band.row(y).or_else(|| self.history.row(y)) {
                    Some(row) => self.labels.weigh(y, |run| pixels.weigh(row, run)),
                    None => self.status |= Status::FRAME_INCOMPLETE,
                }
            }
            if self.labels.is_exhausted() {
                return;
            }
        }
        self.dilation.advance(rows);
    }

    /// Brings out the rows that the dilation still holds, and the blobs that they end.
    fn flush(&mut self, pixels: &impl Pixels) {
        if self.rows_in < self.settings.height {
            self.status |= Status::FRAME_INCOMPLETE;
        }
        let late = usize::from(self.late());
        if !self.labels.is_exhausted() {
            let incoming = self.dilation.incoming(late);
            incoming.fill(0);
            if self.settings.cleaned && self.majority.filter(incoming, self.settings.width) {
                self.dilation.look(late);
            }
            let band = match pixels.row_length(self.settings.width) {
                0 => Band::WITHOUT_PIXELS,
                _ => Band::EMPTY,
            };
            self.label(pixels, &band, late);
        }
        self.labels.finish(self.rows_in);
        if self.labels.overflowed() {
            self.status |= Status::BLOB_OVERFLOW;
        }
    }
}

/// What becomes of the rows of a band.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stay {
    /// They may not be there any more when the next ones come.
    Gone,
    /// They stay until then, or no others come.
    Here,
}

impl<const BLOBS: usize> Default for Scanner<BLOBS> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_what_the_documentation_says() {
        assert!(size_of::<Scanner<64>>() < 68 * 1024);
        assert_eq!(size_of::<Scanner<65>>() - size_of::<Scanner<64>>(), 112);
    }
}
