//! Records the sensor's samples, the gauge's lines and the poses into a folder.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::reply::log_text;
use hivtac_host::stop;
use hivtac_wire::message::{DeviceMessage, Request, Sample};

use super::folder::{Folder, conditions_of};
use super::free::FreeTake;
use super::gauge_port::{GaugeArgs, GaugePort};
use super::poses::{self, Person, Pose, Task};
use super::take::{GaugeActivity, Take};
use super::watched::Watched;

/// Options of `collect record`.
#[derive(Debug, clap::Args)]
pub struct RecordArgs {
    /// The folder to record into; an interrupted recording goes on.
    #[arg(long, value_name = "FOLDER")]
    pub into: PathBuf,
    /// Port of the sensor: serial port, pseudo-terminal, or tcp:HOST:PORT; found by its USB id when
    /// not given.
    #[arg(long, value_name = "PORT")]
    pub port: Option<String>,
    /// Longest wait for the sensor's answers and for its next frame, s.
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    pub timeout: f64,
    /// A list of poses, one a line: α and β in degrees, and x and y of the tip in mm where it is
    /// not in the middle. Without one they are typed.
    #[arg(long, value_name = "FILE")]
    pub poses: Option<PathBuf>,
    /// Length of a take, s of the sensor's clock.
    #[arg(long, value_name = "S", default_value_t = 20.0, value_parser = seconds)]
    pub seconds: f64,
    /// One take of presses anywhere instead, 20 to 1800 s long.
    #[command(flatten)]
    pub free: FreeArgs,
    /// Length of the take of the untouched film that begins every run, s.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub rest_seconds: f64,
    /// The gauge at a serial port.
    #[command(flatten)]
    pub gauge: GaugeArgs,
}

/// Presses anywhere, for commands that record.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct FreeArgs {
    /// Press anywhere within ±4 mm, with any force to 0.25 N, for 20 to 1800 seconds: by hand
    /// with a gauge on a stick, or by a robot. Nobody notes where.
    #[arg(long, value_name = "S", value_parser = free_seconds, conflicts_with = "poses")]
    pub free: Option<f64>,
    /// The axis that such presses are about along: α and β in degrees, such as `0,0`.
    #[arg(long, value_name = "α,β", value_parser = axis, default_value = "0,0")]
    #[arg(allow_hyphen_values = true, requires = "free")]
    pub axis: Pose,
    /// Also show the coverage of such presses on a live page, as `hivtac view` shows a sensor; the
    /// address is printed.
    #[arg(long, requires = "free")]
    pub view: bool,
}

impl FreeArgs {
    /// The task of presses anywhere, if they are requested.
    pub fn task(&self) -> Option<Task> {
        Some(Task::anywhere(self.axis, self.free?))
    }
}

fn axis(text: &str) -> Result<Pose, String> {
    poses::parse_axis(text).map_err(|error| error.to_string())
}

fn free_seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (20.0..=1800.0).contains(&seconds) => Ok(seconds),
        _ => Err("a number of seconds from 20 to 1800 is needed".to_owned()),
    }
}

/// A number of seconds from a command line.
///
/// # Errors
/// When it is not a number, or outside 0 to 36,000.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds > 0.0 && seconds <= 36_000.0 => Ok(seconds),
        _ => Err("a number of seconds above 0 is needed, up to 36000".to_owned()),
    }
}

/// The fewest frames of the untouched film that determine a rest position.
const FEWEST_AT_REST: usize = 8;

/// Readings below this (N) count as no load. With a model of a different unit, the sensor reports
/// half to twice the actual force.
const LEAST_FELT_N: f64 = 0.005;
/// Time between two updates of the live numbers.
const SHOW_EVERY: Duration = Duration::from_millis(200);

/// Frames for the sensor's own rest position, and the time allowed for them beyond the usual wait.
const TARE_FRAMES: u16 = 64;
const TARE_PATIENCE: Duration = Duration::from_secs(30);

