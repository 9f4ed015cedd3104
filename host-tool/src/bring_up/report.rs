//! Collects the steps' results, for a person on the terminal and in one file to pass on.

use hivtac_host::failure::Failure;
use serde::Serialize;
use serde_json::Value;

/// The names of all steps, in the order in which faults occur.
const STEPS: [&str; 8] = [
    "usb", "camera", "clocks", "white", "markers", "film", "noise", "press",
];

/// The result of one step.
#[derive(Debug, Serialize)]
pub struct Step {
    /// Its name, one of [`STEPS`].
    step: &'static str,
    right: bool,
    /// The finding.
    found: String,
    /// Faults and remedies; empty if the step is right.
    wrong: Vec<String>,
    /// The measured values.
    figures: Value,
}

impl Step {
    /// A step that is right if `wrong` is empty.
    pub fn new(step: &'static str, found: String, wrong: Vec<String>, figures: Value) -> Step {
        Step {
            step,
            right: wrong.is_empty(),
            found,
            wrong,
            figures,
        }
    }

    /// Adds faults.
    pub fn add(&mut self, wrong: Vec<String>) {
        self.wrong.extend(wrong);
        self.right = self.wrong.is_empty();
    }

    /// Whether the step has no faults.
    pub fn is_right(&self) -> bool {
        self.right
    }

    /// A line with the finding, and one for each fault.
    pub fn text(&self) -> String {
        let verdict = if self.right { "right" } else { "WRONG" };
        let mut lines = vec![format!("{:<8} {verdict}  {}", self.step, self.found)];
        lines.extend(self.wrong.iter().map(|wrong| format!("{:16}{wrong}", "")));
        lines.join("\n")
    }

    #[cfg(test)]
    pub fn wrong(&self) -> &[String] {
        &self.wrong
    }
}

/// The results of all steps.
#[derive(Serialize)]
pub struct Report {
    /// The tool's version.
    hivtac: &'static str,
    /// As in `hivtac info --json`; null without a device.
    pub device: Value,
    /// Whether every step was done and is right.
    right: bool,
    /// The steps that were done.
    pub steps: Vec<Step>,
    /// Names of the steps that were not done, because they depend on one with a fault.
    not_done: Vec<&'static str>,
}

impl Report {
    /// An empty report.
    pub fn new() -> Report {
        Report {
            hivtac: env!("CARGO_PKG_VERSION"),
            device: Value::Null,
            right: false,
            steps: Vec::new(),
            not_done: Vec::new(),
        }
    }

    /// Whether all steps until now are right.
    pub fn is_right(&self) -> bool {
        self.steps.iter().all(Step::is_right)
    }

    /// Names of the steps that have faults.
    pub fn wrong(&self) -> Vec<&'static str> {
        let wrong = self.steps.iter().filter(|step| !step.right);
        wrong.map(|step| step.step).collect()
    }

    /// Notes that there are no more steps.
    pub fn finish(&mut self) {
        let done = |name: &&str| self.steps.iter().any(|step| step.step == *name);
        self.not_done = STEPS.into_iter().filter(|name| !done(name)).collect();
        self.right = self.is_right() && self.not_done.is_empty();
    }

    /// As indented JSON, which people can read.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Writes it to a file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &str) -> Result<(), Failure> {
        std::fs::write(path, self.json() + "\n")
            .map_err(|error| Failure::input(format!("cannot write the report {path}: {error}")))
    }
}
