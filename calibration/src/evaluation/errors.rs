//! Sums up errors of forces and places.

use crate::data::loads::norm;

/// Below this |F|, N, direction errors are reported separately, as in the paper's Section 7.
pub const WEAK_N: f64 = 0.05;

/// Collected errors; forces in N, film frame.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    directions_deg: Vec<f64>,
    strong_directions_deg: Vec<f64>,
    magnitude: MeanSquare,
    lateral: MeanSquare,
    place: MeanSquare,
}

#[derive(Clone, Copy, Debug, Default)]
struct MeanSquare {
    sum: f64,
    count: usize,
}

impl MeanSquare {
    fn add(&mut self, error: f64) {
        self.sum += error * error;
        self.count += 1;
    }

    fn root(&self) -> f64 {
        if self.count == 0 {
            f64::NAN
        } else {
            (self.sum / self.count as f64).sqrt()
        }
    }
}

impl Errors {
    /// Adds a force with its truth. A force of size 0 has no direction, and adds no direction
    /// error.
    pub fn add(&mut self, found: [f64; 3], truth: [f64; 3]) {
        self.magnitude.add(norm(found) - norm(truth));
        self.lateral.add(found[0] - truth[0]);
        self.lateral.add(found[1] - truth[1]);
        if let Some(angle) = angle_deg(found, truth) {
            self.directions_deg.push(angle);
            if norm(truth) >= WEAK_N {
                self.strong_directions_deg.push(angle);
            }
        }
    }

    /// Adds a place with its truth, mm; both coordinates count.
    pub fn add_place(&mut self, found_mm: [f64; 2], truth_mm: [f64; 2]) {
        for (found, truth) in found_mm.iter().zip(truth_mm) {
            self.place.add(found - truth);
        }
    }

    /// Root mean square error of a place's coordinates, mm; `None` without places.
    pub fn place_rmse_mm(&self) -> Option<f64> {
        (self.place.count > 0).then(|| self.place.root())
    }

    /// Number of forces.
    pub fn count(&self) -> usize {
        self.magnitude.count
    }

    /// Mean angle between found and true force, degrees; NaN without one.
    pub fn mean_direction_deg(&self) -> f64 {
        mean(self.directions_deg.iter().copied())
    }

    /// The same for true forces of at least [`WEAK_N`].
    pub fn mean_strong_direction_deg(&self) -> f64 {
        mean(self.strong_directions_deg.iter().copied())
    }

    /// Number of true forces of at least [`WEAK_N`].
    pub fn strong_count(&self) -> usize {
        self.strong_directions_deg.len()
    }

    /// Root mean square error of |F|, N.
    pub fn magnitude_rmse_n(&self) -> f64 {
        self.magnitude.root()
    }

    /// Root mean square error of F_x and F_y, N.
    pub fn lateral_rmse_n(&self) -> f64 {
        self.lateral.root()
    }
}

/// The mean of some values; NaN without values.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    sum / count
}

/// The angle between two forces in degrees, exact for small ones as well; `None` if one has size 0.
pub fn angle_deg(a: [f64; 3], b: [f64; 3]) -> Option<f64> {
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let sized = norm(a) > 0.0 && norm(b) > 0.0;
    sized.then(|| libm::atan2(norm(cross), dot).to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_between_vectors() {
        assert_eq!(angle_deg([0.0, 0.0, -1.0], [0.0, 2.0, 0.0]), Some(90.0));
        assert_eq!(angle_deg([0.0, 0.0, -1.0], [0.0, 0.0, 3.0]), Some(180.0));
        let small = angle_deg([1e-6, 0.0, -1.0], [0.0, 0.0, -0.1]).unwrap();
        assert!((small - 1e-6_f64.to_degrees()).abs() < 1e-15);
        assert_eq!(angle_deg([0.0; 3], [0.0, 0.0, -1.0]), None);
    }

    #[test]
    fn errors_are_summed_by_kind() {
        let mut errors = Errors::default();
        errors.add([0.0, 0.0, -0.1], [0.0, 0.0, -0.1]);
        errors.add([0.02, 0.0, -0.02], [0.0, 0.0, -0.02]);
        errors.add([0.0, 0.0, -0.003], [0.0; 3]);
        assert_eq!(errors.place_rmse_mm(), None);
        errors.add_place([1.0, 2.0], [1.3, 1.6]);
        assert!((errors.place_rmse_mm().unwrap() - 0.125_f64.sqrt()).abs() < 1e-12);
        assert_eq!((errors.count(), errors.strong_count()), (3, 1));
        assert!((errors.mean_direction_deg() - 22.5).abs() < 1e-12);
        assert_eq!(errors.mean_strong_direction_deg(), 0.0);
        assert!((errors.lateral_rmse_n() - 0.02 / 6_f64.sqrt()).abs() < 1e-12);
    }
}