/// Records until the list is done, the person ends it, or Ctrl-C.
///
/// # Errors
/// When sensor, gauge or folder fail. What was recorded before stays.
pub fn record(args: &RecordArgs) -> Result<()> {
    let list = args.poses.as_deref().map(poses::load).transpose()?;
    let tasks = list.map(|list| {
        let tasks = list.into_iter();
        tasks
            .map(|pose| Task::any_force(pose, args.seconds))
            .collect()
    });
    let free = args.free.task().map(|task| vec![task]);
    record_tasks(args, free.or(tasks))
}

/// Records these tasks except those already done; without tasks, records typed poses. Ignores
/// `args.poses`.
///
/// # Errors
/// When sensor, gauge or folder fail. What was recorded before stays.
pub fn record_tasks(args: &RecordArgs, tasks: Option<Vec<Task>>) -> Result<()> {
    stop::install()?;
    let patience = Duration::from_secs_f64(args.timeout);
    let address = args.port.as_deref().map_or(Address::Find, Address::parse);
    let (link, hello) = Link::connect(&address, patience)?;
    let folder = Folder::open(&args.into, &conditions_of(&hello)?)?;
    let is_watched = args.free.view;
    let watched = is_watched.then(|| Watched::serve(&link, &hello, patience));
    let begun = Instant::now();
    let gauge = GaugePort::listen(&args.gauge, folder.gauge.try_clone()?, folder.run, begun)?;
    let mut recorder = Recorder {
        link,
        patience,
        folder,
        gauge,
        begun,
        person: Person::at_the_terminal(),
        shown: begun,
        zero_n: None,
        free: None,
        watched: watched.transpose()?,
    };
    let result = recorder.run(args, tasks.as_deref());
    let gauge = recorder.gauge.as_mut().map_or(Ok(()), GaugePort::finish);
    if let Err(error) = result {
        return Err(error.context(format!(
            "recording ended early; what came until then is in {}, and the same command goes on",
            args.into.display()
        )));
    }
    gauge
}

struct Recorder {
    link: Link,
    patience: Duration,
    folder: Folder,
    gauge: Option<GaugePort>,
    begun: Instant,
    person: Person,
    /// When the live numbers were last shown.
    shown: Instant,
    /// The gauge's reading while nothing touched the film, N.
    zero_n: Option<f64>,
    /// The present take of presses anywhere.
    free: Option<FreeTake>,
    /// The live page, if requested.
    watched: Option<Watched>,
}

impl Recorder {
    fn run(&mut self, args: &RecordArgs, list: Option<&[Task]>) -> Result<()> {
        let question = "Nothing may touch the film, and the gauge shows zero: press Enter.";
        if self.person.ask(question)?.is_none() {
            bail!("standard input has ended: nothing was recorded");
        }
        self.tare()?;
        let rest = self.take(None, args.rest_seconds)?;
        self.zero_n = rest.gauge_n();
        self.folder.take_done(None, rest.samples, rest.lost)?;
        ensure!(
            rest.good >= FEWEST_AT_REST,
            "{} of {} frames of the untouched film show all markers: at least \
             {FEWEST_AT_REST} are needed (see `hivtac monitor`)",
            rest.good,
            rest.samples
        );
        let mut left = list.map(|list| poses::left(list, &self.folder.done, |task| task.pose));
        if let (Some(list), Some(left)) = (list, &left) {
            match left.as_slice() {
                [task] if task.pose.is_free() => {}
                _ => eprintln!("{} of {} poses are left.", left.len(), list.len()),
            }
        }
        while let Some(task) = self.next_task(left.as_mut(), args.seconds)? {
            self.free = task.pose.is_free().then(|| self.anywhere(&task));
            let take = self.take(Some(&task), task.seconds);
            let free = self.free.take();
            let take = take?;
            if let Some(free) = free {
                eprintln!("{}", free.end());
                if let Some(watched) = &mut self.watched {
                    watched.ended(free.final_page_coverage());
                }
            }
            let is_felt = take.felt_n.is_none_or(|force_n| force_n >= LEAST_FELT_N);
            if task.must_be_felt && !is_felt {
                eprintln!("Nothing pressed the film: once more.");
                left.get_or_insert_default().insert(0, task);
                continue;
            }
            self.folder
                .take_done(Some(task.pose), take.samples, take.lost)?;
        }
        Ok(())
    }

