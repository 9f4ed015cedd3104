//! Units of force as gauges and headings name them.

use anyhow::{Result, bail};

/// Newtons per unit. Case counts for these three, because `MN` is not one of them.
const EXACT: [(&str, f64); 3] = [("N", 1.0), ("mN", 1e-3), ("kN", 1e3)];
/// Units whose case varies between gauges: `lbF`, `gF`, `Kgf`. A balance shows forces as masses.
const ANY_CASE: [(&str, f64); 8] = [
    ("gf", GRAM),
    ("kgf", 1e3 * GRAM),
    ("lbf", POUND),
    ("ozf", POUND / 16.0),
    ("g", GRAM),
    ("kg", 1e3 * GRAM),
    ("lb", POUND),
    ("oz", POUND / 16.0),
];
const GRAM: f64 = 9.806_65e-3;
const POUND: f64 = 4.448_221_615_260_5;

/// A unit of force, by its size in N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit(pub(super) f64);

impl Unit {
    /// The newton.
    pub const NEWTON: Unit = Unit(1.0);

    /// The unit with this name, if it is one.
    pub fn named(name: &str) -> Option<Unit> {
        let exact = EXACT.iter().find(|(unit, _)| *unit == name);
        let any_case = || ANY_CASE.iter().find(|(u, _)| u.eq_ignore_ascii_case(name));
        exact.or_else(any_case).map(|(_, size)| Unit(*size))
    }

    /// The unit with the longest name at the start of a text, and the text after it.
    pub fn at_start(text: &str) -> Option<(Unit, &str)> {
        let ends = (1..=text.len().min(LONGEST)).rev();
        let mut parts = ends.filter_map(|end| text.split_at_checked(end));
        parts.find_map(|(name, rest)| Some((Unit::named(name)?, rest)))
    }

    /// Usual units in which this span of readings is one that the film can hold.
    pub fn that_would_fit(span: f64) -> Vec<&'static str> {
        let usual = ["mN", "gf", "N", "ozf", "lbf", "kgf"];
        let fits = |name: &&str| {
            let span_n = Unit::named(name).map_or(f64::NAN, |unit| unit.0 * span);
            (LEAST_SPAN_N..=LARGEST_SPAN_N).contains(&span_n)
        };
        usual.into_iter().filter(fits).collect()
    }
}

/// Letters of the longest name.
const LONGEST: usize = 3;
/// The least and the largest span of presses, N, on a film that holds 0.25 N.
const LEAST_SPAN_N: f64 = 0.015;
const LARGEST_SPAN_N: f64 = 0.5;

impl std::str::FromStr for Unit {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> Result<Self> {
        let names = EXACT.iter().chain(&ANY_CASE).map(|(name, _)| *name);
        match Unit::named(name) {
            Some(unit) => Ok(unit),
            None => bail!(
                "unknown unit `{name}`: use {}",
                names.collect::<Vec<_>>().join(", ")
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_known_as_gauges_write_them() {
        for (name, newtons) in [
            ("N", 1.0),
            ("mN", 1e-3),
            ("kN", 1e3),
            ("gF", 9.806_65e-3),
            ("g", 9.806_65e-3),
            ("lbF", 4.448_221_615_260_5),
            ("LBF", 4.448_221_615_260_5),
            ("oz", 0.278_013_850_953_781_2),
            ("kg", 9.806_65),
        ] {
            let unit: Unit = name.parse().unwrap();
            assert!((unit.0 - newtons).abs() < 1e-12, "{name}");
        }
        for name in ["MN", "Mn", "n", "psi", "", "stone", "N·m"] {
            assert!(name.parse::<Unit>().is_err(), "{name}");
        }
        assert_eq!(Unit::at_start("NTO"), Some((Unit(1.0), "TO")));
        assert_eq!(Unit::at_start("gfx"), Some((Unit(GRAM), "x")));
        assert_eq!(Unit::at_start("µN"), None);
    }

    #[test]
    fn spans_tell_which_units_they_may_be_in() {
        assert_eq!(Unit::that_would_fit(201.3), ["mN"]);
        assert_eq!(Unit::that_would_fit(20.5), ["mN", "gf"]);
        assert_eq!(Unit::that_would_fit(0.2), ["N", "ozf"]);
        assert!(Unit::that_would_fit(1e6).is_empty());
        assert!(Unit::that_would_fit(f64::NAN).is_empty());
    }
}
