//! The table of how the images of a layout's dots move, at knots of the place that is pressed, as
//! `sensor/src/force/forward/motions.rs` reads it.

use super::LeastSquares;
use super::covariances::Moved;
use super::presses::{END_MM, KNOTS};

/// A table before its numbers are rounded.
pub struct MotionsSpec {
    /// Columns: group, power of the size, power of the second variable.
    pub columns: Vec<[u8; 3]>,
    /// By knot and column, of all coordinates, focal lengths.
    pub knots: Vec<Vec<Moved>>,
}

impl MotionsSpec {
    /// The place along +x and +y, mm, of each knot.
    pub fn places_mm() -> Vec<[f64; 2]> {
        let along = |k: u8| END_MM * f64::from(k) / f64::from(KNOTS - 1);
        let line = |y: u8| (0..KNOTS).map(move |x| [along(x), along(y)]);
        (0..KNOTS).flat_map(line).collect()
    }

    /// The columns that fit the motions under some loads, the samples of `through`, best.
    pub fn columns(through: &LeastSquares, samples: &[Moved]) -> Vec<Moved> {
        let coordinates = samples[0].len();
        let fitted = (0..coordinates).map(|c| {
            let samples: Vec<f64> = samples.iter().map(|moved| moved[c]).collect();
            through.coefficients(&samples)
        });
        let fitted: Vec<_> = fitted.collect();
        let column = |k: usize| Moved::from_fn(coordinates, |c| fitted[c][k]);
        (0..fitted[0].len()).map(column).collect()
    }

    /// The bytes of the table. A column's step is the largest of its entries over 32,767.
    pub fn to_bytes(&self) -> Vec<u8> {
        let coordinates = self.knots[0][0].len();
        let largest = |number: usize| {
            let entries = self.knots.iter().flat_map(|knot| knot[number].iter());
            entries.fold(0.0, |most: f64, entry| most.max(entry.abs()))
        };
        let steps = (0..self.columns.len()).map(|number| largest(number) / 32_767.0);
        let steps: Vec<f64> = steps.collect();
        let mut bytes = vec![KNOTS, coordinates as u8, self.columns.len() as u8, 0];
        bytes.extend((END_MM as f32).to_le_bytes());
        for ([group, of_size, of_second], step) in self.columns.iter().zip(&steps) {
            bytes.extend([*group, *of_size, *of_second, 0]);
            bytes.extend((*step as f32).to_le_bytes());
        }
        for knot in &self.knots {
            for (column, step) in knot.iter().zip(&steps) {
                for entry in column.iter() {
                    bytes.extend(((entry / step).round() as i16).to_le_bytes());
                }
            }
        }
        bytes
    }
}
