//! The data path of the camera interface: frame, line and byte selection, packing, and the
//! four-word FIFO.
//!
//! RM0433 rev 7 chapter 33. Simulated: hardware synchronization, 8 data bits, snapshot and
//! continuous mode, frame rate selection, byte and line selection, overrun. Not simulated: crop,
//! embedded codes, JPEG, more data bits.

use std::collections::VecDeque;

/// Words in the FIFO.
pub const FIFO_WORDS: usize = 4;

/// The control register CR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// DCMI_CR.
    pub control: u32,
}

/// CR bits.
pub mod control {
    /// Capture is requested or under way.
    pub const CAPTURE: u32 = 1 << 0;
    /// Snapshot mode.
    pub const SNAPSHOT: u32 = 1 << 1;
    /// Only the crop window.
    pub const CROP: u32 = 1 << 2;
    /// JPEG.
    pub const JPEG: u32 = 1 << 3;
    /// Embedded synchronization.
    pub const EMBEDDED: u32 = 1 << 4;
    /// Sample at the rising edge of PIXCLK.
    pub const RISING: u32 = 1 << 5;
    /// HSYNC is high while data are not valid.
    pub const HSYNC_BLANKS_HIGH: u32 = 1 << 6;
    /// VSYNC is high while data are not valid.
    pub const VSYNC_BLANKS_HIGH: u32 = 1 << 7;
    /// Data width, bits 11:10.
    pub const WIDTH: u32 = 3 << 10;
    /// The interface is on.
    pub const ENABLE: u32 = 1 << 14;
}

impl Settings {
    /// Returns whether all given CR bits are set.
    pub fn has(&self, bits: u32) -> bool {
        self.control & bits == bits
    }

    fn field(&self, shift: u32, bits: u32) -> u32 {
        self.control >> shift & ((1 << bits) - 1)
    }

    /// Returns n if one frame in n is captured.
    fn frame_interval(&self) -> u32 {
        [1, 2, 4, 4][self.field(8, 2) as usize]
    }
}

/// An overrun: the FIFO was full when a word was ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overrun;

/// The data path's state.
#[derive(Debug, Default)]
pub struct Receiver {
    fifo: VecDeque<u32>,
    packing: u32,
    packed: u32,
    capturing: bool,
    frames_seen: u32,
    line: u32,
    clock: u32,
    words: u32,
}

impl Receiver {
    /// Returns whether a frame is being captured.
    pub fn capturing(&self) -> bool {
        self.capturing
    }

    /// Returns the count of waiting words.
    pub fn waiting(&self) -> usize {
        self.fifo.len()
    }

    /// Takes the oldest word; zero if the FIFO is empty.
    pub fn take(&mut self) -> u32 {
        self.fifo.pop_front().unwrap_or(0)
    }

    /// Handles VSYNC at its valid level with CAPTURE set: captures this frame if it is its turn.
    pub fn begin_frame(&mut self, settings: &Settings) {
        self.capturing = self.frames_seen.is_multiple_of(settings.frame_interval());
        self.frames_seen = self.frames_seen.wrapping_add(1);
        (self.line, self.clock, self.words) = (0, 0, 0);
        (self.packing, self.packed) = (0, 0);
    }

    /// Takes one byte at the valid level of HSYNC and VSYNC.
    ///
    /// # Errors
    /// If it completes a word while the FIFO is full: the FIFO is emptied and the frame is given
    /// up.
    pub fn byte(&mut self, byte: u8, settings: &Settings) -> Result<(), Overrun> {
        let clock = self.clock;
        self.clock += 1;
        if !self.capturing || !self.selects(clock, settings) {
            return Ok(());
        }
        self.packing |= u32::from(byte) << (8 * self.packed);
        self.packed += 1;
        if self.packed == 4 {
            self.push()
        } else {
            Ok(())
        }
    }

    /// Handles HSYNC at its blanking level. An incomplete last word is filled with zeros.
    ///
    /// # Errors
    /// As [`Receiver::byte`].
    pub fn end_line(&mut self) -> Result<(), Overrun> {
        if self.capturing && self.packed > 0 {
            self.push()?;
        }
        self.line += 1;
        self.clock = 0;
        Ok(())
    }

