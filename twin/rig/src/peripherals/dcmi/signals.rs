//! One frame's signals in time, and the bytes that the camera interface takes for data.

use crate::camera::encode;
use crate::camera::output::Output;
use crate::frame_source::Picture;
use crate::truth::Exposed;

/// A frame that the camera is sending.
#[derive(Debug)]
pub struct Frame {
    /// Time at which VSYNC began, ns.
    pub start_ns: u64,
    /// Its signals.
    pub output: Output,
    /// The exposure of the frame; known from the end of VSYNC on.
    pub exposed: Option<Exposed>,
    picture: Option<Picture>,
    row: Option<(u32, Vec<u8>)>,
}

/// A run: bytes that the interface sees at the valid level of HSYNC, in one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Line of the frame, from VSYNC on.
    pub line: u32,
    /// Pixel clock of the line at which the first byte is on the lines.
    pub start: u32,
    /// Number of bytes.
    pub bytes: u32,
    /// The row of the bytes; `None` for the lines' levels between rows.
    pub row: Option<u32>,
    /// HSYNC goes to its blanking level at the end.
    pub ends_line: bool,
}

impl Frame {
    /// Returns a frame that begins now.
    pub fn new(start_ns: u64, output: Output) -> Self {
        Self {
            start_ns,
            output,
            exposed: None,
            picture: None,
            row: None,
        }
    }

    /// Returns the instant at which this many pixel clocks of a line have passed, ns.
    pub fn instant(&self, line: u32, clock: u32) -> u64 {
        let clocks = u64::from(line) * u64::from(self.output.line_clocks) + u64::from(clock);
        self.start_ns + self.output.clocks_ns(clocks)
    }

    /// Returns the line and pixel clock at an instant, which may lie past the frame's end.
    pub fn position(&self, now_ns: u64) -> (u64, u32) {
        let passed = u128::from(now_ns.saturating_sub(self.start_ns));
        let clocks = passed * u128::from(self.output.pixel_clock_hz) / 1_000_000_000;
        let line_clocks = u128::from(self.output.line_clocks);
        ((clocks / line_clocks) as u64, (clocks % line_clocks) as u32)
    }

    /// Returns whether HREF is at its active level at an instant.
    pub fn in_row(&self, now_ns: u64) -> bool {
        let (line, clock) = self.position(now_ns);
        u32::try_from(line).is_ok_and(|line| self.row_of(line).is_some())
            && clock < self.output.row_bytes
    }

    /// Returns the first run at or after a line, before the line `end`; `None` if there is no run.
    /// With `inverted`, the interface takes HREF's idle level for data.
    pub fn run_from(&self, line: u32, end: u32, inverted: bool) -> Option<Run> {
        (line..end).find_map(|line| self.run_in(line, inverted))
    }

    fn run_in(&self, line: u32, inverted: bool) -> Option<Run> {
        let (output, row) = (&self.output, self.row_of(line));
        if !inverted {
            return row.map(|_| Run {
                line,
                start: 0,
                bytes: output.row_bytes,
                row,
                ends_line: true,
            });
        }
        let start = if row.is_some() { output.row_bytes } else { 0 };
        let bytes = output.line_clocks - start;
        let ends_line = self.row_of(line + 1).is_some();
        (output.clock_between_rows && bytes > 0).then_some(Run {
            line,
            start,
            bytes,
            row: None,
            ends_line,
        })
    }

    fn row_of(&self, line: u32) -> Option<u32> {
        self.output.row_of(line)
    }

    /// Returns the bytes `from..to` of a run. The picture is made when the first row is needed.
    /// Between rows the lines are low.
    pub fn bytes(
        &mut self,
        run: &Run,
        from: u32,
        to: u32,
        picture: impl FnOnce(Exposed) -> Picture,
    ) -> Vec<u8> {
        let (Some(row), Some(exposed)) = (run.row, self.exposed) else {
            return vec![0; (to - from) as usize];
        };
        if self.row.as_ref().is_none_or(|(had, _)| *had != row) {
            let picture = self.picture.get_or_insert_with(|| picture(exposed));
            self.row = Some((row, encode::row(&self.output, picture, row)));
        }
        let bytes = self.row.as_ref().map_or(&[][..], |(_, bytes)| bytes);
        bytes[from as usize..to as usize].to_vec()
    }
}

/// Returns the byte that is latched if the lines are sampled at the edge at which they change. Bits
/// that differ from the byte before are old or new with equal probability. The pattern is fixed, to
/// make runs repeatable.
pub fn sampled_while_changing(before: u8, byte: u8, position: u64) -> u8 {
    let coin = (position.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 56) as u8;
    byte ^ ((before ^ byte) & coin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::registers::Registers;
    use crate::frame_source::{Coding, FrameSource, TestPicture};

    fn vga() -> Frame {
        let output = Output::new(&Registers::default(), 24_000_000).unwrap();
        Frame {
            exposed: Some(Exposed {
                frame: 1,
                exposure: 1,
                at_ns: 2000,
                ..Exposed::default()
            }),
            ..Frame::new(1000, output)
        }
    }

    #[test]
    fn rows_are_runs_of_their_lines() {
        let frame = vga();
        let first = frame.run_from(0, 510, false).unwrap();
        assert_eq!(
            first,
            Run {
                line: 22,
                start: 0,
                bytes: 1280,
                row: Some(0),
                ends_line: true
            }
        );
        assert_eq!(frame.run_from(501, 510, false).unwrap().row, Some(479));
        assert_eq!(frame.run_from(502, 510, false), None);
        assert_eq!(
            frame.instant(22, 1280) - 1000,
            (22 * 1568 + 1280) * 1000 / 48
        );
    }

    #[test]
    fn with_href_inverted_the_blanks_are_taken_for_data() {
        let frame = vga();
        assert_eq!(
            frame.run_from(4, 510, true),
            Some(Run {
                line: 4,
                start: 0,
                bytes: 1568,
                row: None,
                ends_line: false
            })
        );
        let run = frame.run_from(22, 510, true).unwrap();
        assert_eq!(
            (run.start, run.bytes, run.row, run.ends_line),
            (1280, 288, None, true)
        );
    }

    #[test]
    fn levels_follow_the_position_in_the_frame() {
        let frame = vga();
        assert!(frame.in_row(frame.instant(22, 5)) && !frame.in_row(frame.instant(22, 1400)));
        assert!(!frame.in_row(frame.instant(5, 5)));
    }

    #[test]
    fn bytes_are_those_of_the_row() {
        let mut frame = vga();
        let run = frame.run_from(22, 510, false).unwrap();
        let picture = TestPicture.picture(frame.exposed.unwrap(), Coding::Rgb565);
        let expected = encode::row(&frame.output, &picture, 0);
        assert_eq!(frame.bytes(&run, 16, 32, |_| picture), expected[16..32]);
    }

    #[test]
    fn sampling_at_the_wrong_edge_garbles_what_changes_and_nothing_else() {
        assert!((0..100).all(|i| sampled_while_changing(0x5A, 0x5A, i) == 0x5A));
        let garbled = (0..100)
            .filter(|&i| sampled_while_changing(0x00, 0xFF, i) != 0xFF)
            .count();
        assert!(garbled > 90, "{garbled}");
    }
}
