//! The program `ccx`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

/// The job's name: CalculiX reads `press.inp` and writes `press.dat`; what it says goes to
/// `press.log`.
const JOB: &str = "press";
/// What it says at the end of a job that it could do.
const DONE: &str = "Job finished";

/// Where CalculiX is, and where it may work.
pub struct Program {
    /// Its name or path.
    pub ccx: PathBuf,
    /// Holds one folder for each press. What lies there of the same deck is not solved again.
    pub keep: PathBuf,
}

impl Program {
    /// Has CalculiX work on a deck; the text of its results.
    ///
    /// # Errors
    /// When it cannot run or finds no equilibrium.
    pub fn run(&self, name: &str, deck: &str) -> Result<String> {
        let folder = self.keep.join(name);
        fs::create_dir_all(&folder)?;
        match kept(&folder, deck) {
            Some(results) => Ok(results),
            None => self.run_in(&folder, deck),
        }
    }

    fn run_in(&self, folder: &Path, deck: &str) -> Result<String> {
        let file = |extension: &str| folder.join(JOB).with_extension(extension);
        fs::write(file("inp"), deck)?;
        let output = Command::new(&self.ccx)
            .arg(JOB)
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .output()
            .with_context(|| self.cannot_run())?;
        let said = String::from_utf8_lossy(&output.stdout);
        fs::write(file("log"), said.as_bytes())?;
        if !output.status.success() || !said.contains(DONE) {
            let why = said
                .lines()
                .skip_while(|line| !line.contains("*ERROR"))
                .take(3);
            let why: Vec<&str> = why.map(str::trim).collect();
            bail!("CalculiX gave up ({}): {}", output.status, why.join(" "));
        }
        fs::read_to_string(file("dat")).context("CalculiX wrote no results")
    }

    fn cannot_run(&self) -> String {
        format!("cannot run {}", self.ccx.display())
    }
}

/// The results of the same deck, if its job came to its end.
fn kept(folder: &Path, deck: &str) -> Option<String> {
    let read = |extension: &str| fs::read_to_string(folder.join(JOB).with_extension(extension));
    let same = read("inp").ok()? == deck && read("log").ok()?.contains(DONE);
    same.then(|| read("dat").ok()).flatten()
}
