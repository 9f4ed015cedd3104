//! `hivtac record`: everything that the device says, into a file.

mod bag;
mod ros;
mod table;

pub use bag::WIRE;
pub use ros::BEFORE_BYTES;

use crate::output::{note, print};
use crate::tally::Tally;
use bag::Bag;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::{Link, log_text};
use hivtac_host::port::Address;
use hivtac_host::shown::shown;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Request};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use table::Table;

/// Time between two flushes, and two lines of progress.
const FLUSH_EVERY: Duration = Duration::from_secs(1);
/// A device that sends nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(10);

/// What to do.
pub struct Options {
    /// Where the device is.
    pub address: Address,
    /// Longest wait for the device's answers.
    pub patience: Duration,
    /// End after so long; else at Ctrl-C.
    pub duration: Option<Duration>,
    /// `….mcap` or `….csv`.
    pub file: PathBuf,
    /// At the end, what became of it as one JSON object.
    pub json: bool,
}

/// Records until the time is over, Ctrl-C, or the device is gone.
pub fn run(options: &Options) -> Result<(), Failure> {
    check(&options.file)?;
    let (mut link, hello) = Link::connect(&options.address, options.patience)?;
    let mut recording = Recording::create(&options.file, &hello)?;
    let result = recording.follow(&mut link, options);
    recording.tally.rejected(link.rejected());
    let counts = recording.tally.counts();
    let ended = recording.end(&hello, result);
    if options.json {
        print(&summary(options, counts, &ended).to_string())?;
    }
    ended
}

/// What became of a recording, as one JSON object.
fn summary(
    options: &Options,
    counts: impl IntoIterator<Item = (&'static str, u64)>,
    ended: &Result<(), Failure>,
) -> Value {
    let is_whole = is_clean(ended);
    let file = options.file.display();
    let mut summary = json!({
        "file": if is_whole { file.to_string() } else { format!("{file}.partial") },
        "whole": is_whole,
    });
    for (name, count) in counts {
        summary[name] = count.into();
    }
    summary
}

/// Whether nothing is missing of a recording that ended so.
fn is_clean(ended: &Result<(), Failure>) -> bool {
    let asked = |failure: &Failure| failure.kind == Kind::Interrupted;
    ended.as_ref().err().is_none_or(asked)
}

/// Says whether a file can be made.
fn check(file: &Path) -> Result<Format, Failure> {
    let format = Format::of(file)?;
    match file.exists() {
        true => {
            let what = "there is such a file already; choose another name";
            Err(input(file, what))
        }
        false => Ok(format),
    }
}

/// The kind of a file, by the end of its name.
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
    Bag(Box<Bag>),
    Table(Table),
}

/// A file under way.
pub struct Recording {
    file: PathBuf,
    partial: PathBuf,
    sink: Sink,
    /// This program's clock, which never jumps, and what time it was when it began, ns since 1970.
    begun: Instant,
    begun_ns: u64,
    tally: Tally,
}

impl Recording {
    /// Begins `….mcap` or `….csv` with a device's hello, as `….partial`.
    ///
    /// # Errors
    /// When there is such a file already, or it cannot be made.
    pub fn create(file: &Path, hello: &DeviceHello) -> Result<Recording, Failure> {
        let kind = check(file)?;
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
        let since = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        let begun_ns = since.as_nanos() as u64;
        let sink = match kind {
            Format::Mcap => Bag::create(open, hello, begun_ns).map(|bag| Sink::Bag(Box::new(bag))),
            Format::Csv => Table::create(open).map(Sink::Table).map_err(Into::into),
        };
        Ok(Recording {
            sink: sink.map_err(|error| input(&partial, error))?,
            file,
            partial,
            begun: Instant::now(),
            begun_ns,
            tally: Tally::default(),
        })
    }

