//! The truth log: one JSON object per exposure, for comparison with the firmware's results.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use anyhow::Context;
use hivtac_twin::Shutter;
use serde_json::{Value, json};

/// The truth log and its file, if it has one. The truth never enters the firmware.
#[derive(Debug, Default)]
pub struct TruthLog {
    file: Option<File>,
    failed: Option<String>,
}

/// One exposure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exposed {
    /// Ends of VSYNC pulses since the camera's first register reset after the microcontroller's
    /// reset, counted from 1. Zero before that.
    pub frame: u64,
    /// Ends of VSYNC pulses since the run began. The scene's noise depends on it.
    pub exposure: u64,
    /// Virtual time of the edge, ns.
    pub at_ns: u64,
    /// Virtual time of the middle of the exposure of the middle row, ns.
    pub middle_ns: u64,
    /// Exposure time of each row, ns.
    pub exposure_ns: u64,
    /// Time from the exposure of the first row to that of a row just below the last, ns.
    pub readout_ns: u64,
}

impl Exposed {
    /// Returns the time in the scene, s.
    pub fn time_s(&self) -> f64 {
        self.middle_ns as f64 / 1e9
    }

    /// Returns when each row was exposed.
    pub fn shutter(&self) -> Shutter {
        Shutter {
            exposure_s: self.exposure_ns as f64 / 1e9,
            readout_s: self.readout_ns as f64 / 1e9,
        }
    }
}

impl TruthLog {
    /// Returns a log in a file, which is emptied first.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| format!("truth log {}", path.display()))?;
        Ok(Self {
            file: Some(file),
            failed: None,
        })
    }

    /// Returns whether the log has a file.
    pub fn wanted(&self) -> bool {
        self.file.is_some()
    }

    /// Writes one exposure, at once: a reader that follows the file sees it.
    pub fn exposed(&mut self, exposed: Exposed, truth: Value) {
        let Some(file) = &mut self.file else { return };
        let mut line = json!({
            "frame": exposed.frame,
            "exposure": exposed.exposure,
            "time_us": exposed.at_ns / 1000,
            "time_s": exposed.time_s(),
            "exposure_s": exposed.shutter().exposure_s,
            "readout_s": exposed.shutter().readout_s,
        });
        if let (Some(line), Value::Object(truth)) = (line.as_object_mut(), truth) {
            line.extend(truth);
        }
        // In one piece: a reader meanwhile finds half a line at most where it crosses a page.
        if let Err(error) = file.write_all(format!("{line}\n").as_bytes()) {
            self.failed = Some(error.to_string());
            self.file = None;
        }
    }

    /// Returns the reason why the log ended early; `None` if it did not.
    pub fn failure(&self) -> Option<&str> {
        self.failed.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_finds_each_exposure_as_a_whole_line_at_once() {
        const LINES: u64 = 50;
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut log = TruthLog::create(file.path()).unwrap();
        for frame in 1..=LINES {
            let exposed = Exposed {
                frame,
                ..Exposed::default()
            };
            log.exposed(exposed, json!({ "alpha_deg": 4.0 }));
            let text = std::fs::read_to_string(file.path()).unwrap();
            assert!(text.ends_with('\n'));
            let last = text.lines().last().unwrap();
            let line: Value = serde_json::from_str(last).unwrap();
            assert_eq!(line["frame"], frame);
            assert_eq!(line["alpha_deg"], 4.0);
            assert_eq!(text.lines().count() as u64, frame);
        }
    }
}
