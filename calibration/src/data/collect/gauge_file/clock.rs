//! Reads the times of a gauge's file, and finds where its clock starts again.

use crate::data::collect::gauge::{number, signed};

/// After a step back, this many rising times mean a clock that started again; a single one is
/// wrong.
const GOES_ON: usize = 4;

/// The seconds of a text: a number, or hours, minutes and seconds with colons. `None` for other
/// texts.
pub(super) fn seconds(text: &str) -> Option<f64> {
    let parts: Vec<&str> = text.trim().split(':').collect();
    match parts.as_slice() {
        [seconds] => {
            let (sign, digits) = signed(seconds);
            Some(sign * number(digits)?)
        }
        [hours, minutes, seconds] => {
            let (hours, minutes): (u32, u32) = (hours.parse().ok()?, minutes.parse().ok()?);
            let seconds = number(seconds).filter(|seconds| *seconds < 60.0)?;
            let is_clock = hours < 24 && minutes < 60;
            is_clock.then(|| f64::from(3600 * hours + 60 * minutes) + seconds)
        }
        _ => None,
    }
}

/// Where a clock starts again.
#[derive(Debug)]
pub(super) struct Clock {
    /// Numbers of the rows at which it starts again.
    begins: Vec<usize>,
}

impl Clock {
    /// From the times of a file's rows.
    pub fn of(times: &[Option<f64>]) -> Self {
        let mut begins = Vec::new();
        let mut last = f64::NEG_INFINITY;
        for (row, time) in times.iter().enumerate() {
            let Some(time) = *time else { continue };
            if time < last && goes_on(&times[row..], last) {
                begins.push(row);
                last = time;
            }
            last = last.max(time);
        }
        Self { begins }
    }

    pub fn begins_at(&self, row: usize) -> bool {
        self.begins.contains(&row)
    }
}

/// Whether the next times rise steadily from here, all below `before`.
fn goes_on(times: &[Option<f64>], before: f64) -> bool {
    let next: Vec<f64> = times.iter().flatten().take(GOES_ON).copied().collect();
    let rises = next.windows(2).all(|pair| pair[0] < pair[1]);
    next.len() == GOES_ON && rises && next[GOES_ON - 1] < before
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_numbers_or_clocks() {
        for (text, time_s) in [
            ("12.5", Some(12.5)),
            (" 12,5", Some(12.5)),
            ("-1", Some(-1.0)),
            ("00:01:02.5", Some(62.5)),
            ("13:00:00", Some(46_800.0)),
            ("13:00", None),
            ("25:00:00", None),
            ("00:00:61", None),
            ("1.234,5", None),
            ("", None),
            ("x", None),
            ("1e400", None),
        ] {
            assert_eq!(seconds(text), time_s, "{text}");
        }
    }

    #[test]
    fn a_clock_starts_again_and_a_wrong_time_does_not() {
        let begins = |times: &[f64]| {
            let times: Vec<_> = times.iter().map(|time| Some(*time)).collect();
            Clock::of(&times).begins
        };
        let rising = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        assert!(begins(&rising).is_empty());
        assert_eq!(begins(&[&rising[..], &rising].concat()), [6]);
        assert_eq!(begins(&[&rising[..], &rising, &rising].concat()), [6, 12]);
        let wrong = [&rising[..], &[2.5], &[6.0, 7.0, 8.0, 9.0]].concat();
        assert!(begins(&wrong).is_empty());
        assert!(begins(&[&rising[..], &[0.0, 1.0]].concat()).is_empty());
        assert!(Clock::of(&[None, None]).begins.is_empty());
    }
}
