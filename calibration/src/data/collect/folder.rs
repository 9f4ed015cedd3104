//! Keeps a recording on disk: a folder of files that only grow.
//!
//! | file | what |
//! |---|---|
//! | `unit.json` | the unit, and how it looks at its frames |
//! | `samples.csv` | every sample of the sensor, with the pose it was taken in |
//! | `gauge.csv` | every line of a gauge at a serial port, as it came |
//! | `takes.csv` | the takes that were finished |
//! | `down.csv` | which way the sensor was held in each run, where that was known |
//! | `covered.csv` | places and forces covered by presses anywhere, as the sensor measured them |
//!
//! Every line is written at once. An interruption therefore costs at most the unfinished line,
//! which the next run removes.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use hivtac_terms::down::Direction;
use hivtac_terms::marker::{LEAST_MARKERS, Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;
use hivtac_twin::Contact;
use hivtac_wire::message::{DeviceHello, Sample};
use serde::{Deserialize, Serialize};

use super::poses::{self, Pose};
use super::series::LARGEST_S;
use crate::data::conditions::{Conditions, OriginName, layout};
use crate::data::dataset::{LARGEST_AREA, check_down};

const SAMPLES: &str = "samples.csv";
const GAUGE: &str = "gauge.csv";
const TAKES: &str = "takes.csv";
const COVERED: &str = "covered.csv";
const DOWN: &str = "down.csv";
const UNIT: &str = "unit.json";

/// Columns of the samples before and after those of the markers.
const BEFORE_MARKERS: &str = "run,host_s,device_us,frame,sequence,alpha_deg,beta_deg,status";
const AFTER_MARKERS: &str = "x_mm,y_mm";
/// The first column of the markers, and how many each has: x, y and its area.
const MARKERS_AT: usize = 8;
const OF_MARKER: usize = 3;
const GAUGE_COLUMNS: &str = "run,host_s,line";
const TAKE_COLUMNS: &str = "run,alpha_deg,beta_deg,samples,lost,x_mm,y_mm";
const COVERED_COLUMNS: &str = "run,x_mm,y_mm,force_n";
const DOWN_COLUMNS: &str = "run,x,y,z";

/// Directions of gravity in two runs are different if any component differs by more than this, g.
const SAME_DOWN: f64 = 0.05;

/// Greatest coordinate of a marker along either side of a frame: 2¹⁰ px in 1/65,536 px. Then a
/// pattern is never larger than a data set can hold.
const FARTHEST_MARKER: i64 = 1 << 26;
/// The longest time that a sensor runs, µs: most of a century, exact in seconds as `f64`.
const LARGEST_US: u64 = 1 << 51;

/// A recording's folder, open for writing.
#[derive(Debug)]
pub struct Folder {
    samples: File,
    takes: File,
    covered: File,
    down: File,
    /// For the thread that listens to the gauge.
    pub gauge: File,
    /// Number of this run, from 0.
    pub run: usize,
    /// Number of markers.
    markers: usize,
    /// Poses whose takes were finished in earlier runs.
    pub done: Vec<Pose>,
    /// Coverage and lengths of presses anywhere in earlier runs.
    pub before: Before,
}

/// Takes of presses anywhere in earlier runs.
#[derive(Clone, Debug, Default)]
pub struct Before {
    /// Recorded time in each pose, s.
    lasted_s: Vec<(Pose, f64)>,
    /// Covered places, mm, with the force there, N.
    pub covered: Vec<([f64; 2], f64)>,
}

impl Before {
    /// Recorded time in a pose, s.
    pub fn lasted_s(&self, pose: Pose) -> f64 {
        let same = self.lasted_s.iter().find(|(other, _)| *other == pose);
        same.map_or(0.0, |(_, seconds)| *seconds)
    }
}

/// Frames farther apart than this, s, have a pause between them.
const PAUSE_S: f64 = 1.0;

impl Folder {
    /// Opens a recording to continue it, or begins one.
    ///
    /// # Errors
    /// When it belongs to a different unit or to other conditions, or cannot be written.
    pub fn open(path: &Path, conditions: &Conditions) -> Result<Self> {
        fs::create_dir_all(path).with_context(|| format!("cannot make {}", path.display()))?;
        same_unit(&path.join(UNIT), conditions)?;
        let samples = append(&path.join(SAMPLES), &sample_columns(conditions.markers))?;
        let gauge = append(&path.join(GAUGE), GAUGE_COLUMNS)?;
        let takes = append(&path.join(TAKES), TAKE_COLUMNS)?;
        let covered = append(&path.join(COVERED), COVERED_COLUMNS)?;
        let down = append(&path.join(DOWN), DOWN_COLUMNS)?;
        let before = Recording::read(path)?;
        let done = done(path)?;
        Ok(Self {
            samples,
            takes,
            covered,
            down,
            gauge,
            run: before.runs(),
            markers: conditions.markers,
            done,
            before: Before {
                lasted_s: before.lasted_s(),
                covered: read_covered(&path.join(COVERED))?,
            },
        })
    }

    /// Records that the film is covered near this place, mm, at about this force, N.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn covered(&mut self, [x_mm, y_mm]: [f64; 2], force_n: f64) -> Result<()> {
        let line = format!("{},{x_mm:.3},{y_mm:.3},{force_n:.6}", self.run);
        write_line(&mut self.covered, &line, COVERED)
    }

    /// Records the direction of gravity in this run, in the film frame.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn held(&mut self, down: Direction) -> Result<()> {
        let [x, y, z] = down.to_unit();
        write_line(&mut self.down, &format!("{},{x},{y},{z}", self.run), DOWN)
    }

    /// Stores a sample.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn sample(&mut self, host_s: f64, pose: Option<Pose>, sample: &Sample) -> Result<()> {
        let mut line = format!(
            "{},{host_s:.6},{},{},{},{},{}",
            self.run,
            sample.time_us,
            sample.frame,
            sample.sequence,
            pair(pose.map(|pose| pose.angles_deg)),
            reasons(sample)
        );
        match sample.markers.len() == self.markers {
            true => sample.markers.iter().for_each(|m| {
                line += &format!(",{},{},{}", m.x.0, m.y.0, m.area);
            }),
            false => line += &",".repeat(OF_MARKER * self.markers),
        }
        line += &format!(",{}", pair(pose.and_then(|pose| pose.place_mm)));
        write_line(&mut self.samples, &line, SAMPLES)
    }

    /// Records a finished take.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn take_done(&mut self, pose: Option<Pose>, samples: usize, lost: u32) -> Result<()> {
        let [angles, place] = [
            pose.map(|pose| pose.angles_deg),
            pose.and_then(|pose| pose.place_mm),
        ];
        let line = format!(
            "{},{},{samples},{lost},{}",
            self.run,
            pair(angles),
            pair(place)
        );
        write_line(&mut self.takes, &line, TAKES)
    }
}

