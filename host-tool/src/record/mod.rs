//! `hivtac record`: writes every message of one or several devices into a file.

mod listen;
mod table;

pub use listen::{Arrival, listen_to_all};

use crate::device::{Devices, seconds};
use crate::grip_command::{GripArguments, Paired};
use crate::output::{note, print};
use clap::Args;
use hivtac_host::bag::{Bag, summary_of};
use hivtac_host::clock::now_ns;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::reply::log_text;
use hivtac_host::shown::{shown, unit_number};
use hivtac_host::tally::Tally;
use hivtac_terms::marker::LEAST_MARKERS;
use hivtac_wire::message::{DeviceHello, DeviceMessage};
use mcap::McapError;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use table::Table;

/// Time between two flushes and between two lines of progress.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// Record every message of one or several devices, with both clocks, until Ctrl-C
///
/// FILE.mcap has ROS 2's profile: `ros2 bag play`, Foxglove and PlotJuggler read it, and
/// `hivtac replay`. FILE.csv has a row a sample, with units in its header. Until its end it is
/// FILE.partial; it keeps that name when the connection was lost. Several sensors are recorded
/// into one FILE.mcap, each with its own topics.
///
/// Example: hivtac record press.mcap --seconds 60
#[derive(Args)]
pub struct RecordArguments {
    #[command(flatten)]
    devices: Devices,
    #[command(flatten)]
    grip: GripArguments,
    /// The file to make, ….mcap or ….csv
    file: PathBuf,
    /// End after this number of seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<Duration>,
    /// At the end, the counts as one JSON object
    #[arg(long)]
    json: bool,
}

/// Records until the time is over, Ctrl-C, or the loss of a device.
pub fn run(arguments: &RecordArguments) -> Result<(), Failure> {
    let (devices, grip) = (&arguments.devices, &arguments.grip);
    let addresses = grip.before(devices.timeout, || devices.addresses())?;
    check(&arguments.file, addresses.len())?;
    let (mut links, hellos) = arguments.devices.connect(&addresses)?;
    let paired = grip.pair(&hellos)?;
    let mut recording = Recording::create(&arguments.file, &hellos)?;
    recording.add_grip(paired)?;
    let result = recording.follow(&mut links, arguments);
    for (link, sensor) in links.iter().zip(&mut recording.sensors) {
        sensor.tally.rejected(link.rejected());
    }
    let counts: Vec<Value> = recording.sensors.iter().map(Sensor::counts).collect();
    let ended = recording.end(result);
    if arguments.json {
        print(&summary(&arguments.file, counts, &ended).to_string())?;
    }
    ended
}

/// The result of a recording as one JSON object: the counts of a single sensor, or a list with
/// those of each.
fn summary(file: &Path, mut counts: Vec<Value>, ended: &Result<(), Failure>) -> Value {
    let is_whole = is_clean(ended);
    let file = file.display();
    let mut summary = match &mut counts[..] {
        [only] => only.take(),
        _ => json!({ "sensors": counts }),
    };
    summary["file"] = match is_whole {
        true => file.to_string(),
        false => format!("{file}.partial"),
    }
    .into();
    summary["whole"] = is_whole.into();
    summary
}

/// Whether a recording with this end is complete.
fn is_clean(ended: &Result<(), Failure>) -> bool {
    let asked = |failure: &Failure| failure.kind == Kind::Interrupted;
    ended.as_ref().err().is_none_or(asked)
}

/// The format of a file for this number of sensors; an error if it cannot hold them.
fn check(file: &Path, sensors: usize) -> Result<Format, Failure> {
    let format = Format::of(file)?;
    if matches!(format, Format::Csv) && sensors > 1 {
        let what = "a table has one sensor; record several into a name that ends with .mcap";
        return Err(input(file, what));
    }
    match file.exists() {
        true => {
            let what = "there is such a file already; choose another name";
            Err(input(file, what))
        }
        false => Ok(format),
    }
}

/// The format of a file, by the end of its name.
#[derive(Clone, Copy)]
enum Format {
    Mcap,
    Csv,
}

impl Format {
    fn of(file: &Path) -> Result<Format, Failure> {
        match file.extension().and_then(|end| end.to_str()) {
            Some("mcap") => Ok(Format::Mcap),
            Some("csv") => Ok(Format::Csv),
            _ => Err(input(
                file,
                "end its name with .mcap or .csv, which says what it is",
            )),
        }
    }
}

