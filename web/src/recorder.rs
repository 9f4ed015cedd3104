//! A recording in memory, as `hivtac record` writes it into a file.

use hivtac_host::bag::{Bag, summary_of};
use hivtac_host::page;
use hivtac_host::shown::unit_number;
use hivtac_host::tally::Tally;
use hivtac_wire::message::{DeviceHello, DeviceMessage};
use std::io::Cursor;
use std::time::Duration;

/// Most samples of a recording, half an hour at 156 a second: all are in memory until its end.
const MOST_SAMPLES: u64 = 280_000;

/// A whole recording: its name and its bytes.
pub type Recorded = (String, Vec<u8>);

/// The recordings of one sensor.
#[derive(Default)]
pub struct Recorder {
    under_way: Option<UnderWay>,
    /// Number of recordings so far.
    count: u32,
    /// The result of the last one.
    last: String,
}

struct UnderWay {
    bag: Bag<Cursor<Vec<u8>>>,
    hello: DeviceHello,
    tally: Tally,
    samples: u64,
    name: String,
    begun_us: u64,
    now_us: u64,
}

impl Recorder {
    /// Begins a recording, unless one is under way; returns its state in words. `now_us` is the
    /// page's time, `unix_ns` the same in ns since 1970.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn begin(
        &mut self,
        hello: &DeviceHello,
        now_us: u64,
        unix_ns: u64,
    ) -> Result<String, String> {
        if self.under_way.is_none() {
            let bag = Bag::create(Cursor::default(), std::slice::from_ref(hello), unix_ns);
            self.count += 1;
            let name = format!(
                "hivtac-{}-{}.mcap",
                unit_number(&hello.device_id),
                self.count
            );
            self.under_way = Some(UnderWay {
                bag: bag.map_err(|error| error.to_string())?,
                hello: hello.clone(),
                tally: Tally::default(),
                samples: 0,
                name,
                begun_us: now_us,
                now_us,
            });
        }
        Ok(self.state().text)
    }

    /// Keeps a message. Returns the recording when it is full.
    pub fn message(
        &mut self,
        message: &DeviceMessage,
        now_us: u64,
        unix_ns: u64,
    ) -> Option<Recorded> {
        let under_way = self.under_way.as_mut()?;
        match message {
            DeviceMessage::Sample(sample) => {
                under_way.tally.sample(sample);
                under_way.samples += 1;
            }
            DeviceMessage::Stats(stats) => under_way.tally.stats(stats),
            DeviceMessage::Log(_) => {}
            // A reply to this page is not a measurement.
            _ => return None,
        }
        under_way.now_us = now_us;
        match under_way.bag.message(0, message, unix_ns) {
            Ok(()) if under_way.samples >= MOST_SAMPLES => {
                self.end("it is as long as this page keeps in memory")
            }
            Ok(()) => None,
            Err(error) => self.end(&error.to_string()),
        }
    }

    /// Ends the recording and returns it; `why` is the reason.
    pub fn end(&mut self, why: &str) -> Option<Recorded> {
        let UnderWay {
            bag,
            hello,
            tally,
            name,
            begun_us,
            now_us,
            ..
        } = self.under_way.take()?;
        let lasted = Duration::from_micros(now_us - begun_us);
        let summary = summary_of(&hello, &tally, why, lasted);
        let (seconds, line) = (lasted.as_secs(), tally.received_line());
        match bag.finish(vec![summary]) {
            Ok(memory) => {
                self.last = format!("recorded {name}: {seconds} s, {line}; it ended: {why}");
                Some((name, memory.into_inner()))
            }
            Err(error) => {
                self.last = format!("{name} could not be ended: {error}");
                None
            }
        }
    }

    /// The recording's state, for the page.
    pub fn state(&self) -> page::Recording {
        match &self.under_way {
            Some(UnderWay {
                name,
                tally,
                begun_us,
                now_us,
                ..
            }) => page::Recording {
                on: true,
                text: format!(
                    "recording {name}: {} s, {}",
                    (now_us - begun_us) / 1_000_000,
                    tally.received_line()
                ),
            },
            None => page::Recording {
                on: false,
                text: self.last.clone(),
            },
        }
    }
}