/// Stores a line of the gauge. Quotes are replaced because they would end the field; no reading has
/// any.
///
/// # Errors
/// When it cannot be written.
pub fn keep_gauge_line(file: &mut File, run: usize, host_s: f64, line: &str) -> Result<()> {
    let line: String = line
        .chars()
        .map(|c| {
            if c == '"' || c.is_control() {
                '\u{fffd}'
            } else {
                c
            }
        })
        .collect();
    write_line(file, &format!("{run},{host_s:.6},\"{line}\""), GAUGE)
}

fn write_line(file: &mut File, line: &str, name: &str) -> Result<()> {
    file.write_all(format!("{line}\n").as_bytes())
        .with_context(|| format!("cannot write {name}"))
}

fn pair(numbers: Option<[f64; 2]>) -> String {
    numbers.map_or(",".to_owned(), |[a, b]| format!("{a},{b}"))
}

/// Status bits that depend on the model in use rather than on the markers.
const OF_THE_MODEL: Status =
    Status(Status::MODEL_MISSING.0 | Status::MODEL_MISMATCH.0 | Status::UNEXPLAINED.0);

/// Names of the bits by which a frame is unusable for training: without markers, with implausible
/// ones, or disturbed.
fn reasons(sample: &Sample) -> String {
    let bad = Status::NO_FORCE.0 & !OF_THE_MODEL.0 | Status::FRAME_DISTURBED.0;
    let frame = Status(bad & sample.status.0);
    let names: Vec<_> = frame.names().collect();
    if names.is_empty() && sample.found().is_none() {
        // A sensor that sends no markers although it found them has a bug in its firmware.
        return "markers_not_sent".to_owned();
    }
    names.join(" ")
}