enum Sink {
    Bag(Box<Bag<BufWriter<File>>>),
    Table(Table),
}

/// A sensor, and the counts of its messages.
struct Sensor {
    hello: DeviceHello,
    tally: Tally,
}

impl Sensor {
    fn new(hello: &DeviceHello) -> Sensor {
        Sensor {
            hello: hello.clone(),
            tally: Tally::default(),
        }
    }

    fn unit(&self) -> String {
        unit_number(&self.hello.device_id)
    }

    /// Prints its counts, with its name if there are several sensors.
    fn tell(&self, of: usize) {
        if of > 1 {
            note(&format!("{} {}:", self.unit(), shown(&self.hello.name)));
        }
        note(self.tally.summary_of_recorded().trim_end());
    }

    fn counts(&self) -> Value {
        let mut counts = json!({ "unit": self.unit() });
        for (name, count) in self.tally.counts() {
            counts[name] = count.into();
        }
        counts
    }
}

/// A recording that is being written.
pub struct Recording {
    file: PathBuf,
    partial: PathBuf,
    sink: Sink,
    /// The start by this program's clock, which never jumps, and the time of the start, ns since
    /// 1970.
    begun: Instant,
    begun_ns: u64,
    sensors: Vec<Sensor>,
}

impl Recording {
    /// Begins `….mcap` or `….csv`, as `….partial`, with the devices' hellos.
    ///
    /// # Errors
    /// When the file exists already or cannot be made, or when two devices are the same.
    pub fn create(file: &Path, hellos: &[DeviceHello]) -> Result<Recording, Failure> {
        let kind = check(file, hellos.len())?;
        let sensors: Vec<Sensor> = hellos.iter().map(Sensor::new).collect();
        let units: BTreeSet<String> = sensors.iter().map(Sensor::unit).collect();
        if units.len() < sensors.len() {
            return Err(input(file, "the same sensor is named twice"));
        }
        let file = file.to_owned();
        let mut partial = file.clone().into_os_string();
        partial.push(".partial");
        let partial = PathBuf::from(partial);
        let open = OpenOptions::new()
            .write(true)
            .read(true)
            .create_new(true)
            .open(&partial);
        let open = open.map_err(|error| input(&partial, error))?;
        let begun_ns = now_ns();
        let sink = match kind {
            Format::Mcap => Bag::create(BufWriter::new(open), hellos, begun_ns)
                .map(|bag| Sink::Bag(Box::new(bag))),
            Format::Csv => {
                let model = hellos.first().and_then(|hello| hello.model.as_ref());
                let markers = model.map_or(LEAST_MARKERS, |model| model.markers.into());
                let table = Table::create(open, markers);
                table.map(Sink::Table).map_err(Into::into)
            }
        };
        Ok(Recording {
            sink: sink.map_err(|error| unwritten(&partial, error))?,
            file,
            partial,
            begun: Instant::now(),
            begun_ns,
            sensors,
        })
    }

    /// Also records the grip of the first two devices.
    fn add_grip(&mut self, paired: Option<Paired>) -> Result<(), Failure> {
        let (Sink::Bag(bag), Some(Paired { pair, names })) = (&mut self.sink, paired) else {
            return Ok(());
        };
        bag.add_grip(pair, names)
            .map_err(|error| unwritten(&self.partial, error))
    }

    /// Keeps all messages until the end; a failure of one device ends the recording.
    fn follow(&mut self, links: &mut [Link], arguments: &RecordArguments) -> Result<(), Failure> {
        let patience = arguments.devices.timeout;
        listen_to_all(links, patience, arguments.seconds, |arrivals| {
            self.keep_all(arrivals)
        })
    }

