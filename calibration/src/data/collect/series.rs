//! A gauge's readings over time, and the force between them.

use std::collections::BTreeMap;

use anyhow::{Result, bail};

use super::gauge::{Bad, Unit, read};

/// Readings of a gauge on its own clock. Readings on both sides of a bad line are not joined.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// (time in s, force in N); `None` for a bad line. Times rise.
    points: Vec<(f64, Option<f64>)>,
    /// Number of unused lines, by cause.
    pub bad: BTreeMap<Bad, usize>,
    /// The first unused line: number and text.
    pub first_bad: Option<(usize, String)>,
    /// Number of readings without a unit.
    unnamed: usize,
    /// If its clock started again: the line, and the last time before that, s.
    pub begins: Option<(usize, f64)>,
}

/// The largest time of a clock, ± s: three centuries, beyond the seconds since 1970 and a sensor's
/// counter. Sums and differences of such times stay exact to microseconds.
pub const LARGEST_S: f64 = 1e10;
/// The largest span of readings of presses, N, on a film that holds 0.25 N: with a unit, and
/// without any stated unit.
const LARGEST_SPAN_N: f64 = 5.0;
const UNNAMED_SPAN_N: f64 = 0.5;
/// One reading in this many may come from a knock, on either side.
const RARE: usize = 200;
/// Readings farther apart than this many median distances are not joined.
const GAP: f64 = 5.0;

impl Series {
    /// Adds a line that arrived at `time_s`.
    pub fn push(&mut self, number: usize, time_s: Option<f64>, text: &str, unit: Unit) {
        let last = self.points.last().map_or(f64::NEG_INFINITY, |p| p.0);
        let time = time_s.filter(|t| t.abs() <= LARGEST_S && *t > last);
        let found = match time {
            Some(_) => read(text, unit),
            None => Err(Bad::Time),
        };
        let found = found.map(|reading| {
            self.unnamed += usize::from(!reading.names_unit);
            reading.force_n
        });
        if let Err(why) = found {
            *self.bad.entry(why).or_default() += 1;
            self.first_bad
                .get_or_insert_with(|| (number, text.trim().to_owned()));
        }
        if let Some(time) = time {
            self.points.push((time, found.ok()));
        }
    }

    /// A series whose clock started again at `line` of its file, after `last_s`.
    pub(super) fn after(line: usize, last_s: f64) -> Self {
        Self {
            begins: Some((line, last_s)),
            ..Self::default()
        }
    }

    /// Refuses readings that no press of the film gives because their unit was not stated, or is
    /// different from the stated one.
    ///
    /// # Errors
    /// When they span more than a press of the film can; names the units that would fit. `is_said`
    /// is whether a person stated the unit of readings without one.
    pub fn plausible(&self, is_said: bool) -> Result<()> {
        let mut forces: Vec<f64> = self.points.iter().filter_map(|point| point.1).collect();
        forces.sort_by(f64::total_cmp);
        // Knocks against the gauge do not count.
        let few = forces.len() / RARE;
        let [Some(least), Some(most)] = [
            forces.get(few),
            forces.get(forces.len().wrapping_sub(few + 1)),
        ] else {
            return Ok(());
        };
        let span_n = most - least;
        let is_named = is_said || self.unnamed == 0;
        let largest_n = if is_named {
            LARGEST_SPAN_N
        } else {
            UNNAMED_SPAN_N
        };
        if span_n <= largest_n {
            return Ok(());
        }
        let hint = match Unit::that_would_fit(span_n).as_slice() {
            _ if is_named => "is the unit right, and nothing but the film pressed?".to_owned(),
            [] => "say their unit with --gauge-unit".to_owned(),
            units if span_n <= LARGEST_SPAN_N => {
                format!("--gauge-unit {}? Or N, if it is that", units.join(" or "))
            }
            units => format!("--gauge-unit {}?", units.join(" or ")),
        };
        let unit = if is_named {
            ""
        } else {
            "no reading names a unit; taken for newtons, "
        };
        bail!("{unit}readings span {span_n:.3} N, and the film holds 0.25 N: {hint}");
    }

