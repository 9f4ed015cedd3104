//! Sums the errors of one kind of presses.

use anyhow::{Context, Result};
use hivtac_calibration::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_sensor::force::Force;
use serde::Serialize;

use super::presses::Press;

/// What the sensor made of the frames of a kind of presses.
#[derive(Debug, Default, Serialize)]
pub struct Row {
    kind: String,
    presses: u32,
    frames: u32,
    /// Frames without a force.
    refused: u32,
    /// Sums over frames with a force: of squares of the direction's error, degrees; of |F|'s, in
    /// parts of the true size; of the place's, mm.
    squares: [f64; 3],
    /// Sum of the errors of |F|, in parts of the true size.
    stronger: f64,
    /// Frames with errors within their stated 95 % bounds, of the same three.
    within: [u32; 3],
}

impl Row {
    /// Returns a row without presses.
    pub fn new(kind: String) -> Row {
        Row {
            kind,
            ..Row::default()
        }
    }

    /// Counts a press.
    pub fn begin_press(&mut self) {
        self.presses += 1;
    }

    /// Adds a frame of a press; `None` if the sensor refused it.
    ///
    /// # Errors
    /// If the force has no place.
    pub fn add(&mut self, force: Option<&Force>, press: &Press) -> Result<()> {
        self.frames += 1;
        let Some(force) = force else {
            self.refused += 1;
            return Ok(());
        };
        let place = force.place.context("the model tells no places")?;
        let [x, y] = [place.x, place.y].map(|part| f64::from(part.0) * 1e-3);
        let size_n = press
            .force_n
            .iter()
            .map(|part| part * part)
            .sum::<f64>()
            .sqrt();
        let found = force.cartesian.map(|part| f64::from(part.0));
        let stronger = f64::from(force.magnitude.0) * 1e-6 / size_n - 1.0;
        let errors = [
            angle_deg(found, press.force_n).unwrap_or(180.0),
            stronger.abs(),
            (x - press.centre_mm[0]).hypot(y - press.centre_mm[1]),
        ];
        let bounds = [
            DIRECTION_BOUND * f64::from(force.direction_sigma.0) * 1e-3,
            MAGNITUDE_BOUND * f64::from(force.magnitude_sigma.0) * 1e-6 / size_n,
            PLACE_BOUND * f64::from(place.sigma.0) * 1e-3,
        ];
        self.stronger += stronger;
        for k in 0..3 {
            self.squares[k] += errors[k] * errors[k];
            self.within[k] += u32::from(errors[k] <= bounds[k]);
        }
        Ok(())
    }

    fn line(&self) -> String {
        let refused = 100.0 * f64::from(self.refused) / f64::from(self.frames);
        let before = format!("| {} | {} | {refused:.0} % |", self.kind, self.presses);
        let told = f64::from(self.frames - self.refused);
        if told == 0.0 {
            return format!("{before} – | – | – | – |\n");
        }
        let [direction, size, place] = self.squares.map(|sum| (sum / told).sqrt());
        let [a, b, c] = self.within.map(|within| 100.0 * f64::from(within) / told);
        format!(
            "{before} {direction:.2}° | {:+.1} %, {:.1} % | {place:.3} mm | {a:.0}, {b:.0}, \
             {c:.0} % |\n",
            100.0 * self.stronger / told,
            100.0 * size
        )
    }
}

/// Returns the table of all kinds.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| what presses | presses | refused | direction, rms | \\|F\\|, mean and rms | place, rms \
         | within the stated 95 %: direction, \\|F\\|, place |\n|---|--:|--:|--:|--:|--:|--:|\n",
    );
    text.extend(rows.iter().map(Row::line));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_that_is_always_refused_has_no_errors() {
        let row = Row {
            presses: 2,
            frames: 4,
            refused: 4,
            ..Row::new("pad".into())
        };
        assert_eq!(row.line(), "| pad | 2 | 100 % | – | – | – | – |\n");
        assert_eq!(table(&[row]).lines().count(), 3);
    }
}
