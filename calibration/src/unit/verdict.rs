//! How good a unit's model is on loads that it was not fitted to.

use std::fmt;

use hivtac_data::dataset::Free;
use hivtac_evaluation::Judged;

/// Root mean square errors.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    frames: usize,
    /// Nothing where no direction is known.
    direction_deg: Option<f64>,
    magnitude_mn: f64,
    /// Of the place along x and y each; nothing where no place is known.
    place_um: Option<f64>,
}

impl Verdict {
    /// Of answers beside their truth, the gauge's and the stage's own errors included. Of presses
    /// anywhere only |F| is known.
    pub fn of(judged: &[Judged], free: Option<Free>) -> Verdict {
        let is_noted = |it: &&Judged| free.is_none() || it.tip_mm.is_some();
        let directions = judged.iter().filter(is_noted).map(|it| it.direction_deg);
        let directions: Vec<f64> = directions.collect();
        let places = judged.iter().filter_map(|it| {
            let ([x, y], [true_x, true_y]) = (it.found_place?.0, it.tip_mm?);
            Some([x - true_x, y - true_y])
        });
        let places: Vec<f64> = places.flatten().collect();
        let magnitude = |it: &Judged| it.found_polar[2] - it.truth_polar[2];
        Verdict {
            frames: judged.len(),
            direction_deg: (!directions.is_empty()).then(|| root_mean_square(directions)),
            magnitude_mn: 1e3 * root_mean_square(judged.iter().map(magnitude)),
            place_um: (!places.is_empty()).then(|| 1e3 * root_mean_square(places)),
        }
    }
}

fn root_mean_square(errors: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = errors.into_iter().fold((0.0, 0), |(sum, count), error| {
        (sum + error * error, count + 1)
    });
    (sum / f64::from(count)).sqrt()
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.frames == 0 {
            return write!(
                f,
                "with fewer than five loads none can be left out: how good the model is, is not \
                 known"
            );
        }
        let place = self.place_um.map_or(String::new(), |um| {
            format!(", the place {um:.0} µm along x and y each")
        });
        let direction = self.direction_deg.map_or(String::new(), |degrees| {
            format!("direction {degrees:.2}°, ")
        });
        write!(
            f,
            "on loads left out of the fit ({} frames), root mean square: {direction}|F| {:.2} \
             mN{place}; the gauge's and the stage's own errors included",
            self.frames, self.magnitude_mn
        )?;
        match self.direction_deg {
            Some(_) => Ok(()),
            None => write!(f, "; directions and places were not noted, so not judged"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(direction_deg: f64, found_n: f64, found_mm: [f64; 2]) -> Judged {
        Judged {
            truth: [0.0, 0.0, -0.1],
            truth_polar: [0.0, 0.0, 0.1],
            found_polar: [0.0, 0.0, found_n],
            direction_deg,
            direction_sigma_deg: 1.0,
            magnitude_sigma_n: 0.001,
            tip_mm: Some([3.0, 0.0]),
            found_place: Some((found_mm, 0.01)),
            session: 0,
            pose: None,
        }
    }

    #[test]
    fn errors_are_root_mean_squares() {
        let judged = [
            judged(0.3, 0.101, [3.01, 0.0]),
            judged(0.4, 0.099, [3.0, 0.01]),
        ];
        let text = Verdict::of(&judged, None).to_string();
        for words in ["(2 frames)", "direction 0.35°", "|F| 1.00 mN", "place 7 µm"] {
            assert!(text.contains(words), "no {words}: {text}");
        }
        let free = Some(Free { direction_deg: 3.0 });
        let anywhere = judged.map(|it| Judged { tip_mm: None, ..it });
        let text = Verdict::of(&anywhere, free).to_string();
        assert!(text.contains("not judged") && !text.contains("°"), "{text}");
        assert!(
            Verdict::of(&[], None)
                .to_string()
                .contains("fewer than five loads")
        );
    }
}
