//! The curves as text: one line per curve, `motion,a,b,c,d,c0,c1,…`; lines with # are notes.

use std::fmt::{self, Write as _};
use std::str::FromStr;

use super::{Curve, Motion, Reduced, TERMS};
use crate::FilmError;

const NAMES: [(Motion, &str); 4] = [
    (Motion::Radial, "radial"),
    (Motion::Tangential, "tangential"),
    (Motion::Normal, "normal"),
    (Motion::Depth, "depth"),
];

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = NAMES.iter().find(|(motion, _)| motion == self);
        f.write_str(name.map_or("", |(_, name)| name))
    }
}

impl fmt::Display for Reduced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for curve in &self.curves {
            let mut line = curve.motion.to_string();
            for power in curve.powers {
                write!(line, ",{power}")?;
            }
            for part in &curve.series {
                write!(line, ",{part:.7}")?;
            }
            writeln!(f, "{line}")?;
        }
        Ok(())
    }
}

impl FromStr for Reduced {
    type Err = FilmError;

    fn from_str(text: &str) -> Result<Reduced, FilmError> {
        let lines = text
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let read = |(number, line)| {
            curve(line).ok_or_else(|| {
                FilmError::Curves(format!(
                    "line {} is no curve: expected motion, four powers up to 3 and up to {TERMS} numbers",
                    number + 1
                ))
            })
        };
        let curves = lines.map(read).collect::<Result<_, _>>()?;
        Ok(Reduced { curves })
    }
}

fn curve(line: &str) -> Option<Curve> {
    let mut words = line.split(',');
    let name = words.next()?;
    let (motion, _) = NAMES.iter().find(|(_, known)| *known == name)?;
    let mut powers = [0; 4];
    for power in &mut powers {
        *power = words.next()?.parse().ok().filter(|power| *power <= 3)?;
    }
    let series: Option<Vec<f64>> = words
        .map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    let series = series.filter(|series| (1..=TERMS).contains(&series.len()))?;
    Some(Curve {
        motion: *motion,
        powers,
        series,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_as_written() {
        let text = "# a note\nradial,0,1,0,3,0.5000000,-1.2500000\ndepth,0,0,0,0,3.0000000\n";
        let reduced: Reduced = text.parse().unwrap();
        assert_eq!(reduced.curves.len(), 2);
        assert_eq!(reduced.curves[0].powers, [0, 1, 0, 3]);
        assert_eq!(format!("# a note\n{reduced}"), text);
    }

    #[test]
    fn what_is_no_curve_is_refused_with_its_line() {
        let bad = [
            "radial",
            "lateral,0,0,0,0,1",
            "radial,0,0,0,4,1",
            "radial,0,0,0,0",
            "radial,0,0,0,0,x",
            "depth,0,0,0,0,inf",
        ];
        for line in bad {
            let error = format!("# note\n{line}\n").parse::<Reduced>().unwrap_err();
            assert!(error.to_string().contains("line 2"), "{line}: {error}");
        }
    }
}
