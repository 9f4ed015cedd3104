//! Scans rows into blobs: threshold, dilation, runs and labels, without a frame in memory.

use core::fmt;

use crate::markers::beside::Beside;
use crate::markers::blob::Blob;
use crate::markers::dilate::{Dilation, MAX_ROWS};
use crate::markers::history::{Band, History};
use crate::markers::label::Labeller;
use crate::markers::majority::Majority;
use crate::markers::mask::{any_set, last_word_bits, words_of};
use crate::markers::tables::Pixels;
use hivtac_terms::status::Status;

pub use crate::markers::{dilate::MAX_DILATIONS, mask::MAX_WIDTH};

/// Most rows of a frame; the moments of [`Blob`] are proven for it.
pub const MAX_HEIGHT: u16 = 800;

/// The size of a frame, and how to scan it.
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
    /// True if the pixels of blobs are weighed, for weighted centroids.
    pub weighted: bool,
    /// Scanning stops once a frame has more runs: [`Status::BLOB_OVERFLOW`]. That bounds the time
    /// of a frame of noise.
    pub max_runs: u32,
    /// True for a frame with specks or little light. The mask then has the pixels that a marker
    /// covers at least half, at any light ([`Pixels::mask_covered_rows`]), filtered by the majority
    /// of 3×3.
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
    /// Checks whether such a frame can be scanned.
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

/// The result of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scan<'a> {
    /// The blobs of at least the minimum area, ordered by their lowest row, then by their first
    /// column in it.
    pub blobs: &'a [Blob],
    /// Number of pixels that passed the threshold, before dilation. In a frame with too many runs,
    /// of the scanned part.
    pub set_pixels: u32,
    /// Number of set pixels that [cleaning](ScanSettings::cleaned) cleared.
    pub specks: u32,
    /// Number of unset pixels that it set.
    pub holes: u32,
    /// [`Status::FRAME_INCOMPLETE`] if rows were missing, too many or of another width.
    /// [`Status::BLOB_OVERFLOW`] if there were more than `BLOBS` blobs or
    /// [`ScanSettings::max_runs`] runs. With either, `blobs` is incomplete or wrong.
    pub status: Status,
}

/// Scans frames row by row and keeps up to `BLOBS` blobs of each.
///
/// For each frame call [`begin`](Self::begin), [`push_rows`](Self::push_rows) with all rows from
/// the top, one or more at a time as they arrive, and [`finish`](Self::finish). A scanner holds a
/// few rows of mask and of pixels, and the sums of the blobs that the current row may still touch.
/// That is below 68 KiB with 64 blobs, whatever the height, and 120 bytes for each additional blob.
#[derive(Clone, Debug)]
pub struct Scanner<const BLOBS: usize> {
    settings: ScanSettings,
    majority: Majority,
    dilation: Dilation,
    labels: Labeller<BLOBS>,
    /// Copies of pixel rows that the dilation still holds, if pixels are weighed and their
    /// originals may be gone.
    history: History,
    /// Rows taken so far.
    rows_in: u16,
    set_pixels: u32,
    status: Status,
    /// True between `begin` and `finish`.
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

    /// Starts a frame and discards the previous one.
    ///
    /// # Errors
    /// Those of [`ScanSettings::check`]; then no frame is active.
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

    /// Takes the next row of pixels, as they lie in memory. A row of another length, or beyond the
    /// frame's height, is ignored and makes the frame incomplete.
    pub fn push_row(&mut self, pixels: &impl Pixels, row: &[u16]) {
        let length = pixels.row_length(self.settings.width);
        if row.len() == length {
            let band = self.band(pixels, row);
            self.push_band(pixels, &band, 1, Stay::Gone);
        } else {
            self.status |= Status::FRAME_INCOMPLETE;
        }
    }

    /// Takes the next rows of pixels, as they lie in memory one after the other. A part of a row,
    /// or rows beyond the frame's height, are ignored and make the frame incomplete. The more rows
    /// at a time, the lower the cost of each.
    ///
    /// If pixels are weighed, the last rows are copied, one for each dilation, because the next
    /// rows may need them.
    pub fn push_rows(&mut self, pixels: &impl Pixels, rows: &[u16]) {
        self.push_whole(pixels, &[], rows, Stay::Gone);
    }