    /// Makes the sensor take its rest position. It then refuses bad markers, and compares markers
    /// under a force with their own rest places. Records the direction of gravity, if the sensor
    /// knows it.
    fn tare(&mut self) -> Result<()> {
        let request = Request::Tare {
            frames: TARE_FRAMES,
        };
        let mut down = None;
        let patience = self.patience + TARE_PATIENCE;
        self.link.request(request, patience, |message| {
            if let DeviceMessage::Tared(report) = message {
                down = report.rest.down;
            }
        })?;
        match down {
            Some(down) => self.folder.held(down),
            None => Ok(()),
        }
    }

    /// The next task, once its pose is set; `None` at the end.
    fn next_task(&self, list: Option<&mut Vec<Task>>, seconds: f64) -> Result<Option<Task>> {
        let Some(list) = list else {
            return self.typed_task(seconds);
        };
        if list.is_empty() {
            return Ok(None);
        }
        let task = list.remove(0);
        let answer = self.person.ask(&task.set)?;
        Ok(answer.filter(|text| text != "done").map(|_| task))
    }

    /// The remainder of a take of presses anywhere.
    fn anywhere(&self, task: &Task) -> FreeTake {
        let before = &self.folder.before;
        let before_s = before.lasted_s(task.pose);
        if before_s > 0.0 {
            eprintln!(
                "{before_s:.0} s of {:.0} s were recorded before.",
                task.seconds
            );
        }
        FreeTake::new(task.seconds, before_s, &before.covered)
    }

    fn typed_task(&self, seconds: f64) -> Result<Option<Task>> {
        loop {
            let question = "Set a pose and type α and β in degrees, such as `4, -3`, and where the \
                            tip is not in the middle its x and y in mm, such as `4, -3, 2.5, 0` \
                            (`done` to end).";
            match self.person.ask(question)?.as_deref() {
                None | Some("done") => return Ok(None),
                Some(text) => match poses::parse(text) {
                    Ok(pose) => return Ok(Some(Task::any_force(pose, seconds))),
                    Err(error) => eprintln!("{error}"),
                },
            }
        }
    }

    /// Records for this many seconds of the sensor's clock.
    fn take(&mut self, task: Option<&Task>, seconds: f64) -> Result<Take> {
        let pose = task.map(|task| task.pose);
        let text = match task {
            Some(task) if self.free.is_some() => format!("Recording: {}.", task.press),
            Some(task) => format!("Recording for {seconds} s: {}.", task.press),
            None => format!("Recording the untouched film for {seconds} s."),
        };
        eprintln!("{text}");
        if let Some(watched) = &mut self.watched {
            watched.recording(true, text);
        }
        let mut activity = GaugeActivity::from(self.gauge_readings()?);
        let mut take = Take::default();
        let mut early = Vec::new();
        self.link
            .request(Request::StartWithMarkers, self.patience, |m| early.push(m))?;
        for message in early {
            self.keep(message, pose, &mut take)?;
        }
        let length_us = (seconds * 1e6) as u64;
        let mut deadline = Instant::now() + self.patience;
        while !self.is_over(&take, length_us) {
            if activity.is_silent(self.gauge_readings()?) {
                bail!("{}", self.silence());
            }
            let Some(message) = self.link.receive(deadline)? else {
                bail!(
                    "no frame for {} s: does the camera run? (hivtac info)",
                    self.patience.as_secs_f64()
                );
            };
            if matches!(message, DeviceMessage::Sample(_)) {
                deadline = Instant::now() + self.patience;
            }
            self.keep(message, pose, &mut take)?;
        }
        let mut late = Vec::new();
        self.link
            .request(Request::Stop, self.patience, |m| late.push(m))?;
        for message in late {
            self.keep(message, pose, &mut take)?;
        }
        let readings = activity.since(self.gauge_readings()?);
        self.sum_up(&take, readings, task.is_none())?;
        Ok(take)
    }

