//! Steps that are run one after the other, whatever becomes of each, and the table of how they
//! went.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::process;

/// Tests that passed and failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Tests that passed.
    pub passed: u64,
    /// Tests that failed.
    pub failed: u64,
}

impl Tally {
    /// Adds what a line of a test runner says, if it is its summary:
    /// `test result: ok. 6 passed; 0 failed; …`.
    pub fn add_line(&mut self, line: &str) {
        let Some((_, summary)) = line.split_once("test result: ") else {
            return;
        };
        let before = |word: &str| -> u64 {
            let number = summary.split_once(word).map(|(text, _)| text.trim_end());
            let digits = number.and_then(|text| text.rsplit([' ', '.']).next());
            digits.and_then(|digits| digits.parse().ok()).unwrap_or(0)
        };
        self.passed += before(" passed");
        self.failed += before(" failed");
    }
}

struct Step {
    name: &'static str,
    /// Why it was left out.
    obstacle: Option<&'static str>,
    problem: Option<String>,
    duration: Duration,
    tally: Tally,
}

/// How the steps so far went.
#[derive(Default)]
pub struct Report {
    steps: Vec<Step>,
}

impl Report {
    /// Runs a step and keeps what became of it. Gives its result when it went well.
    pub fn step<T>(
        &mut self,
        name: &'static str,
        work: impl FnOnce(&mut Tally) -> Result<T>,
    ) -> Option<T> {
        process::say(&format!("\n=== {name}"));
        let (start, mut tally) = (Instant::now(), Tally::default());
        let result = work(&mut tally);
        let problem = result.as_ref().err().map(|error| format!("{error:#}"));
        if let Some(problem) = &problem {
            process::say(&format!("=== {name} failed: {problem}"));
        }
        self.steps.push(Step {
            name,
            obstacle: None,
            problem,
            duration: start.elapsed(),
            tally,
        });
        result.ok()
    }

    /// Runs a step that nothing depends on, unless something keeps it from running here.
    pub fn optional(
        &mut self,
        name: &'static str,
        obstacle: Option<&'static str>,
        work: impl FnOnce(&mut Tally) -> Result<()>,
    ) {
        match obstacle {
            None => drop(self.step(name, work)),
            Some(obstacle) => self.leave_out(name, obstacle),
        }
    }

    /// Takes over the steps of another.
    pub fn append(&mut self, other: Report) {
        self.steps.extend(other.steps);
    }

    /// Notes that a step is left out, and why.
    fn leave_out(&mut self, name: &'static str, obstacle: &'static str) {
        process::say(&format!("\n=== {name} is left out: {obstacle}"));
        self.steps.push(Step {
            name,
            obstacle: Some(obstacle),
            problem: None,
            duration: Duration::ZERO,
            tally: Tally::default(),
        });
    }

    /// Prints the table.
    ///
    /// # Errors
    /// When a step failed: names all that did.
    pub fn finish(&self) -> Result<()> {
        println!(
            "\n{:<34}{:>8}{:>9}{:>8}{:>9}",
            "step", "result", "seconds", "passed", "failed"
        );
        self.steps.iter().for_each(Step::print);
        let total = self.total();
        let failed: Vec<_> = self.failed().map(|step| step.name).collect();
        for (step, obstacle) in self.left_out() {
            println!("{step} was not run: {obstacle}");
        }
        for step in self.failed() {
            println!("{}: {}", step.name, step.problem.as_deref().unwrap_or(""));
        }
        println!("{} steps, {} failed", self.steps.len(), failed.len());
        println!("{} passed, {} failed", total.passed, total.failed);
        if !failed.is_empty() {
            bail!("failed: {}", failed.join("; "));
        }
        Ok(())
    }

    fn failed(&self) -> impl Iterator<Item = &Step> {
        self.steps.iter().filter(|step| step.problem.is_some())
    }

    fn left_out(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let steps = self.steps.iter();
        steps.filter_map(|step| Some((step.name, step.obstacle?)))
    }

    fn total(&self) -> Tally {
        self.steps.iter().fold(Tally::default(), |sum, step| Tally {
            passed: sum.passed + step.tally.passed,
            failed: sum.failed + step.tally.failed,
        })
    }
}

impl Step {
    fn print(&self) {
        let result = match (&self.problem, self.obstacle) {
            (Some(_), _) => "FAILED",
            (None, Some(_)) => "not run",
            (None, None) => "ok",
        };
        let seconds = self.duration.as_secs_f64();
        let Tally { passed, failed } = self.tally;
        if (passed, failed) == (0, 0) {
            println!("{:<34}{result:>8}{seconds:>9.1}", self.name);
        } else {
            println!(
                "{:<34}{result:>8}{seconds:>9.1}{passed:>8}{failed:>9}",
                self.name
            );
        }
    }
}

/// Runs a test runner, shows all it prints, and adds up its summaries.
///
/// # Errors
/// When it fails, or when it ran no test at all.
pub fn run_tests(command: &mut Command, tally: &mut Tally) -> Result<()> {
    process::for_each_line(command, |line| {
        process::print_through(line);
        tally.add_line(line);
    })?;
    if tally.passed == 0 {
        bail!("`{}` ran no test", process::display(command));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_of_test_runners_add_up() {
        let mut tally = Tally::default();
        tally
            .add_line("test result: ok. 6 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out");
        tally.add_line("test result: FAILED. 5 passed; 12 failed; 0 ignored\n");
        tally.add_line("test works ... ok");
        assert_eq!(
            tally,
            Tally {
                passed: 11,
                failed: 12
            }
        );
    }

    #[test]
    fn a_failing_step_does_not_keep_others_from_running() {
        let mut report = Report::default();
        assert_eq!(
            report.step("one", |_| -> Result<u8> { bail!("broken") }),
            None
        );
        assert_eq!(report.step("two", |_| Ok(2)), Some(2));
        let error = report.finish().unwrap_err().to_string();
        assert!(error.contains("one") && !error.contains("two"), "{error}");
    }

    #[test]
    fn a_step_that_was_left_out_is_told_and_fails_nothing() {
        let mut report = Report::default();
        report.optional("one", Some("it is night"), |_| bail!("it ran"));
        let told: Vec<_> = report.left_out().collect();
        assert_eq!(told, [("one", "it is night")]);
        assert!(report.finish().is_ok());
    }

    #[test]
    fn a_runner_without_tests_fails() {
        let mut tally = Tally::default();
        assert!(run_tests(&mut Command::new("true"), &mut tally).is_err());
    }
}