    /// Keeps what comes until the end.
    fn follow(&mut self, link: &mut Link, options: &Options) -> Result<(), Failure> {
        for request in [Request::GetInfo, Request::StartWithMarkers] {
            let mut early = Vec::new();
            link.request(request, options.patience, |message| early.push(message))?;
            early.iter().try_for_each(|message| self.keep(message))?;
        }
        let end = options.duration.map(|duration| Instant::now() + duration);
        let (mut heard, mut flushed) = (Instant::now(), Instant::now());
        while end.is_none_or(|end| Instant::now() < end) {
            let next = flushed + FLUSH_EVERY;
            if let Some(message) = link.receive(end.map_or(next, |end| end.min(next)))? {
                heard = Instant::now();
                self.keep(&message)?;
            }
            if flushed.elapsed() >= FLUSH_EVERY {
                flushed = Instant::now();
                self.flush()?;
                self.show_progress();
            }
            if heard.elapsed() >= SILENCE {
                return Err(link.lost("the device sends nothing"));
            }
        }
        let mut late = Vec::new();
        for request in [Request::Stop, Request::GetInfo] {
            link.request(request, options.patience, |message| late.push(message))?;
        }
        late.iter().try_for_each(|message| self.keep(message))
    }

    /// Keeps a message that has just come.
    ///
    /// # Errors
    /// When the disk is full, or gone.
    pub fn keep(&mut self, message: &DeviceMessage) -> Result<(), Failure> {
        match message {
            DeviceMessage::Sample(sample) => drop(self.tally.sample(sample)),
            DeviceMessage::Stats(stats) => self.tally.stats(stats),
            DeviceMessage::Log(line) => note(&log_text(line)),
            // An answer to this program: no part of what the device measured.
            _ => return Ok(()),
        }
        let now_ns = self.begun_ns + self.begun.elapsed().as_nanos() as u64;
        let kept = match &mut self.sink {
            Sink::Bag(bag) => bag.message(message, now_ns),
            Sink::Table(table) => table.message(message, now_ns).map_err(Into::into),
        };
        kept.map_err(|error| input(&self.partial, error))
    }

    /// Brings to the disk what came so far.
    ///
    /// # Errors
    /// When it is full, or gone.
    pub fn flush(&mut self) -> Result<(), Failure> {
        let flushed = match &mut self.sink {
            Sink::Bag(bag) => bag.flush(),
            Sink::Table(table) => table.flush().map_err(Into::into),
        };
        flushed.map_err(|error| input(&self.partial, error))
    }

    /// For a person, how long it lasts and what came.
    pub fn progress(&self) -> String {
        let seconds = self.begun.elapsed().as_secs();
        format!("{seconds} s, {}", self.tally.received_line())
    }

    fn show_progress(&self) {
        let mut terminal = std::io::stderr();
        if terminal.is_terminal() {
            let _ = write!(terminal, "\r{} ", self.progress());
        }
    }

    /// Ends the file, whatever ended the recording, and names it when nothing is missing.
    ///
    /// # Errors
    /// What ended it, or that it could not be ended.
    pub fn end(self, hello: &DeviceHello, result: Result<(), Failure>) -> Result<(), Failure> {
        let Recording {
            file,
            partial,
            sink,
            begun,
            tally,
            ..
        } = self;
        let is_clean = is_clean(&result);
        if let Err(failure) = &result
            && failure.kind == Kind::Input
        {
            // The disk is full, or gone: nothing more can be written. What was flushed can be read.
            drop(sink);
            note(tally.summary_of_recorded().trim_end());
            return result;
        }
        let ended = result
            .as_ref()
            .err()
            .map_or("as asked".to_owned(), ToString::to_string);
        let counts = tally.counts().into_iter();
        let texts = counts.map(|(name, count)| (name.to_owned(), count.to_string()));
        let mut summary: BTreeMap<String, String> = texts.collect();
        summary.insert("ended".to_owned(), ended);
        summary.insert(
            "seconds".to_owned(),
            format!("{:.3}", begun.elapsed().as_secs_f64()),
        );
        summary.insert("board".to_owned(), hello.board.to_string());
        summary.insert("firmware".to_owned(), hello.firmware.to_string());
        let model = hello.model.as_ref().map_or("none", |model| &model.name);
        summary.insert("model".to_owned(), model.to_owned());
        finish(sink, summary).map_err(|error| input(&partial, error))?;
        note(tally.summary_of_recorded().trim_end());
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
fn finish(sink: Sink, summary: BTreeMap<String, String>) -> Result<(), mcap::McapError> {
    let file: File = match sink {
        Sink::Bag(bag) => bag.finish(summary)?,
        Sink::Table(table) => table.finish()?,
    };
    Ok(file.sync_all()?)
}

fn input(file: &Path, what: impl Display) -> Failure {
    Failure::input(format!("cannot record into {}: {what}", file.display()))
}
