//! Passes the last half minute of samples and the state of a device to the threads that show it.
//!
//! The device's thread never waits for a reader. A reader that is too slow misses samples, and gets
//! their number.

use super::press::Truth;
use hivtac_wire::message::Sample;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Most samples that are kept: half a minute at 270 a second.
const KEPT: usize = 8192;
/// Length of the past that a new reader gets, µs of the device's clock.
const PAST_US: u64 = 30_000_000;
/// Most samples of one [`News`], which limits the time for which the lock is held.
const AT_ONCE: usize = 512;

/// Samples and state of a device, written by one thread, read by many.
#[derive(Default)]
pub struct Feed(Mutex<Contents>);

#[derive(Default)]
struct Contents {
    samples: VecDeque<Sample>,
    /// Number of samples before the first one that is kept.
    before: u64,
    /// The true presses of a simulated sensor's newest frames.
    truths: VecDeque<Truth>,
    /// Number of true presses before the first one that is kept.
    truths_before: u64,
    state: Arc<str>,
    /// Number of states that were set.
    states: u64,
}

/// How far a reader has read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cursor {
    sample: u64,
    truth: u64,
    state: u64,
}

/// The samples and the state that a reader has not read yet.
#[derive(Debug, Default)]
pub struct News {
    /// Samples, the oldest first.
    pub samples: Vec<Sample>,
    /// Number of samples before them that this reader missed.
    pub skipped: u64,
    /// True presses of a simulated sensor, the oldest first.
    pub truths: Vec<Truth>,
    /// The newest state, as JSON; `None` if it has not changed.
    pub state: Option<Arc<str>>,
}

impl Feed {
    fn contents(&self) -> MutexGuard<'_, Contents> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a sample.
    pub fn sample(&self, sample: Sample) {
        let mut contents = self.contents();
        if contents.samples.len() == KEPT {
            contents.samples.pop_front();
            contents.before += 1;
        }
        contents.samples.push_back(sample);
    }

    /// Adds the true press in a frame of a simulated sensor, before the frame's sample.
    pub fn truth(&self, truth: Truth) {
        let mut contents = self.contents();
        if contents.truths.len() == AT_ONCE {
            contents.truths.pop_front();
            contents.truths_before += 1;
        }
        contents.truths.push_back(truth);
    }

    /// Sets the device's state, as JSON.
    pub fn state(&self, state: String) {
        let mut contents = self.contents();
        contents.state = state.into();
        contents.states += 1;
    }

    /// The cursor of a new reader: half a minute ago, with the newest state unread.
    pub fn begin(&self) -> Cursor {
        let contents = self.contents();
        let newest = contents.samples.back().map_or(0, |sample| sample.time_us);
        let is_new = |sample: &&Sample| {
            newest
                .checked_sub(sample.time_us)
                .is_some_and(|age_us| age_us <= PAST_US)
        };
        // Backwards, to where a restarted device had other times.
        let past = contents.samples.iter().rev().take_while(is_new).count();
        let end = contents.before + contents.samples.len() as u64;
        Cursor {
            sample: end - past as u64,
            truth: contents.truths_before,
            state: 0,
        }
    }

    /// The news since the cursor, at most `AT_ONCE` samples; moves the cursor.
    pub fn news(&self, cursor: &mut Cursor) -> News {
        let contents = self.contents();
        let skipped = contents.before.saturating_sub(cursor.sample);
        cursor.sample += skipped;
        let read = (cursor.sample - contents.before) as usize;
        let samples: Vec<Sample> = contents
            .samples
            .iter()
            .skip(read)
            .take(AT_ONCE)
            .cloned()
            .collect();
        cursor.sample += samples.len() as u64;
        let read = cursor.truth.saturating_sub(contents.truths_before) as usize;
        let truths: Vec<Truth> = contents.truths.iter().skip(read).copied().collect();
        cursor.truth = contents.truths_before + contents.truths.len() as u64;
        let is_new = contents.states != cursor.state;
        cursor.state = contents.states;
        News {
            samples,
            skipped,
            truths,
            state: is_new.then(|| contents.state.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::force::ContactList;
    use hivtac_terms::marker::MarkerList;
    use hivtac_terms::status::Status;

    fn sample(number: u32, time_us: u64) -> Sample {
        Sample {
            sequence: number,
            frame: number,
            time_us,
            status: Status::OK,
            force: None,
            contacts: ContactList::default(),
            markers: MarkerList::default(),
        }
    }

    fn numbers(news: &News) -> Vec<u32> {
        news.samples.iter().map(|sample| sample.sequence).collect()
    }

    #[test]
    fn readers_get_each_sample_once_and_the_newest_state() {
        let feed = Feed::default();
        let mut cursor = feed.begin();
        assert!(feed.news(&mut cursor).state.is_none());
        feed.state("1".to_owned());
        feed.state("2".to_owned());
        (0..3).for_each(|number| feed.sample(sample(number, 0)));
        let news = feed.news(&mut cursor);
        assert_eq!((numbers(&news), news.skipped), (vec![0, 1, 2], 0));
        assert_eq!(news.state.as_deref(), Some("2"));
        let news = feed.news(&mut cursor);
        assert_eq!((news.samples.len(), news.state), (0, None));
        feed.sample(sample(3, 0));
        assert_eq!(numbers(&feed.news(&mut cursor)), [3]);
    }

    #[test]
    fn a_reader_that_was_too_slow_learns_how_many_it_missed() {
        let feed = Feed::default();
        let mut slow = feed.begin();
        let all = KEPT as u32 + 100;
        (0..all).for_each(|number| feed.sample(sample(number, 0)));
        let news = feed.news(&mut slow);
        assert_eq!((news.skipped, news.samples.len()), (100, AT_ONCE));
        assert_eq!(news.samples[0].sequence, 100);
        let rest: usize = std::iter::from_fn(|| {
            let count = feed.news(&mut slow).samples.len();
            (count > 0).then_some(count)
        })
        .sum();
        assert_eq!(rest, KEPT - AT_ONCE);
    }

    #[test]
    fn a_new_reader_is_given_half_a_minute() {
        let feed = Feed::default();
        (0..100).for_each(|second| feed.sample(sample(second, u64::from(second) * 1_000_000)));
        assert_eq!(numbers(&feed.news(&mut feed.begin()))[0], 69);
        // The device restarts: earlier samples have another clock.
        feed.sample(sample(100, 5));
        assert_eq!(numbers(&feed.news(&mut feed.begin())), [100]);
    }
}