/// Opens a file to append to, and removes a line that an interruption cut.
fn append(path: &Path, columns: &str) -> Result<File> {
    let context = || format!("cannot write {}", path.display());
    let text = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(error).with_context(context),
    };
    let whole = text
        .iter()
        .rposition(|&b| b == b'\n')
        .map_or(0, |end| end + 1);
    let mut file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .with_context(context)?;
    file.set_len(whole as u64).with_context(context)?;
    if whole == 0 {
        writeln!(file, "{columns}").with_context(context)?;
    }
    Ok(file)
}

/// Writes the unit into a new recording, or compares it with that of an existing one.
fn same_unit(path: &Path, conditions: &Conditions) -> Result<()> {
    match fs::read_to_string(path) {
        Ok(text) => {
            let before: Conditions = serde_json::from_str(&text)
                .with_context(|| format!("{} is damaged", path.display()))?;
            ensure!(
                before == *conditions,
                "this recording is of another unit, or of the same one set otherwise: {} says \
                 {text}, the sensor {}; use another folder, or set it as before",
                path.display(),
                serde_json::to_string(conditions)?
            );
            Ok(())
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {
            fs::write(path, serde_json::to_string(conditions)?)
                .with_context(|| format!("cannot write {}", path.display()))
        }
        Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
    }
}

/// The conditions of a unit's data, from the unit's own hello.
///
/// # Errors
/// When this program does not know its preset.
pub fn conditions_of(hello: &DeviceHello) -> Result<Conditions> {
    let markers = hello
        .model
        .as_ref()
        .map_or(LEAST_MARKERS, |model| model.markers.into());
    layout(markers).context("the device's model")?;
    let threshold = hello.threshold;
    crate::data::conditions::preset(&hello.preset)
        .context("the sensor says what this program does not know")?;
    Ok(Conditions {
        preset: hello.preset.as_str().to_owned(),
        width: hello.width,
        height: hello.height,
        pixel_format: threshold.format(),
        threshold: threshold.limits(),
        dilations: hello.dilations,
        centroid: hello.centroid,
        contact: Contact::default(),
        origin: OriginName::unit(hello.device_id),
        markers,
    })
}

/// A whole recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The unit, and how it reads its frames.
    pub conditions: Conditions,
    /// Direction of gravity in the film frame, parts of g, if known for all runs.
    pub down: Option<[f64; 3]>,
    /// In order of arrival.
    pub samples: Vec<Kept>,
    /// Lines of the gauge at a serial port: run, computer time in s, text.
    pub gauge_lines: Vec<(usize, f64, String)>,
}

/// A recorded sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// Its run, from 0.
    pub run: usize,
    /// Time of arrival, s of the computer since the run began.
    pub host_s: f64,
    /// Time of exposure, µs of the sensor.
    pub device_us: u64,
    /// The pose; `None` for the untouched film.
    pub pose: Option<Pose>,
    /// The markers, or names of the status bits by which they are missing or unreliable.
    pub seen: Result<MarkerList, String>,
}

#[derive(Deserialize, Serialize)]
struct GaugeLine {
    run: usize,
    host_s: f64,
    line: String,
}

