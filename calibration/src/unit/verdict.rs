//! Sums up a unit's model: its errors on loads that it was not fitted to.

use std::fmt;

use crate::unit_fit::LeaveOneOutError;

/// Root mean square errors.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    loads: usize,
    /// `None` if nobody noted directions.
    direction_deg: Option<f64>,
    magnitude_mn: f64,
    /// Of the place along x and y each; `None` if nobody noted places.
    place_um: Option<f64>,
    /// The largest |F|, if the least is about as large, mN.
    one_size_mn: Option<f64>,
}

/// Loads whose |F| differ by less than this factor are of one size.
const ONE_SIZE: f64 = 1.4;

impl Verdict {
    /// From loads that were left out; includes the gauge's and the stage's own errors.
    pub fn of(left_out: &[LeaveOneOutError]) -> Verdict {
        let of = |values: Vec<f64>| (!values.is_empty()).then(|| root_mean_square(&values));
        let noted = left_out.iter().filter(|load| load.place_mm.is_some());
        let places = left_out.iter().filter_map(|load| load.place_mm);
        let sizes: Vec<f64> = left_out.iter().map(|load| load.size_n).collect();
        let stated = left_out.iter().map(|load| load.stated_n);
        let least_n = stated.clone().fold(f64::INFINITY, f64::min);
        let largest_n = stated.fold(0.0, f64::max);
        Verdict {
            loads: left_out.len(),
            direction_deg: of(noted.map(|load| load.direction_deg).collect()),
            magnitude_mn: 1e3 * root_mean_square(&sizes),
            place_um: of(places.flatten().collect()).map(|mm| 1e3 * mm),
            one_size_mn: (largest_n < ONE_SIZE * least_n).then_some(1e3 * largest_n),
        }
    }
}

fn root_mean_square(errors: &[f64]) -> f64 {
    let sum: f64 = errors.iter().map(|error| error * error).sum();
    (sum / errors.len() as f64).sqrt()
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = self.place_um.map_or(String::new(), |um| {
            format!(", the place {um:.0} µm along x and y each")
        });
        let direction = self.direction_deg.map_or(String::new(), |degrees| {
            format!("direction {degrees:.2}°, ")
        });
        write!(
            f,
            "on each of the {} loads, left out of the fit, root mean square: {direction}|F| {:.2} \
             mN{place}; the gauge's and the stage's own errors included",
            self.loads, self.magnitude_mn
        )?;
        if self.direction_deg.is_none() {
            write!(f, "; directions and places were not noted, so not judged")?;
        }
        match self.one_size_mn {
            Some(mn) => write!(
                f,
                "; all are of about {mn:.0} mN, so other forces are not judged: add a load of \
                 twice or half of it"
            ),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left_out(direction_deg: f64, size_n: f64, place_mm: [f64; 2]) -> LeaveOneOutError {
        LeaveOneOutError {
            stated_n: 0.1,
            size_n,
            direction_deg,
            place_mm: Some(place_mm),
        }
    }

    #[test]
    fn errors_are_root_mean_squares() {
        let loads = [
            left_out(0.3, 0.001, [0.01, 0.0]),
            left_out(0.4, -0.001, [0.0, 0.01]),
        ];
        let text = Verdict::of(&loads).to_string();
        for words in ["2 loads", "direction 0.35°", "|F| 1.00 mN", "place 7 µm"] {
            assert!(text.contains(words), "no {words}: {text}");
        }
        assert!(text.contains("all are of about 100 mN"), "{text}");
        let [one, other] = loads;
        let strong = LeaveOneOutError {
            stated_n: 0.2,
            ..other
        };
        let text = Verdict::of(&[one, strong]).to_string();
        assert!(!text.contains("all are of"), "{text}");
        let anywhere = loads.map(|load| LeaveOneOutError {
            place_mm: None,
            ..load
        });
        let text = Verdict::of(&anywhere).to_string();
        assert!(text.contains("not judged") && !text.contains("°"), "{text}");
    }
}
