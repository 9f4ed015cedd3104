//! Counts contacts and slips of a course that are missed or invented, and measures their delays.

use std::ops::RangeInclusive;

use serde::Serialize;

/// Longest gap within a contact or a slip, in frames.
const GAP: usize = 2;
/// Longest delay of a report that belongs to an event, s: the time of the limits.
const LATE_S: f64 = 0.05;
/// Least length of a slip, mm; a shorter one counts neither as missed nor as invented.
const LEAST_SLIP_MM: f64 = 0.1;
/// A slip that begins at most this long before its contact ends is the grip's opening: it counts
/// neither as missed nor as invented, s.
const OPENS_S: f64 = 0.025;

/// A frame: the true state in the middle of its exposure, and the reported one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame {
    /// Time, s.
    pub time_s: f64,
    /// True contact, and true slip.
    pub touches: bool,
    pub slips: bool,
    /// Distance that the contact has slipped, mm.
    pub slipped_mm: f64,
    /// Whether the sensor had a force.
    pub has_force: bool,
    /// The reported contact and slip.
    pub told_touch: bool,
    pub told_slip: bool,
}

/// Counts of events, and their delays.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Score {
    /// True events, and those of them that were reported.
    pub true_events: u32,
    pub found: u32,
    /// Reported events, and those of them that are not true.
    pub told: u32,
    pub invented: u32,
    /// Unreported events with frames that had no force.
    pub missed_without_force: u32,
    /// Time from the first true frame of each reported event to its report, s.
    pub delays_s: Vec<f64>,
}

impl Score {
    /// Adds the events of another score.
    pub fn merge(&mut self, other: &Score) {
        self.true_events += other.true_events;
        self.found += other.found;
        self.told += other.told;
        self.invented += other.invented;
        self.missed_without_force += other.missed_without_force;
        self.delays_s.extend(&other.delays_s);
    }

    /// The score of a course's contacts.
    pub fn of_contacts(frames: &[Frame]) -> Score {
        let truth = events(frames, |frame| frame.touches);
        Score::of(frames, &truth, &truth, |frame| frame.told_touch)
    }

    /// The score of its slips.
    pub fn of_slips(frames: &[Frame]) -> Score {
        let all = events(frames, |frame| frame.slips);
        let far = |event: &&Event| {
            let [before, after] = [event.start().saturating_sub(1), event.end() + 1];
            let after = after.min(frames.len() - 1);
            (frames[after].slipped_mm - frames[before].slipped_mm).abs() >= LEAST_SLIP_MM
        };
        let opens = |event: &&Event| {
            let first = &frames[*event.start()..];
            let ends = first.iter().find(|frame| !frame.touches);
            ends.is_some_and(|end| end.time_s - first[0].time_s <= OPENS_S)
        };
        let counts = |event: &&Event| far(event) && !opens(event);
        let wanted: Vec<Event> = all.iter().filter(counts).cloned().collect();
        Score::of(frames, &wanted, &all, |frame| frame.told_slip)
    }

    /// The score for the events `wanted`; a report of an event in `others` does not count as
    /// invented.
    fn of(
        frames: &[Frame],
        wanted: &[Event],
        others: &[Event],
        is_told: impl Fn(&Frame) -> bool,
    ) -> Score {
        let mut score = Score::default();
        for event in wanted {
            score.true_events += 1;
            let first_s = frames[*event.start()].time_s;
            let first_told = belonging(frames, event).find(|frame| is_told(frame));
            match first_told {
                Some(frame) => {
                    score.found += 1;
                    score.delays_s.push(frame.time_s - first_s);
                }
                None => {
                    let blind = frames[event.clone()].iter().any(|frame| !frame.has_force);
                    score.missed_without_force += u32::from(blind);
                }
            }
        }
        for told in events(frames, &is_told) {
            score.told += 1;
            let first_s = frames[*told.start()].time_s;
            let is_of = |event: &Event| {
                let last_s = frames[*event.end()].time_s + LATE_S;
                event.start() <= told.end() && first_s <= last_s
            };
            score.invented += u32::from(!others.iter().any(is_of));
        }
        score
    }

    /// The delay that `percent` of the reported events do not exceed, ms; `None` without such
    /// events.
    pub fn delay_ms(&self, percent: usize) -> Option<f64> {
        let mut sorted = self.delays_s.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        Some(1e3 * sorted[(sorted.len() * percent / 100).min(last)])
    }
}

/// First to last frame of an event.
type Event = RangeInclusive<usize>;

fn events(frames: &[Frame], is: impl Fn(&Frame) -> bool) -> Vec<Event> {
    let mut events: Vec<Event> = Vec::new();
    for (at, _) in frames.iter().enumerate().filter(|(_, frame)| is(frame)) {
        match events.last_mut() {
            Some(event) if at - event.end() <= GAP + 1 => *event = *event.start()..=at,
            _ => events.push(at..=at),
        }
    }
    events
}

/// The frames of an event, and those after it whose reports still belong to it.
fn belonging<'f>(frames: &'f [Frame], event: &Event) -> impl Iterator<Item = &'f Frame> {
    let last_s = frames[*event.end()].time_s + LATE_S;
    let after = frames[*event.start()..].iter();
    after.take_while(move |frame| frame.time_s <= last_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of 10 ms: `t` true, `x` reported, `b` both, `n` true without a force, `_` without a
    /// contact.
    fn score(text: &str) -> Score {
        let mut slipped_mm = 0.0;
        let frames = text.chars().enumerate().map(|(at, what)| {
            slipped_mm += if "tbn".contains(what) { 0.06 } else { 0.0 };
            Frame {
                time_s: at as f64 * 0.01,
                slips: "tbn".contains(what),
                told_slip: "xb".contains(what),
                has_force: what != 'n',
                touches: what != '_',
                slipped_mm,
                ..Frame::default()
            }
        });
        Score::of_slips(&frames.collect::<Vec<_>>())
    }

    #[test]
    fn events_are_found_missed_and_invented() {
        for (text, expected) in [
            ("...tttbbb.....", [1, 1, 1, 0, 0]),
            ("...tttnnn.....", [1, 0, 0, 0, 1]),
            ("......xx......", [0, 0, 1, 1, 0]),
            // A late report with one of its own; a report too late; a short gap; a slip too short
            // to count.
            ("...tttttt...xx", [1, 1, 1, 0, 0]),
            ("ttt........xxx", [1, 0, 1, 1, 0]),
            ("..bb.bb...bb..", [2, 2, 2, 0, 0]),
            ("......b.......", [0, 0, 1, 0, 0]),
            // A grip that opens, and a slip that ends with its contact.
            ("....tt____....", [0, 0, 0, 0, 0]),
            ("...ttt____....", [1, 0, 0, 0, 0]),
        ] {
            let score = score(text);
            let found = [
                score.true_events,
                score.found,
                score.told,
                score.invented,
                score.missed_without_force,
            ];
            assert_eq!(found, expected, "{text}");
        }
        let mut both = score("...tttbbb......");
        both.merge(&score("...bbbbb......."));
        assert!((both.delay_ms(95).unwrap() - 30.0).abs() < 1e-9);
        assert_eq!(both.delay_ms(0), Some(0.0));
    }
}
