//! Reads the true force of each frame and its place from a simulated sensor's log, by frame number.

use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::time::{Duration, Instant};

/// Longest wait for the line of a frame that was received.
const PATIENCE: Duration = Duration::from_millis(300);
/// Time between two reads of a growing file.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Most bytes of a line, and of one read.
const LONGEST_LINE: usize = 1 << 16;
const READ_AT_ONCE: u64 = 1 << 16;
/// Most frames that were read and not yet asked for: some hours of them.
const MOST_WAITING: usize = 1 << 22;

/// One line of the log. A line without a force, such as of a test picture, belongs to a frame
/// without a true force.
#[derive(Deserialize)]
struct Line {
    /// Frame number, as in the samples.
    frame: u32,
    #[serde(flatten)]
    truth: Option<Truth>,
}

/// The true force of a frame and, if the log has it, the place where the tip touches the film.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Truth {
    /// α, degrees.
    pub alpha_deg: f64,
    /// β, degrees.
    pub beta_deg: f64,
    /// |F|, N.
    pub magnitude_n: f64,
    /// Fx, N.
    pub x_n: f64,
    /// Fy, N.
    pub y_n: f64,
    /// Fz, N.
    pub z_n: f64,
    /// Place to the right in the image, mm from the film's middle.
    #[serde(default)]
    pub place_x_mm: Option<f64>,
    /// Place down in the image, mm from the film's middle.
    #[serde(default)]
    pub place_y_mm: Option<f64>,
}

impl Truth {
    /// The first value that cannot be a true one, with its name. A single such value would spoil
    /// the summary.
    fn impossible(&self) -> Option<(&'static str, f64)> {
        let place = [self.place_x_mm, self.place_y_mm].map(Option::unwrap_or_default);
        let values = [
            ("alpha_deg", self.alpha_deg, 180.0),
            ("beta_deg", self.beta_deg, 180.0),
            ("magnitude_n", self.magnitude_n, 1e3),
            ("x_n", self.x_n, 1e3),
            ("y_n", self.y_n, 1e3),
            ("z_n", self.z_n, 1e3),
            ("place_x_mm", place[0], 1e3),
            ("place_y_mm", place[1], 1e3),
        ];
        let mut impossible = values
            .iter()
            .filter(|(_, value, most)| value.is_nan() || value.abs() > *most);
        impossible.next().map(|(name, value, _)| (*name, *value))
    }

    /// Where the tip touches the film, mm along x and y from its middle.
    pub fn place_mm(&self) -> Option<[f64; 2]> {
        Some([self.place_x_mm?, self.place_y_mm?])
    }
}

/// A log of JSON lines that may still grow while it is read.
pub struct TruthFile {
    path: String,
    file: File,
    /// The part of a line whose end was not read yet.
    partial: Vec<u8>,
    lines: usize,
    frames: HashMap<u32, Option<Truth>>,
}

impl TruthFile {
    /// Opens the log.
    pub fn open(path: &str) -> Result<TruthFile, Failure> {
        let file = File::open(path).map_err(|error| {
            let hint = match error.kind() {
                ErrorKind::NotFound => "; start what writes it first",
                _ => "",
            };
            Failure::input(format!("cannot open the truth file {path}: {error}{hint}"))
        })?;
        let path = path.to_owned();
        Ok(TruthFile {
            path,
            file,
            partial: Vec::new(),
            lines: 0,
            frames: HashMap::new(),
        })
    }

