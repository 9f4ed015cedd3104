//! Reads a gauge at a serial port: its lines, with the computer's time.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use super::folder::keep_gauge_line;
use super::gauge::{Bad, Unit, reading};

/// Where a gauge is and how it is made to talk.
#[derive(Clone, Debug, clap::Args)]
pub struct GaugeArgs {
    /// Serial port of the force gauge. Without one, the gauge records by itself (`align --gauge`).
    #[arg(long, value_name = "PORT")]
    pub gauge_port: Option<String>,
    /// Its baud rate.
    #[arg(long, default_value_t = 19_200, requires = "gauge_port")]
    pub gauge_baud: u32,
    /// For a gauge that only answers: the request to repeat (`\r` and `\n` as in C).
    #[arg(long, value_name = "TEXT", requires = "gauge_port")]
    pub gauge_ask: Option<String>,
    /// The unit of readings that name none: N when it is not said.
    #[arg(long, value_name = "UNIT")]
    pub gauge_unit: Option<Unit>,
}

/// Interval at which a gauge that only answers is asked.
const ASK_EVERY: Duration = Duration::from_millis(20);
/// The longest wait of one read.
const PATIENCE: Duration = Duration::from_millis(5);
/// The longest line; a longer one is noise.
const LONGEST_LINE: usize = 256;

/// A gauge and the thread that listens to it.
#[derive(Debug)]
pub struct GaugePort {
    thread: Option<JoinHandle<Result<()>>>,
    end: Arc<AtomicBool>,
    readings: Arc<AtomicUsize>,
    /// The newest reading, bits of an `f64` in N.
    newest: Arc<AtomicU64>,
    unread: Arc<Mutex<Option<(String, Bad)>>>,
    name: String,
}

impl GaugePort {
    /// Opens the port and stores every line in `file`, with the time since `begun`.
    ///
    /// # Errors
    /// When the port cannot be opened.
    pub fn listen(
        args: &GaugeArgs,
        file: File,
        run: usize,
        begun: Instant,
    ) -> Result<Option<Self>> {
        let Some(name) = &args.gauge_port else {
            return Ok(None);
        };
        let port = serialport::new(name, args.gauge_baud)
            .timeout(PATIENCE)
            .open()
            .with_context(|| {
                format!(
                    "cannot open the gauge at {name}: is it plugged in, and used \
                                      by no other program?"
                )
            })?;
        let (end, readings) = (Arc::<AtomicBool>::default(), Arc::<AtomicUsize>::default());
        let newest = Arc::new(AtomicU64::new(f64::NAN.to_bits()));
        let unread = Arc::<Mutex<_>>::default();
        let listener = Listener {
            port,
            name: name.clone(),
            ask: args.gauge_ask.as_deref().map(unescaped),
            file,
            run,
            begun,
            end: end.clone(),
            readings: readings.clone(),
            newest: newest.clone(),
            unread: unread.clone(),
            unit: args.gauge_unit.unwrap_or(Unit::NEWTON),
        };
        let thread = std::thread::spawn(move || listener.run());
        Ok(Some(Self {
            thread: Some(thread),
            end,
            readings,
            newest,
            unread,
            name: name.clone(),
        }))
    }

    /// Number of readings until now.
    ///
    /// # Errors
    /// When the gauge was lost; says why.
    pub fn readings(&mut self) -> Result<usize> {
        if self.thread.as_ref().is_some_and(JoinHandle::is_finished) {
            self.finish()?;
        }
        Ok(self.readings.load(Ordering::Relaxed))
    }

    /// The first line that was not a reading, and the reason.
    fn unread(&self) -> Option<(String, Bad)> {
        let unread = self.unread.lock();
        unread.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Why there are no readings: the invalid lines that it sends, or that it sends nothing.
    pub fn silence(&self) -> String {
        let name = &self.name;
        match self.unread() {
            Some((line, why)) => format!(
                "the gauge at {name} sends nothing that can be read: the first such line is \
                 `{line}` ({}); set it to send a number with its unit, or none and --gauge-unit, \
                 and look at --gauge-baud",
                why.words()
            ),
            None => format!(
                "the gauge at {name} sends nothing: is it switched on and set to send, does it \
                 only answer (--gauge-ask), and is --gauge-baud right?"
            ),
        }
    }

    /// Whether it sent lines, but not a single valid reading.
    pub fn is_unreadable(&self) -> bool {
        self.readings.load(Ordering::Relaxed) == 0 && self.unread().is_some()
    }

    /// Its newest reading, N; `None` before the first.
    pub fn newest_n(&self) -> Option<f64> {
        let newest = f64::from_bits(self.newest.load(Ordering::Relaxed));
        (!newest.is_nan()).then_some(newest)
    }

    /// Stops listening.
    ///
    /// # Errors
    /// When the gauge was lost, or its lines could not be stored.
    pub fn finish(&mut self) -> Result<()> {
        self.end.store(true, Ordering::Relaxed);
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            Some(Err(_)) => bail!("listening to the gauge failed"),
            None => Ok(()),
        }
    }
}

struct Listener {
    port: Box<dyn serialport::SerialPort>,
    name: String,
    ask: Option<Vec<u8>>,
    file: File,
    run: usize,
    begun: Instant,
    end: Arc<AtomicBool>,
    readings: Arc<AtomicUsize>,
    newest: Arc<AtomicU64>,
    unread: Arc<Mutex<Option<(String, Bad)>>>,
    unit: Unit,
}

impl Listener {
    fn run(mut self) -> Result<()> {
        let mut line = Vec::new();
        let mut buffer = [0; 256];
        let mut ask_at = Instant::now();
        while !self.end.load(Ordering::Relaxed) {
            if let Some(ask) = self.ask.as_ref().filter(|_| Instant::now() >= ask_at) {
                ask_at = Instant::now() + ASK_EVERY;
                self.port.write_all(ask).with_context(|| self.lost())?;
            }
            match self.port.read(&mut buffer) {
                Ok(0) => bail!("{}", self.lost()),
                Ok(count) => {
                    let host_s = self.begun.elapsed().as_secs_f64();
                    for &byte in &buffer[..count] {
                        self.take(byte, &mut line, host_s)?;
                    }
                }
                Err(error)
                    if matches!(
                        error.kind(),
                        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                    ) => {}
                Err(error) => return Err(error).with_context(|| self.lost()),
            }
        }
        Ok(())
    }

    fn lost(&self) -> String {
        format!("the gauge at {} is lost: cable pulled?", self.name)
    }

    /// Lines end with CR, LF or both.
    fn take(&mut self, byte: u8, line: &mut Vec<u8>, host_s: f64) -> Result<()> {
        if !matches!(byte, b'\r' | b'\n') && line.len() < LONGEST_LINE {
            line.push(byte);
            return Ok(());
        }
        if !line.is_empty() {
            let text = String::from_utf8_lossy(line).into_owned();
            line.clear();
            keep_gauge_line(&mut self.file, self.run, host_s, &text)?;
            match reading(&text, self.unit) {
                Ok(force_n) => {
                    self.readings.fetch_add(1, Ordering::Relaxed);
                    self.newest.store(force_n.to_bits(), Ordering::Relaxed);
                }
                Err(why) => {
                    let unread = self.unread.lock();
                    let mut unread = unread.unwrap_or_else(PoisonError::into_inner);
                    unread.get_or_insert((text, why));
                }
            }
        }
        Ok(())
    }
}

fn unescaped(text: &str) -> Vec<u8> {
    text.replace("\\r", "\r").replace("\\n", "\n").into_bytes()
}
