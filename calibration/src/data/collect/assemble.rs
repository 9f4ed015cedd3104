//! Makes a data set of a recording: aligns the clocks and gives each frame the force that pressed
//! it.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use hivtac_sensor::force::features::Features;
use hivtac_terms::marker::MarkerList;

use super::align::{Alignment, RadiusSample, Search, align};
use super::folder::{Kept, Recording};
use super::gauge::Unit;
use super::gauge_file;
use super::poses::Pose;
use super::report::{Report, RunReport};
use super::series::{Joined, Series};
use super::steady_intervals::steady_frames;
use crate::data::dataset::{About, Dataset, Free, Loads, Observation, Place, Row};
use crate::data::loads::{PaperPoses, norm};
use crate::data::range::Range;
use crate::data::rest::features_to_q16;

/// Where the gauge's readings are.
#[derive(Clone, Debug)]
pub enum Gauge {
    /// In the recording, on the computer's clock.
    AtThePort,
    /// In the gauge's own files, on its own clock: one file for all runs with poses, or one for
    /// each of them, in order.
    Files(Vec<Series>),
}

impl Gauge {
    /// From these files; at the port if there are no files.
    ///
    /// # Errors
    /// When one is unusable; says why.
    pub fn of(files: &[PathBuf], unit: Option<Unit>) -> Result<Self> {
        let series = files.iter().map(|path| gauge_file::load(path, unit));
        let series = series.collect::<Result<Vec<_>>>()?.concat();
        Ok(match series.is_empty() {
            true => Gauge::AtThePort,
            false => Gauge::Files(series),
        })
    }
}

/// How a recording becomes a data set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct How {
    /// The unit of readings without one, if a person stated it.
    pub unit: Option<Unit>,
    /// Takes only steady stretches, each as one load; presses anywhere are always taken whole.
    pub holds: bool,
    /// Standard uncertainty of the direction of presses anywhere, degrees.
    pub direction_deg: f64,
}

impl Default for How {
    /// Every frame, with the direction of a hand that keeps well to the film's normal.
    fn default() -> Self {
        Self {
            unit: None,
            holds: false,
            direction_deg: DIRECTION_DEG,
        }
    }
}

/// Standard uncertainty of a hand's direction along each of the two axes across it, degrees.
pub const DIRECTION_DEG: f64 = 3.0;

/// The largest lag of a gauge at a serial port, s.
const LARGEST_LAG_S: f64 = 2.0;
/// The least force of a contact, N.
const LEAST_N: f64 = 0.001;
/// A force counts as contact above this many standard deviations of the gauge's noise.
const CONTACT_SIGMAS: f64 = 4.0;
/// Number of samples on each side of one that determine its time on the computer's clock.
const AROUND: usize = 16;

/// A frame with its force, before it becomes a row of a data set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loaded<'a> {
    pub kept: &'a Kept,
    pub time_s: f64,
    /// |F|, N.
    pub force_n: f64,
    /// Standard uncertainty due to the clocks, N; `None` where the force was held.
    pub clock_n: Option<f64>,
}

/// Makes the data set.
///
/// # Errors
/// When a run has no frames of the untouched film, or its clocks cannot be aligned; names the run.
pub fn assemble(recording: &Recording, gauge: &Gauge, how: How) -> Result<(Dataset, Report)> {
    ensure!(recording.runs() > 0, "the recording has no samples yet");
    if let Gauge::Files(files) = gauge {
        one_for_each(files, recording)?;
    }
    let mut rows = Vec::new();
    let mut report = Report::default();
    for run in 0..recording.runs() {
        let kept: Vec<&Kept> = recording
            .samples
            .iter()
            .filter(|kept| kept.run == run)
            .collect();
        // A run that ended before its first pose, for example one begun by mistake.
        if kept.iter().all(|kept| kept.pose.is_none()) {
            report.empty_runs += 1;
            continue;
        }
        let session = report.runs.len();
        let one = || format!("run {run}");
        let aligned = match gauge {
            Gauge::AtThePort => at_the_port(recording, &kept, run, how.unit),
            Gauge::Files(files) => from_file(files, session, &kept),
        }
        .with_context(one)?;
        let done = Run {
            kept: &kept,
            times: &aligned.times,
            gauge: aligned.series.joined(),
            alignment: aligned.alignment,
            holds: how.holds,
        };
        let (more, mut of_run) = done.rows(session).with_context(one)?;
        of_run.run = run;
        of_run.complaint = aligned.series.complaint();
        of_run.is_turned = aligned.is_turned;
        report.runs.push(of_run);
        rows.extend(more);
    }
    ensure!(!rows.is_empty(), "the recording has no frame in a pose");
    let mut about = about(recording, &rows, &report);
    let is_free = |kept: &Kept| kept.pose.is_some_and(|pose| pose.is_free());
    if recording.samples.iter().any(is_free) {
        let direction_deg = how.direction_deg;
        about.free = Some(Free { direction_deg });
    } else if !about.range.knows_places() {
        rows.iter_mut().for_each(|row| row.tip_mm = None);
    }
    Ok((Dataset { about, rows }, report))
}

