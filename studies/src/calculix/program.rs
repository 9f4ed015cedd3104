//! The program `ccx`.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

/// The job's name: CalculiX reads `press.inp` and writes `press.dat`.
const JOB: &str = "press";

/// Where CalculiX is, and where it may work.
pub struct Program {
    /// Its name or path.
    pub ccx: PathBuf,
    /// Holds one folder for each press; temporary without it.
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
                "there is no program `{}`: this study needs CalculiX. On Debian and Ubuntu, as root: \
                 apt-get install calculix-ccx. Elsewhere: https://www.calculix.de, and --ccx FILE",
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
        self.run_in(&folder, deck)
    }

    fn run_in(&self, folder: &Path, deck: &str) -> Result<String> {
        fs::write(folder.join(JOB).with_extension("inp"), deck)?;
        let output = Command::new(&self.ccx)
            .arg(JOB)
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .output()
            .with_context(|| self.cannot_run())?;
        let said = String::from_utf8_lossy(&output.stdout);
        if !output.status.success() || !said.contains("Job finished") {
            let why = said
                .lines()
                .skip_while(|line| !line.contains("*ERROR"))
                .take(3);
            let why: Vec<&str> = why.map(str::trim).collect();
            bail!("CalculiX gave up ({}): {}", output.status, why.join(" "));
        }
        let results = folder.join(JOB).with_extension("dat");
        fs::read_to_string(&results).context("CalculiX wrote no results")
    }

    fn cannot_run(&self) -> String {
        format!("cannot run {}", self.ccx.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
