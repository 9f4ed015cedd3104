//! Recording: the sensor's samples, the gauge's lines and the poses, into a folder.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use hivtac_host::link::{Link, log_text};
use hivtac_host::port::Address;
use hivtac_host::stop;
use hivtac_terms::status::Status;
use hivtac_wire::message::{DeviceMessage, Request, Sample};

use super::folder::{Folder, conditions_of};
use super::gauge_port::{GaugeArgs, GaugePort};
use super::poses::{self, Person, Pose, Task};

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
    /// Length of the take of the untouched film that begins every run, s.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub rest_seconds: f64,
    /// The gauge at a serial port.
    #[command(flatten)]
    pub gauge: GaugeArgs,
}

/// A number of seconds of a command line.
///
/// # Errors
/// When it is none, or beyond what makes sense.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds > 0.0 && seconds <= 36_000.0 => Ok(seconds),
        _ => Err("a number of seconds above 0 is needed, up to 36000".to_owned()),
    }
}

/// Fewer frames of the untouched film are no rest position.
const FEWEST_AT_REST: usize = 8;

/// A load of which the sensor feels less was none, N: with a model of another unit it feels half to
/// twice of what there is.
const LEAST_FELT_N: f64 = 0.005;
/// Time between two lines of live numbers.
const SHOW_EVERY: Duration = Duration::from_millis(200);

/// Frames of the sensor's own rest position, and what they may take beyond its usual patience.
const TARE_FRAMES: u16 = 64;
const TARE_PATIENCE: Duration = Duration::from_secs(30);

/// Records until the list is done, the person says so, or Ctrl-C.
///
/// # Errors
/// When sensor, gauge or folder fail. What was recorded until then stays.
pub fn record(args: &RecordArgs) -> Result<()> {
    let list = args.poses.as_deref().map(poses::load).transpose()?;
    let tasks = list.map(|list| {
        let tasks = list.into_iter();
        tasks
            .map(|pose| Task::any_force(pose, args.seconds))
            .collect()
    });
    record_tasks(args, tasks)
}

/// Records these tasks but those that were done; without any, poses that are typed. `args.poses`
/// is not looked at.
///
/// # Errors
/// When sensor, gauge or folder fail. What was recorded until then stays.
pub fn record_tasks(args: &RecordArgs, tasks: Option<Vec<Task>>) -> Result<()> {
    stop::install()?;
    let patience = Duration::from_secs_f64(args.timeout);
    let address = args.port.as_deref().map_or(Address::Find, Address::parse);
    let (link, hello) = Link::connect(&address, patience)?;
    let folder = Folder::open(&args.into, &conditions_of(&hello)?)?;
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
    /// When live numbers were last shown.
    shown: Instant,
}

/// What a take gave.
#[derive(Clone, Copy, Debug, Default)]
struct Take {
    samples: usize,
    good: usize,
    lost: u32,
    first_us: Option<u64>,
    last_us: u64,
    last_sequence: Option<u32>,
    /// The largest |F| that the sensor felt, N; nothing without a force.
    felt_n: Option<f64>,
}

impl Recorder {
    fn run(&mut self, args: &RecordArgs, list: Option<&[Task]>) -> Result<()> {
        let question = "Nothing may touch the film, and the gauge shows zero: press Enter.";
        if self.person.ask(question)?.is_none() {
            bail!("standard input has ended: nothing was recorded");
        }
        self.tare()?;
        let rest = self.take(None, args.rest_seconds)?;
        self.folder.take_done(None, rest.samples, rest.lost)?;
        ensure!(
            rest.good >= FEWEST_AT_REST,
            "{} of {} frames of the untouched film show the four markers: at least \
             {FEWEST_AT_REST} are needed (see `hivtac monitor`)",
            rest.good,
            rest.samples
        );
        let mut left = list.map(|list| poses::left(list, &self.folder.done, |task| task.pose));
        if let (Some(list), Some(left)) = (list, &left) {
            eprintln!("{} of {} poses are left.", left.len(), list.len());
        }
        while let Some(task) = self.next_task(left.as_mut(), args.seconds)? {
            let take = self.take(Some(&task), task.seconds)?;
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

    /// Has the sensor take its rest position: it refuses bad markers, and what it then says of
    /// markers under a force is against their own places.
    fn tare(&mut self) -> Result<()> {
        let request = Request::Tare {
            frames: TARE_FRAMES,
        };
        self.link
            .request(request, self.patience + TARE_PATIENCE, |_| ())?;
        Ok(())
    }

    /// The next task, once its pose is set; nothing at the end.
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

    /// Records for so long on the sensor's clock.
    fn take(&mut self, task: Option<&Task>, seconds: f64) -> Result<Take> {
        let pose = task.map(|task| task.pose);
        match task {
            Some(task) => eprintln!("Recording for {seconds} s: {}.", task.press),
            None => eprintln!("Recording the untouched film for {seconds} s."),
        }
        let heard = self.gauge_readings()?;
        let mut take = Take::default();
        let mut early = Vec::new();
        self.link
            .request(Request::StartWithMarkers, self.patience, |m| early.push(m))?;
        for message in early {
            self.keep(message, pose, &mut take)?;
        }
        let length_us = (seconds * 1e6) as u64;
        let mut deadline = Instant::now() + self.patience;
        while take
            .first_us
            .is_none_or(|first| take.last_us < first + length_us)
        {
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
        let heard = match (heard, self.gauge_readings()?) {
            (Some(before), Some(after)) => format!(", {} gauge readings", after - before),
            _ => String::new(),
        };
        eprintln!(
            "{} samples ({} with markers, {} lost){heard}.",
            take.samples, take.good, take.lost
        );
        Ok(take)
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
                take.count(&sample);
                self.show(&sample);
            }
            DeviceMessage::Log(line) => eprintln!("{}", log_text(&line)),
            _ => {}
        }
        Ok(())
    }

    /// Live numbers on one line of a terminal, a few times a second.
    fn show(&mut self, sample: &Sample) {
        let mut terminal = std::io::stderr();
        if self.shown.elapsed() < SHOW_EVERY || !terminal.is_terminal() {
            return;
        }
        self.shown = Instant::now();
        let gauge_n = self.gauge.as_ref().and_then(GaugePort::newest_n);
        let _ = write!(terminal, "\r{}\r", live(gauge_n, sample));
    }
}

/// What gauge and sensor show now, each as wide as the last.
fn live(gauge_n: Option<f64>, sample: &Sample) -> String {
    let gauge = gauge_n.map_or(String::new(), |n| format!("gauge {:7.1} mN, ", 1e3 * n));
    let sensor = match &sample.force {
        Some(force) => format!("sensor about {:5.0} mN", f64::from(force.magnitude.0) / 1e3),
        None if sample.markers.is_some() => "sensor sees four markers".to_owned(),
        None => "sensor sees NO four markers".to_owned(),
    };
    format!("{:<60}", gauge + &sensor)
}

impl Take {
    fn count(&mut self, sample: &Sample) {
        self.samples += 1;
        let implausible = Status::MARKERS_IMPLAUSIBLE;
        self.good += usize::from(sample.markers.is_some() && !sample.status.contains(implausible));
        self.first_us.get_or_insert(sample.time_us);
        self.last_us = sample.time_us;
        if let Some(force) = &sample.force {
            let force_n = f64::from(force.magnitude.0) / 1e6;
            self.felt_n = Some(self.felt_n.map_or(force_n, |most| most.max(force_n)));
        }
        if let Some(last) = self.last_sequence.replace(sample.sequence) {
            self.lost += sample.sequence.wrapping_sub(last).wrapping_sub(1);
        }
    }
}
