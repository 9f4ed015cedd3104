//! `hivtac monitor`: shows the forces as they arrive, and a summary at the end.

use crate::device::{Device, seconds};
use crate::follow::{RETRY_EVERY, SILENCE, note_connected_again};
use crate::lines::{Format, Row};
use crate::output::{self, Reader, note, print};
use clap::Args;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::reply::log_text;
use hivtac_host::stop;
use hivtac_host::tally::Tally;
use hivtac_host::truth::TruthFile;
use hivtac_wire::message::{DeviceMessage, Request, Sample};
use std::time::{Duration, Instant};

/// Longest wait for the last counters at the end, even when `--timeout` is longer.
const FAREWELL: Duration = Duration::from_secs(10);

/// Show forces as they come, and a summary at the end
///
/// Example: hivtac monitor --seconds 10
#[derive(Args)]
pub struct MonitorArguments {
    #[command(flatten)]
    device: Device,
    /// End after N frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// End after S seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<Duration>,
    /// One JSON object a line
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Comma-separated values
    #[arg(long)]
    csv: bool,
    /// Go on after a lost connection, trying twice a second
    #[arg(long)]
    reconnect: bool,
    /// Compare with the log of a simulated sensor: JSON lines with "frame" and the true force
    #[arg(long, value_name = "FILE")]
    truth: Option<String>,
}

impl MonitorArguments {
    /// How samples are printed.
    fn format(&self) -> Format {
        match (self.json, self.csv) {
            (true, _) => Format::Json,
            (_, true) => Format::Csv,
            _ => Format::Human,
        }
    }
}

/// Shows samples until the frames or the time are over, the reader is gone, or something fails.
/// Then prints the summary: to standard output for a person, to standard error with JSON and CSV.
pub fn run(arguments: &MonitorArguments) -> Result<(), Failure> {
    let mut monitor = Monitor::new(arguments)?;
    let result = monitor.watch();
    if monitor.started.is_some() {
        monitor.print_summary();
    }
    result.map(|_| ())
}

/// Why the samples ended without a failure.
enum End {
    /// The wanted number of frames was shown, or the wanted time has passed.
    Enough,
    /// The reader of the output is gone.
    ReaderGone,
}

/// Time since the last sample.
struct Silence {
    since: Instant,
    is_reported: bool,
}

impl Silence {
    fn new() -> Silence {
        Silence {
            since: Instant::now(),
            is_reported: false,
        }
    }

    /// The time at which the device is asked whether it is there.
    fn end(&self) -> Instant {
        self.since + SILENCE
    }

    /// Notes that the device answered, with a message the first time, and restarts the time.
    fn tell(&mut self) {
        if !std::mem::replace(&mut self.is_reported, true) {
            let seconds = SILENCE.as_secs();
            note(&format!(
                "hivtac: no sample for {seconds} s, but the device answers; does the camera run? \
                 (waiting)"
            ));
        }
        self.since = Instant::now();
    }
}

struct Monitor<'o> {
    arguments: &'o MonitorArguments,
    address: Address,
    patience: Duration,
    truth: Option<TruthFile>,
    tally: Tally,
    /// Time of the first start of samples.
    started: Option<Instant>,
    reader: Reader,
    /// True from a new connection to its first sample.
    just_back: bool,
}

impl<'o> Monitor<'o> {
    fn new(arguments: &'o MonitorArguments) -> Result<Self, Failure> {
        let address = arguments.device.address()?;
        let truth = arguments
            .truth
            .as_deref()
            .map(TruthFile::open)
            .transpose()?;
        Ok(Monitor {
            arguments,
            address,
            patience: arguments.device.timeout,
            truth,
            tally: Tally::default(),
            started: None,
            reader: Reader::There,
            just_back: false,
        })
    }

    /// Follows the device through as many connections as necessary.
    fn watch(&mut self) -> Result<End, Failure> {
        let (mut link, _) = Link::connect(&self.address, self.patience)?;
        loop {
            let result = self.converse(&mut link);
            self.tally.rejected(link.rejected());
            match result {
                Err(failure) if failure.kind == Kind::Lost && self.arguments.reconnect => {
                    drop(link);
                    note(&format!("hivtac: {failure}"));
                    match self.find_again()? {
                        Some(again) => link = again,
                        None => return Ok(End::Enough),
                    }
                }
                result => return result,
            }
        }
    }

    /// Connects again, however long it takes; `None` if the monitor's time ends first.
    fn find_again(&mut self) -> Result<Option<Link>, Failure> {
        let lost = Instant::now();
        while !self.time_is_over() {
            stop::check()?;
            std::thread::sleep(RETRY_EVERY);
            match Link::connect(&self.address, self.patience) {
                Ok((link, _)) => {
                    note_connected_again(&link.name, lost);
                    self.tally.connected_again();
                    self.just_back = true;
                    return Ok(Some(link));
                }
                Err(failure) if matches!(failure.kind, Kind::NoDevice | Kind::Lost) => (),
                Err(failure) => return Err(failure),
            }
        }
        Ok(None)
    }

