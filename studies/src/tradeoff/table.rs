//! Accuracy and cost of every configuration, side by side.

use std::fmt;

use anyhow::Result;
use hivtac_terms::conditions::CentroidEstimator;

use super::costs::{Behind, Cost, Costs};
use super::plan::{Estimator, Numbers, firmware_size, has_camera};
use super::results::{Figures, Finished, Results};

/// A mean over seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Half of the interval that holds the true mean with 95 %, by Student's t; none of a single
    /// seed.
    pub half_width: Option<f64>,
}

/// One configuration: what it is, how accurate it is (simulated), what it costs.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// Columns and rows of a frame.
    pub size: [u16; 2],
    /// How markers' positions are taken.
    pub centroid: CentroidEstimator,
    /// What makes a force of features.
    pub estimator: Estimator,
    /// How its numbers are held.
    pub numbers: Numbers,
    /// Gauss–Newton steps from its answer, at the least; 0: it stands alone.
    pub steps: u8,
    /// How often the film is run forwards for a force, on average.
    pub looks: f64,
    /// Mean angle between found and true force, degrees.
    pub direction_deg: Mean,
    /// The same from 50 mN up.
    pub strong_direction_deg: Mean,
    /// Root mean square error of |F|, mN.
    pub force_rmse_mn: Mean,
    /// Root mean square error of each coordinate of the place from 50 mN up, µm.
    pub place_rmse_um: Mean,
    /// Frames that no single contact explains, in parts of those that are judged.
    pub unexplained: f64,
    /// The worst over all seeds: direction from 50 mN up (degrees), |F| (mN).
    pub worst: [f64; 2],
    /// Cost on the chip; none of floats.
    pub cost: Option<Cost>,
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            size: [width, height],
            estimator,
            numbers,
            steps,
            ..
        } = self;
        let centroid = words(self.centroid);
        write!(
            f,
            "{estimator} ({numbers}) with {steps} step{} on {centroid} centroids of \
             {width}×{height}",
            if *steps == 1 { "" } else { "s" }
        )
    }
}

/// A centroid estimator in a word.
pub fn words(centroid: CentroidEstimator) -> &'static str {
    match centroid {
        CentroidEstimator::BinaryMask => "binary",
        CentroidEstimator::RednessWeighted => "weighted",
    }
}

/// How far a configuration is from use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reach {
    /// Not at all: the chip runs no floats, or no supported camera has the size.
    None,
    /// A supported camera delivers it, but the firmware captures frames of another size.
    Camera,
    /// The firmware does it.
    Firmware,
}

impl Configuration {
    /// How far it is from use.
    pub fn reach(&self) -> Reach {
        match &self.cost {
            Some(_) if self.size == firmware_size() => Reach::Firmware,
            Some(_) if has_camera(self.size) => Reach::Camera,
            _ => Reach::None,
        }
    }
}

/// Every configuration of a sweep's results.
///
/// # Errors
/// When a part of one was not counted.
pub fn configurations(results: &Results, costs: &Costs) -> Result<Vec<Configuration>> {
    let mut configurations = Vec::new();
    // Sorted by task: the seeds of one training follow each other.
    let same = |a: &Finished, b: &Finished| {
        (a.task.size, a.task.centroid, &a.task.estimator)
            == (b.task.size, b.task.centroid, &b.task.estimator)
    };
    for seeds in results.finished.chunk_by(same) {
        let task = &seeds[0].task;
        for (i, (numbers, steps, _)) in seeds[0].figures.iter().enumerate() {
            let figures: Vec<Figures> = seeds.iter().map(|seed| seed.figures[i].2).collect();
            let looks = mean(&figures, |f| f.looks).value;
            let behind = Behind {
                estimator: &task.estimator,
                numbers: *numbers,
                looks,
            };
            let cost = costs.of(task.size, task.centroid, behind)?;
            configurations.push(Configuration {
                size: task.size,
                centroid: task.centroid,
                estimator: task.estimator.clone(),
                numbers: *numbers,
                steps: *steps,
                looks,
                direction_deg: mean(&figures, |f| f.direction_deg),
                strong_direction_deg: mean(&figures, |f| f.strong_direction_deg),
                force_rmse_mn: mean(&figures, |f| f.force_rmse_mn),
                place_rmse_um: mean(&figures, |f| f.place_rmse_um),
                unexplained: unexplained(&figures),
                worst: [
                    largest(&figures, |f| f.worst_direction_deg),
                    largest(&figures, |f| f.worst_force_mn),
                ],
                cost,
            });
        }
    }
    Ok(configurations)
}

fn unexplained(figures: &[Figures]) -> f64 {
    let refused: usize = figures.iter().map(|f| f.unexplained).sum();
    let judged: usize = figures.iter().map(|f| f.frames + f.unexplained).sum();
    refused as f64 / judged as f64
}

fn largest(figures: &[Figures], of: impl Fn(&Figures) -> f64) -> f64 {
    figures.iter().map(of).fold(0.0, f64::max)
}

fn mean(figures: &[Figures], of: impl Fn(&Figures) -> f64) -> Mean {
    let count = figures.len() as f64;
    let value = figures.iter().map(&of).sum::<f64>() / count;
    let squares: f64 = figures.iter().map(|f| (of(f) - value).powi(2)).sum();
    let half_width = student(figures.len()).map(|t| t * (squares / (count - 1.0) / count).sqrt());
    Mean { value, half_width }
}

/// Student's t for 95 %, both sides, of a mean of so many.
fn student(count: usize) -> Option<f64> {
    const T: [f64; 9] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262,
    ];
    let freedom = count.checked_sub(2)?;
    Some(T.get(freedom).copied().unwrap_or(2.228))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(direction: f64) -> Figures {
        Figures {
            frames: 100,
            direction_deg: direction,
            strong_direction_deg: direction,
            force_rmse_mn: direction,
            place_rmse_um: 100.0 * direction,
            unexplained: 25,
            looks: 2.0,
            worst_direction_deg: direction,
            worst_force_mn: direction,
        }
    }

    #[test]
    fn intervals_are_students() {
        let three: Vec<_> = [0.9, 1.0, 1.1].map(figures).to_vec();
        let Mean { value, half_width } = mean(&three, |f| f.direction_deg);
        assert!((value - 1.0).abs() < 1e-12);
        // s = 0.1, over the square root of three.
        assert!((half_width.unwrap() - 4.303 * 0.1 / 3_f64.sqrt()).abs() < 1e-9);
        assert_eq!(mean(&three[..1], |f| f.direction_deg).half_width, None);
        assert!((unexplained(&three) - 0.2).abs() < 1e-12);
        assert!((largest(&three, |f| f.worst_force_mn) - 1.1).abs() < 1e-12);
    }
}