    /// As [`push_rows`](Self::push_rows), but without copying. `above` holds the last rows, which
    /// must still be in memory, one after the other. Either all of the frame, or at least one row
    /// for each dilation; one more if the frame is [cleaned](ScanSettings::cleaned). With fewer
    /// rows, a frame whose pixels are weighed becomes incomplete if one of them is needed.
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

    /// The band of the next rows.
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
        // The rows that end a frame are weighed when it is finished.
        let ends = |scanner: &Self| {
            let settings = &scanner.settings;
            scanner.rows_in == settings.height && (settings.cleaned || !scanner.is_quiet())
        };
        if self.settings.weighted && (stay == Stay::Gone || ends(self)) {
            self.history.keep(band, self.rows_in, self.late());
        }
    }

    /// Takes the next row as its mask of ⌈width / 32⌉ words; bits beyond the width are ignored. Its
    /// pixels are unknown, so they are not weighed. Otherwise as [`push_row`](Self::push_row).
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

    /// Ends the frame, whose rows were `pixels`; `()` if they came as masks. Without an active
    /// frame (no successful `begin` since the last `finish`) it repeats the last result.
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

    /// Returns the blobs that are complete; after [`finish`](Self::finish) all of the frame, as in
    /// [`Scan::blobs`].
    pub fn blobs(&self) -> &[Blob] {
        self.labels.kept()
    }

    /// Returns whether no blob is open: the rows so far may have shown the whole content of the
    /// frame.
    #[inline(always)]
    pub fn is_settled(&self) -> bool {
        self.labels.is_idle()
    }

    /// Number of rows by which the output lags behind the input.
    #[inline(always)]
    fn late(&self) -> u8 {
        self.dilation.radius() + u8::from(self.settings.cleaned)
    }

    /// Number of rows that are still missing.
    fn room(&self) -> usize {
        let missing = self.settings.height.saturating_sub(self.rows_in);
        if self.active { usize::from(missing) } else { 0 }
    }

    /// Takes the rows that were written to the dilation; `any` is true if one of their bits is set.
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

    /// Whether no nearby row is set and no blob is open, as with most rows.
    #[inline(always)]
    fn is_quiet(&self) -> bool {
        self.dilation.is_empty() && self.labels.is_idle()
    }

    /// Passes rows through the dilation to the labels, and weighs the pixels of their runs.
    fn label(&mut self, pixels: &impl Pixels, band: &Band<'_>, rows: usize) {
        let late = u16::from(self.late());
        let near = self.dilation.near();
        // The frame has no rows above its first one.
        let above = usize::from(late.saturating_sub(self.rows_in));
        for i in above.min(rows)..rows {
            let y = self.rows_in + i as u16 - late;
            if self.labels.is_idle() && self.dilation.is_empty_row(i) {
                continue;
            }
            self.set_pixels += self.labels.push(y, &self.dilation, i, &near);
            if self.settings.weighted && !self.labels.is_idle() {
                match band.row(y).or_else(|| self.history.row(y)) {
                    Some(row) => {
                        self.labels.weigh(y, |run| pixels.weigh(row, run));
                        if Beside::is_looked_at(y) {
                            let beside = |run| pixels.beside(row, run);
                            self.labels.look_beside(y, beside);
                        }
                    }
                    None => self.status |= Status::FRAME_INCOMPLETE,
                }
            }
            if self.labels.is_exhausted() {
                return;
            }
        }
        self.dilation.advance(rows);
    }

    /// Flushes the rows that the dilation still holds, and the blobs that they end.
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

/// How long the rows of a band stay in memory.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stay {
    /// They may be gone when the next ones come.
    Gone,
    /// They stay until the next ones come, or these are the last.
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
        assert_eq!(size_of::<Scanner<65>>() - size_of::<Scanner<64>>(), 120);
    }
}
