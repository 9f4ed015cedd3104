//! Explains a fit's χ² in words: what it says of the loads, and what to do.

use std::fmt;

use super::descent::EXPLAINED;
use crate::loads::SeenLoad;

/// χ² above which a load's stated values are wrong, rather than less certain than stated. Its
/// markers are then some hundredths of a pixel from the fit.
const WRONG: f64 = 10.0;

/// How well a fit explains its loads.
pub struct GoodnessOfFit<'a> {
    /// χ² over the number of seen coordinates.
    pub chi_square: f64,
    /// The load that the fit explains worst.
    pub worst: &'a SeenLoad,
}

impl fmt::Display for GoodnessOfFit<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let GoodnessOfFit { chi_square, worst } = self;
        write!(
            f,
            "χ² of what is seen, over its coordinates: {chi_square:.2}, "
        )?;
        if *chi_square < EXPLAINED {
            return write!(f, "as it should be: one film explains all loads");
        }
        let [x, y] = worst.place_mm;
        write!(
            f,
            "where about 1 is left of loads that are known as well as is said. All stated \
             uncertainties are {:.1} times as wide for it.\nMost is left of the load of {:.0} mN \
             at x {x:+.1}, y {y:+.1} mm: ",
            chi_square.sqrt(),
            1e3 * worst.magnitude_n()
        )?;
        let (known, options) = match worst.each_place_mm.is_finite() {
            true => ("places are", "--gauge-n, --stage-mm, --place-mm"),
            false => ("direction is", "--gauge-n, --direction-deg"),
        };
        match *chi_square < WRONG {
            true => write!(
                f,
                "the gauge or the {known} known less well than stated ({options}), or the film \
                 creeps. Check the gauge's zero, and press again; more loads help, too."
            ),
            false => write!(
                f,
                "a load is stated wrongly. Check its force, its direction and its place, the gauge's \
                 zero and unit, that one tip alone touched the film, and that nothing moved the \
                 sensor since its tare. Then put it on again: until then the model is worth little."
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_size_of_chi_square_says_what_to_do() {
        let worst = SeenLoad {
            force_n: [0.0, 0.0, -0.2],
            size_n: 1e-3,
            direction_rad: 0.0,
            place_mm: [3.0, -1.5],
            each_place_mm: 0.0,
            seen_px: [[0.0; 2]; 4].into(),
            noise_px: 0.008,
            frames: 4,
        };
        let words = |chi_square: f64| {
            let worst = &worst;
            GoodnessOfFit { chi_square, worst }.to_string()
        };
        let good = words(1.39);
        assert!(good.contains("1.39, as it should be") && !good.contains("200 mN"));
        for (chi_square, wider, advice) in [
            (4.0, "2.0 times as wide", "--place-mm"),
            (400.0, "20.0 times as wide", "stated wrongly"),
        ] {
            let text = words(chi_square);
            for part in [wider, advice, "200 mN at x +3.0, y -1.5 mm"] {
                assert!(text.contains(part), "no {part}: {text}");
            }
        }
    }
}
