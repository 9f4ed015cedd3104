//! Collects data from a real unit: the sensor's samples, a force gauge's readings, and the set
//! poses.
//!
//! ```text
//! sensor ─samples with markers─┐
//! gauge ─lines of text─────────┼→ folder → align → data set
//! person ─poses────────────────┘
//! ```
//!
//! Recording only stores what arrives ([`folder`]); clocks are aligned afterwards, as often as
//! wanted.

pub mod align;
pub mod assemble;
pub mod coverage;
pub mod folder;
mod free;
pub mod gauge;
pub mod gauge_file;
pub mod gauge_port;
mod gauge_unit;
pub mod poses;
pub mod record;
pub mod report;
pub mod series;
pub mod simulated;
mod steady_intervals;
mod take;
mod watched;

use std::path::PathBuf;

use anyhow::Result;
use hivtac_twin::Contact;

use assemble::{DIRECTION_DEG, Gauge, How, assemble};
use folder::Recording;
use gauge::Unit;

/// Calibration data from a real unit.
#[derive(Debug, clap::Subcommand)]
pub enum CollectCommand {
    /// Record the sensor's samples, the gauge's lines and the poses into a folder. Ctrl-C loses
    /// nothing; the same command goes on.
    Record(record::RecordArgs),
    /// Align the clocks of a recording and write its data set.
    Align(AlignArgs),
    /// Write the file that a gauge with a clock of its own would have recorded of a rig's run, to
    /// try all this without a gauge.
    SimulateGauge(simulated::SimulateArgs),
}

/// Options of `collect align`.
#[derive(Debug, clap::Args)]
pub struct AlignArgs {
    /// The folder that was recorded into.
    #[arg(long, value_name = "FOLDER")]
    recording: PathBuf,
    /// The gauge's own recording: a line for each reading, seconds and force. One file for all
    /// runs, or repeated, one for each run with a pose, in order; a file whose clock starts again
    /// counts as one more from there. By default the lines that `record` received from the gauge.
    #[arg(long, value_name = "FILE")]
    gauge: Vec<PathBuf>,
    /// The unit of readings that name none: N when it is not said.
    #[arg(long, value_name = "UNIT")]
    gauge_unit: Option<Unit>,
    /// The meaning of the poses' angles: `force` (the direction of the force, as of a weight that
    /// hangs), or the pressing direction of a tip that sticks (`stick`) or slips from a friction
    /// ratio on (`slip:0.6`).
    #[arg(long, default_value = "force")]
    contact: Contact,
    /// Take only stretches in which the force was held, each as one load: for `unit`.
    #[arg(long)]
    holds: bool,
    /// Standard uncertainty of the direction of presses anywhere (`record --free`), degrees.
    #[arg(long, value_name = "DEG", default_value_t = DIRECTION_DEG, value_parser = direction_deg)]
    direction_deg: f64,
    /// The CSV file to write.
    #[arg(long)]
    out: PathBuf,
}

/// Parses a standard uncertainty of a direction, degrees, from a command line.
///
/// # Errors
/// When it is not a number above 0 and up to 45.
pub fn direction_deg(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(degrees) if degrees > 0.0 && degrees <= 45.0 => Ok(degrees),
        _ => Err("a number of degrees above 0 is needed, up to 45".to_owned()),
    }
}

impl CollectCommand {
    /// Runs it.
    ///
    /// # Errors The failure and the remedy.
    pub fn run(self) -> Result<()> {
        match self {
            CollectCommand::Record(args) => record::record(&args),
            CollectCommand::Align(args) => args.run(),
            CollectCommand::SimulateGauge(args) => args.run(),
        }
    }
}

impl AlignArgs {
    fn run(self) -> Result<()> {
        let mut recording = Recording::read(&self.recording)?;
        let gauge = Gauge::of(&self.gauge, self.gauge_unit)?;
        recording.conditions.contact = self.contact;
        let how = How {
            unit: self.gauge_unit,
            holds: self.holds,
            direction_deg: self.direction_deg,
        };
        let (dataset, report) = assemble(&recording, &gauge, how)?;
        dataset.save(&self.out)?;
        println!("{report}");
        println!(
            "wrote {}: {} rows in {} session(s)",
            self.out.display(),
            dataset.rows.len(),
            dataset.about.sessions
        );
        Ok(())
    }
}
