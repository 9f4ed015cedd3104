//! Errors of the frames that everyone accepts.

use hivtac_calibration::data::loads::norm;
use hivtac_calibration::evaluation::errors::{WEAK_N, angle_deg, mean};

use super::models::Answers;

/// Means over frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    /// Mean angle between found and true force, degrees.
    pub direction_deg: f64,
    /// The same where |F| ≥ 50 mN.
    pub strong_deg: f64,
    /// Root mean square error of |F|, N.
    pub force_rmse_n: f64,
}

impl Sums {
    /// Of some of the frames. An answer without size has no direction: it is as far off as one can
    /// be on average.
    pub fn of(answers: &Answers, frames: &[usize]) -> Self {
        let known = || frames.iter().filter_map(|&i| answers[i]);
        let angle = |[truth, found]: [[f64; 3]; 2]| angle_deg(found, truth).unwrap_or(90.0);
        let strong = |[truth, _]: &[[f64; 3]; 2]| norm(*truth) >= WEAK_N;
        let square = |[truth, found]: [[f64; 3]; 2]| (norm(found) - norm(truth)).powi(2);
        Self {
            direction_deg: mean(known().map(angle)),
            strong_deg: mean(known().filter(strong).map(angle)),
            force_rmse_n: mean(known().map(square)).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_chosen_frames_count() {
        let down = |n: f64| [0.0, 0.0, -n];
        let answers = vec![
            Some([down(0.1), [0.0, 0.1, -0.1]]),
            None,
            Some([down(0.02), down(0.03)]),
            Some([down(0.1), down(0.1)]),
        ];
        let sums = Sums::of(&answers, &[0, 2]);
        assert!((sums.direction_deg - 22.5).abs() < 1e-12);
        assert!((sums.strong_deg - 45.0).abs() < 1e-12);
        let expected = (((0.02_f64.sqrt() - 0.1).powi(2) + 1e-4) / 2.0).sqrt();
        assert!((sums.force_rmse_n - expected).abs() < 1e-12);
        assert_eq!(Sums::of(&answers, &[3]).direction_deg, 0.0);
        assert_eq!(
            Sums::of(&vec![Some([down(0.1), [0.0; 3]])], &[0]).strong_deg,
            90.0
        );
    }
}
