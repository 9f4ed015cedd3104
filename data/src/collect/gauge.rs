//! What a force gauge says: lines of text with one reading each (`docs/calibration.md`).
//!
//! A reading is `[sign] digits [. digits] [unit] [letters]`, spaces anywhere between the parts:
//!
//! ```text
//! +0.123N    -0.123 N    0.123    123.4mN    12.5 gf    +0.123NTO
//! ```
//!
//! The letters after the unit are those of common gauges: `T` or `C` for the present force (`P`: a
//! held peak, which is no reading of now), then `O`, `H` or `L` for how it compares with the
//! gauge's own limits (`E`: overload).

use anyhow::{Result, bail};

use crate::dataset;

/// Newtons in one step of a unit; longer names before those that they begin with.
const UNITS: [(&str, f64); 8] = [
    ("mN", 1e-3),
    ("kN", 1e3),
    ("N", 1.0),
    ("kgf", 9.806_65),
    ("gf", 9.806_65e-3),
    ("lbf", 4.448_221_615_260_5),
    ("ozf", 0.278_013_850_953_781_2),
    ("g", 9.806_65e-3),
];

/// No gauge for a fingertip reads more, ± N; a data set holds the difference of any two.
const LARGEST_N: f64 = dataset::LARGEST_N / 2.0;

/// Why a line is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bad {
    /// Not a reading: a cut line, noise, an answer to something else.
    NoReading,
    /// A unit that is not known, or none where none was agreed on.
    Unit,
    /// The gauge says that the force is beyond its range.
    Overload,
    /// A force that no gauge for a fingertip reads: a wrong unit, or digits run together.
    TooLarge,
    /// A held peak instead of the present force.
    Peak,
    /// Its time is no number, or not after the one before.
    Time,
}

impl Bad {
    /// In words.
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

/// The force (N, with the gauge's sign) that a line says. `usual` is taken where the line names no
/// unit.
///
/// # Errors
/// Why the line is not to be used.
pub fn reading(line: &str, usual: Unit) -> Result<f64, Bad> {
    let text: String = line.chars().filter(|c| !c.is_whitespace()).collect();
    if says_overload(&text) {
        return Err(Bad::Overload);
    }
    let (sign, unsigned) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(&text)),
    };
    let end = unsigned
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(unsigned.len());
    let (number, rest) = unsigned.split_at(end);
    // Rust reads `5.` and `.5` as well; a gauge that sends those has lost characters.
    let whole = number.starts_with(|c: char| c.is_ascii_digit())
        && number.ends_with(|c: char| c.is_ascii_digit());
    let value: f64 = number
        .parse()
        .ok()
        .filter(|value: &f64| whole && value.is_finite())
        .ok_or(Bad::NoReading)?;
    let (scale, letters) = UNITS
        .iter()
        .find_map(|(name, scale)| Some((*scale, rest.strip_prefix(name)?)))
        .unwrap_or((usual.0, rest));
    state(letters)?;
    let force_n = sign * value * scale;
    if force_n.abs() > LARGEST_N {
        return Err(Bad::TooLarge);
    }
    Ok(force_n)
}

/// The usual ways of gauges to show that there is more than they can measure.
fn says_overload(text: &str) -> bool {
    let body = text.trim_start_matches(['+', '-']);
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

/// A unit of force, by its size in N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit(f64);

impl Unit {
    /// The newton.
    pub const NEWTON: Unit = Unit(1.0);
}

impl std::str::FromStr for Unit {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> Result<Self> {
        match UNITS.iter().find(|(unit, _)| *unit == name) {
            Some((_, scale)) => Ok(Unit(*scale)),
            None => bail!(
                "unknown unit `{name}`: use {}",
                UNITS.map(|(unit, _)| unit).join(", ")
            ),
        }
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
            ("16ozf", 4.448_221_615_260_5),
            ("+0.123NTO", 0.123),
            ("+0.123NTH", 0.123),
            ("-0.050NTL", -0.05),
            ("0.002kN", 2.0),
            ("0.5kN", 500.0),
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
            ("12.", Bad::NoReading),
            (".5N", Bad::NoReading),
            ("1e3", Bad::NoReading),
            ("0.12\u{fffd}N", Bad::NoReading),
            ("0.12N0.13N", Bad::NoReading),
            ("inf", Bad::NoReading),
            ("NaN", Bad::NoReading),
            (&"9".repeat(400), Bad::NoReading),
            ("0.501kN", Bad::TooLarge),
            ("-500.1", Bad::TooLarge),
            (&"9".repeat(308), Bad::TooLarge),
            (&format!("{}kN", "9".repeat(308)), Bad::TooLarge),
            ("0.1psi", Bad::Unit),
            ("OL", Bad::Overload),
            ("+OVER", Bad::Overload),
            ("-OL", Bad::Overload),
            ("-----", Bad::Overload),
            ("+9.999NTE", Bad::Overload),
            ("+0.321NPO", Bad::Peak),
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
        fn what_a_gauge_writes_is_read(steps in -99_999_i32..=99_999, letters in "(N|NTO|NTL|mN| \
            N)?") {
            let value = f64::from(steps) / 1e3;
            let unit = if letters == "mN" { 1e-3 } else { 1.0 };
            let found = read(&format!("{value:+.3}{letters}")).unwrap();
            prop_assert!((found - value * unit).abs() < 1e-9);
        }
    }
}
