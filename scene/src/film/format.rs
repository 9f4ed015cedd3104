//! Curves as text: one line per curve, `output,a,b,c,d,c0,c1,…`; lines with # are notes.

use std::fmt::{self, Write as _};
use std::str::FromStr;

use super::curves::{Curve, Curves, DEGREE, Output, TERMS};
use crate::SceneError;

/// The outputs' names, in their order.
const NAMES: [&str; 12] = [
    "r", "t", "z", "r_by_r", "t_by_r", "z_by_r", "r_by_t", "t_by_t", "z_by_t", "tip_r", "tip_t",
    "tip_z",
];

impl fmt::Display for Curves {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for curve in &self.curves {
            let mut line = NAMES[curve.output.index()].to_owned();
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

impl FromStr for Curves {
    type Err = SceneError;

    fn from_str(text: &str) -> Result<Curves, SceneError> {
        let lines = text
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let read = |(number, line)| {
            curve(line).ok_or_else(|| {
                SceneError::Curves(format!(
                    "line {} is no curve: expected an output, four powers that sum up to at most {DEGREE} and 1 to \
                     {TERMS} numbers",
                    number + 1
                ))
            })
        };
        let curves = lines.map(read).collect::<Result<Vec<_>, _>>()?;
        Ok(Curves::new(curves))
    }
}

fn curve(line: &str) -> Option<Curve> {
    let mut words = line.split(',');
    let name = words.next()?;
    let output = NAMES.iter().position(|known| *known == name)?;
    let mut powers = [0; 4];
    let mut degree = 0;
    for power in &mut powers {
        *power = words.next()?.parse().ok().filter(|p| *p <= DEGREE)?;
        degree += *power;
    }
    let series: Option<Vec<f64>> = words
        .map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    let series = series.filter(|series| (1..=TERMS).contains(&series.len()))?;
    (degree <= DEGREE).then_some(Curve {
        output: Output::ALL[output],
        powers,
        series,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_as_written() {
        let text = "# a note\nr_by_t,0,1,0,3,0.5000000,-1.2500000\ntip_z,0,0,0,0,3.0000000\n";
        let curves: Curves = text.parse().unwrap();
        assert_eq!(curves.count(), 2);
        assert_eq!(curves.curves[0].powers, [0, 1, 0, 3]);
        assert_eq!(format!("# a note\n{curves}"), text);
    }

    #[test]
    fn names_are_in_the_order_of_the_outputs() {
        for (index, output) in Output::ALL.into_iter().enumerate() {
            assert_eq!(output.index(), index);
        }
        let line: Curves = "t_by_t,0,0,0,0,1".parse().unwrap();
        assert_eq!(
            line.curves[0].output,
            Output::AlongT(super::super::curves::Part::T)
        );
    }

    #[test]
    fn what_is_no_curve_is_refused_with_its_line() {
        let bad = [
            "r",
            "lateral,0,0,0,0,1",
            "r,0,0,0,13,1",
            "r,4,2,4,3,1",
            "r,0,0,0,0",
            "r,0,0,0,0,x",
            "tip_z,0,0,0,0,inf",
        ];
        for line in bad {
            let error = format!("# note\n{line}\n").parse::<Curves>().unwrap_err();
            assert!(error.to_string().contains("line 2"), "{line}: {error}");
        }
    }
}