/// Refuses gauge files that cannot be assigned to runs.
fn one_for_each(files: &[Series], recording: &Recording) -> Result<()> {
    let posed = recording.samples.iter().filter(|kept| kept.pose.is_some());
    let mut runs: Vec<usize> = posed.map(|kept| kept.run).collect();
    runs.sort_unstable();
    runs.dedup();
    let runs = runs.len();
    let begins: Vec<String> = (files.iter().filter_map(|file| file.begins))
        .map(|(line, last_s)| format!("line {line} (after {last_s} s)"))
        .collect();
    let again = match begins.is_empty() {
        true => String::new(),
        false => format!(
            "; a clock starts again at {}, and what follows counts as a file of its own: cut the \
             file there, and name with --gauge what belongs to each run",
            begins.join(", ")
        ),
    };
    ensure!(
        files.len() == 1 || files.len() == runs,
        "{} gauge files for {runs} run(s) with poses: one for all, or one for each{again}",
        files.len()
    );
    Ok(())
}

/// The gauge's lines and the frames' times of a run, both on the computer's clock.
fn at_the_port(
    recording: &Recording,
    kept: &[&Kept],
    run: usize,
    unit: Option<Unit>,
) -> Result<Aligned> {
    let mut series = Series::default();
    let lines = recording.gauge_lines.iter().filter(|(r, ..)| *r == run);
    for (number, (_, host_s, text)) in lines.enumerate() {
        let unit = unit.unwrap_or(Unit::NEWTON);
        series.push(number + 1, Some(*host_s), text, unit);
    }
    ensure!(
        series.readings() > 1,
        "no gauge was heard ({} lines): name the file that it recorded with --gauge, or record \
         with --gauge-port",
        series.bad.values().sum::<usize>()
    );
    series.plausible(unit.is_some())?;
    let times = on_the_computers_clock(kept);
    let search = Search {
        lags_s: [-LARGEST_LAG_S, LARGEST_LAG_S],
        drift: false,
    };
    Aligned::of(series, kept, times, search)
}

/// Exposure times of the frames on the computer's clock, up to a constant. The sensor's clock has
/// no jitter, and the gauge is on the computer's clock. The median of their difference over
/// neighbouring samples relates the two.
fn on_the_computers_clock(kept: &[&Kept]) -> Vec<f64> {
    let device = |kept: &Kept| kept.device_us as f64 / 1e6;
    let late: Vec<f64> = kept.iter().map(|kept| kept.host_s - device(kept)).collect();
    let smooth = |i: usize| {
        // The same number on both sides, so that a steady drift cancels.
        let reach = AROUND.min(i).min(late.len() - 1 - i);
        let mut near = late[i - reach..=i + reach].to_vec();
        near.sort_by(f64::total_cmp);
        near[near.len() / 2]
    };
    (0..kept.len())
        .map(|i| device(kept[i]) + smooth(i))
        .collect()
}

