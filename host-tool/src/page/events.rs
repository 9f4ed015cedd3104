//! Sends samples and states as Server-Sent Events for as long as the browser reads.

use super::feed::{Cursor, Feed};
use super::response::{EVENTS, begin};
use super::rows::{self, Event};
use crate::stop;
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
    let mut text = text_of(&[rows::hello(feeds.len(), obeys, presses)]);
    let mut said = Instant::now();
    while !stop::requested() {
        let mut all_read = true;
        for (sensor, (feed, cursor)) in readers.iter_mut().enumerate() {
            let news = feed.news(cursor);
            all_read &= news.samples.is_empty();
            text += &text_of(&rows::events(sensor, &news));
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

/// Events in the stream's format; JSON has no line ends.
fn text_of(events: &[Event]) -> String {
    let events = events.iter();
    events
        .map(|(name, data)| format!("event: {name}\ndata: {data}\n\n"))
        .collect()
}
