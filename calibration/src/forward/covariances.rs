//! Covariances of the images' motion around a film's tables, at even places and sizes.

use hivtac_sensor::force::forward::MOST_EQUATIONS;
use hivtac_sensor::force::model::CovarianceSpec;
use hivtac_terms::list::List;
use hivtac_twin::film::reduced::{LARGEST_SIZE, Pose};

use super::matrix::cholesky;

/// Places range to this, ±, mm.
pub const END_MM: f64 = 4.2;
/// Knots along the size, along y and along x, for a calibrated unit.
pub const KNOTS: [u8; 3] = [5, 5, 5];
/// The same where covariances do not depend on the place.
const ANYWHERE: [u8; 3] = [5, 2, 2];

/// Number of coordinates of four markers: x and y of each.
pub const OF_FOUR: usize = 8;

/// Motion of all images, x and y of each marker, focal lengths along the film's axes.
pub type Moved = List<f64, MOST_EQUATIONS>;

/// The covariance of images' motion, row by row.
pub type Covariance = Vec<Moved>;

/// No covariance of this many coordinates.
fn zeros(coordinates: usize) -> Covariance {
    vec![Moved::defaults(coordinates); coordinates]
}

/// The sum over motions of each times its transpose.
pub fn sum_of_squares(differences: &[Moved]) -> Covariance {
    let mut sum = zeros(differences.first().map_or(0, |one| one.len()));
    for difference in differences {
        for (row, a) in sum.iter_mut().zip(difference.iter()) {
            for (sum, b) in row.iter_mut().zip(difference.iter()) {
                *sum += a * b;
            }
        }
    }
    sum
}

/// The loads at this number of knots along size, y and x, without tilt, in a file's order.
pub fn knots([sizes, lines, places]: [u8; 3]) -> impl Iterator<Item = Pose> {
    let along = |k: u8, count: u8| f64::from(k) / f64::from(count - 1);
    let place = move |k: u8, count: u8| END_MM * (2.0 * along(k, count) - 1.0);
    let of_size = move |i: u8| {
        let of_line = move |j: u8| {
            (0..places).map(move |k| Pose {
                size: LARGEST_SIZE * along(i, sizes).powi(2),
                tilt: [0.0; 2],
                place_mm: [place(k, places), place(j, lines)],
            })
        };
        (0..lines).flat_map(of_line)
    };
    (0..sizes).flat_map(of_size)
}

/// Covariances given at these [`knots`], as a model file holds them.
pub fn covariances(counts: [u8; 3], knots: &[Covariance]) -> CovarianceSpec {
    let factor = |covariance: &Covariance| {
        let rows = covariance.iter().map(|row| row.to_vec());
        cholesky(rows.collect())
    };
    CovarianceSpec {
        factors: knots.iter().map(factor).collect(),
        counts,
        end_mm: END_MM as f32,
    }
}

/// Independent errors of every coordinate of four markers, the same everywhere. They grow in
/// proportion to size, to `largest` focal lengths at the largest.
pub fn even(largest: f64) -> CovarianceSpec {
    let at = |pose: &Pose| {
        let mut covariance = zeros(OF_FOUR);
        for (k, row) in covariance.iter_mut().enumerate() {
            row[k] = (largest * pose.size / LARGEST_SIZE).powi(2);
        }
        covariance
    };
    let all: Vec<Covariance> = knots(ANYWHERE).map(|pose| at(&pose)).collect();
    covariances(ANYWHERE, &all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_sensor::force::forward::{
        Covariance as ChipCovariance, CovarianceGrid, Limits, Pose as ChipPose,
    };

    /// The chip reads the covariances that were written, at knots and between them.
    #[test]
    fn a_chip_reads_what_was_written() {
        let wave = |k: usize, pose: &Pose| -> Moved {
            let [x, y] = pose.place_mm;
            Moved::from_fn(OF_FOUR, |i| {
                pose.size * (0.1 + 0.01 * x * ((i + k) as f64).sin() + 0.01 * y)
            })
        };
        let truth = |pose: &Pose| sum_of_squares(&[0, 5, 9].map(|k| wave(k, pose)));
        let all: Vec<Covariance> = knots(KNOTS).map(|pose| truth(&pose)).collect();
        let spec = covariances(KNOTS, &all);
        let mut bytes = Vec::new();
        spec.push(&mut bytes);
        let grid = CovarianceGrid::new(OF_FOUR, spec.counts, spec.end_mm, &bytes[8..]).unwrap();
        let limits = Limits {
            size: LARGEST_SIZE as f32,
            tilt: 0.6,
        };
        for (size, place_mm, part) in [
            (LARGEST_SIZE, [2.1, -4.2], 1e-4),
            (LARGEST_SIZE / 4.0, [-4.2, 0.0], 1e-4),
            (0.45, [0.3, -2.0], 0.2),
        ] {
            let pose = Pose {
                size,
                place_mm,
                ..Pose::default()
            };
            let chip = ChipPose {
                size: size as f32,
                place_mm: place_mm.map(|part| part as f32),
                ..ChipPose::default()
            };
            let (mut found, truth) = (ChipCovariance::EMPTY, truth(&pose));
            grid.put(&chip, &limits, &mut found);
            for i in 0..OF_FOUR {
                for j in 0..=i {
                    let off = f64::from(found.entry(i, j)) - truth[i][j];
                    let whole = (truth[i][i] * truth[j][j]).sqrt();
                    assert!(off.abs() < part * whole, "{pose:?} {i} {j}: {off} {whole}");
                }
            }
        }
    }
}
