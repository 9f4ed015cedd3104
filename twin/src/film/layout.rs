//! The dots of a film: how many, where, and how large.

use std::str::FromStr;

use hivtac_terms::layout::EIGHT_V;

use crate::film::{Dots, FilmError, MARKER_CENTRES_MM, MARKER_RADIUS_MM, MOST_DOTS};

/// The smallest number of dots.
const LEAST_DOTS: usize = 4;
/// The largest distance of a dot's centre from the film's middle, mm.
const MOST_PLACE_MM: f64 = 8.0;
/// The range of a dot's diameter, mm.
const DIAMETERS_MM: [f64; 2] = [0.4, 2.0];

/// The dots of a film at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(try_from = "Written"))]
pub struct Layout {
    centres_mm: Dots<[f64; 2]>,
    diameter_mm: f64,
}

impl Default for Layout {
    /// Returns the nominal sensor's four dots, the layout `4`.
    fn default() -> Layout {
        Layout {
            centres_mm: MARKER_CENTRES_MM.into(),
            diameter_mm: 2.0 * MARKER_RADIUS_MM,
        }
    }
}

impl Layout {
    /// The names of layouts, as [`str::parse`] reads them.
    pub const NAMES: [&str; 2] = ["4", "8v"];

    /// Returns the layout of dots with these centres, mm from the film's middle, and a diameter.
    ///
    /// # Errors
    /// If there are too few or too many dots, two touch, or a number is outside its range.
    pub fn new(centres_mm: &[[f64; 2]], diameter_mm: f64) -> Result<Layout, FilmError> {
        let wrong = |why: String| Err(FilmError::Layout(why));
        if !(LEAST_DOTS..=MOST_DOTS).contains(&centres_mm.len()) {
            let count = centres_mm.len();
            return wrong(format!("{count} dots: use {LEAST_DOTS} to {MOST_DOTS}"));
        }
        let [least, most] = DIAMETERS_MM;
        if !(least..=most).contains(&diameter_mm) {
            return wrong(format!(
                "the dots' diameter is {diameter_mm} mm: use {least} to {most}"
            ));
        }
        for (k, [x, y]) in centres_mm.iter().enumerate() {
            if !(x.abs() <= MOST_PLACE_MM && y.abs() <= MOST_PLACE_MM) {
                return wrong(format!(
                    "dot {k} is at ({x}, {y}) mm: use places within ±{MOST_PLACE_MM}"
                ));
            }
            let touches = |[a, b]: &&[f64; 2]| libm::hypot(x - a, y - b) <= diameter_mm;
            if let Some([a, b]) = centres_mm[..k].iter().find(touches) {
                return wrong(format!(
                    "dots at ({a}, {b}) and ({x}, {y}) mm touch: put them more than \
                     {diameter_mm} mm apart"
                ));
            }
        }
        Ok(Layout {
            centres_mm: Dots::of(centres_mm.iter().copied()),
            diameter_mm,
        })
    }

    /// Returns the dots' centres by identity, mm from the film's middle.
    pub fn centres_mm(&self) -> Dots<[f64; 2]> {
        self.centres_mm
    }

    /// Returns the dots' diameter, mm.
    pub fn diameter_mm(&self) -> f64 {
        self.diameter_mm
    }

    /// Returns the number of dots.
    pub fn count(&self) -> usize {
        self.centres_mm.len()
    }

    /// Returns whether these are the nominal sensor's four dots, which have tables of their own.
    pub(crate) fn is_nominal(&self) -> bool {
        *self == Layout::default()
    }
}

impl FromStr for Layout {
    type Err = FilmError;

    /// Reads a name of [`Layout::NAMES`].
    fn from_str(name: &str) -> Result<Layout, FilmError> {
        match name {
            "4" => Ok(Layout::default()),
            "8v" => {
                let mm = EIGHT_V.map(|place| place.map(|part| f64::from(part.0) / 1e3));
                Layout::new(&mm, 2.0 * MARKER_RADIUS_MM)
            }
            _ => Err(FilmError::Layout(format!(
                "unknown layout `{name}`: use one of {}",
                Layout::NAMES.join(", ")
            ))),
        }
    }
}

/// A layout as a file has it.
#[cfg(feature = "file")]
#[derive(serde::Deserialize)]
#[serde(untagged, expecting = "a name, or dots_mm and diameter_mm")]
enum Written {
    Name(String),
    Own(Own),
}

#[cfg(feature = "file")]
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    dots_mm: Vec<[f64; 2]>,
    diameter_mm: Option<f64>,
}

#[cfg(feature = "file")]
impl TryFrom<Written> for Layout {
    type Error = FilmError;

    fn try_from(written: Written) -> Result<Layout, FilmError> {
        match written {
            Written::Name(name) => name.parse(),
            Written::Own(Own {
                dots_mm,
                diameter_mm,
            }) => Layout::new(&dots_mm, diameter_mm.unwrap_or(2.0 * MARKER_RADIUS_MM)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_layouts_are_possible() {
        for name in Layout::NAMES {
            let layout: Layout = name.parse().unwrap();
            let own = Layout::new(&layout.centres_mm(), layout.diameter_mm());
            assert_eq!(own, Ok(layout), "{name}");
        }
        assert_eq!("4".parse(), Ok(Layout::default()));
        assert_eq!("8v".parse::<Layout>().unwrap().count(), 8);
    }

    #[test]
    fn impossible_layouts_are_refused_by_name() {
        let refused =
            |dots: &[[f64; 2]], diameter| Layout::new(dots, diameter).unwrap_err().to_string();
        let mut dots = MARKER_CENTRES_MM;
        assert!(refused(&dots[..3], 1.0).contains("3 dots: use 4 to 16"));
        assert!(refused(&[[0.0; 2]; 17], 1.0).contains("17 dots"));
        assert!(refused(&dots, f64::NAN).contains("diameter"));
        dots[2] = [8.5, 0.0];
        assert!(refused(&dots, 1.0).contains("dot 2 is at (8.5, 0)"));
        dots[2] = [f64::NAN, 0.0];
        assert!(refused(&dots, 1.0).contains("dot 2"));
        dots[2] = [3.717, -3.0];
        assert!(refused(&dots, 1.0).contains("touch"));
        assert!(
            "5".parse::<Layout>()
                .unwrap_err()
                .to_string()
                .contains("8v")
        );
    }
}
