//! Reports the steps of `cargo xtask test`: a line at each start and end, and a table of all.

use std::fs::File;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use crate::process;

/// Number of tests that passed and failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    passed: u64,
    failed: u64,
}

impl Tally {
    /// Adds a test runner's line; returns whether it sums up others. Rust's is `test result: ok. 6
    /// passed; 0 failed; …`. Python's unittest prints `NAME ... ok` for each test, and `Ran 6 tests
    /// in 1.2s` at the end.
    pub fn add_line(&mut self, line: &str) -> bool {
        if let Some((_, summary)) = line.split_once("test result: ") {
            let before = |word: &str| -> u64 {
                let words = summary
                    .split_once(word)
                    .and_then(|(text, _)| text.rsplit(' ').next());
                words.and_then(|number| number.parse().ok()).unwrap_or(0)
            };
            self.passed += before(" passed");
            self.failed += before(" failed");
            return true;
        }
        match line.trim_end().rsplit_once(" ... ") {
            Some((name, _)) if name.starts_with("test ") => {}
            Some((_, "ok")) => self.passed += 1,
            Some((_, "FAIL" | "ERROR")) => self.failed += 1,
            _ => return line.starts_with("Ran "),
        }
        false
    }
}

/// Runs a test runner, with its output to the step's log. Prints its summary lines at once and adds
/// them to the tally. An error if it fails or runs no tests.
pub fn run_tests(command: &mut Command, tally: &mut Tally) -> Result<()> {
    process::for_each_line(command, |line| {
        process::say(line);
        if tally.add_line(line) {
            println!("{line}");
        }
    })?;
    ensure!(tally.passed > 0, "`{command:?}` ran no test");
    Ok(())
}

struct Done {
    name: &'static str,
    result: &'static str,
    /// Why it failed or was not run; empty if it passed.
    why: String,
    seconds: f64,
    tally: Tally,
}

/// The steps of all threads until now.
pub struct Report {
    start: Instant,
    /// Number of steps.
    all: usize,
    /// Folder of the logs; each step writes a file with its name.
    logs: PathBuf,
    begun: AtomicUsize,
    done: Mutex<Vec<Done>>,
}

impl Report {
    /// A report of `all` steps, none of them run yet.
    pub fn new(all: usize, logs: PathBuf) -> Report {
        Report {
            start: Instant::now(),
            all,
            logs,
            begun: AtomicUsize::new(0),
            done: Mutex::default(),
        }
    }

    /// Runs a step on this thread and keeps its result, unless an obstacle prevents it. Its output
    /// goes to its log, which is shown after a failure.
    pub fn step(
        &self,
        name: &'static str,
        obstacle: impl FnOnce() -> Option<String>,
        work: impl FnOnce(&mut Tally) -> Result<()>,
    ) {
        let number = 1 + self.begun.fetch_add(1, Ordering::Relaxed);
        println!("{} begins: {name}", self.mark(number));
        let (begin, mut tally) = (Instant::now(), Tally::default());
        let log = self.logs.join(name.replace([':', ' '], "-") + ".txt");
        let work = || match obstacle() {
            Some(why) => Ok(("not run", why)),
            None => work(&mut tally).map(|()| ("ok", String::new())),
        };
        let file = File::create(&log).with_context(|| log.display().to_string());
        let done = file.and_then(|file| process::logged(file, work));
        let (result, why) = done.unwrap_or_else(|error| ("FAILED", format!("{error:#}")));
        if result == "FAILED" {
            let said = std::fs::read(&log).unwrap_or_default();
            // In one call, which keeps lines of other threads out.
            let said = String::from_utf8_lossy(&said);
            println!("=== {name}\n{said}\n=== {name}: {why}");
        }
        let seconds = begin.elapsed().as_secs_f64();
        let mut steps = self.done();
        steps.push(Done {
            name,
            result,
            why,
            seconds,
            tally,
        });
        let (mark, so_far) = (self.mark(number), summary(&steps));
        println!("{mark} {result}: {name}, {seconds:.1} s; so far: {so_far}");
    }

    /// The step's number, and the time since the first began.
    fn mark(&self, number: usize) -> String {
        let (all, seconds) = (self.all, self.start.elapsed().as_secs());
        format!("[{number}/{all} {}:{:02}]", seconds / 60, seconds % 60)
    }

    fn done(&self) -> MutexGuard<'_, Vec<Done>> {
        self.done.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Prints the table; an error names the failed steps.
    pub fn finish(&self) -> Result<()> {
        let steps = self.done();
        println!("\nstep                                result  seconds  passed  failed");
        for step in &*steps {
            let Tally { passed, failed } = step.tally;
            let tests = format!("{passed:>8}{failed:>8}");
            let tests = if passed + failed > 0 { &tests } else { "" };
            let (name, result, seconds) = (step.name, step.result, step.seconds);
            println!("{name:<34}{result:>8}{seconds:>9.1}{tests}");
        }
        for step in steps.iter().filter(|step| !step.why.is_empty()) {
            println!("{}: {}: {}", step.name, step.result, step.why);
        }
        println!("{}", summary(&steps));
        let failed = failed(&steps);
        ensure!(failed.is_empty(), "failed: {}", failed.join("; "));
        Ok(())
    }
}

fn failed(steps: &[Done]) -> Vec<&'static str> {
    let failed = steps.iter().filter(|step| step.result == "FAILED");
    failed.map(|step| step.name).collect()
}

fn summary(steps: &[Done]) -> String {
    let passed: u64 = steps.iter().map(|step| step.tally.passed).sum();
    let failed_tests: u64 = steps.iter().map(|step| step.tally.failed).sum();
    let (all, failed) = (steps.len(), failed(steps).len());
    format!("{all} steps, {failed} failed; tests: {passed} passed, {failed_tests} failed")
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use anyhow::bail;

    use super::*;

    #[test]
    fn what_test_runners_say_adds_up() {
        let mut tally = Tally::default();
        assert!(tally.add_line("test result: ok. 6 passed; 0 failed; 1 ignored; 0 measured"));
        assert!(tally.add_line("test result: FAILED. 5 passed; 12 failed; 0 ignored"));
        assert!(!tally.add_line("test works ... ok"));
        assert!(!tally.add_line("test_a (t.T.test_a) ... ok"));
        assert!(!tally.add_line("test_b (t.T.test_b) ... ERROR"));
        assert!(tally.add_line("Ran 2 tests in 0.1s"));
        assert_eq!((tally.passed, tally.failed), (12, 13));
    }

    #[test]
    fn a_failing_step_keeps_no_other_from_running_and_one_left_out_fails_nothing() {
        let report = Report::new(3, std::env::temp_dir());
        let none = || None;
        let no_test = |tally: &mut Tally| run_tests(&mut Command::new("true"), tally);
        report.step("xtask one", none, no_test);
        let ran = Cell::new(false);
        report.step("xtask two", none, |_| {
            ran.set(true);
            Ok(())
        });
        let night = || Some("it is night".to_owned());
        report.step("xtask three", night, |_| bail!("it ran"));
        let error = report.finish().unwrap_err().to_string();
        assert!(ran.get() && error == "failed: xtask one", "{error}");
    }
}