fn from_file(files: &[Series], session: usize, kept: &[&Kept]) -> Result<Aligned> {
    let series = match files {
        [series] => series,
        files => files.get(session).context(
            "there are fewer gauge files than runs with poses: one for all, or one for each",
        )?,
    };
    let times: Vec<f64> = kept
        .iter()
        .map(|kept| kept.device_us as f64 / 1e6)
        .collect();
    let ends = [times[0], times[times.len() - 1]];
    let [first, last] = series.span().context("the gauge's file has no readings")?;
    let search = Search {
        lags_s: [first - ends[1], last - ends[0]],
        drift: true,
    };
    Aligned::of(series.clone(), kept, times, search)
}

/// A gauge and a sensor on one clock.
struct Aligned {
    series: Series,
    alignment: Alignment,
    /// The frames' times, s.
    times: Vec<f64>,
    /// Whether the gauge shows pressing as negative.
    is_turned: bool,
}

impl Aligned {
    /// If no lag fits, the gauge may show pressing as negative: then tries the opposite sign.
    fn of(series: Series, kept: &[&Kept], times: Vec<f64>, search: Search) -> Result<Self> {
        let frames = radius_samples(kept, &times)?;
        let (series, alignment, is_turned) = match align(&frames, series.joined(), search) {
            Ok(alignment) => (series, alignment, false),
            Err(error) => {
                let turned = series.turned_round();
                let alignment = align(&frames, turned.joined(), search).map_err(|_| error)?;
                (turned, alignment, true)
            }
        };
        Ok(Self {
            series,
            alignment,
            times,
            is_turned,
        })
    }
}

/// Times and mean radii of the frames with markers, beginning with the untouched film.
fn radius_samples(kept: &[&Kept], times: &[f64]) -> Result<Vec<RadiusSample>> {
    let radii: Vec<Option<f64>> = kept
        .iter()
        .map(|kept| kept.seen.as_ref().ok().map(mean_radius_px))
        .collect();
    let at_rest: Vec<f64> = (radii.iter().zip(kept))
        .filter(|(_, kept)| kept.pose.is_none())
        .filter_map(|(radius, _)| *radius)
        .collect();
    ensure!(
        !at_rest.is_empty(),
        "no frame of the untouched film shows the markers"
    );
    let rest = at_rest.iter().sum::<f64>() / at_rest.len() as f64;
    let frames = radii.iter().zip(times).filter_map(|(radius, &time_s)| {
        Some(RadiusSample {
            time_s,
            radius_px: (*radius)? - rest,
        })
    });
    Ok(frames.collect())
}

/// Mean distance of the markers from their middle, px.
fn mean_radius_px(markers: &MarkerList) -> f64 {
    let count = markers.len() as f64;
    let all = 0..markers.len();
    let px = |m: usize, axis: usize| [markers[m].x, markers[m].y][axis].to_f64();
    let middle = [0, 1].map(|axis| all.clone().map(|m| px(m, axis)).sum::<f64>() / count);
    let distance = |m: usize| (px(m, 0) - middle[0]).hypot(px(m, 1) - middle[1]);
    all.map(distance).sum::<f64>() / count
}

/// One run with its clocks aligned.
struct Run<'a> {
    kept: &'a [&'a Kept],
    times: &'a [f64],
    gauge: Joined<'a>,
    alignment: Alignment,
    /// Only steady stretches, each as one load.
    holds: bool,
}

