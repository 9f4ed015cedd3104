//! Rows in, blobs out: threshold, dilation, runs and labels, without a frame in memory.

use core::fmt;

use crate::{
    blob::Blob,
    dilate::Dilation,
    history::{Band, History},
    label::Labeller,
    mask::{last_word_bits, words_of},
    status::Status,
    tables::{Pixels, Weights},
};

pub use crate::{dilate::MAX_DILATIONS, mask::MAX_WIDTH};

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
    /// A frame of more runs is not looked at to its end: [`Status::BLOB_OVERFLOW`]. It bounds the time that noise takes.
    pub max_runs: u32,
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
    /// The blobs of at least the minimum area, ordered by their lowest row, then by where they begin in it.
    pub blobs: &'a [Blob],
    /// Pixels that passed the threshold, before dilation.
    pub set_pixels: u32,
    /// [`Status::FRAME_INCOMPLETE`] when rows were missing, too many or of another width, [`Status::BLOB_OVERFLOW`] when
    /// there were more than `BLOBS` blobs or [`ScanSettings::max_runs`] runs; either means that `blobs` is not the whole truth.
    pub status: Status,
}

/// Scans frames row by row and keeps up to `BLOBS` blobs of each.
///
/// For each frame: [`begin`](Self::begin), [`push_rows`](Self::push_rows) with all rows from the top, one or more at
/// a time as they arrive, and [`finish`](Self::finish). It holds a few rows of mask and of pixels and the sums of the
/// blobs that the current row may still touch: below 68 KiB with 64 blobs, whatever the height, and 104 bytes for each
/// blob more.
#[derive(Clone, Debug)]
pub struct Scanner<const BLOBS: usize> {
    settings: ScanSettings,
    dilation: Dilation,
    labels: Labeller<BLOBS>,
    /// The pixels of rows that the dilation still holds, when they are weighed.
    history: History,
    /// Rows taken so far.
    rows_in: u16,
    /// Rows that came out of the dilation so far.
    rows_out: u16,
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
            },
            dilation: Dilation::new(),
            labels: Labeller::new(),
            history: History::new(),
            rows_in: 0,
            rows_out: 0,
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
        self.rows_out = 0;
        self.set_pixels = 0;
        self.labels.begin(settings.min_area, settings.max_runs);
        settings.check()?;
        self.settings = settings;
        self.dilation.begin(settings.width, settings.dilations);
        self.status = Status::OK;
        self.active = true;
        Ok(())
    }

    /// Takes the next row of pixels, as they lie in memory. A row of another length, or one too many, is left out and
    /// makes the frame incomplete.
    pub fn push_row(&mut self, pixels: &impl Pixels, row: &[u16]) {
        if !self.expects(row.len() == pixels.row_length(self.settings.width)) {
            return;
        }
        let band = Band {
            first: self.rows_in,
            row_length: row.len(),
            pixels: row,
        };
        pixels.mask_row(row, self.dilation.incoming());
        self.take(pixels, &band);
        if self.settings.weighted {
            self.history.keep(band.first, row, row.len());
        }
    }

    /// Takes the next rows of pixels, as they lie in memory one after the other. What is no whole row, or too many,
    /// is left out and makes the frame incomplete. The more rows at a time, the fewer of them are copied.
    pub fn push_rows(&mut self, pixels: &impl Pixels, rows: &[u16]) {
        let row_length = pixels.row_length(self.settings.width).max(1);
        let band = Band {
            first: self.rows_in,
            row_length,
            pixels: rows,
        };
        if !rows.len().is_multiple_of(row_length) {
            self.status |= Status::FRAME_INCOMPLETE;
        }
        for row in rows.chunks_exact(row_length) {
            if !self.expects(true) {
                break;
            }
            pixels.mask_row(row, self.dilation.incoming());
            self.take(pixels, &band);
        }
        if self.settings.weighted {
            let taken = usize::from(self.rows_in - band.first) * row_length;
            self.history.keep(band.first, &rows[..taken], row_length);
        }
    }

    /// Takes the next row as its mask: ⌈width / 32⌉ words; bits beyond the width are ignored. Its pixels are unknown,
    /// so that nothing of it is weighed. Otherwise as [`push_row`](Self::push_row).
    pub fn push_mask_row(&mut self, words: &[u32]) {
        if !self.expects(words.len() == words_of(self.settings.width)) {
            return;
        }
        let incoming = self.dilation.incoming();
        incoming.copy_from_slice(words);
        if let Some(last) = incoming.last_mut() {
            *last &= last_word_bits(self.settings.width);
        }
        self.take(&(), &Band::EMPTY);
    }

    /// Ends the frame, whose rows were `pixels`; `()` when they came as masks. Without a frame (no successful `begin`
    /// since the last `finish`), it repeats the last result.
    pub fn finish(&mut self, pixels: &impl Pixels) -> Scan<'_> {
        if self.active {
            self.active = false;
            self.flush(pixels);
        }
        Scan {
            blobs: self.blobs(),
            set_pixels: self.set_pixels,
            status: self.status,
        }
    }

    /// The blobs that are complete: after [`finish`](Self::finish) all of the frame, as in [`Scan::blobs`].
    pub fn blobs(&self) -> &[Blob] {
        self.labels.kept()
    }

    /// Whether a row of the right or wrong width is the next one of the frame; notes it when it is not.
    fn expects(&mut self, right_width: bool) -> bool {
        let expected = self.active && right_width && self.rows_in < self.settings.height;
        if !expected {
            self.status |= Status::FRAME_INCOMPLETE;
        }
        expected
    }

    /// Takes the row that was written to the dilation.
    #[inline(always)]
    fn take(&mut self, pixels: &impl Pixels, band: &Band<'_>) {
        self.rows_in += 1;
        self.advance(pixels, band);
    }

    /// Passes a row through the dilation to the labels, where the pixels of its runs are weighed.
    #[inline(always)]
    fn advance(&mut self, pixels: &impl Pixels, band: &Band<'_>) {
        if self.labels.is_exhausted() {
            self.set_pixels += self.dilation.count();
            return;
        }
        let (count, dilated) = self.dilation.push();
        self.set_pixels += count;
        let Some(dilated) = dilated else {
            return;
        };
        let y = self.rows_out;
        self.rows_out += 1;
        if dilated.words.is_empty() && self.labels.is_idle() {
            return;
        }
        if self.settings.weighted {
            let row = band.row(y).unwrap_or_else(|| self.history.row(y));
            self.labels.push(dilated, y, |run| pixels.weigh(row, run));
        } else {
            self.labels.push(dilated, y, |_| Weights::NONE);
        }
    }

    /// Brings out the rows that the dilation still holds, and the blobs that they end.
    fn flush(&mut self, pixels: &impl Pixels) {
        if self.rows_in < self.settings.height {
            self.status |= Status::FRAME_INCOMPLETE;
        }
        for _ in 0..self.dilation.radius() {
            self.dilation.incoming().fill(0);
            self.advance(pixels, &Band::EMPTY);
        }
        self.labels.finish(self.rows_out);
        if self.labels.overflowed() {
            self.status |= Status::BLOB_OVERFLOW;
        }
    }
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
        assert_eq!(size_of::<Scanner<65>>() - size_of::<Scanner<64>>(), 104);
    }
}