    /// Prints a take's summary, and refuses a take under load without gauge readings. At rest there
    /// may be none yet: a gauge that must be asked may begin slowly. But one that sends only
    /// invalid lines does not recover.
    fn sum_up(&self, take: &Take, readings: Option<usize>, is_rest: bool) -> Result<()> {
        let of_gauge = readings.map_or(String::new(), |count| format!(", {count} gauge readings"));
        eprintln!(
            "{} samples ({} with markers, {} lost){of_gauge}.",
            take.samples, take.good, take.lost
        );
        let is_unreadable = self.gauge.as_ref().is_some_and(GaugePort::is_unreadable);
        ensure!(
            readings != Some(0) || is_rest && !is_unreadable,
            "{}",
            self.silence()
        );
        Ok(())
    }

    /// Whether a take is complete.
    fn is_over(&self, take: &Take, length_us: u64) -> bool {
        match (&self.free, take.first_us) {
            (_, None) => false,
            (Some(free), _) => free.is_over(),
            (None, Some(first)) => take.last_us >= first + length_us,
        }
    }

    /// Why the gauge gives no readings.
    fn silence(&self) -> String {
        let gauge = self.gauge.as_ref();
        gauge.map_or(String::new(), GaugePort::silence)
    }

    fn gauge_readings(&mut self) -> Result<Option<usize>> {
        self.gauge.as_mut().map(GaugePort::readings).transpose()
    }

    fn keep(&mut self, message: DeviceMessage, pose: Option<Pose>, take: &mut Take) -> Result<()> {
        match message {
            DeviceMessage::Sample(sample) => {
                let host_s = self.begun.elapsed().as_secs_f64();
                self.folder
                    .sample(host_s, pose, &sample)
                    .context("the recording")?;
                let gauge_n = self.gauge.as_ref().and_then(GaugePort::newest_n);
                take.count(&sample, gauge_n);
                match &mut self.free {
                    Some(free) => {
                        let pressed_n = gauge_n.map(|n| n - self.zero_n.unwrap_or(0.0));
                        let covered = free.sample(&sample, pressed_n);
                        free.show(&sample);
                        if let Some((place_mm, force_n)) = covered {
                            self.folder.covered(place_mm, force_n)?;
                        }
                    }
                    None => self.show(&sample, gauge_n),
                }
                if let Some(watched) = &mut self.watched {
                    let free = self.free.as_ref();
                    watched.sample(&sample, take, || {
                        free.map(|free| free.page_coverage(&sample))
                    });
                }
            }
            DeviceMessage::Log(line) => eprintln!("{}", log_text(&line)),
            _ => {}
        }
        Ok(())
    }

    /// Shows live numbers on one line of a terminal, a few times a second.
    fn show(&mut self, sample: &Sample, gauge_n: Option<f64>) {
        let mut terminal = std::io::stderr();
        if self.shown.elapsed() < SHOW_EVERY || !terminal.is_terminal() {
            return;
        }
        self.shown = Instant::now();
        let _ = write!(terminal, "\r{}\r", live(gauge_n, sample));
    }
}

/// The present readings of gauge and sensor, in constant width.
fn live(gauge_n: Option<f64>, sample: &Sample) -> String {
    let gauge = gauge_n.map_or(String::new(), |n| format!("gauge {:7.1} mN, ", 1e3 * n));
    let sensor = match &sample.force {
        Some(force) => format!("sensor about {:5.0} mN", f64::from(force.magnitude.0) / 1e3),
        None if sample.found().is_some() => "sensor sees all markers".to_owned(),
        None => "sensor does NOT see all markers".to_owned(),
    };
    format!("{:<60}", gauge + &sensor)
}