    /// Keeps the messages until all senders are gone.
    fn keep_all(&mut self, arrivals: &Receiver<Arrival>) -> Result<(), Failure> {
        let mut flushed = Instant::now();
        loop {
            match arrivals.recv_timeout(FLUSH_EVERY.saturating_sub(flushed.elapsed())) {
                Ok(arrival) => self.keep(&arrival)?,
                Err(RecvTimeoutError::Timeout) => (),
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            if flushed.elapsed() >= FLUSH_EVERY {
                flushed = Instant::now();
                self.flush()?;
                self.show_progress();
            }
        }
    }

    /// Keeps a device's message.
    ///
    /// # Errors
    /// When the disk is full or gone.
    pub fn keep(&mut self, arrival: &Arrival) -> Result<(), Failure> {
        let Arrival {
            sensor,
            at,
            message,
        } = arrival;
        let tally = &mut self.sensors[*sensor].tally;
        match message {
            DeviceMessage::Sample(sample) => drop(tally.sample(sample)),
            DeviceMessage::Stats(stats) => tally.stats(stats),
            DeviceMessage::Log(line) => note(&log_text(line)),
            // A reply to this program is not a measurement.
            _ => return Ok(()),
        }
        let since = at.saturating_duration_since(self.begun);
        let came_ns = self.begun_ns + since.as_nanos() as u64;
        let kept = match &mut self.sink {
            Sink::Bag(bag) => bag.message(*sensor, message, came_ns),
            Sink::Table(table) => {
                table.message(message, came_ns);
                Ok(())
            }
        };
        kept.map_err(|error| unwritten(&self.partial, error))
    }

    /// Writes all messages kept until now to the disk.
    ///
    /// # Errors
    /// When the disk is full or gone.
    pub fn flush(&mut self) -> Result<(), Failure> {
        let flushed = match &mut self.sink {
            Sink::Bag(bag) => bag.flush(),
            Sink::Table(table) => table.flush().map_err(Into::into),
        };
        flushed.map_err(|error| unwritten(&self.partial, error))
    }

    /// The duration and the counts, for a person.
    pub fn progress(&self) -> String {
        let seconds = self.begun.elapsed().as_secs();
        let lines = self
            .sensors
            .iter()
            .map(|sensor| sensor.tally.received_line());
        format!("{seconds} s, {}", lines.collect::<Vec<_>>().join("; "))
    }

    fn show_progress(&self) {
        let mut terminal = std::io::stderr();
        if terminal.is_terminal() {
            let _ = write!(terminal, "\r{} ", self.progress());
        }
    }

    /// Ends the file and, if it is complete, gives it its final name.
    ///
    /// # Errors
    /// The failure that ended the recording, or that of ending the file.
    pub fn end(self, result: Result<(), Failure>) -> Result<(), Failure> {
        let Recording {
            file,
            partial,
            sink,
            begun,
            sensors,
            ..
        } = self;
        let tell_counts = || sensors.iter().for_each(|sensor| sensor.tell(sensors.len()));
        let is_clean = is_clean(&result);
        if let Err(failure) = &result
            && failure.kind == Kind::Input
        {
            // The disk is full or gone, and nothing more can be written. Flushed data can be read.
            drop(sink);
            tell_counts();
            return result;
        }
        let ended = result
            .as_ref()
            .err()
            .map_or("as asked".to_owned(), ToString::to_string);
        let lasted = begun.elapsed();
        let summaries = sensors
            .iter()
            .map(|sensor| summary_of(&sensor.hello, &sensor.tally, &ended, lasted));
        let summaries = summaries.collect();
        finish(sink, summaries).map_err(|error| unwritten(&partial, error))?;
        tell_counts();
        if is_clean {
            fs::rename(&partial, &file).map_err(|error| input(&file, error))?;
            note(&format!(
                "recorded into {}",
                shown(&file.display().to_string())
            ));
        } else {
            note(&format!(
                "what came until then is in {}",
                shown(&partial.display().to_string())
            ));
        }
        result
    }
}

/// Ends a file, and waits until the disk has it.
fn finish(sink: Sink, summaries: Vec<BTreeMap<String, String>>) -> Result<(), McapError> {
    let file: File = match sink {
        Sink::Bag(bag) => {
            let writer = bag.finish(summaries)?;
            writer.into_inner().map_err(|error| error.into_error())?
        }
        Sink::Table(table) => table.finish()?,
    };
    Ok(file.sync_all()?)
}

/// The failure of writing: the disk's own words, such as that it is full.
fn unwritten(file: &Path, error: McapError) -> Failure {
    match error {
        McapError::Io(error) => input(file, error),
        error => input(file, error),
    }
}

fn input(file: &Path, what: impl Display) -> Failure {
    Failure::input(format!("cannot record into {}: {what}", file.display()))
}
