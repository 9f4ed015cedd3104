//! What was found, step by step: for a person on the terminal, and in one file to pass on.

use hivtac_host::failure::Failure;
use serde::Serialize;
use serde_json::Value;

/// Every step, in the order in which things go wrong.
const STEPS: [&str; 7] = [
    "usb", "camera", "clocks", "white", "markers", "noise", "press",
];

/// One step.
#[derive(Debug, Serialize)]
pub struct Step {
    /// Its name, of [`STEPS`].
    step: &'static str,
    right: bool,
    /// What was found.
    found: String,
    /// What is wrong and what to do; empty when it is right.
    wrong: Vec<String>,
    /// What was measured.
    figures: Value,
}

impl Step {
    /// A step that is right when nothing is `wrong`.
    pub fn new(step: &'static str, found: String, wrong: Vec<String>, figures: Value) -> Step {
        Step {
            step,
            right: wrong.is_empty(),
            found,
            wrong,
            figures,
        }
    }

    /// More things are wrong.
    pub fn add(&mut self, wrong: Vec<String>) {
        self.wrong.extend(wrong);
        self.right = self.wrong.is_empty();
    }

    /// Whether nothing is wrong.
    pub fn is_right(&self) -> bool {
        self.right
    }

    /// A line with what was found, and one for each thing that is wrong.
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

/// All of it.
#[derive(Serialize)]
pub struct Report {
    /// This tool.
    hivtac: &'static str,
    /// As `hivtac info --json` has it; nothing when there is no device.
    pub device: Value,
    /// Whether every step was gone through and is right.
    right: bool,
    /// As far as it came.
    pub steps: Vec<Step>,
    /// What was not looked at, as it rests on what is wrong.
    not_done: Vec<&'static str>,
}

impl Report {
    /// Before the first step.
    pub fn new() -> Report {
        Report {
            hivtac: env!("CARGO_PKG_VERSION"),
            device: Value::Null,
            right: false,
            steps: Vec::new(),
            not_done: Vec::new(),
        }
    }

    /// Whether all is right so far.
    pub fn is_right(&self) -> bool {
        self.steps.iter().all(Step::is_right)
    }

    /// Names of what is wrong.
    pub fn wrong(&self) -> Vec<&'static str> {
        let wrong = self.steps.iter().filter(|step| !step.right);
        wrong.map(|step| step.step).collect()
    }

    /// There are no more steps.
    pub fn finish(&mut self) {
        let done = |name: &&str| self.steps.iter().any(|step| step.step == *name);
        self.not_done = STEPS.into_iter().filter(|name| !done(name)).collect();
        self.right = self.is_right() && self.not_done.is_empty();
    }

    /// As JSON, for people to read, too.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Writes it to a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &str) -> Result<(), Failure> {
        std::fs::write(path, self.json() + "\n")
            .map_err(|error| Failure::input(format!("cannot write the report {path}: {error}")))
    }
}