impl Run<'_> {
    fn rows(&self, session: usize) -> Result<(Vec<Row>, RunReport)> {
        let reading = |i: usize| self.gauge.at(self.alignment.gauge_time(self.times[i]));
        let at_rest: Vec<f64> = (0..self.kept.len())
            .filter(|&i| self.kept[i].pose.is_none())
            .filter_map(reading)
            .collect();
        let count = at_rest.len().max(1) as f64;
        let zero_n = at_rest.iter().sum::<f64>() / count;
        let noise_n = (at_rest.iter().map(|f| (f - zero_n).powi(2)).sum::<f64>() / count).sqrt();
        let least_n = LEAST_N.max(CONTACT_SIGMAS * noise_n);
        let mut report = RunReport {
            alignment: self.alignment,
            zero_n,
            noise_n,
            least_n,
            ..RunReport::default()
        };
        // Presses anywhere are taken whole; loads at a known place, if requested, only while they
        // were held.
        let (mut rows, mut free, mut loaded) = (Vec::new(), Vec::new(), Vec::new());
        for (i, &kept) in self.kept.iter().enumerate() {
            if kept.pose.is_none() {
                rows.push(row(session, kept, 0.0)?);
                report.at_rest += 1;
                continue;
            }
            match reading(i).map(|force| force - zero_n) {
                None => report.without_reading += 1,
                Some(force) if force < -least_n => report.pulled += 1,
                Some(force) if force < least_n => report.no_contact += 1,
                Some(force_n) => {
                    let is_free = kept.pose.is_some_and(|pose| pose.is_free());
                    let time_s = self.times[i];
                    let clock_n = is_free.then(|| self.alignment.clock_n(self.gauge, time_s));
                    let frame = Loaded {
                        kept,
                        time_s,
                        force_n,
                        clock_n: clock_n.flatten(),
                    };
                    if is_free { &mut free } else { &mut loaded }.push(frame);
                }
            }
        }
        if self.holds {
            let before = loaded.len();
            loaded = steady_frames(&loaded, noise_n);
            report.unsteady = before - loaded.len();
        }
        for loaded in loaded.iter().chain(&free) {
            let clock_n = loaded.clock_n;
            rows.push(Row {
                clock_n,
                ..row(session, loaded.kept, loaded.force_n)?
            });
        }
        report.pressed = loaded.len() + free.len();
        report.anywhere = free.len();
        for why in rows.iter().filter_map(|row| row.seen.as_ref().err()) {
            *report.rejected.entry(why.clone()).or_default() += 1;
        }
        Ok((rows, report))
    }
}

fn row(session: usize, kept: &Kept, force_n: f64) -> Result<Row> {
    let [alpha, beta] = kept.pose.unwrap_or(Pose::MIDDLE).angles_deg;
    let direction = hivtac_twin::Load::from_angles(force_n, alpha, beta)?;
    Ok(Row {
        place: Place {
            session,
            pose: (kept.pose.filter(|pose| pose.place_mm == Some([0.0; 2])))
                .and_then(|pose| PaperPoses::numbered(pose.angles_deg)),
        },
        force_n: if force_n == 0.0 {
            [0.0; 3]
        } else {
            direction.vector_n()
        },
        tip_mm: (kept.pose.filter(|_| force_n != 0.0)).and_then(|pose| pose.place_mm),
        clock_n: None,
        seen: match &kept.seen {
            Ok(markers) => Ok(observation(markers)),
            Err(why) => Err(why.clone()),
        },
    })
}

/// The greatest distance of a pose's tip from the film's middle along x or y, mm.
fn reach_mm(recording: &Recording) -> f64 {
    let poses = recording.samples.iter().filter_map(|kept| kept.pose);
    let places = poses.filter_map(|pose| pose.place_mm);
    let far = places.flatten().map(f64::abs);
    far.fold(0.0, f64::max)
}

fn observation(markers: &MarkerList) -> Observation {
    Observation {
        features_q16: features_to_q16(&Features::of_markers(markers)),
        areas_px: markers.map(|marker| marker.area),
    }
}

fn about(recording: &Recording, rows: &[Row], report: &Report) -> About {
    let largest = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).fold(0.0, f64::max);
    let mut poses: Vec<Pose> = Vec::new();
    for pose in recording.samples.iter().filter_map(|kept| kept.pose) {
        if !poses.contains(&pose) {
            poses.push(pose);
        }
    }
    let extreme = |axis: usize| {
        poses
            .iter()
            .map(|p| p.angles_deg[axis].abs())
            .fold(0.0, f64::max)
    };
    let at_rest = rows.iter().filter(|row| row.force_n == [0.0; 3]).count();
    About {
        conditions: recording.conditions.clone(),
        scene: report.sentence(),
        loads: Loads::Measured(poses.len()),
        rest: at_rest / report.runs.len(),
        sessions: report.runs.len(),
        seed: 0,
        range: Range {
            force_n: largest(&|row| norm(row.force_n)),
            alpha_deg: extreme(0),
            beta_deg: extreme(1),
            place_mm: reach_mm(recording),
        },
        free: None,
        down: recording.down,
    }
}

#[cfg(test)]
mod tests;