    /// One connection from the first command to its end.
    fn converse(&mut self, link: &mut Link) -> Result<End, Failure> {
        self.request(link, Request::GetInfo, self.patience)?;
        self.started.get_or_insert_with(Instant::now);
        self.end().into_iter().for_each(output::limit);
        self.print_header()?;
        let started = self.request(link, Request::Start, self.patience)?;
        let end = match started {
            Some(end) => end,
            None => self.stream(link)?,
        };
        self.say_goodbye(link);
        Ok(end)
    }

    fn print_header(&mut self) -> Result<(), Failure> {
        let header = self.arguments.format().header(self.truth.is_some());
        if let (Some(header), 0) = (header, self.tally.reconnections()) {
            self.reader = print(&header)?;
        }
        Ok(())
    }

    /// Sends a command; samples that arrive before its reply are shown.
    fn request(
        &mut self,
        link: &mut Link,
        request: Request,
        patience: Duration,
    ) -> Result<Option<End>, Failure> {
        let mut early = Vec::new();
        link.request(request, patience, |message| early.push(message))?;
        self.take_all(early)
    }

    /// Handles messages in their order, up to a reason to end.
    fn take_all(&mut self, messages: Vec<DeviceMessage>) -> Result<Option<End>, Failure> {
        for message in messages {
            if let Some(end) = self.take(message)? {
                return Ok(Some(end));
            }
        }
        Ok(None)
    }

    fn stream(&mut self, link: &mut Link) -> Result<End, Failure> {
        let mut silence = Silence::new();
        while !self.time_is_over() {
            let wait = self
                .end()
                .map_or(silence.end(), |end| end.min(silence.end()));
            match link.receive(wait)? {
                Some(message) => {
                    let is_sample = matches!(message, DeviceMessage::Sample(_));
                    if let Some(end) = self.take(message)? {
                        return Ok(end);
                    }
                    // After `take`, which may have waited for the reader of the output.
                    if is_sample {
                        silence = Silence::new();
                    }
                }
                None if Instant::now() >= silence.end() => {
                    let mut early = Vec::new();
                    // Behind a TCP port the device may have been unplugged or restarted while the
                    // port stayed open.
                    match link.probe(self.patience, |message| early.push(message))? {
                        true => silence.tell(),
                        false => silence = Silence::new(),
                    }
                    if let Some(end) = self.take_all(early)? {
                        return Ok(end);
                    }
                }
                None => (),
            }
        }
        Ok(End::Enough)
    }

    /// Handles one message; returns the reason to end, if there is one.
    fn take(&mut self, message: DeviceMessage) -> Result<Option<End>, Failure> {
        match message {
            DeviceMessage::Sample(sample) => return self.show(&sample),
            DeviceMessage::Stats(stats) => self.tally.stats(&stats),
            DeviceMessage::Log(line) => note(&log_text(&line)),
            // Late replies to a repeated hello or to commands whose wait is over.
            _ => (),
        }
        Ok(None)
    }

    fn show(&mut self, sample: &Sample) -> Result<Option<End>, Failure> {
        let (samples, frames) = self.tally.sample(sample);
        if std::mem::take(&mut self.just_back) {
            note(&format!(
                "hivtac: {samples} samples missed, {frames} more frames passed meanwhile"
            ));
        }
        let truth = match &mut self.truth {
            Some(file) => Some(file.take(sample.frame)?),
            None => None,
        };
        if let (Some(force), Some(Some(truth))) = (&sample.force, &truth) {
            self.tally.compare(force, truth);
        }
        self.reader = print(&self.arguments.format().row(&Row { sample, truth }))?;
        match self.reader {
            Reader::There => (),
            Reader::Gone => return Ok(Some(End::ReaderGone)),
            Reader::Stalled => return stop::check().map(|()| Some(End::Enough)),
        }
        self.tally.shown += 1;
        let enough = self
            .arguments
            .frames
            .is_some_and(|frames| self.tally.shown >= frames);
        Ok(enough.then_some(End::Enough))
    }

    /// The time to end; `None` before the first start of samples or without a limit.
    fn end(&self) -> Option<Instant> {
        Some(self.started? + self.arguments.seconds?)
    }

    fn time_is_over(&self) -> bool {
        self.end().is_some_and(|end| Instant::now() >= end)
    }

    /// Stops the device and fetches its last counters; errors are ignored.
    fn say_goodbye(&mut self, link: &mut Link) {
        let ignore_samples = |stats: &mut Tally, message| {
            if let DeviceMessage::Stats(last) = message {
                stats.stats(&last);
            }
        };
        let patience = FAREWELL.min(self.patience);
        for request in [Request::Stop, Request::GetInfo] {
            let tally = &mut self.tally;
            let result = link.request(request, patience, |message| ignore_samples(tally, message));
            if result.is_err() {
                return;
            }
        }
    }

    fn print_summary(&self) {
        let summary = self.tally.summary(self.truth.is_some());
        let for_a_person = self.arguments.format() == Format::Human && self.reader == Reader::There;
        let printed = for_a_person.then(|| print(&format!("\n{}", summary.trim_end())));
        if !matches!(printed, Some(Ok(Reader::There | Reader::Gone))) {
            note(summary.trim_end());
        }
    }
}
