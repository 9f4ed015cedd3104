//! Recording: the sensor's samples, the gauge's lines and the poses, into a folder.

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
use super::poses::{self, Person, Pose};

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
    #[command(flatten)]
    pub gauge: GaugeArgs,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds > 0.0 && seconds <= 36_000.0 => Ok(seconds),
        _ => Err("a number of seconds above 0 is needed, up to 36000".to_owned()),
    }
}

/// Fewer frames of the untouched film are no rest position.
const FEWEST_AT_REST: usize = 8;

/// Frames of the sensor's own rest position, and what they may take beyond its usual patience.
const TARE_FRAMES: u16 = 64;
const TARE_PATIENCE: Duration = Duration::from_secs(30);

/// Records until the list is done, the person says so, or Ctrl-C.
///
/// # Errors
/// When sensor, gauge or folder fail. What was recorded until then stays.
pub fn record(args: &RecordArgs) -> Result<()> {
    stop::install()?;
    let list = args.poses.as_deref().map(poses::load).transpose()?;
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
    };
    let result = recorder.run(args, list.as_deref());
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
}

impl Recorder {
    fn run(&mut self, args: &RecordArgs, list: Option<&[Pose]>) -> Result<()> {
        let question = "Nothing may touch the film, and the gauge shows zero: press Enter.";
        if self.person.ask(question)?.is_none() {
            bail!("standard input has ended: nothing was recorded");
        }
        self.tare()?;
        let rest = self.take(None, args.rest_seconds)?;
        ensure!(
            rest.good >= FEWEST_AT_REST,
            "{} of {} frames of the untouched film show the four markers: at least \
             {FEWEST_AT_REST} are needed (see `hivtac monitor`)",
            rest.good,
            rest.samples
        );
        let mut left = list.map(|list| poses::left(list, &self.folder.done));
        if let (Some(list), Some(left)) = (list, &left) {
            eprintln!("{} of {} poses are left.", left.len(), list.len());
        }
        while let Some(pose) = self.next_pose(left.as_mut())? {
            self.take(Some(pose), args.seconds)?;
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

    /// The next pose, once it is set; nothing at the end.
    fn next_pose(&self, list: Option<&mut Vec<Pose>>) -> Result<Option<Pose>> {
        let Some(list) = list else {
            return self.typed_pose();
        };
        if list.is_empty() {
            return Ok(None);
        }
        let pose = list.remove(0);
        let question = format!("Set {pose}, and press Enter (`done` to end).");
        let answer = self.person.ask(&question)?;
        Ok(answer.filter(|text| text != "done").map(|_| pose))
    }

    fn typed_pose(&self) -> Result<Option<Pose>> {
        loop {
            let question = "Set a pose and type α and β in degrees, such as `4, -3`, and where the \
                            tip is not in the middle its x and y in mm, such as `4, -3, 2.5, 0` \
                            (`done` to end).";
            match self.person.ask(question)?.as_deref() {
                None | Some("done") => return Ok(None),
                Some(text) => match poses::parse(text) {
                    Ok(pose) => return Ok(Some(pose)),
                    Err(error) => eprintln!("{error}"),
                },
            }
        }
    }

    /// Records for so long on the sensor's clock.
    fn take(&mut self, pose: Option<Pose>, seconds: f64) -> Result<Take> {
        match pose {
            Some(_) => {
                eprintln!("Recording for {seconds} s: press and release, in no even rhythm.")
            }
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
        self.folder.take_done(pose, take.samples, take.lost)?;
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
            }
            DeviceMessage::Log(line) => eprintln!("{}", log_text(&line)),
            _ => {}
        }
        Ok(())
    }
}

impl Take {
    fn count(&mut self, sample: &Sample) {
        self.samples += 1;
        let implausible = Status::MARKERS_IMPLAUSIBLE;
        self.good += usize::from(sample.markers.is_some() && !sample.status.contains(implausible));
        self.first_us.get_or_insert(sample.time_us);
        self.last_us = sample.time_us;
        if let Some(last) = self.last_sequence.replace(sample.sequence) {
            self.lost += sample.sequence.wrapping_sub(last).wrapping_sub(1);
        }
    }
}
