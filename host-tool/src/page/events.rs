//! Sends samples and states as Server-Sent Events for as long as the browser reads.

use super::feed::{Cursor, Feed, News};
use super::lights;
use super::response::{EVENTS, begin};
use crate::force_fields::{FORCE, PLACE};
use crate::shown::to_json;
use crate::stop;
use hivtac_terms::force::Force;
use hivtac_wire::message::Sample;
use serde::Serialize;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two checks for news: thirty a second look like motion on a screen.
const LOOK_EVERY: Duration = Duration::from_millis(33);
/// Silence after which a comment is sent, which shows whether the reader is still there.
const SAY_SOMETHING_EVERY: Duration = Duration::from_secs(5);

/// Sends events until the reader is gone or too slow, or the program must end. `obeys` says whether
/// the sensors take orders from the page, `presses` whether it can press their films.
pub fn stream(
    out: &mut impl Write,
    feeds: &[Arc<Feed>],
    obeys: bool,
    presses: bool,
) -> io::Result<()> {
    begin(out, EVENTS)?;
    let mut readers: Vec<(&Feed, Cursor)> =
        feeds.iter().map(|feed| (&**feed, feed.begin())).collect();
    let mut text = event(
        "hello",
        &Hello {
            sensors: feeds.len(),
            obeys,
            presses,
            lights: lights::all(),
        },
    );
    let mut said = Instant::now();
    while !stop::requested() {
        let mut all_read = true;
        for (sensor, (feed, cursor)) in readers.iter_mut().enumerate() {
            let news = feed.news(cursor);
            all_read &= news.samples.is_empty();
            text += &told(sensor, &news);
        }
        if text.is_empty() && said.elapsed() >= SAY_SOMETHING_EVERY {
            text += ":\n\n";
        }
        if !text.is_empty() {
            out.write_all(text.as_bytes())?;
            out.flush()?;
            said = Instant::now();
            text.clear();
        }
        // Faster while samples wait, until a reader of the past has come to the present.
        if all_read {
            std::thread::sleep(LOOK_EVERY);
        } else {
            std::thread::sleep(LOOK_EVERY / 4);
        }
    }
    Ok(())
}

/// An event in the stream's format; JSON has no line ends.
fn event(name: &str, data: &impl Serialize) -> String {
    format!("event: {name}\ndata: {}\n\n", to_json(data))
}

fn told(sensor: usize, news: &News) -> String {
    let mut text = String::new();
    if let Some(state) = &news.state {
        text += &format!("event: state\ndata: {{\"sensor\":{sensor},\"state\":{state}}}\n\n");
    }
    if !news.truths.is_empty() {
        let truths = &news.truths;
        text += &event("truths", &json!({ "sensor": sensor, "truths": truths }));
    }
    if !news.samples.is_empty() {
        let samples = news.samples.iter().map(Row::from).collect();
        let skipped = news.skipped;
        text += &event(
            "samples",
            &Samples {
                sensor,
                skipped,
                samples,
            },
        );
    }
    text
}

/// The stream's first event.
#[derive(Serialize)]
struct Hello {
    sensors: usize,
    obeys: bool,
    presses: bool,
    lights: Vec<lights::Light>,
}

#[derive(Serialize)]
struct Samples {
    sensor: usize,
    skipped: u64,
    samples: Vec<Row>,
}

/// A sample: sequence number, frame, device time (µs), status; then its force or `null`.
#[derive(Serialize)]
struct Row(u32, u32, u64, u32, Option<Value>);

impl From<&Sample> for Row {
    fn from(sample: &Sample) -> Row {
        Row(
            sample.sequence,
            sample.frame,
            sample.time_us,
            sample.status.0,
            sample.force.as_ref().map(force_row),
        )
    }
}

/// Fx, Fy, Fz, |F| and its standard uncertainty; α, β and the direction's standard uncertainty;
/// then the place or `null`. Integers as in the wire format.
fn force_row(force: &Force) -> Value {
    let [alpha, beta, size, x, y, z, angle_sigma, size_sigma] = FORCE.map(|it| it.integer(force));
    let place = force.place.as_ref();
    let place = place.map(|place| PLACE.map(|it| it.integer(place)));
    json!([x, y, z, size, size_sigma, alpha, beta, angle_sigma, place])
}