impl Recording {
    /// Reads a folder, without a cut last line.
    ///
    /// # Errors
    /// When it is not a recording, or one of its files is damaged; names the line.
    pub fn read(path: &Path) -> Result<Self> {
        let unit = path.join(UNIT);
        let text = fs::read_to_string(&unit).with_context(|| {
            format!(
                "{} is no recording: cannot read {}",
                path.display(),
                unit.display()
            )
        })?;
        let table = |name: &str| {
            let path = path.join(name);
            fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))
        };
        // Recordings of earlier programs do not say which way the sensor was held.
        let down = match path.join(DOWN).try_exists() {
            Ok(false) => format!("{DOWN_COLUMNS}\n"),
            _ => table(DOWN)?,
        };
        Self::parse(&text, &table(SAMPLES)?, &table(GAUGE)?, &down)
            .with_context(|| path.display().to_string())
    }

    /// Parses a recording from the texts of its files: `unit.json`, `samples.csv`, `gauge.csv` and
    /// `down.csv`.
    ///
    /// # Errors
    /// When one is damaged; names the file and the line. When the sensor was turned between runs.
    pub fn parse(unit: &str, samples: &str, gauge: &str, down: &str) -> Result<Self> {
        let conditions: Conditions =
            serde_json::from_str(unit).with_context(|| format!("{UNIT} is damaged"))?;
        conditions.layout().context(UNIT)?;
        let of_line = |record: &csv::StringRecord| sample(record, conditions.markers);
        let columns = sample_columns(conditions.markers);
        let samples = rows([SAMPLES, samples], of_line, &columns)?;
        let gauge_line = |record: &csv::StringRecord| {
            let line: GaugeLine = record.deserialize(Some(&GAUGE_COLUMNS.split(',').collect()))?;
            on_a_clock(line.host_s)?;
            Ok((line.run, line.host_s, line.line))
        };
        let gauge_lines = rows([GAUGE, gauge], gauge_line, GAUGE_COLUMNS)?;
        let mut recording = Self {
            conditions,
            down: None,
            samples,
            gauge_lines,
        };
        recording.down = recording.held(&rows([DOWN, down], direction, DOWN_COLUMNS)?)?;
        let lines = recording.samples.len() + recording.gauge_lines.len();
        let runs = recording.runs();
        // Each run that left a line follows one that did.
        ensure!(runs <= lines, "{lines} lines cannot be of {runs} runs");
        Ok(recording)
    }

    /// Recorded time of presses anywhere in each pose, s.
    fn lasted_s(&self) -> Vec<(Pose, f64)> {
        let mut lasted: Vec<(Pose, f64)> = Vec::new();
        for frames in self.samples.windows(2) {
            let [first, second] = [&frames[0], &frames[1]];
            let Some(pose) = second.pose.filter(Pose::is_free) else {
                continue;
            };
            let us = second.device_us.saturating_sub(first.device_us);
            let seconds = us as f64 / 1e6;
            if (first.run, first.pose) != (second.run, second.pose) || seconds > PAUSE_S {
                continue;
            }
            match lasted.iter_mut().find(|(other, _)| *other == pose) {
                Some((_, sum)) => *sum += seconds,
                None => lasted.push((pose, seconds)),
            }
        }
        lasted
    }

    /// Direction of gravity in all runs with samples, if known, from the lines of its file.
    fn held(&self, lines: &[(usize, [f64; 3])]) -> Result<Option<[f64; 3]>> {
        let Some((first, down)) = lines.first() else {
            return Ok(None);
        };
        for (run, other) in lines {
            let apart = down.iter().zip(other).map(|(a, b)| (a - b).abs());
            ensure!(
                apart.fold(0.0, f64::max) <= SAME_DOWN,
                "{DOWN}: the sensor was held another way in run {run} ({other:?}) than in run \
                 {first} ({down:?}): record each way into a folder of its own"
            );
        }
        let is_known = |kept: &Kept| lines.iter().any(|(run, _)| *run == kept.run);
        Ok(self.samples.iter().all(is_known).then_some(*down))
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        let after = |run: usize| run.saturating_add(1);
        let last = self.samples.iter().map(|kept| after(kept.run)).max();
        let heard = self.gauge_lines.iter().map(|(run, ..)| after(*run)).max();
        last.max(heard).unwrap_or(0)
    }
}

