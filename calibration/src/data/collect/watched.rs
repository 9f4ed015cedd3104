//! Shows a recording on a live page: the sensor's samples, the state of the recording, and its
//! coverage.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;
use hivtac_host::link::Link;
use hivtac_host::page::{Coverage, Feed, Recording, Sensor, SensorState, Server};
use hivtac_wire::message::{DeviceHello, Sample};

use super::take::Take;

/// Time between two updates of the coverage.
const TELL_EVERY: Duration = Duration::from_millis(200);

/// The state that the page shows.
pub(super) struct Watched {
    feed: Arc<Feed>,
    state: SensorState,
    at: Instant,
}

impl Watched {
    /// Serves the page as long as the program runs, and prints its address.
    ///
    /// # Errors
    /// When this computer has no free port.
    pub fn serve(link: &Link, hello: &DeviceHello, patience: Duration) -> Result<Self> {
        let feed = Arc::new(Feed::default());
        let sensor = Sensor {
            feed: feed.clone(),
            orders: None,
            hand: None,
        };
        let server = Arc::new(Server::new(0, vec![sensor], patience)?);
        eprintln!("Watch it in a browser: {}", server.address());
        thread::spawn(move || server.run());
        let mut watched = Self {
            feed,
            state: SensorState::of(&link.name, hello),
            at: Instant::now(),
        };
        watched.recording(
            false,
            "not recording yet: the terminal says what to do".to_owned(),
        );
        Ok(watched)
    }

    /// Updates the state of the recording.
    pub fn recording(&mut self, on: bool, text: String) {
        self.state.recording = Recording { on, text };
        self.tell();
    }

    /// Adds a sample of a take with this content; `coverage` computes its coverage.
    pub fn sample(
        &mut self,
        sample: &Sample,
        take: &Take,
        coverage: impl Fn() -> Option<Coverage>,
    ) {
        self.feed.sample(sample.clone());
        if self.at.elapsed() < TELL_EVERY {
            return;
        }
        let lasted_us = take
            .last_us
            .saturating_sub(take.first_us.unwrap_or(take.last_us));
        let steps = take.samples.saturating_sub(1) as f64;
        self.state.rate_hz = (lasted_us > 0).then(|| 1e6 * steps / lasted_us as f64);
        self.state.lost = take.lost.into();
        self.state.coverage = coverage().or(self.state.coverage.take());
        self.tell();
    }

    /// Ends a take of presses anywhere, with its final coverage.
    pub fn ended(&mut self, coverage: Coverage) {
        self.state.coverage = Some(coverage);
        self.recording(
            false,
            "recorded: the terminal says what comes next".to_owned(),
        );
    }

    fn tell(&mut self) {
        self.at = Instant::now();
        self.feed.state(self.state.json());
    }
}
