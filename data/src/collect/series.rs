//! A gauge's readings in time, and what it said between them.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::gauge::{Bad, Unit, reading};

/// Readings of a gauge on its own clock. Where a line was bad, the readings around it are not
/// joined.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// (time in s, force in N); `None` for a bad line. Times rise.
    points: Vec<(f64, Option<f64>)>,
    /// How many lines were not used, by cause.
    pub bad: BTreeMap<Bad, usize>,
    /// The first of them: line number and text.
    pub first_bad: Option<(usize, String)>,
}

/// No clock counts farther, ± s: three centuries, beyond the seconds since 1970 and what a sensor's
/// counter holds. Sums and differences of such stay exact to microseconds.
pub const LARGEST_S: f64 = 1e10;
/// Readings farther apart than this many usual distances are not joined.
const GAP: f64 = 5.0;

impl Series {
    /// Takes a line that came at `time_s`.
    pub fn push(&mut self, number: usize, time_s: Option<f64>, text: &str, unit: Unit) {
        let last = self.points.last().map_or(f64::NEG_INFINITY, |p| p.0);
        let time = time_s.filter(|t| t.abs() <= LARGEST_S && *t > last);
        let found = match time {
            Some(_) => reading(text, unit),
            None => Err(Bad::Time),
        };
        if let Err(why) = found {
            *self.bad.entry(why).or_default() += 1;
            self.first_bad
                .get_or_insert_with(|| (number, text.trim().to_owned()));
        }
        if let Some(time) = time {
            self.points.push((time, found.ok()));
        }
    }

    /// Reads a gauge's file: one line a reading, time in s and reading, separated by comma,
    /// semicolon or tab. Empty lines, lines that begin with `#`, and one line of column names at
    /// the top are passed over.
    ///
    /// # Errors
    /// When it cannot be read, or has no readings.
    pub fn load(path: &Path, unit: Unit) -> Result<Self> {
        let text =
            std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let series = Self::parse(&String::from_utf8_lossy(&text), unit);
        let (readings, bad) = (series.readings(), series.bad.values().sum::<usize>());
        ensure!(
            readings >= 2,
            "{} has {readings} readings and {bad} other lines: each line must be \
             `seconds,reading`, such as `12.34,+0.123N`",
            path.display()
        );
        Ok(series)
    }

    /// Reads the text of such a file; one without readings is as good as any.
    pub fn parse(text: &str, unit: Unit) -> Self {
        let mut series = Self::default();
        let mut first = true;
        for (index, line) in text.lines().enumerate() {
            let line = line.trim_start_matches('\u{feff}').trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let (time, value) = line.split_once([',', ';', '\t']).unwrap_or((line, ""));
            let (time, value) = (
                time.trim().trim_matches('"'),
                value.trim().trim_matches('"'),
            );
            let is_names = first && !line.contains(|c: char| c.is_ascii_digit());
            first = false;
            if !is_names {
                series.push(index + 1, time.parse().ok(), value, unit);
            }
        }
        series
    }

    /// How many readings there are.
    pub fn readings(&self) -> usize {
        self.points
            .iter()
            .filter(|(_, force)| force.is_some())
            .count()
    }

    /// The first and the last time, s; nothing without readings.
    pub fn span(&self) -> Option<[f64; 2]> {
        Some([self.points.first()?.0, self.points.last()?.0])
    }

    /// Joins the readings, ready to be asked.
    pub fn joined(&self) -> Joined<'_> {
        let mut steps: Vec<f64> = self.points.windows(2).map(|p| p[1].0 - p[0].0).collect();
        steps.sort_by(f64::total_cmp);
        let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        Joined {
            points: &self.points,
            longest_s: GAP * usual,
        }
    }

    /// What was not used, in words; nothing when everything was.
    pub fn complaint(&self) -> Option<String> {
        let (line, text) = self.first_bad.as_ref()?;
        let causes: Vec<String> = self
            .bad
            .iter()
            .map(|(why, count)| format!("{} {count}", why.words()))
            .collect();
        let count = self.bad.values().sum::<usize>();
        Some(format!(
            "{count} gauge lines were not used ({}); the first is line {line}, `{text}`",
            causes.join(", ")
        ))
    }
}

/// Readings joined by straight lines.
#[derive(Clone, Copy, Debug)]
pub struct Joined<'a> {
    points: &'a [(f64, Option<f64>)],
    longest_s: f64,
}

impl Joined<'_> {
    /// The force at a time (N), when the readings on both sides are good and near enough to each
    /// other.
    pub fn at(&self, time_s: f64) -> Option<f64> {
        let after = self.points.partition_point(|p| p.0 < time_s);
        let (t1, f1) = *self.points.get(after)?;
        if t1 == time_s {
            return f1;
        }
        let (t0, f0) = *self.points.get(after.checked_sub(1)?)?;
        let (f0, f1) = (f0?, f1?);
        (t1 - t0 <= self.longest_s).then(|| f0 + (f1 - f0) * (time_s - t0) / (t1 - t0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_with_its_faults_counted() {
        let text = "time;force\n# made by hand\n0.0;+0.100N\n0.1;0.200\n0.2;OL\n\n0.3;+0.4N\n\
                    0.25;0.5N\nx;1\n0.5;1..2N\n0.6\n";
        let series = Series::parse(text, Unit::NEWTON);
        assert_eq!(series.readings(), 3);
        let counts: Vec<_> = series.bad.iter().map(|(why, n)| (*why, *n)).collect();
        assert_eq!(
            counts,
            [(Bad::NoReading, 2), (Bad::Overload, 1), (Bad::Time, 2)]
        );
        assert_eq!(series.first_bad, Some((5, "OL".into())));
        let complaint = series.complaint().unwrap();
        assert!(
            complaint.contains("5 gauge lines were not used (no reading 2"),
            "{complaint}"
        );
        assert_eq!(Series::parse("1,2\n2,3", Unit::NEWTON).complaint(), None);
    }

    #[test]
    fn readings_are_joined_but_not_across_what_was_bad_or_missing() {
        let text = "0,0\n1,1\n2,OL\n3,3\n4,4\n20,5\n21,6";
        let series = Series::parse(text, Unit::NEWTON);
        let joined = series.joined();
        assert_eq!(joined.at(0.0), Some(0.0));
        assert_eq!(joined.at(0.25), Some(0.25));
        assert_eq!(joined.at(1.5), None, "beside an overload");
        assert_eq!(joined.at(2.0), None);
        assert_eq!(joined.at(3.5), Some(3.5));
        assert_eq!(joined.at(10.0), None, "a gap");
        assert_eq!((joined.at(-0.1), joined.at(21.1)), (None, None));
    }

    #[test]
    fn a_file_without_readings_is_refused_with_an_example() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("gauge.csv");
        std::fs::write(&path, b"time,force\n\xff\xfe,0.1N\n").unwrap();
        let error = Series::load(&path, Unit::NEWTON).unwrap_err().to_string();
        assert!(error.contains("0 readings and 1 other lines"), "{error}");
        assert!(error.contains("12.34,+0.123N"), "{error}");
    }
}
