//! The program `ccx`.

use std::fs;
use std::io::ErrorKind;
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
    /// Holds one folder for each press; temporary without it. What lies there of the same deck is
    /// not worked out again.
    pub keep: Option<PathBuf>,
}

impl Program {
    /// Whether the program is there, and its version.
    ///
    /// # Errors
    /// When it is not: the error says how to install it.
    pub fn version(&self) -> Result<String> {
        let output = match Command::new(&self.ccx).arg("-v").output() {
            Ok(output) => output,
            Err(error) if error.kind() == ErrorKind::NotFound => bail!(
                "there is no program `{}`: this study needs CalculiX. On Debian and Ubuntu, \
                 as root: apt-get install calculix-ccx. \
                 Elsewhere: https://www.calculix.de, and --ccx FILE",
                self.ccx.display()
            ),
            Err(error) => return Err(error).with_context(|| self.cannot_run()),
        };
        let text = String::from_utf8_lossy(&output.stdout);
        let number = text
            .split("Version")
            .nth(1)
            .unwrap_or("of an unknown version");
        Ok(format!("CalculiX {}", number.trim()))
    }

    /// Has CalculiX work on a deck; the text of its results.
    ///
    /// # Errors
    /// When it cannot run or finds no equilibrium.
    pub fn run(&self, name: &str, deck: &str) -> Result<String> {
        let Some(keep) = &self.keep else {
            let folder = tempfile::tempdir()?;
            return self.run_in(folder.path(), deck);
        };
        let folder = keep.join(name);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finished_jobs_of_the_same_deck_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let write = |extension: &str, text: &str| {
            fs::write(folder.path().join(JOB).with_extension(extension), text).unwrap();
        };
        write("inp", "deck");
        write("dat", "results");
        assert_eq!(kept(folder.path(), "deck"), None);
        write("log", "Job finished");
        assert_eq!(kept(folder.path(), "deck").as_deref(), Some("results"));
        assert_eq!(kept(folder.path(), "another"), None);
    }

    #[test]
    fn a_missing_program_is_told_with_its_package() {
        let program = Program {
            ccx: PathBuf::from("no-such-ccx"),
            keep: None,
        };
        let why = program.version().unwrap_err().to_string();
        assert!(why.contains("no-such-ccx") && why.contains("apt-get install calculix-ccx"));
    }
}
