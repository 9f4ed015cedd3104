//! Finds the columns of a gauge's file: separators, headings, units.

use anyhow::{Result, bail, ensure};

use super::clock::seconds;
use crate::data::collect::gauge::Unit;

/// A table must begin within this many lines.
const HEADING_LINES: usize = 100;
/// Names of headings of times, readings and units; and names of forces other than the present one.
const TIMES: [&str; 8] = [
    "time", "zeit", "temps", "tiempo", "tempo", "elapsed", "seconds", "t",
];
const FORCES: [&str; 12] = [
    "force", "kraft", "fuerza", "forza", "load", "last", "weight", "gewicht", "reading", "value",
    "wert", "f",
];
const UNITS: [&str; 3] = ["unit", "units", "einheit"];
const OTHERS: [&str; 6] = ["peak", "max", "min", "limit", "set", "spitze"];
/// Seconds per unit in a heading of times.
const TIME_UNITS: [(&str, f64); 6] = [
    ("s", 1.0),
    ("sec", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("min", 60.0),
];

/// A file's columns.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    separator: Separator,
    /// Index of the table's first line among the lines that are not empty.
    first: usize,
    time: usize,
    force: usize,
    /// The column that contains only units.
    unit: Option<usize>,
    /// The unit named by the heading, its name, and the heading's line.
    heading: Option<(Unit, String, usize)>,
    /// Seconds per unit of the times.
    time_scale: f64,
}

/// A line of the table.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Its number in the file.
    pub line: usize,
    /// The time, s; `None` where it is invalid.
    pub time_s: Option<f64>,
    /// The reading, with its unit where a column has it.
    pub reading: String,
}

/// The separator between columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Mark(char),
    /// One or more spaces after the time; the rest is the reading.
    Spaces,
}

impl Separator {
    /// The separator that most lines have. A comma may be a decimal mark where there is a different
    /// one.
    fn of(lines: &[(usize, &str)]) -> Self {
        let looked_at = &lines[..lines.len().min(HEADING_LINES)];
        let has = |mark: &char| {
            let count = looked_at.iter().filter(|(_, line)| line.contains(*mark));
            2 * count.count() >= looked_at.len().max(1)
        };
        let mark = [';', '\t', ','].into_iter().find(has);
        mark.map_or(Separator::Spaces, Separator::Mark)
    }

    /// A line's fields; a mark within quotes is not a separator.
    fn fields(self, line: &str) -> Vec<String> {
        let Separator::Mark(mark) = self else {
            let line = line.trim();
            let (time, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            return [time, rest].map(|field| field.trim().to_owned()).to_vec();
        };
        let (mut fields, mut is_quoted) = (vec![String::new()], false);
        for character in line.chars() {
            match character {
                '"' => is_quoted = !is_quoted,
                c if c == mark && !is_quoted => fields.push(String::new()),
                c => fields
                    .last_mut()
                    .into_iter()
                    .for_each(|field| field.push(c)),
            }
        }
        // Neither is a mark at a line's end.
        while fields.len() > 2 && fields.last().is_some_and(|field| field.trim().is_empty()) {
            fields.pop();
        }
        let trimmed = fields.into_iter().map(|field| field.trim().to_owned());
        trimmed.collect()
    }
}

impl Columns {
    /// From the lines of a file that are not empty, with their numbers.
    ///
    /// # Errors
    /// When there is no table, or more than one reading of it.
    pub fn of(lines: &[(usize, &str)]) -> Result<Self> {
        let separator = Separator::of(lines);
        let fields = |(_, line): &(usize, &str)| separator.fields(line);
        let is_table = |line: &(usize, &str)| {
            let fields = fields(line);
            fields.len() > 1 && fields.iter().take(2).any(|field| seconds(field).is_some())
        };
        let found = lines.iter().take(HEADING_LINES).position(is_table);
        let Some(first) = found else {
            let (number, line) = lines.first().copied().unwrap_or((1, ""));
            bail!(
                "no line is a time and a reading: line {number} is `{line}`, and it must be \
                 `seconds,reading`, such as `12.34,+0.123N`"
            );
        };
        let of_first = fields(&lines[first]);
        one_decimal_mark(separator, &lines[first..], &of_first)?;
        let heading = lines[..first].last();
        let names = heading.map(fields).unwrap_or_default();
        let number = heading.map_or(lines[first].0, |(number, _)| *number);
        let time = one_named(&names, &TIMES, number)?.unwrap_or(0);
        let unit = one_named(&names, &UNITS, number)?.or_else(|| column_of_units(&of_first));
        let named = one_named(&names, &FORCES, number)?.filter(|force| *force != time);
        let force = match named {
            Some(force) => force,
            None => only_other(&of_first, time, unit, lines[first].0)?,
        };
        let name = |column: usize| names.get(column).map_or("", String::as_str);
        Ok(Self {
            separator,
            first,
            time,
            force,
            unit,
            heading: force_unit(name(force), number)?,
            time_scale: time_scale(name(time), number)?,
        })
    }

    /// The unit of readings without one, if the file or a person states it.
    ///
    /// # Errors
    /// When both state different units.
    pub fn unit(&self, said: Option<Unit>) -> Result<Option<Unit>> {
        if let (Some(said), Some((unit, name, line))) = (said, &self.heading) {
            ensure!(
                said == *unit,
                "line {line} says that readings are in {name}, and --gauge-unit another unit: \
                 leave the option out, or mend the line"
            );
        }
        let heading = self.heading.as_ref().map(|(unit, ..)| *unit);
        Ok(heading.or(said))
    }

