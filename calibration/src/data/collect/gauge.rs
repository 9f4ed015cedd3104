//! Parses a force gauge's output: lines of text with one reading each (`docs/calibration.md`).
//!
//! A reading is `[what] [sign] digits [mark digits] [unit] [letters]`, spaces between the parts but
//! not within a number:
//!
//! ```text
//! +0.123N    -0.123 N    0,123    123.4mN    0.0452 lbF    +0.123NTO    ST,+00012.3  g
//! ```
//!
//! `what` comes from balances: `ST` or `S S` steady, `US` or `S D` unsteady, `GS` gross, `NT` net.
//! The letters after the unit are those of common gauges. First `T` or `C` for the present force
//! (`P`: a held peak, not a present reading). Then `O`, `H` or `L` for its comparison with the
//! gauge's own limits (`E`: overload). Before these letters, `K` and `O` are kgf and lbf.

pub use super::gauge_unit::Unit;
use crate::data::dataset;

/// The largest reading of a gauge for a fingertip, ± N; a data set holds the difference of any two.
const LARGEST_N: f64 = dataset::LARGEST_N / 2.0;

/// Why a line is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bad {
    /// Not a reading: a cut line, noise, an answer to something else.
    NoReading,
    /// An unknown unit, or no unit where none was agreed on.
    Unit,
    /// The gauge reports that the force is beyond its range.
    Overload,
    /// A force beyond that of any gauge for a fingertip: a wrong unit, or digits run together.
    TooLarge,
    /// A held peak instead of the present force.
    Peak,
    /// Its time is not a number, or not after the previous one.
    Time,
}

impl Bad {
    /// The reason in words.
    pub fn words(self) -> &'static str {
        match self {
            Bad::NoReading => "no reading",
            Bad::Unit => "unknown unit",
            Bad::Overload => "overload",
            Bad::TooLarge => "more than 500 N",
            Bad::Peak => "held peak",
            Bad::Time => "bad time",
        }
    }
}

/// The reading of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The force with the gauge's sign, N.
    pub force_n: f64,
    /// Whether the line names its unit.
    pub names_unit: bool,
}

/// The force of a line, N, with the gauge's sign. `usual` is the unit of lines without one.
///
/// # Errors
/// The reason not to use the line.
pub fn reading(line: &str, usual: Unit) -> Result<f64, Bad> {
    read(line, usual).map(|reading| reading.force_n)
}

/// The reading of a line. `usual` is the unit of lines without one.
///
/// # Errors
/// The reason not to use the line.
pub fn read(line: &str, usual: Unit) -> Result<Reading, Bad> {
    let text = without_heading(line.trim())?;
    if says_overload(text) {
        return Err(Bad::Overload);
    }
    let (sign, unsigned) = signed(text);
    let end = unsigned
        .find(|c: char| !c.is_ascii_digit() && c != '.' && c != ',')
        .unwrap_or(unsigned.len());
    let (digits, rest) = unsigned.split_at(end);
    let value = number(digits).ok_or(Bad::NoReading)?;
    let rest: String = rest.chars().filter(|c| !c.is_whitespace()).collect();
    if rest.contains(|c: char| c.is_ascii_digit()) {
        return Err(Bad::NoReading);
    }
    let (unit, letters) = unit(&rest);
    state(letters)?;
    let force_n = sign * value * unit.unwrap_or(usual).0;
    if force_n.abs() > LARGEST_N {
        return Err(Bad::TooLarge);
    }
    Ok(Reading {
        force_n,
        names_unit: unit.is_some(),
    })
}

/// A number without sign, with a point or a comma as its decimal mark and digits on both sides of
/// it. Rust also parses `5.` and `.5`, but a gauge that sends those has lost characters.
pub(super) fn number(digits: &str) -> Option<f64> {
    let is_whole = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let whole = match digits.split_once(['.', ',']) {
        Some((before, after)) => is_whole(before) && is_whole(after),
        None => is_whole(digits),
    };
    let value: f64 = digits.replace(',', ".").parse().ok()?;
    (whole && value.is_finite()).then_some(value)
}

