//! What a sweep has found so far: a file of one JSON object a line, to which every finished
//! training is added, so that an interrupted sweep goes on.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

use super::frames::FrameTally;
use super::plan::{Numbers, Plan, Task};

/// How far one model was from the truth, on frames that it was not made from, within the calibrated
/// range of |F|.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// Frames.
    pub frames: usize,
    /// Mean angle between found and true force, degrees.
    pub direction_deg: f64,
    /// The same from 50 mN up.
    pub strong_direction_deg: f64,
    /// Root mean square error of |F|, mN.
    pub force_rmse_mn: f64,
    /// Root mean square error of each coordinate of the place from 50 mN up, µm.
    pub place_rmse_um: f64,
    /// Largest angle between found and true force from 50 mN up, degrees.
    pub worst_direction_deg: f64,
    /// Largest |error| of |F|, mN.
    pub worst_force_mn: f64,
    /// Frames that no single contact explains: without a force, and not among the others.
    pub unexplained: usize,
    /// How often the film was run forwards for a force, on average; 0 where the network stands
    /// alone.
    pub looks: f64,
}

/// One finished training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finished {
    /// What was trained.
    #[serde(flatten)]
    pub task: Task,
    /// What it was like in each arithmetic, with so many steps.
    pub figures: Vec<(Numbers, u8, Figures)>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Line {
    Plan(Plan),
    Frames { size: [u16; 2], seen: FrameTally },
    Finished(Finished),
}

/// A sweep's results, and the file that they are in.
#[derive(Clone, Debug)]
pub struct Results {
    file: PathBuf,
    /// What is swept.
    pub plan: Plan,
    /// What became of the frames of each size.
    pub seen: Vec<([u16; 2], FrameTally)>,
    /// Finished trainings.
    pub finished: Vec<Finished>,
}