    /// The table's lines.
    pub fn rows<'a>(&'a self, lines: &'a [(usize, &str)]) -> impl Iterator<Item = Row> + 'a {
        lines[self.first..].iter().map(|(number, line)| {
            let fields = self.separator.fields(line);
            let field = |column: usize| fields.get(column).map_or("", String::as_str);
            let unit = self.unit.map_or("", field);
            Row {
                line: *number,
                time_s: seconds(field(self.time)).map(|time| time * self.time_scale),
                reading: format!("{} {unit}", field(self.force)).trim().to_owned(),
            }
        })
    }
}

/// Refuses a file with ambiguous commas. These are commas both between columns and in numbers, and
/// commas that may separate thousands or decimals, in a file that also has points.
fn one_decimal_mark(separator: Separator, lines: &[(usize, &str)], first: &[String]) -> Result<()> {
    let is_digits = |field: &String| {
        let digits = field.trim_start_matches(['-', '+', '\u{2212}']);
        !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
    };
    let number = lines[0].0;
    ensure!(
        separator != Separator::Mark(',') || first.len() != 4 || !first.iter().all(is_digits),
        "line {number} has commas between columns and in numbers: save the file with `;` or a tab \
         between columns"
    );
    let with = |mark: char| {
        lines.iter().find(|(_, line)| {
            let fields = separator.fields(line);
            let number = |field: &String| {
                let (before, after) = field.split_once(mark)?;
                let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
                (is_digit(before.chars().last()) && is_digit(after.chars().next())).then_some(())
            };
            fields.iter().any(|field| number(field).is_some())
        })
    };
    if let (Some((comma, _)), Some((point, _))) = (with(','), with('.')) {
        bail!(
            "numbers have a comma at line {comma} and a point at line {point}: which is the \
             decimal mark? Save the file with one of them only"
        );
    }
    Ok(())
}

/// The words of a heading, without units in brackets.
fn words(name: &str) -> Vec<String> {
    let outside = name.split(['(', '[']).next().unwrap_or_default();
    let words = outside.split(|c: char| !c.is_alphabetic());
    let words = words.filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

/// The column with one of these names; `None` without one.
fn one_named(names: &[String], called: &[&str], line: usize) -> Result<Option<usize>> {
    let is_called = |name: &String| {
        let words = words(name);
        let is_in = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
        is_in(called) && !is_in(&OTHERS)
    };
    let columns: Vec<usize> = (0..names.len())
        .filter(|column| is_called(&names[*column]))
        .collect();
    if let [one, other, ..] = columns.as_slice() {
        bail!(
            "line {line}: columns {} (`{}`) and {} (`{}`) may both be what is looked for: leave \
             one of them in the file",
            one + 1,
            names[*one],
            other + 1,
            names[*other]
        );
    }
    Ok(columns.first().copied())
}

/// A column that contains only a unit.
fn column_of_units(first: &[String]) -> Option<usize> {
    first.iter().position(|field| Unit::named(field).is_some())
}

/// A balance's states of its reading, in a column of their own.
const STATES: [&str; 5] = ["ST", "US", "OL", "GS", "NT"];

/// The single remaining column, for readings.
fn only_other(first: &[String], time: usize, unit: Option<usize>, line: usize) -> Result<usize> {
    let is_left = |column: &usize| {
        let is_state = STATES.contains(&first[*column].as_str());
        *column != time && Some(*column) != unit && !is_state
    };
    let left: Vec<usize> = (0..first.len()).filter(is_left).collect();
    match left.as_slice() {
        [force] => Ok(*force),
        _ => bail!(
            "line {line} has {} columns, and which is the force is not said: name them in a line \
             above, such as `time,force`, or leave two of them, seconds and reading",
            first.len()
        ),
    }
}

/// The text in a heading's brackets, after its slash, or its last word; and whether it is in
/// brackets.
fn said_unit(name: &str) -> Option<(&str, bool)> {
    let bracketed = name.split_once(['(', '[']).map(|(_, rest)| rest);
    if let Some(inside) = bracketed.and_then(|rest| rest.split([')', ']']).next()) {
        return Some((inside.trim(), true));
    }
    let last = name.rsplit(|c: char| !c.is_alphabetic()).next()?;
    (last.len() < name.len()).then_some((last, false))
}

/// The longest name of a unit; longer text in brackets is a remark.
const LONGEST_UNIT: usize = 5;

/// The unit of a heading of readings.
fn force_unit(name: &str, line: usize) -> Result<Option<(Unit, String, usize)>> {
    let Some((unit, is_bracketed)) = said_unit(name) else {
        return Ok(None);
    };
    let found = Unit::named(unit);
    let is_remark = !is_bracketed || unit.is_empty() || unit.chars().count() > LONGEST_UNIT;
    ensure!(
        found.is_some() || is_remark,
        "line {line}: `{name}` has an unknown unit of force: N, mN, kN, gf, kgf, lbf and ozf \
         are known; write one of them there"
    );
    Ok(found.map(|found| (found, unit.to_owned(), line)))
}

/// Seconds per unit of the times under this heading.
fn time_scale(name: &str, line: usize) -> Result<f64> {
    let Some((unit, is_bracketed)) = said_unit(name) else {
        return Ok(1.0);
    };
    let unit = unit.to_lowercase().replace(['µ', 'μ'], "u");
    match TIME_UNITS.iter().find(|(known, _)| *known == unit) {
        Some((_, scale)) => Ok(*scale),
        None if is_bracketed && !unit.is_empty() && !unit.contains(':') => {
            bail!("line {line}: `{name}` has an unknown unit of time: s, ms, us and min are known")
        }
        None => Ok(1.0),
    }
}