/// The sign of a number, and the text after it; the minus may be a typographic one.
pub(super) fn signed(text: &str) -> (f64, &str) {
    if let Some(rest) = text.strip_prefix(['-', '\u{2212}', '\u{2013}']) {
        return (-1.0, rest.trim_start());
    }
    (1.0, text.strip_prefix('+').unwrap_or(text).trim_start())
}

/// The text after the words that a balance puts before the number.
fn without_heading(text: &str) -> Result<&str, Bad> {
    let mut rest = text;
    while let Some((word, after)) = rest.split_once(',') {
        match word.trim() {
            "ST" | "US" | "GS" | "NT" => rest = after.trim_start(),
            "OL" => return Err(Bad::Overload),
            _ => break,
        }
    }
    if let Some(after) = rest.strip_prefix("S ") {
        let after = after.trim_start();
        return match after.split_at_checked(1) {
            Some(("S" | "D", number)) => Ok(number.trim_start()),
            Some(("+" | "-", "")) => Err(Bad::Overload),
            _ => Err(Bad::NoReading),
        };
    }
    Ok(rest)
}

/// The unit at the start of a text, and the letters after it.
fn unit(rest: &str) -> (Option<Unit>, &str) {
    let imada = |letter: char, name: &str| {
        let letters = rest.strip_prefix(letter)?;
        let is_mode = letters.starts_with(['T', 'C', 'P']) && letters.len() <= 2;
        is_mode.then_some((Unit::named(name), letters))
    };
    let long = || Unit::at_start(rest).map(|(unit, letters)| (Some(unit), letters));
    imada('K', "kgf")
        .or_else(|| imada('O', "lbf"))
        .or_else(long)
        .unwrap_or((None, rest))
}

/// Whether a text is one of the usual overload messages of gauges.
fn says_overload(text: &str) -> bool {
    let body = text.trim_start_matches(['+', '-', ' ']);
    let word = body.to_ascii_uppercase();
    ["OL", "OVER", "OVERLOAD", "O.L", "O.L."].contains(&word.as_str())
        || (body.is_empty() && text.len() >= 3)
}