    /// Ends the frame. Returns its count of words.
    pub fn end_frame(&mut self) -> u32 {
        self.capturing = false;
        self.words
    }

    /// Resets the state when the interface is switched off.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    fn selects(&self, clock: u32, settings: &Settings) -> bool {
        let second_line = settings.field(20, 1);
        let line_wanted = settings.field(19, 1) == 0 || self.line % 2 == second_line;
        line_wanted && selects_byte(clock, settings.field(16, 2), settings.field(18, 1))
    }

    fn push(&mut self) -> Result<(), Overrun> {
        let word = std::mem::take(&mut self.packing);
        self.packed = 0;
        if self.fifo.len() == FIFO_WORDS {
            self.fifo.clear();
            self.capturing = false;
            return Err(Overrun);
        }
        self.fifo.push_back(word);
        self.words += 1;
        Ok(())
    }
}

/// Returns whether BSM and OEBS select a byte: all bytes, every other, one of four, two of four;
/// from the first or the second on.
fn selects_byte(column: u32, mode: u32, second: u32) -> bool {
    match mode {
        0 => true,
        1 => column % 2 == second,
        2 => column % 4 == second,
        _ => column % 4 / 2 == second,
    }
}

#[cfg(test)]
mod tests {
    use super::control::*;
    use super::*;

    fn settings(control: u32) -> Settings {
        Settings {
            control: control | ENABLE | CAPTURE,
        }
    }

    /// Returns all words that leave the FIFO if it is emptied in time.
    fn captured(settings: &Settings, lines: &[&[u8]]) -> Vec<u32> {
        let mut receiver = Receiver::default();
        receiver.begin_frame(settings);
        let mut words = Vec::new();
        for line in lines {
            for &byte in *line {
                receiver.byte(byte, settings).unwrap();
                words.extend(std::iter::from_fn(|| {
                    (receiver.waiting() > 0).then(|| receiver.take())
                }));
            }
            receiver.end_line().unwrap();
            words.extend(std::iter::from_fn(|| {
                (receiver.waiting() > 0).then(|| receiver.take())
            }));
        }
        words
    }

    #[test]
    fn bytes_pack_little_endian_and_a_short_line_is_filled_with_zeros() {
        assert_eq!(
            captured(&settings(0), &[&[1, 2, 3, 4, 5, 6], &[7, 8, 9, 10]]),
            [0x0403_0201, 0x0605, 0x0A09_0807]
        );
    }

    #[test]
    fn the_fifth_word_overruns_and_ends_the_frame() {
        let settings = settings(0);
        let mut receiver = Receiver::default();
        receiver.begin_frame(&settings);
        for byte in 0..19 {
            receiver.byte(byte, &settings).unwrap();
        }
        assert_eq!(receiver.waiting(), 4);
        assert_eq!(receiver.byte(19, &settings), Err(Overrun));
        assert_eq!((receiver.waiting(), receiver.capturing()), (0, false));
        receiver.byte(20, &settings).unwrap();
        assert_eq!(receiver.waiting(), 0);
    }

    #[test]
    fn byte_and_line_selection() {
        let line: Vec<u8> = (0..8).collect();
        let kept = |control: u32| captured(&settings(control), &[&line, &line]);
        assert_eq!(kept(1 << 16), [0x0604_0200; 2]);
        assert_eq!(kept(1 << 16 | 1 << 18), [0x0705_0301; 2]);
        assert_eq!(kept(2 << 16), [0x0400; 2]);
        assert_eq!(kept(3 << 16), [0x0504_0100; 2]);
        assert_eq!(kept(1 << 19), [0x0302_0100, 0x0706_0504]);
    }

    #[test]
    fn one_frame_in_four() {
        let settings = settings(2 << 8);
        let mut receiver = Receiver::default();
        let captured: Vec<bool> = (0..8)
            .map(|_| {
                receiver.begin_frame(&settings);
                receiver.capturing()
            })
            .collect();
        assert_eq!(
            captured,
            [true, false, false, false, true, false, false, false]
        );
    }
}