/// The complete lines of one of the folder's tables.
fn rows<T>(
    [name, text]: [&str; 2],
    parse: impl Fn(&csv::StringRecord) -> Result<T>,
    columns: &str,
) -> Result<Vec<T>> {
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    let mut table = csv::Reader::from_reader(whole.as_bytes());
    ensure!(
        whole.is_empty() || table.headers()?.iter().eq(columns.split(',')),
        "{name} has other columns than this release writes ({columns}): record into another folder"
    );
    let rows = table.records().map(|record| {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        parse(&record).with_context(|| format!("line {line}"))
    });
    rows.collect::<Result<_>>()
        .with_context(|| format!("{name} is damaged"))
}

fn direction(record: &csv::StringRecord) -> Result<(usize, [f64; 3])> {
    let mut down = [0.0; 3];
    for (part, text) in down.iter_mut().zip(record.iter().skip(1)) {
        *part = text.parse()?;
    }
    check_down(&down)?;
    Ok((record[0].parse()?, down))
}

/// The columns of samples with this many markers.
fn sample_columns(markers: usize) -> String {
    let of_marker = |k| format!("x{k}_q16,y{k}_q16,area{k}_px");
    let of_markers: Vec<String> = (0..markers).map(of_marker).collect();
    [BEFORE_MARKERS, &of_markers.join(","), AFTER_MARKERS].join(",")
}

fn sample(record: &csv::StringRecord, count: usize) -> Result<Kept> {
    let number = |i: usize| -> Result<i64> { Ok(record[i].parse()?) };
    let seen = match &record[7] {
        "" => {
            let mut markers = MarkerList::defaults(count);
            for (m, marker) in markers.iter_mut().enumerate() {
                let first = MARKERS_AT + OF_MARKER * m;
                let (x, y, area) = (number(first)?, number(first + 1)?, number(first + 2)?);
                ensure!(
                    [x, y].iter().all(|at| (0..=FARTHEST_MARKER).contains(at))
                        && (0..=i64::from(LARGEST_AREA)).contains(&area),
                    "marker {m} is beyond every frame: {:?}",
                    [x, y, area]
                );
                *marker = Marker {
                    x: Px(x as i32),
                    y: Px(y as i32),
                    area: area as u32,
                };
            }
            Ok(markers)
        }
        why => Err(why.to_owned()),
    };
    let (host_s, device_us): (f64, u64) = (record[1].parse()?, record[2].parse()?);
    on_a_clock(host_s)?;
    ensure!(device_us <= LARGEST_US, "device_us is {device_us}");
    Ok(Kept {
        run: record[0].parse()?,
        host_s,
        device_us,
        pose: pose(record, [5, MARKERS_AT + OF_MARKER * count])?,
        seen,
    })
}

fn on_a_clock(host_s: f64) -> Result<()> {
    ensure!(host_s.abs() <= LARGEST_S, "host_s is {host_s}");
    Ok(())
}

/// The pose whose angles and place begin at these columns; without a place the tip was anywhere.
fn pose(record: &csv::StringRecord, [angles, place]: [usize; 2]) -> Result<Option<Pose>> {
    let is_empty = |first: usize| record[first].is_empty() && record[first + 1].is_empty();
    if is_empty(angles) {
        return Ok(None);
    }
    let texts = [angles, angles + 1, place, place + 1].map(|column| &record[column]);
    if is_empty(place) {
        return poses::parse_axis(&texts[..2].join(",")).map(Some);
    }
    ensure!(
        texts.iter().all(|text| !text.is_empty()),
        "half a pose: {texts:?}"
    );
    poses::parse(&texts.join(",")).map(Some)
}

/// Reads the records of [`Folder::covered`].
fn read_covered(path: &Path) -> Result<Vec<([f64; 2], f64)>> {
    let text =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let press = |record: &csv::StringRecord| {
        let number = |column: usize| -> Result<f64> { Ok(record[column].parse()?) };
        Ok(([number(1)?, number(2)?], number(3)?))
    };
    rows([COVERED, &text], press, COVERED_COLUMNS)
}