fn state(letters: &str) -> Result<(), Bad> {
    match letters {
        "" => Ok(()),
        _ if letters.ends_with('E') && letters.len() <= 2 => Err(Bad::Overload),
        _ if letters.starts_with('P') && letters.len() <= 2 => Err(Bad::Peak),
        "T" | "C" | "TO" | "TH" | "TL" | "CO" | "CH" | "CL" | "O" | "H" | "L" => Ok(()),
        _ if letters.chars().all(|c| c.is_ascii_alphabetic()) => Err(Bad::Unit),
        _ => Err(Bad::NoReading),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(line: &str) -> Result<f64, Bad> {
        reading(line, Unit::NEWTON)
    }

    #[test]
    fn readings_of_all_forms_are_read() {
        for (line, newtons) in [
            ("+0.123N", 0.123),
            ("-0.123N", -0.123),
            ("0.123", 0.123),
            (" + 0.123 N \r\n", 0.123),
            ("123.4mN", 0.1234),
            ("-2 N", -2.0),
            ("100gf", 0.980_665),
            ("100 g", 0.980_665),
            ("1kgf", 9.806_65),
            ("1.0lbf", 4.448_221_615_260_5),
            ("1.0 lbF", 4.448_221_615_260_5),
            ("-100 gF", -0.980_665),
            ("16ozf", 4.448_221_615_260_5),
            ("+0.123NTO", 0.123),
            ("+0.123NTH", 0.123),
            ("-0.050NTL", -0.05),
            ("+0.100KTO", 0.980_665),
            ("+0.100OTO", 0.444_822_161_526_05),
            ("0.002kN", 2.0),
            ("0.5kN", 500.0),
            ("\u{2212}0.123 N", -0.123),
            ("0,123 N", 0.123),
            ("-0,123N", -0.123),
            ("ST,+00012.3  g", 0.120_621_795),
            ("US,-00012.3  g", -0.120_621_795),
            ("ST,NT,+000012.3 g", 0.120_621_795),
            ("S S      12.30 g", 0.120_621_795),
            ("S D     -12.30 g", -0.120_621_795),
        ] {
            let found = read(line).unwrap();
            assert!((found - newtons).abs() < 1e-12, "{line}: {found}");
        }
        assert_eq!(reading("250", "mN".parse().unwrap()), Ok(0.25));
        assert_eq!(reading("250N", "mN".parse().unwrap()), Ok(250.0));
    }

    #[test]
    fn what_is_no_reading_says_why() {
        for (line, why) in [
            ("", Bad::NoReading),
            ("N", Bad::NoReading),
            ("+N", Bad::NoReading),
            ("0.1.2N", Bad::NoReading),
            ("1.234,5 N", Bad::NoReading),
            ("1 234.5 N", Bad::NoReading),
            ("0.1 2N", Bad::NoReading),
            ("0. 12N", Bad::NoReading),
            ("12.", Bad::NoReading),
            (".5N", Bad::NoReading),
            (",5N", Bad::NoReading),
            ("1e3", Bad::NoReading),
            ("0.12\u{fffd}N", Bad::NoReading),
            ("0.12N0.13N", Bad::NoReading),
            ("inf", Bad::NoReading),
            ("NaN", Bad::NoReading),
            ("S I", Bad::NoReading),
            (&"9".repeat(400), Bad::NoReading),
            ("0.501kN", Bad::TooLarge),
            ("-500.1", Bad::TooLarge),
            (&"9".repeat(308), Bad::TooLarge),
            (&format!("{}kN", "9".repeat(308)), Bad::TooLarge),
            ("0.1psi", Bad::Unit),
            ("0.1MN", Bad::Unit),
            ("0.1K", Bad::Unit),
            ("OL", Bad::Overload),
            ("OL,+9999999  g", Bad::Overload),
            ("S +", Bad::Overload),
            ("+OVER", Bad::Overload),
            ("-OL", Bad::Overload),
            ("-----", Bad::Overload),
            ("+9.999NTE", Bad::Overload),
            ("+0.321NPO", Bad::Peak),
            ("+0.321KPO", Bad::Peak),
            ("+0.321NP", Bad::Peak),
        ] {
            assert_eq!(read(line), Err(why), "{line}");
        }
        assert!("stone".parse::<Unit>().is_err());
    }

    proptest! {
        #[test]
        fn any_text_is_a_finite_reading_or_refused(line in "\\PC{0,24}") {
            prop_assert!(read(&line).map_or(true, f64::is_finite));
        }

        #[test]
        fn what_a_gauge_writes_is_read(
            steps in -9_999_i32..=9_999,
            (letters, unit) in prop::sample::select(vec![
                ("N", 1.0), ("NTO", 1.0), ("NTL", 1.0), ("mN", 1e-3), ("", 1.0),
                (" gF", 9.80665e-3), (" lbF", 4.4482216152605), ("KTO", 9.80665),
                ("OTH", 4.4482216152605),
            ]),
            comma in any::<bool>(),
            before in prop::sample::select(vec!["", "ST,", "US,GS,", "S S  "]),
        ) {
            let value = f64::from(steps) / 1e3;
            let mut number = format!("{value:+.3}");
            if comma {
                number = number.replace('.', ",");
            }
            let found = read(&format!("{before}{number}{letters}"));
            prop_assert!((found.unwrap() - value * unit).abs() < 1e-9);
        }

        /// White space within a number means a lost digit, or two numbers.
        #[test]
        fn digits_apart_are_no_number(a in 0_u32..1000, b in 0_u32..1000, space in "[ \u{a0}\t]+") {
            prop_assert_eq!(read(&format!("{a}{space}{b} N")), Err(Bad::NoReading));
        }
    }
}