    /// The series with the opposite sign.
    #[must_use]
    pub fn turned_round(mut self) -> Self {
        for (_, force) in &mut self.points {
            *force = force.map(|force| -force);
        }
        self
    }

    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.points
            .iter()
            .filter(|(_, force)| force.is_some())
            .count()
    }

    /// The first and the last time, s; `None` without readings.
    pub fn span(&self) -> Option<[f64; 2]> {
        Some([self.points.first()?.0, self.points.last()?.0])
    }

    /// Joins the readings for queries at any time.
    pub fn joined(&self) -> Joined<'_> {
        let mut steps: Vec<f64> = self.points.windows(2).map(|p| p[1].0 - p[0].0).collect();
        steps.sort_by(f64::total_cmp);
        let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        Joined {
            points: &self.points,
            longest_s: GAP * usual,
        }
    }

    /// The unused lines, in words; `None` when all were used.
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
    /// The force at a time, N. `None` unless the readings on both sides are good and near enough to
    /// each other.
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

    /// Largest deviation of the force from the straight line between two readings, N, estimated
    /// from the slopes of the lines before and after it.
    pub fn bent_n(&self, time_s: f64) -> f64 {
        let after = self.points.partition_point(|p| p.0 < time_s).max(1);
        let line = |after: usize| {
            let (t0, f0) = *self.points.get(after.checked_sub(1)?)?;
            let (t1, f1) = *self.points.get(after)?;
            Some(((f1? - f0?) / (t1 - t0), t1 - t0))
        };
        let Some((slope, step_s)) = line(after) else {
            return 0.0;
        };
        let beside = [after.checked_sub(1).and_then(line), line(after + 1)];
        let bends = beside.into_iter().flatten();
        let bend = bends.map(|(other, _)| (other - slope).abs());
        // A parabola's arc is an eighth of its bend over the step above its chord.
        bend.fold(0.0, f64::max) * step_s / 8.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One reading per second.
    fn series(readings: &[&str]) -> Series {
        let mut series = Series::default();
        for (second, text) in readings.iter().enumerate() {
            series.push(second + 1, Some(second as f64), text, Unit::NEWTON);
        }
        series
    }

    #[test]
    fn few_readings_leave_more_open_where_the_force_bends() {
        let parabola: Vec<String> = (0..9)
            .map(|i| format!("{}", f64::from(i * i) / 100.0))
            .collect();
        let texts: Vec<&str> = parabola.iter().map(String::as_str).collect();
        let series = series(&texts);
        let joined = series.joined();
        // Between 4 and 5 s, 0.16 and 0.25 N, the parabola is at 0.2025 N.
        let off_n = joined.at(4.5).unwrap() - 0.2025;
        assert!((joined.bent_n(4.5) - off_n).abs() < 1e-9, "{off_n}");
        assert!(joined.bent_n(0.5) > 0.0 && joined.bent_n(7.9) > 0.0);
        assert_eq!(Series::default().joined().bent_n(1.0), 0.0);
    }

    #[test]
    fn what_no_film_gives_is_asked_about() {
        let asked = |readings: &[&str], is_said: bool| {
            let error = series(readings).plausible(is_said).unwrap_err();
            error.to_string()
        };
        assert!(asked(&["0", "201.3"], false).ends_with("0.25 N: --gauge-unit mN?"));
        assert!(asked(&["150.0", "170.5"], false).ends_with("--gauge-unit mN or gf?"));
        assert!(asked(&["0", "0.6"], false).ends_with("ozf? Or N, if it is that"));
        assert!(asked(&["0", "10"], true).contains("is the unit right"));
        assert!(asked(&["0 N", "10 N"], false).contains("is the unit right"));
        for (fine, is_said) in [
            (&["0", "0.25"][..], false),
            (&["0 N", "0.6 N"], false),
            (&["0", "0.6"], true),
            (&["OL", "OL"], false),
            (&[], false),
        ] {
            assert!(series(fine).plausible(is_said).is_ok(), "{fine:?}");
        }
        let mut knocked = vec!["0.1"; 500];
        knocked[250] = "40";
        assert!(series(&knocked).plausible(false).is_ok());
    }

    #[test]
    fn readings_are_joined_but_not_across_what_was_bad_or_missing() {
        let mut series = series(&["0", "1", "OL", "3", "4"]);
        series.push(6, Some(20.0), "5", Unit::NEWTON);
        series.push(7, Some(21.0), "6", Unit::NEWTON);
        assert_eq!(series.clone().turned_round().joined().at(3.5), Some(-3.5));
        let joined = series.joined();
        assert_eq!(joined.at(0.0), Some(0.0));
        assert_eq!(joined.at(0.25), Some(0.25));
        assert_eq!(joined.at(1.5), None, "beside an overload");
        assert_eq!(joined.at(2.0), None);
        assert_eq!(joined.at(3.5), Some(3.5));
        assert_eq!(joined.at(10.0), None, "a gap");
        assert_eq!((joined.at(-0.1), joined.at(21.1)), (None, None));
    }
}
