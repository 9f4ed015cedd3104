//! Reads files that a gauge, its maker's program or a spreadsheet wrote: tables of times and
//! readings.
//!
//! | file | subject |
//! |---|---|
//! | `encoding` | bytes to text |
//! | `columns` | which column is what, and in which unit |
//! | `clock` | times, and a clock that starts again |
//!
//! A file with a single possible meaning is read. Any other is refused, with the line, the cause,
//! and what helps.

mod clock;
mod columns;
mod encoding;

use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::gauge::Unit;
use super::series::Series;
use clock::Clock;
use columns::Columns;

/// Reads a gauge's file: one series, or several when its clock starts again. `unit` is the unit of
/// readings without one, if a person stated it.
///
/// # Errors
/// When it cannot be read, has no readings, or has more than one possible meaning.
pub fn load(path: &Path, unit: Option<Unit>) -> Result<Vec<Series>> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let text = encoding::text(&bytes);
    parse(&text, unit).with_context(|| path.display().to_string())
}

/// Parses the text of such a file.
///
/// # Errors
/// As [`load`].
pub fn parse(text: &str, unit: Option<Unit>) -> Result<Vec<Series>> {
    let lines: Vec<(usize, &str)> = (1..)
        .zip(text.lines())
        .map(|(number, line)| (number, line.trim_end_matches(['\r', '\0'])))
        .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
        .collect();
    let columns = Columns::of(&lines)?;
    let said = columns.unit(unit)?;
    let rows: Vec<_> = columns.rows(&lines).collect();
    let times: Vec<Option<f64>> = rows.iter().map(|row| row.time_s).collect();
    let clock = Clock::of(&times);
    let mut series = vec![Series::default()];
    for (index, row) in rows.iter().enumerate() {
        if clock.begins_at(index) {
            let last_s = series[series.len() - 1].span().map_or(0.0, |span| span[1]);
            series.push(Series::after(row.line, last_s));
        }
        let newest = series.len() - 1;
        let unit = said.unwrap_or(Unit::NEWTON);
        series[newest].push(row.line, row.time_s, &row.reading, unit);
    }
    for part in &series {
        enough(part, rows.first().map(|row| row.line))?;
        part.plausible(said.is_some())?;
    }
    Ok(series)
}

/// Refuses a file with hardly any readings.
fn enough(series: &Series, first_line: Option<usize>) -> Result<()> {
    let (readings, bad) = (series.readings(), series.bad.values().sum::<usize>());
    let complaint = series.complaint().map_or_else(
        || format!("no table begins at line {}", first_line.unwrap_or(1)),
        |complaint| complaint.to_string(),
    );
    ensure!(
        readings >= 2 && readings > bad,
        "{readings} readings and {bad} other lines: {complaint}; each line must be \
         `seconds,reading`, such as `12.34,+0.123N`"
    );
    Ok(())
}

#[cfg(test)]
mod tests;
