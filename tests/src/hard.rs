//! Runs the pipeline on the hard cases, and collects the results.

use std::collections::BTreeSet;
use std::format;
use std::string::{String, ToString};
use std::vec;
use std::vec::Vec;

use anyhow::Result;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::PixelFormat;
use hivtac_twin::hard_cases::{Expected, HardCase, hard_cases, hard_loads};
use hivtac_twin::{Contact, Frame, Scene};

use crate::tared::{Detection, View};

/// The results of the pipeline on the frames of one case.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The case.
    pub case: HardCase,
    /// The camera and pipeline that saw it.
    pub view: View,
    /// Frames shown.
    pub frames: usize,
    /// Frames with a force.
    pub trusted: usize,
    /// The largest error of a marker in frames with a force, px.
    pub worst_px: f64,
    /// The reasons of the frames without a force.
    pub reasons: BTreeSet<&'static str>,
}

impl Outcome {
    fn nothing(case: &HardCase, view: View) -> Outcome {
        Outcome {
            case: case.clone(),
            view,
            frames: 0,
            trusted: 0,
            worst_px: 0.0,
            reasons: BTreeSet::new(),
        }
    }

    fn add(&mut self, detection: Detection) {
        self.frames += 1;
        match detection {
            Detection::Trusted { worst_px, .. } => {
                self.trusted += 1;
                self.worst_px = self.worst_px.max(worst_px);
            }
            Detection::Refused(status) => {
                let forbids = |(bit, _): &&(Status, &str)| {
                    Status::NO_FORCE.contains(*bit) && status.contains(*bit)
                };
                let reasons = Status::NAMES.iter().filter(forbids);
                self.reasons.extend(reasons.map(|(_, name)| *name));
            }
        }
    }

    /// Returns the largest allowed error of a marker, px; 1 under four-fold noise. Beyond QVGA,
    /// compression may move markers by 0.05 px more than usual: its effect on a pattern is no
    /// larger than that of a press. For a tip that sticks or slips the limit is 0.15 px wider.
    pub fn tolerance_px(&self) -> f64 {
        let width = self.view.size[0];
        let case = self.case.tolerance_px(width);
        let compressed = width > 320 && self.case.name.starts_with("jpeg-");
        let moves_along = self.view.contact != Contact::Force;
        let more = |yes: bool, px: f64| if yes { px } else { 0.0 };
        (self.view.tolerance_px() + more(compressed, 0.05) + more(moves_along, 0.15)).max(case)
    }

    /// Returns whether a frame had wrong markers without a status that reports it.
    pub fn is_silently_wrong(&self) -> bool {
        self.trusted > 0
            && (self.worst_px > self.tolerance_px() || self.case.expected == Expected::Rejected)
    }

    /// Returns whether plainly visible markers were refused in most frames. Dim markers do not
    /// count as plainly visible in YUV422, whose chroma fades with the light.
    pub fn is_overlooked(&self) -> bool {
        let dim = ["gain-", "one-sided-"];
        let dim = dim.iter().any(|name| self.case.name.starts_with(name));
        let plain = self.case.expected == Expected::Found
            && !(dim && self.view.format == PixelFormat::Yuv422);
        plain && 2 * self.trusted < self.frames
    }

    /// Returns a row of the table: case, found, rejected, worst error, reasons.
    pub fn row(&self) -> String {
        let worst = match self.trusted {
            0 => "–".to_string(),
            _ => format!("{:.2}", self.worst_px),
        };
        let reasons = self.reasons.iter().copied().collect::<Vec<_>>().join(", ");
        let rejected = self.frames - self.trusted;
        format!(
            "| {} | {} | {} | {} | {worst} | {reasons} |",
            self.case.name, self.case.what, self.trusted, rejected
        )
    }
}

/// Runs every hard case that the views' camera can take, under every load of the catalogue, with
/// `repeats` frames each. Moving cases have as many moments instead. The views differ only in their
/// estimators, and therefore see the same frames. Returns the outcomes of each view.
///
/// # Errors
/// If the frame size is not valid.
pub fn detect_in_all(views: &[View], repeats: u64) -> Result<Vec<Vec<Outcome>>> {
    let mut all = vec![Vec::new(); views.len()];
    let Some(shown) = views.first() else {
        return Ok(all);
    };
    let sensors: Result<Vec<_>> = views.iter().map(View::sensor).collect();
    let mut sensors = sensors?;
    for case in hard_cases() {
        let [width, height] = shown.size;
        let scene = shown.pressed(case.scene(shown.preset, width, height, 7)?)?;
        if !shown.takes(&scene) {
            continue;
        }
        let nothing = |view: &View| Outcome::nothing(&case, *view);
        let mut outcomes: Vec<Outcome> = views.iter().map(nothing).collect();
        for frame in frames(&scene, case.moves(), repeats)? {
            for (sensor, outcome) in sensors.iter_mut().zip(&mut outcomes) {
                outcome.add(sensor.detect(&frame));
            }
        }
        for (outcomes, outcome) in all.iter_mut().zip(outcomes) {
            outcomes.push(outcome);
        }
    }
    Ok(all)
}

/// Returns the frames of a case: moments of its motion, or presses of the catalogue's loads.
fn frames(scene: &Scene, moves: bool, repeats: u64) -> Result<Vec<Frame>> {
    let loads = hard_loads();
    if moves {
        let count = repeats * loads.len() as u64;
        let moments = (0..count).map(|number| scene.frame(number, 0.2 + number as f64 * 0.013));
        return Ok(moments.collect());
    }
    let mut frames = Vec::new();
    for (index, load) in (0..).zip(&loads) {
        for repeat in 0..repeats {
            frames.push(scene.render_load(load, 100 * index + repeat)?);
        }
    }
    Ok(frames)
}

/// Returns the Markdown table of one view's outcomes.
pub fn table(view: View, outcomes: &[Outcome]) -> String {
    let preset = view.preset.name();
    let estimator = match view.estimator {
        CentroidEstimator::BinaryMask => "binary",
        CentroidEstimator::RednessWeighted => "redness-weighted",
    };
    let [width, height] = view.size;
    let format = view.format.name();
    let contact = match view.contact {
        Contact::Force => String::new(),
        contact => format!(", contact `{contact}`"),
    };
    let mut table = format!(
        "### {preset}, {width}×{height}, {format}, {estimator} centroids{contact}\n\n\
         | case | what | found | rejected | worst, px | why rejected |\n|---|---|--:|--:|--:|---|\n"
    );
    for outcome in outcomes {
        table.push_str(&outcome.row());
        table.push('\n');
    }
    table
}
