//! Reports to a person what a recording contained.

use std::collections::BTreeMap;
use std::fmt;

use super::align::Alignment;

/// All runs of a recording.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Those with a pose.
    pub runs: Vec<RunReport>,
    /// Number of runs without a pose.
    pub empty_runs: usize,
}

/// One run.
#[derive(Clone, Debug, Default)]
pub struct RunReport {
    /// Its number.
    pub run: usize,
    /// The relation of the clocks.
    pub alignment: Alignment,
    /// The gauge's reading with the film untouched, N.
    pub zero_n: f64,
    /// Its standard deviation then, N.
    pub noise_n: f64,
    /// Smaller forces counted as no contact, N.
    pub least_n: f64,
    /// Frames of the untouched film.
    pub at_rest: usize,
    /// Frames under a force.
    pub pressed: usize,
    /// Frames among them that were pressed anywhere.
    pub anywhere: usize,
    /// Frames in a pose without contact.
    pub no_contact: usize,
    /// Frames in a pose while the gauge pulled.
    pub pulled: usize,
    /// Frames in a pose without a gauge reading.
    pub without_reading: usize,
    /// Frames left out because the force was not steady.
    pub unsteady: usize,
    /// Frames of the data set whose markers were not found, by status.
    pub rejected: BTreeMap<String, usize>,
    /// Whether the gauge shows pressing as negative, and its sign was reversed.
    pub is_turned: bool,
    /// The faults of the gauge's lines.
    pub complaint: Option<String>,
}

impl Report {
    /// The description in the data set's header.
    pub fn sentence(&self) -> String {
        let worst = |of: fn(&RunReport) -> f64| self.runs.iter().map(of).fold(0.0, f64::max);
        format!(
            "measured with a force gauge, {} run(s); gauge noise up to {:.2} mN, clocks aligned \
             with residuals up to {:.2} mN",
            self.runs.len(),
            1e3 * worst(|run| run.noise_n),
            1e3 * worst(|run| run.alignment.residual_n)
        )
    }
}

impl fmt::Display for RunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Alignment {
            lag_s,
            drift,
            correlation,
            residual_n,
            next_n,
            ..
        } = self.alignment;
        writeln!(
            f,
            "run {}: the gauge's clock is {lag_s:+.4} s ahead ({:+.0} ppm); correlation \
             {correlation:.4}, residual {:.2} mN (next best lag {:.2} mN)",
            self.run,
            1e6 * drift,
            1e3 * residual_n,
            1e3 * next_n
        )?;
        writeln!(
            f,
            "  gauge at rest {:+.2} mN (taken off), noise {:.2} mN; below {:.2} mN is no contact",
            1e3 * self.zero_n,
            1e3 * self.noise_n,
            1e3 * self.least_n
        )?;
        write!(
            f,
            "  {} frames at rest, {} under a force{}; left out: {} without contact, {} without a \
             gauge reading, {} while the gauge pulled, {} not held",
            self.at_rest,
            self.pressed,
            match self.anywhere {
                0 => String::new(),
                anywhere => format!(" ({anywhere} of them anywhere)"),
            },
            self.no_contact,
            self.without_reading,
            self.pulled,
            self.unsteady
        )?;
        for (status, count) in &self.rejected {
            write!(f, "\n  rejected by the sensor and kept: {status}: {count}")?;
        }
        if self.is_turned {
            write!(
                f,
                "\n  the gauge shows pressing as negative: its sign was turned round"
            )?;
        }
        match &self.complaint {
            Some(complaint) => write!(f, "\n  {complaint}"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, run) in self.runs.iter().enumerate() {
            write!(f, "{}{run}", if i > 0 { "\n" } else { "" })?;
        }
        if self.empty_runs > 0 {
            write!(
                f,
                "\n{} run(s) without a pose were left out",
                self.empty_runs
            )?;
        }
        Ok(())
    }
}
