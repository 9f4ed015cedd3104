//! The truth log: one JSON object per frame, as `hivtac monitor --truth` reads it.

use hivtac_host::failure::Failure;
use hivtac_host::live::run::FrameTruth;
use hivtac_host::shown::to_json;
use serde_json::{Value, json};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// The log's file.
pub struct TruthLog {
    name: String,
    file: File,
}

impl TruthLog {
    /// A log in a file, which is emptied first.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn create(path: &Path) -> Result<TruthLog, Failure> {
        let name = path.display().to_string();
        match File::create(path) {
            Ok(file) => Ok(TruthLog { name, file }),
            Err(error) => Err(Failure::of_file(&name, error)),
        }
    }

    /// Writes a frame, at once: a reader that follows the file sees it whole.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&mut self, frame: &FrameTruth) -> Result<(), Failure> {
        let line = to_json(&line(frame)) + "\n";
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|error| Failure::of_file(&self.name, error))
    }
}

fn line(frame: &FrameTruth) -> Value {
    let force = frame.truth.force;
    let [x, y, z] = force.vector_n();
    let place = frame.truth.touches_mm;
    json!({
        "frame": frame.frame,
        "time_us": frame.time_us,
        "alpha_deg": force.alpha_deg(),
        "beta_deg": force.beta_deg(),
        "magnitude_n": force.magnitude_n(),
        "x_n": x, "y_n": y, "z_n": z,
        "place_x_mm": place.map(|[x, _]| x),
        "place_y_mm": place.map(|[_, y]| y),
    })
}