/// The poses whose takes were finished in a folder; empty before the first recording.
///
/// # Errors
/// When their list cannot be read, or is damaged.
pub fn done(folder: &Path) -> Result<Vec<Pose>> {
    let path = folder.join(TAKES);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => {
            return Err(error).with_context(|| format!("cannot read {}", path.display()));
        }
    };
    let poses = rows([TAKES, &text], |record| pose(record, [1, 5]), TAKE_COLUMNS)?;
    Ok(poses.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::conditions::CentroidEstimator;
    use hivtac_terms::force::ContactList;
    use hivtac_terms::threshold::PixelFormat;
    use hivtac_terms::threshold::Yuv422;
    use hivtac_terms::threshold::{HsvBox, Threshold};
    use hivtac_wire::message::{ModelIdentity, ModelSource};

    fn conditions() -> Conditions {
        Conditions {
            origin: OriginName::unit([7; 12]),
            ..Conditions::simulated(
                hivtac_terms::geometry::Preset::Ov7725,
                320,
                240,
                PixelFormat::Rgb565,
            )
        }
    }

    fn sample(frame: u32, found: bool) -> Sample {
        let marker = |i: i32| Marker {
            x: Px(65_536 * i),
            y: Px(i),
            area: 190,
        };
        Sample {
            sequence: frame,
            frame,
            time_us: u64::from(frame) * 25_600,
            status: if found {
                Status::MODEL_MISMATCH | Status::UNEXPLAINED
            } else {
                Status::MARKERS_MISSING | Status::TARE_MISSING
            },
            force: None,
            contacts: ContactList::default(),
            markers: MarkerList::of((1..5).filter(|_| found).map(marker)),
        }
    }

    fn tilted() -> Pose {
        Pose {
            angles_deg: [4.0, -3.5],
            place_mm: Some([0.5, -2.0]),
        }
    }

    #[test]
    fn a_recording_goes_on_after_an_interruption() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("unit");
        let mut folder = Folder::open(&path, &conditions()).unwrap();
        assert_eq!((folder.run, folder.done.len()), (0, 0));
        folder.sample(0.5, None, &sample(1, true)).unwrap();
        folder
            .sample(0.6, Some(tilted()), &sample(2, false))
            .unwrap();
        keep_gauge_line(&mut folder.gauge, 0, 0.55, "+0.1\"2,N").unwrap();
        folder.take_done(Some(tilted()), 1, 0).unwrap();
        drop(folder);
        // Cut in the middle of a line.
        let file = path.join(SAMPLES);
        let mut bytes = fs::read(&file).unwrap();
        let whole = bytes.len();
        bytes.extend(b"0,0.7,51");
        fs::write(&file, &bytes).unwrap();
        assert_eq!(Recording::read(&path).unwrap().samples.len(), 2);

        let mut again = Folder::open(&path, &conditions()).unwrap();
        assert_eq!(fs::read(&file).unwrap().len(), whole);
        assert_eq!((again.run, &again.done[..]), (1, &[tilted()][..]));
        again.sample(0.1, None, &sample(1, true)).unwrap();
        let recording = Recording::read(&path).unwrap();
        assert_eq!(recording.conditions, conditions());
        assert_eq!((recording.runs(), recording.samples.len()), (2, 3));
        let kept = &recording.samples[0];
        assert_eq!((kept.pose, kept.device_us), (None, 25_600));
        let expected = Marker {
            x: Px::from_int(2),
            y: Px(2),
            area: 190,
        };
        assert_eq!(kept.seen.as_ref().unwrap()[1], expected);
        assert_eq!(recording.samples[1].pose, Some(tilted()));
        assert_eq!(recording.samples[1].seen, Err("markers_missing".into()));
        assert_eq!(recording.gauge_lines, [(0, 0.55, "+0.1\u{fffd}2,N".into())]);
    }

    #[test]
    fn presses_anywhere_go_on_after_an_interruption() {
        let directory = tempfile::tempdir().unwrap();
        let mut folder = Folder::open(directory.path(), &conditions()).unwrap();
        let anywhere = Pose::anywhere([4.0, -3.5]);
        folder.sample(0.1, None, &sample(1, true)).unwrap();
        for (host_s, frame) in [(0.5, 2), (0.6, 12), (0.7, 13), (9.0, 400), (9.1, 402)] {
            folder
                .sample(host_s, Some(anywhere), &sample(frame, true))
                .unwrap();
        }
        folder.covered([-3.2, 1.6], 0.15).unwrap();
        drop(folder);
        let again = Folder::open(directory.path(), &conditions()).unwrap();
        assert_eq!(again.before.covered, [([-3.2, 1.6], 0.15)]);
        let lasted_s = again.before.lasted_s(anywhere);
        assert!((lasted_s - 13.0 * 0.0256).abs() < 1e-9, "{lasted_s}");
        assert_eq!(again.before.lasted_s(tilted()), 0.0);
        assert!(again.done.is_empty());
        let recording = Recording::read(directory.path()).unwrap();
        assert_eq!(recording.samples[1].pose, Some(anywhere));
    }

    #[test]
    fn implausible_markers_are_kept_and_not_used() {
        let directory = tempfile::tempdir().unwrap();
        let mut folder = Folder::open(directory.path(), &conditions()).unwrap();
        let mut covered = sample(1, true);
        covered.status |= Status::MARKERS_IMPLAUSIBLE;
        folder.sample(0.5, None, &covered).unwrap();
        let recording = Recording::read(directory.path()).unwrap();
        assert_eq!(recording.samples[0].seen, Err("markers_implausible".into()));
        let text = fs::read_to_string(directory.path().join(SAMPLES)).unwrap();
        assert!(text.contains(",131072,2,190,"), "{text}");
    }

    #[test]
    fn a_recording_says_which_way_the_sensor_was_held() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        let down = Direction([0, 600, -800]);
        for run in 0..2 {
            let mut folder = Folder::open(path, &conditions()).unwrap();
            assert_eq!(folder.run, run);
            folder.held(down).unwrap();
            folder.sample(0.5, None, &sample(1, true)).unwrap();
        }
        let recording = Recording::read(path).unwrap();
        let near = recording.down.unwrap().into_iter().zip([0.0, 0.6, -0.8]);
        assert!(near.into_iter().all(|(a, b)| (a - b).abs() < 1e-6));
        let kept = fs::read(path.join(DOWN)).unwrap();
        fs::remove_file(path.join(DOWN)).unwrap();
        assert_eq!(Recording::read(path).unwrap().down, None, "not noted");
        fs::write(path.join(DOWN), kept).unwrap();
        // In a third run the direction is unknown.
        let mut folder = Folder::open(path, &conditions()).unwrap();
        folder.sample(0.5, None, &sample(1, true)).unwrap();
        assert_eq!(Recording::read(path).unwrap().down, None);
        // Turned over in a fourth.
        let mut folder = Folder::open(path, &conditions()).unwrap();
        folder.held(Direction([0, 0, 1000])).unwrap();
        let error = format!("{:#}", Recording::read(path).unwrap_err());
        assert!(error.contains("another way in run 3"), "{error}");
        fs::write(path.join(DOWN), format!("{DOWN_COLUMNS}\n0,0,0,9.81\n")).unwrap();
        let error = format!("{:#}", Recording::read(path).unwrap_err());
        assert!(error.contains("down.csv is damaged: line 2"), "{error}");
    }

    #[test]
    fn conditions_have_the_pixel_format_that_the_sensor_is_set_to() {
        let mut hello = DeviceHello {
            protocol: 1,
            schema: 0,
            device_id: [7; 12],
            board: "board".try_into().unwrap(),
            firmware: "firmware".try_into().unwrap(),
            model: None,
            width: 320,
            height: 240,
            threshold: Threshold::Yuv422(Yuv422 { cr_low: 170 }),
            preset: "ov7725".try_into().unwrap(),
            dilations: 1,
            centroid: CentroidEstimator::RednessWeighted,
            name: Default::default(),
            filter: Default::default(),
        };
        let yuv422 = conditions_of(&hello).unwrap();
        assert_eq!(yuv422.pixel_format, PixelFormat::Yuv422);
        assert_eq!(yuv422.threshold, [170, 0, 0, 0, 0, 0]);
        let model = yuv422.to_model().unwrap();
        assert_eq!(model.threshold, hello.threshold);
        assert_eq!(yuv422.markers, 4);
        let mut of = |markers| {
            hello.model = Some(ModelIdentity {
                markers,
                crc: 0,
                name: "model".try_into().unwrap(),
                simulated: true,
                threshold: hello.threshold,
                source: ModelSource::BuiltIn,
            });
            conditions_of(&hello)
        };
        assert_eq!(of(8).unwrap().markers, 8);
        let error = format!("{:#}", of(5).unwrap_err());
        assert!(error.contains("5 markers"), "{error}");
        hello.threshold = Threshold::Rgb565(HsvBox::of_limits([1, 2, 3, 4, 5, 6]));
        hello.model = None;
        let rgb565 = conditions_of(&hello).unwrap();
        assert_eq!(rgb565.pixel_format, PixelFormat::Rgb565);
        assert_eq!(rgb565.threshold, [1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn another_unit_and_another_threshold_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        Folder::open(directory.path(), &conditions()).unwrap();
        let mut other = conditions();
        other.threshold[0] = 160;
        let error = Folder::open(directory.path(), &other)
            .unwrap_err()
            .to_string();
        assert!(error.contains("set otherwise"), "{error}");
        other = conditions();
        other.origin = OriginName::unit([8; 12]);
        assert!(Folder::open(directory.path(), &other).is_err());
    }

    #[test]
    fn what_is_damaged_is_named() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        let error = format!("{:#}", Recording::read(path).unwrap_err());
        assert!(error.contains("is no recording"), "{error}");
        let mut folder = Folder::open(path, &conditions()).unwrap();
        folder.sample(0.5, None, &sample(1, true)).unwrap();
        let file = path.join(SAMPLES);
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, text.replace(",x_mm,y_mm", "")).unwrap();
        let error = format!("{:#}", Recording::read(path).unwrap_err());
        assert!(error.contains("record into another folder"), "{error}");
        fs::write(&file, text.replace("131072", "131o72")).unwrap();
        let error = format!("{:#}", Recording::read(path).unwrap_err());
        assert!(error.contains("samples.csv is damaged: line 2"), "{error}");
    }

    #[test]
    fn numbers_that_no_sensor_sends_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        let mut folder = Folder::open(path, &conditions()).unwrap();
        folder
            .sample(0.5, Some(tilted()), &sample(1, true))
            .unwrap();
        let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
        let [unit, samples, gauge] = [UNIT, SAMPLES, GAUGE].map(read);
        assert!(Recording::parse(&unit, &samples, &gauge, "").is_ok());
        let refused = |before: &str, after: &str, words: &str| {
            assert!(samples.contains(before), "{before} in {samples}");
            let samples = samples.replacen(before, after, 1);
            let error = Recording::parse(&unit, &samples, &gauge, "").unwrap_err();
            assert!(format!("{error:#}").contains(words), "{after}: {error:#}");
        };
        refused("\n0,0.500000,", "\n18446744073709551615,0.5,", "runs");
        refused("\n0,0.500000,", "\n7,0.5,", "runs");
        refused("\n0,0.500000,", "\n0,NaN,", "line 2: host_s is NaN");
        refused("\n0,0.500000,", "\n0,-1e11,", "line 2: host_s is -1");
        refused(",25600,", ",18446744073709551615,", "line 2: device_us");
        refused(",131072,", ",9131072000,", "line 2: marker 1");
        refused(",131072,", ",-131072,", "line 2: marker 1");
        refused(",190,", ",59182190,", "line 2: marker 0");
        refused(",190,", ",-190,", "line 2: marker 0");
        refused(",4,-3.5,", ",NaN,-3.5,", "line 2: `NaN");
        refused(",4,-3.5,", ",4,-93.5,", "angles are within");
        refused(",0.5,-2\n", ",1e9,-2\n", "places within");
        refused(",0.5,-2\n", ",,-2\n", "half a pose");
        let gauge = format!("{gauge}0,inf,0.1N\n");
        let error = Recording::parse(&unit, &samples, &gauge, "").unwrap_err();
        assert!(format!("{error:#}").contains("gauge.csv is damaged: line 2"));
    }
}
