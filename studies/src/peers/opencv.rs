//! The paper's image processing in OpenCV, as a detector: a Python that is shown frames through a
//! pipe.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, ensure};
use hivtac_calibration::data::dataset::{Detection, MarkerDetector, Observation};
use hivtac_sensor::force::features::Features;
use hivtac_terms::marker::Marker;
use hivtac_terms::units::Px;
use hivtac_twin::Frame;

const ENVIRONMENT: &str = include_str!("../../python/opencv_environment.py");
const PIPELINE: &str = include_str!("../../python/paper_pipeline.py");

/// A Python that has OpenCV.
#[derive(Clone, Debug)]
pub struct Python {
    python: PathBuf,
    pipeline: PathBuf,
}

impl Python {
    /// Makes it in a folder, or finds it there.
    ///
    /// # Errors
    /// When there is no `python3`, or it cannot install OpenCV.
    pub fn in_folder(folder: &Path) -> Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
        let script = |name: &str, text: &str| {
            let path = folder.join(name);
            fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
            Ok::<_, anyhow::Error>(path)
        };
        let environment = script("opencv_environment.py", ENVIRONMENT)?;
        let made = Command::new("python3")
            .arg(environment)
            .arg(folder.join("venv"))
            .stderr(Stdio::inherit())
            .output()
            .context("`python3` cannot be started: install Python 3 with its venv module")?;
        ensure!(
            made.status.success(),
            "there is no Python with OpenCV (see above): install python3-venv, and see that pip \
             reaches its index"
        );
        Ok(Self {
            python: PathBuf::from(String::from_utf8(made.stdout)?.trim()),
            pipeline: script("paper_pipeline.py", PIPELINE)?,
        })
    }

    /// A detector for frames of a size.
    ///
    /// # Errors
    /// When Python cannot be started.
    pub fn detector(&self, width: u16, height: u16) -> Result<OpenCv> {
        OpenCv::start(
            Command::new(&self.python).arg(&self.pipeline),
            width,
            height,
        )
    }
}

/// The paper's image processing in a process of its own.
pub struct OpenCv {
    process: Child,
    frames: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl OpenCv {
    fn start(command: &mut Command, width: u16, height: u16) -> Result<Self> {
        let mut process = command
            .args([width.to_string(), height.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {command:?}"))?;
        Ok(Self {
            frames: process.stdin.take(),
            answers: BufReader::new(process.stdout.take().context("it has no output")?),
            process,
        })
    }
}

impl MarkerDetector for OpenCv {
    fn detect(&mut self, frame: &Frame) -> Result<Detection> {
        let bytes: Vec<u8> = frame.pixels.iter().flat_map(|p| p.to_le_bytes()).collect();
        let mut line = String::new();
        let frames = self.frames.as_mut().context("it takes no frames")?;
        let asked = frames.write_all(&bytes).and_then(|()| frames.flush());
        asked
            .and_then(|()| self.answers.read_line(&mut line))
            .context("OpenCV's process has ended")?;
        let contours: Vec<[f64; 3]> =
            serde_json::from_str(&line).with_context(|| format!("OpenCV answered `{line}`"))?;
        Ok(observation(&contours))
    }
}

impl Drop for OpenCv {
    fn drop(&mut self) {
        // Without frames to come it ends by itself.
        self.frames = None;
        let _ = self.process.wait();
    }
}

/// The paper's features of four contours (x, y, area in px), which lie in the four quadrants about
/// their middle.
fn observation(contours: &[[f64; 3]]) -> Detection {
    let missing = || "markers_missing".to_owned();
    if contours.len() != 4 {
        return Err(missing());
    }
    let middle = [0, 1].map(|axis| contours.iter().map(|c| c[axis]).sum::<f64>() / 4.0);
    let mut markers = [None; 4];
    for [x, y, area] in contours {
        let identity = match (*x < middle[0], *y < middle[1]) {
            (true, true) => 0,
            (false, true) => 1,
            (false, false) => 2,
            (true, false) => 3,
        };
        let q16 = |px: f64| Px((px * 65_536.0).round() as i32);
        markers[identity] = Some(Marker {
            x: q16(*x),
            y: q16(*y),
            area: area.round() as u32,
        });
    }
    let [Some(a), Some(b), Some(c), Some(d)] = markers else {
        return Err(missing());
    };
    let markers = [a, b, c, d];
    Ok(Observation {
        features_q16: Features::of_markers(&markers).to_array(),
        areas_px: markers.map(|marker| marker.area),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_calibration::data::dataset::Recipe;

    #[test]
    fn contours_become_features_whatever_their_order() {
        let contours = [
            [30.5, 10.0, 90.0],
            [10.0, 10.25, 80.0],
            [10.0, 30.0, 70.0],
            [30.0, 31.0, 60.0],
        ];
        let seen = observation(&contours).unwrap();
        let px = seen.features_px();
        assert_eq!(px[..8], [10.0, 10.25, 30.5, 10.0, 30.0, 31.0, 10.0, 30.0]);
        assert_eq!(px[8..], [20.25, 20.5, 20.5 * 21.0]);
        assert_eq!(seen.areas_px, [80, 90, 60, 70]);
        assert!(observation(&contours[..3]).is_err());
        let mut twice = contours;
        twice[0] = [11.0, 11.0, 90.0];
        assert_eq!(observation(&twice), Err("markers_missing".into()));
    }

    /// A process that answers without looking: what goes through the pipe, and what is said when it
    /// ends.
    #[test]
    fn frames_and_answers_go_through_a_pipe() {
        let scene = Recipe::default().scene(0).unwrap();
        let frame = scene.render_load(&hivtac_twin::Load::REST, 0).unwrap();
        let answer = "[[1,1,5],[9,1,5],[9,9,5],[1,9,5]]";
        let script =
            format!("head -c 153600 >/dev/null; echo '{answer}'; head -c 153600 >/dev/null");
        let mut shell = Command::new("sh");
        let mut detector = OpenCv::start(shell.args(["-c", &script]), 320, 240).unwrap();
        assert_eq!(detector.detect(&frame).unwrap().unwrap().areas_px, [5; 4]);
        let error = format!("{:#}", detector.detect(&frame).unwrap_err());
        assert!(error.contains("OpenCV"), "{error}");
    }
}
