//! Limits of the residual: χ² with as many degrees of freedom as there are coordinates beyond the
//! five unknowns. Few undisturbed frames exceed them.

use super::solve::UNKNOWNS;

/// χ² that 1 of 2,000, 1 of 100 and 1 of 6 undisturbed frames exceed, by the number of markers from
/// 4 on.
const LIMITS: [[f32; 3]; 13] = [
    [17.7, 11.3, 5.0],
    [22.1, 15.1, 7.8],
    [26.0, 18.5, 10.4],
    [29.7, 21.7, 12.9],
    [33.1, 24.7, 15.4],
    [36.5, 27.7, 17.8],
    [39.7, 30.6, 20.1],
    [42.9, 33.4, 22.5],
    [46.0, 36.2, 24.8],
    [49.0, 38.9, 27.1],
    [52.0, 41.6, 29.4],
    [55.0, 44.3, 31.7],
    [57.9, 47.0, 34.0],
];

/// The row of this number of coordinates, or of the nearest number.
fn limits(coordinates: usize) -> [f32; 3] {
    let last = LIMITS.len() - 1;
    let row = (coordinates / 2).saturating_sub(4).min(last);
    LIMITS.get(row).copied().unwrap_or_default()
}

/// Largest residual, relative to its variance, of a load that explains the markers: 1 of 2,000
/// undisturbed frames exceeds it.
pub fn unexplained(coordinates: usize) -> f32 {
    limits(coordinates)[0]
}

/// With a larger residual, the steps may be stuck where the tables bend: 1 of 100 undisturbed
/// frames exceeds it.
pub fn stuck(coordinates: usize) -> f32 {
    limits(coordinates)[1]
}

/// 1 of 6 frames exceeds this. A larger residual is taken for noise that is larger than the model
/// says.
pub fn usual(coordinates: usize) -> f32 {
    limits(coordinates)[2]
}

/// Number of coordinates that are left over.
pub fn left_over(coordinates: usize) -> usize {
    coordinates.saturating_sub(UNKNOWNS)
}