impl Results {
    /// Reads what there is, or begins a file for `plan`. Another plan than the file's is an error,
    /// none is the file's.
    ///
    /// # Errors
    /// When the file cannot be read or written, holds something else, or the results of another
    /// plan.
    pub fn open(file: &Path, plan: Option<&Plan>) -> Result<Self> {
        let text = match fs::read_to_string(file) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => {
                return Err(error).with_context(|| format!("cannot read {}", file.display()));
            }
        };
        let mut results = Self {
            file: file.to_owned(),
            plan: plan.cloned().unwrap_or_default(),
            seen: Vec::new(),
            finished: Vec::new(),
        };
        // What comes after the last line's end was cut off while it was written.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        for (number, line) in whole.lines().enumerate() {
            let line = serde_json::from_str(line)
                .with_context(|| format!("{} line {}", file.display(), number + 1))?;
            results.take(line, plan).with_context(|| {
                format!(
                    "{}: remove it to begin anew, or use another name",
                    file.display()
                )
            })?;
        }
        if whole.len() + 1 != text.len() {
            results.write()?;
        }
        Ok(results)
    }

    fn take(&mut self, line: Line, wanted: Option<&Plan>) -> Result<()> {
        match line {
            Line::Plan(plan) => {
                let same = wanted.is_none_or(|wanted| *wanted == plan);
                ensure!(same, "it has the results of another plan: {plan:?}");
                self.plan = plan;
            }
            Line::Frames { size, seen } => self.seen.push((size, seen)),
            Line::Finished(finished) => self.finished.push(finished),
        }
        Ok(())
    }

    /// Writes everything again, in the plan's order.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&mut self) -> Result<()> {
        self.seen.sort_by_key(|(size, _)| *size);
        self.finished.sort_by(|a, b| a.task.cmp(&b.task));
        let frames = self
            .seen
            .iter()
            .map(|&(size, seen)| Line::Frames { size, seen });
        let finished = self.finished.iter().cloned().map(Line::Finished);
        let mut text = String::new();
        for line in std::iter::once(Line::Plan(self.plan.clone()))
            .chain(frames)
            .chain(finished)
        {
            text += &(serde_json::to_string(&line)? + "\n");
        }
        fs::write(&self.file, text).with_context(|| format!("cannot write {}", self.file.display()))
    }

    /// What is not finished among the trainings for a size.
    pub fn missing(&self, size: [u16; 2]) -> Vec<Task> {
        let mut tasks = self.plan.tasks(size);
        tasks.retain(|task| self.finished.iter().all(|finished| finished.task != *task));
        tasks
    }

    /// Takes what became of the frames of a size.
    ///
    /// # Errors
    /// When there are results of other frames, or it cannot be written.
    pub fn saw(&mut self, size: [u16; 2], seen: FrameTally) -> Result<()> {
        let before = self.seen.iter().find(|(known, _)| *known == size);
        if let Some((_, before)) = before {
            ensure!(
                *before == seen,
                "{} has results of other frames than are rendered now: remove it to begin anew",
                self.file.display()
            );
            return Ok(());
        }
        self.seen.push((size, seen));
        self.append(&Line::Frames { size, seen })
    }

    /// Takes a finished training.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn add(&mut self, finished: Finished) -> Result<()> {
        self.append(&Line::Finished(finished.clone()))?;
        self.finished.push(finished);
        Ok(())
    }

    fn append(&self, line: &Line) -> Result<()> {
        let text = serde_json::to_string(line)? + "\n";
        let mut file = OpenOptions::new().append(true).open(&self.file)?;
        file.write_all(text.as_bytes())
            .with_context(|| format!("cannot write {}", self.file.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finished(task: &Task) -> Finished {
        let figures = Figures {
            frames: 10,
            direction_deg: 0.5,
            strong_direction_deg: 0.2,
            force_rmse_mn: 0.1,
            place_rmse_um: 40.0,
            unexplained: 0,
            looks: 0.0,
            worst_direction_deg: 1.0,
            worst_force_mn: 0.3,
        };
        Finished {
            task: task.clone(),
            figures: vec![(Numbers::F32, 0, figures)],
        }
    }

    fn small() -> Plan {
        Plan {
            sizes: vec![[160, 120]],
            rows: 10,
            ..Plan::default()
        }
    }

    #[test]
    fn an_interrupted_sweep_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("results.jsonl");
        let size = [160, 120];
        let mut results = Results::open(&file, Some(&small())).unwrap();
        let tasks = results.missing(size);
        for task in &tasks[..5] {
            results.add(finished(task)).unwrap();
        }
        assert_eq!(results.missing(size), tasks[5..]);
        let bytes = fs::read(&file).unwrap();
        // Cut in the last line: that training is done again.
        fs::write(&file, &bytes[..bytes.len() - 7]).unwrap();
        let mut results = Results::open(&file, Some(&small())).unwrap();
        assert_eq!(results.missing(size), tasks[4..]);
        for task in tasks[4..].iter().rev() {
            results.add(finished(task)).unwrap();
        }
        results.write().unwrap();
        let results = Results::open(&file, None).unwrap();
        assert!(results.missing(size).is_empty());
        assert_eq!(results.plan, small());
        let order: Vec<_> = results.finished.iter().map(|f| f.task.clone()).collect();
        assert!(order.is_sorted());
    }

    #[test]
    fn results_of_something_else_are_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("results.jsonl");
        let mut results = Results::open(&file, Some(&small())).unwrap();
        let seen = FrameTally {
            frames: 10,
            rejected: [0; 2],
            fingerprint: 1,
        };
        results.saw([160, 120], seen).unwrap();
        let other = FrameTally {
            fingerprint: 2,
            ..seen
        };
        assert!(results.saw([160, 120], seen).is_ok());
        assert!(results.saw([160, 120], other).is_err());
        let error = Results::open(&file, Some(&Plan::default())).unwrap_err();
        assert!(format!("{error:#}").contains("another plan"), "{error:#}");
        fs::write(&file, "{}\n").unwrap();
        let error = Results::open(&file, None).unwrap_err();
        assert!(format!("{error:#}").contains("line 1"), "{error:#}");
    }
}