    /// Returns a frame's true force and forgets it; waits a little for its line. `None` if the line
    /// does not come or has no force.
    pub fn take(&mut self, frame: u32) -> Result<Option<Truth>, Failure> {
        let end = Instant::now() + PATIENCE;
        loop {
            self.read_on(frame)?;
            match self.frames.remove(&frame) {
                Some(truth) => return Ok(truth),
                None if Instant::now() >= end => return Ok(None),
                None => (),
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }

    /// Reads to the file's end, or until the frame's line was read.
    fn read_on(&mut self, frame: u32) -> Result<(), Failure> {
        while !self.frames.contains_key(&frame) && self.read_some()? {}
        Ok(())
    }

    /// Reads one block; false at the file's end.
    fn read_some(&mut self) -> Result<bool, Failure> {
        let before = self.partial.len();
        (&self.file)
            .take(READ_AT_ONCE)
            .read_to_end(&mut self.partial)
            .map_err(|error| self.failure(&format!("cannot be read: {error}")))?;
        if let Some(end) = self.partial.iter().rposition(|byte| *byte == b'\n') {
            let rest = self.partial.split_off(end + 1);
            let whole = std::mem::replace(&mut self.partial, rest);
            let mut lines = whole[..end].split(|byte| *byte == b'\n');
            lines.try_for_each(|line| self.keep(line))?;
            return Ok(true);
        }
        if self.partial.len() > LONGEST_LINE {
            let what = format!(
                "line {} is longer than {LONGEST_LINE} bytes: this is no log of a simulated sensor",
                self.lines + 1
            );
            return Err(self.failure(&what));
        }
        Ok(self.partial.len() > before)
    }

    fn keep(&mut self, line: &[u8]) -> Result<(), Failure> {
        self.lines += 1;
        let line: Line = serde_json::from_slice(line)
            .map_err(|error| self.failure(&format!("line {}: {error}", self.lines)))?;
        let number = self.lines;
        if let Some((name, value)) = line.truth.as_ref().and_then(Truth::impossible) {
            let what = format!("line {number}: {name} is {value:e}, which no sensor measures");
            return Err(self.failure(&what));
        }
        if self.frames.len() >= MOST_WAITING {
            let what =
                format!("line {number}: {MOST_WAITING} frames before it were never received");
            return Err(self.failure(&what));
        }
        self.frames.insert(line.frame, line.truth);
        Ok(())
    }

    fn failure(&self, what: &str) -> Failure {
        Failure::input(format!("truth file {}: {what}", self.path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn line(frame: u32, alpha: f64) -> String {
        format!(
            r#"{{"frame":{frame},"time_us":5,"alpha_deg":{alpha},"beta_deg":0.5,"magnitude_n":0.1,"x_n":0.0,"y_n":0.0,"z_n":-0.1}}"#
        )
    }

    #[test]
    fn frames_are_joined_by_number_while_the_file_grows() {
        let mut log = tempfile::NamedTempFile::new().unwrap();
        write!(
            log,
            "{}\n{}\n{}",
            line(3, 1.0),
            line(5, 2.0),
            &line(6, 3.0)[..20]
        )
        .unwrap();
        let mut truth = TruthFile::open(log.path().to_str().unwrap()).unwrap();
        assert_eq!(truth.take(5).unwrap().unwrap().alpha_deg, 2.0);
        assert_eq!(truth.take(4).unwrap(), None);
        assert_eq!(truth.take(6).unwrap(), None, "half a line is no truth");
        writeln!(log, "{}", &line(6, 3.0)[20..]).unwrap();
        assert_eq!(truth.take(6).unwrap().unwrap().alpha_deg, 3.0);
        assert_eq!(truth.take(3).unwrap().unwrap().alpha_deg, 1.0);
    }

    #[test]
    fn it_waits_for_a_line_that_comes_late() {
        let log = tempfile::NamedTempFile::new().unwrap();
        let path = log.path().to_str().unwrap().to_owned();
        let mut writer = log.reopen().unwrap();
        let thread = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(60));
            writeln!(writer, "{}", line(1, 4.0)).unwrap();
        });
        assert_eq!(
            TruthFile::open(&path)
                .unwrap()
                .take(1)
                .unwrap()
                .unwrap()
                .alpha_deg,
            4.0
        );
        thread.join().unwrap();
    }

    #[test]
    fn a_line_without_a_force_is_a_frame_without_a_truth() {
        let mut log = tempfile::NamedTempFile::new().unwrap();
        writeln!(
            log,
            "{{\"frame\":1,\"time_us\":5}}\n{}",
            line(2, 1.0).replace("0.1,", "null,")
        )
        .unwrap();
        writeln!(log, "{}", line(3, 7.0)).unwrap();
        let mut truth = TruthFile::open(log.path().to_str().unwrap()).unwrap();
        assert_eq!(truth.take(1).unwrap(), None);
        assert_eq!(truth.take(2).unwrap(), None);
        assert_eq!(truth.take(3).unwrap().unwrap().alpha_deg, 7.0);
    }

    #[test]
    fn a_place_is_there_when_the_log_has_both_coordinates() {
        let mut log = tempfile::NamedTempFile::new().unwrap();
        let with = |frame, place: &str| line(frame, 1.0).replace('}', &format!(",{place}}}"));
        writeln!(log, "{}", line(1, 1.0)).unwrap();
        let whole = with(2, r#""place_x_mm":0.25,"place_y_mm":-1.5"#);
        writeln!(log, "{whole}").unwrap();
        writeln!(log, "{}", with(3, r#""place_x_mm":0.25"#)).unwrap();
        let at_rest = with(4, r#""place_x_mm":null,"place_y_mm":null"#);
        writeln!(log, "{at_rest}").unwrap();
        let mut truth = TruthFile::open(log.path().to_str().unwrap()).unwrap();
        let mut place = |frame| truth.take(frame).unwrap().unwrap().place_mm();
        assert_eq!(place(1), None);
        assert_eq!(place(2), Some([0.25, -1.5]));
        assert_eq!((place(3), place(4)), (None, None));
    }

    #[test]
    fn a_bad_line_is_named() {
        let mut log = tempfile::NamedTempFile::new().unwrap();
        writeln!(log, "{}\nnonsense", line(1, 0.0)).unwrap();
        let path = log.path().to_str().unwrap();
        let error = TruthFile::open(path)
            .unwrap()
            .take(1)
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with(&format!("truth file {path}: line 2: ")),
            "{error}"
        );
        assert!(TruthFile::open("/nowhere").is_err());
    }

    #[test]
    fn what_is_no_log_is_not_read_to_its_end() {
        let error = |path: &str| TruthFile::open(path).unwrap().take(1).unwrap_err();
        let endless = error("/dev/zero").to_string();
        assert!(
            endless.contains("line 1 is longer than 65536 bytes"),
            "{endless}"
        );
        let mut log = tempfile::NamedTempFile::new().unwrap();
        writeln!(log, "{}", line(1, 1.0).replace("0.1", "1e308")).unwrap();
        let impossible = error(log.path().to_str().unwrap()).to_string();
        assert!(
            impossible.contains("line 1: magnitude_n is 1e308"),
            "{impossible}"
        );
    }
}
