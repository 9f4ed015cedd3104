//! Simulates a gauge's file for a simulated press: for tests, and to try a calibration without a
//! gauge.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

/// Options of `collect simulate-gauge`.
#[derive(Debug, clap::Args)]
pub struct SimulateArgs {
    /// The truth log of a rig or of a twin (`hivtac-rig --truth`, `hivtac twin --truth`).
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    #[command(flatten)]
    gauge: SimulatedGauge,
    /// The file to write: seconds and reading.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// How the gauge differs from the truth.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct SimulatedGauge {
    /// How far its clock is ahead, s.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub ahead_s: f64,
    /// How much faster its clock runs, parts in a million.
    #[arg(skip = SimulatedGauge::default().drift_ppm)]
    pub drift_ppm: f64,
    /// Readings in a second.
    #[arg(skip = SimulatedGauge::default().rate_hz)]
    pub rate_hz: f64,
    /// Standard deviation of its readings, N.
    #[arg(skip = SimulatedGauge::default().noise_n)]
    pub noise_n: f64,
    /// Its reading without a force, N.
    #[arg(skip = SimulatedGauge::default().zero_n)]
    pub zero_n: f64,
    /// One line in this number is damaged; 0: no line.
    #[arg(skip = SimulatedGauge::default().damaged_every)]
    pub damaged_every: usize,
    /// Decides the noise.
    #[arg(skip = SimulatedGauge::default().seed)]
    pub seed: u64,
}

impl Default for SimulatedGauge {
    /// A typical one: 0.5 mN of noise, a zero error, and some damaged lines.
    fn default() -> Self {
        Self {
            ahead_s: 0.0,
            drift_ppm: 0.0,
            rate_hz: 100.0,
            noise_n: 0.000_5,
            zero_n: 0.012,
            damaged_every: 61,
            seed: 1,
        }
    }
}

#[derive(Deserialize)]
struct Exposure {
    time_us: u64,
    magnitude_n: f64,
}

impl SimulateArgs {
    /// Writes the gauge's file.
    ///
    /// # Errors
    /// When the log is unusable or the file cannot be written.
    pub fn run(self) -> Result<()> {
        let text = fs::read_to_string(&self.truth)
            .with_context(|| format!("cannot read {}", self.truth.display()))?;
        let exposures = text.lines().map(|line| {
            let Exposure {
                time_us,
                magnitude_n,
            } = serde_json::from_str(line)
                .with_context(|| format!("{} is no truth log: {line}", self.truth.display()))?;
            Ok((1e-6 * time_us as f64, magnitude_n))
        });
        let forces: Vec<(f64, f64)> = exposures.collect::<Result<_>>()?;
        fs::write(&self.out, self.gauge.lines(&forces)?)
            .with_context(|| format!("cannot write {}", self.out.display()))
    }
}

impl SimulatedGauge {
    /// The gauge's file for forces over time, (s, N), joined by straight lines.
    ///
    /// # Errors
    /// When there are fewer than two points, or the gauge's rate is invalid.
    pub fn lines(&self, forces: &[(f64, f64)]) -> Result<String> {
        ensure!(forces.len() > 1, "the truth log has no two exposures");
        ensure!(
            self.rate_hz > 0.0 && self.rate_hz <= 1e5 && self.noise_n >= 0.0,
            "a rate above 0 and up to 100,000 Hz is needed, and a noise from 0 up"
        );
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let (first, last) = (forces[0].0, forces[forces.len() - 1].0);
        let mut text = String::from("time_s,force\n");
        for i in 0..((last - first) * self.rate_hz) as usize {
            let time = first + i as f64 / self.rate_hz;
            let after = forces
                .partition_point(|f| f.0 < time)
                .clamp(1, forces.len() - 1);
            let ((t0, f0), (t1, f1)) = (forces[after - 1], forces[after]);
            let force = f0 + (f1 - f0) * ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
            // The sum of twelve uniform numbers is close enough to Gaussian here.
            let noise: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
            let shown = force + self.zero_n + self.noise_n * noise;
            let clock = self.ahead_s + first + (time - first) * (1.0 + self.drift_ppm * 1e-6);
            if self.damaged_every > 0 && i % self.damaged_every == self.damaged_every - 1 {
                writeln!(text, "{clock:.4},{shown:+.4}#")?;
            } else {
                writeln!(text, "{clock:.4},{shown:+.4}N")?;
            }
        }
        Ok(text)
    }
}
