//! What is swept: frame sizes, centroid estimators, networks, arithmetics, steps.

use std::fmt;

use hivtac_calibration::data::dataset::Recipe;
use hivtac_calibration::data::range::Range;
use hivtac_calibration::network::Arithmetic;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::Preset;
use serde::{Deserialize, Serialize};

/// What makes a force of features.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimator {
    /// Widths of the network's hidden layers.
    pub hidden: Vec<usize>,
}

/// How the numbers of an estimator are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Numbers {
    /// Floats: what the others are compared with. The chip runs no floats.
    F32,
    /// int16 weights, activations of 12 bits.
    Int16,
    /// int8 weights with a scale for each output, activations of 7 bits.
    Int8PerChannel,
}

/// Gauss–Newton steps from the network's answer; none: the network stands alone.
pub const STEPS: [u8; 4] = [0, 1, 2, 3];
/// The steps of the default model.
pub const USUAL_STEPS: u8 = 1;
/// Loads of the frames that are rendered, a little beyond those that are judged.
pub const RENDERED: Range = Range {
    force_n: 0.25,
    alpha_deg: 10.0,
    beta_deg: 10.0,
    place_mm: 4.2,
};
/// The largest |F|, N, and the farthest place along x and y, mm, of those that are judged.
pub const JUDGED_N: f64 = 0.2;
pub const JUDGED_MM: f64 = 4.0;
/// Both ways to take a marker's position.
pub const CENTROIDS: [CentroidEstimator; 2] = [
    CentroidEstimator::BinaryMask,
    CentroidEstimator::RednessWeighted,
];
/// Hidden layers of the paper's network.
const PAPER: [usize; 3] = [512; 3];

/// How much is swept, and how well: what results depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Columns and rows of frames.
    pub sizes: Vec<[u16; 2]>,
    /// Estimators of the force.
    pub estimators: Vec<Estimator>,
    /// A network of the paper's widths is trained for these sizes, once; for no other.
    pub paper_sizes: Vec<[u16; 2]>,
    /// Frames of each size, besides those of the untouched film.
    pub rows: usize,
    /// Parts that the frames are cut into. Each seed trains without one and is judged on it.
    pub parts: usize,
    /// Seeds; at most as many as parts.
    pub seeds: usize,
    /// Passes over the data in floats, and then with the chip's rounding for each arithmetic.
    pub epochs: [usize; 2],
    /// The same for the paper's network.
    pub paper_epochs: [usize; 2],
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            sizes: vec![[160, 120], [320, 240], [640, 480], [800, 600]],
            estimators: Estimator::all(),
            paper_sizes: vec![[320, 240]],
            rows: 10_000,
            parts: 5,
            seeds: 3,
            epochs: [150, 40],
            paper_epochs: [12, 4],
        }
    }
}

/// One training, and what comes of it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Task {
    /// Columns and rows of the frames.
    pub size: [u16; 2],
    /// How markers' positions are taken.
    pub centroid: CentroidEstimator,
    /// What is trained.
    pub estimator: Estimator,
    /// From 1.
    pub seed: usize,
}

impl Plan {
    /// The trainings for frames of a size.
    pub fn tasks(&self, size: [u16; 2]) -> Vec<Task> {
        let mut tasks = Vec::new();
        for centroid in CENTROIDS {
            for estimator in &self.estimators {
                let seeds = match (estimator.is_papers(), self.paper_sizes.contains(&size)) {
                    (false, _) => self.seeds,
                    (true, wanted) => usize::from(wanted),
                };
                tasks.extend((1..=seeds).map(|seed| Task {
                    size,
                    centroid,
                    estimator: estimator.clone(),
                    seed,
                }));
            }
        }
        tasks
    }

    /// Passes of a training: in floats, and with each rounding.
    pub fn epochs_of(&self, estimator: &Estimator) -> [usize; 2] {
        match estimator.is_papers() {
            true => self.paper_epochs,
            false => self.epochs,
        }
    }
}

impl Estimator {
    /// All that are swept.
    pub fn all() -> Vec<Self> {
        let widths: [&[usize]; 5] = [&[16; 2], &[32; 2], &[64; 2], &[128; 2], &PAPER];
        let network = |hidden: &[usize]| Self {
            hidden: hidden.to_vec(),
        };
        widths.into_iter().map(network).collect()
    }

    /// Whether it is the paper's network.
    pub fn is_papers(&self) -> bool {
        self.hidden == PAPER
    }

    /// Its model's name among the counted costs; `None` where the chip does not run it.
    pub fn cost_name(&self, numbers: Numbers) -> Option<String> {
        match numbers {
            Numbers::F32 => None,
            Numbers::Int16 => Some(format!("{self} int16")),
            Numbers::Int8PerChannel => Some(format!("{self} int8")),
        }
    }
}

impl Numbers {
    /// All of them.
    pub const ALL: [Numbers; 3] = [Numbers::F32, Numbers::Int16, Numbers::Int8PerChannel];

    /// The same as the trainer has it; `None` for what is no arithmetic of a network on the chip.
    pub fn arithmetic(self) -> Option<Arithmetic> {
        match self {
            Numbers::F32 => None,
            Numbers::Int16 => Some(Arithmetic::Int16),
            Numbers::Int8PerChannel => Some(Arithmetic::Int8PerChannel),
        }
    }
}

/// Lens and camera for frames of a size: the sensor's own, or the paper's for its 800×600, which no
/// supported camera has.
pub fn preset(size: [u16; 2]) -> Preset {
    if size == [800, 600] {
        Preset::Paper
    } else {
        Preset::Ov7725
    }
}

/// Whether a supported camera delivers frames of a size: the OV7725 does up to 640×480.
pub fn has_camera(size: [u16; 2]) -> bool {
    preset(size) == Preset::Ov7725
}

/// The size of the frames that the firmware captures.
pub fn firmware_size() -> [u16; 2] {
    let recipe = Recipe::default();
    [recipe.width, recipe.height]
}

impl fmt::Display for Estimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let widths: Vec<String> = self.hidden.iter().map(usize::to_string).collect();
        f.write_str(&widths.join("-"))
    }
}

impl fmt::Display for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Numbers::F32 => "f32",
            Numbers::Int16 => "int16",
            Numbers::Int8PerChannel => "int8 per channel",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_network_is_trained_once_for_one_size() {
        let plan = Plan::default();
        let papers = |size| {
            let tasks = plan.tasks(size);
            tasks.iter().filter(|t| t.estimator.is_papers()).count()
        };
        assert_eq!(
            [[160, 120], [320, 240], [640, 480], [800, 600]].map(papers),
            [0, 2, 0, 0]
        );
        assert_eq!(plan.tasks([640, 480]).len(), 2 * 4 * 3);
    }

    #[test]
    fn names_are_those_of_the_counted_models() {
        let names: Vec<_> = Estimator::all()
            .iter()
            .map(|e| e.cost_name(Numbers::Int16).unwrap())
            .collect();
        assert_eq!(
            names,
            [
                "16-16 int16",
                "32-32 int16",
                "64-64 int16",
                "128-128 int16",
                "512-512-512 int16"
            ]
        );
        assert_eq!(Estimator::all()[0].cost_name(Numbers::F32), None);
    }
}
