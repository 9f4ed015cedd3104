//! The model file: a quantized network with its input scaling, the film run forwards, and the
//! conditions they were made under.
//!
//! [`Model::parse`] reads a file in place, from flash or from memory, without copying, and proves
//! it sound before it can be used. It may lie anywhere; kernels run one that lies at a multiple of
//! four ([`AlignedFile`]). Feature `encode` adds the writer, `encode::ModelSpec`. Both follow
//! `docs/model-file.md`.

mod aligned;
#[cfg(any(test, feature = "encode"))]
pub mod encode;
mod error;
mod forward;
mod layer;
#[cfg(test)]
mod layer_tests;
mod layers;
mod layout;
mod packing;
mod place;
mod reader;
#[cfg(test)]
pub(crate) mod samples;
#[cfg(test)]
mod tests;
mod uncertainty;

pub use aligned::AlignedFile;
pub use error::ModelError;
#[cfg(any(test, feature = "encode"))]
pub use forward::{ForwardSpec, TableSpec};
pub use layer::{Layer, Row};
pub use packing::{
    MAX_ACTIVATION8, MAX_ACTIVATION16, MAX_WEIGHT8, MAX_WEIGHT16, ROWS_TOGETHER, WeightWidth,
};
pub(crate) use packing::{unpack8, unpack16};
pub(crate) use uncertainty::{LARGEST_PLACE_UNCERTAINTY, NO_DIRECTION};
pub use uncertainty::{LARGEST_UNCERTAINTY, Uncertainty, UncertaintyKnot};

use crate::{
    features::{FEATURES, Features},
    forward::Forward,
    geometry::{Geometry, Preset},
    markers::pattern::{Pattern, distance},
    threshold::Threshold,
    units::{MicroNewtons, Micrometres, MilliDegrees, Px},
};
use core::fmt::Write;

/// The widest layer a model may have, and the size of the network's two activation buffers.
pub const MAX_WIDTH: usize = 512;
/// The most layers a model may have.
pub const MAX_LAYERS: usize = 8;
/// The longest side of a picture, px.
const LARGEST_SIDE: i32 = 800;
/// Outputs that say a force, the first ones of every model.
pub const OUTPUTS: usize = 3;
/// Outputs that say where the tip is, after those of the force.
pub const PLACE_OUTPUTS: usize = 2;

/// A model, borrowed from the bytes of its file and proven sound.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    /// What it was made for; a frame made under other conditions has no force.
    pub conditions: Conditions,
    /// The rest position of the sensor it was made on.
    pub rest: Rest,
    /// How features become the network's input.
    pub input: InputScaling,
    /// What the outputs are.
    pub output: OutputKind,
    /// The forces it was trained or calibrated on.
    pub range: CalibratedRange,
    /// How well it knows them.
    pub uncertainty: Uncertainty,
    /// The film run forwards, which betters the network's answer.
    pub forward: Option<Forward<'a>>,
    crc: u32,
    layers: [Layer<'a>; MAX_LAYERS],
    layer_count: usize,
}

/// Everything about a frame that changes its features, and what the labels of the training meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Conditions {
    /// The name of the geometry.
    pub preset: Preset,
    /// Lens, frame and markers.
    pub geometry: Geometry,
    /// The threshold that made the mask, and with that the pixel format.
    pub threshold: Threshold,
    /// 3×3 dilations of the mask, 0–3.
    pub dilations: u8,
    /// How a marker's position is taken from its pixels.
    pub centroid: CentroidEstimator,
    /// What α and β label.
    pub contact: ContactReading,
    /// Where the training data came from.
    pub origin: Origin,
}

/// How a marker's position is taken from its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CentroidEstimator {
    /// The mean of its pixels in the mask (the paper's).
    BinaryMask,
    /// The mean of the same pixels, each weighted with how much of it a marker covers
    /// ([`Pixels::weight`]): by the [`redness`](crate::tables::redness) of RGB565, the Cr of
    /// YUV422, the luma of mono.
    ///
    /// [`Pixels::weight`]: crate::tables::Pixels::weight
    RednessWeighted,
}

/// What α and β label.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContactReading {
    /// The direction of the force on the film.
    Force,
    /// The pressing direction of a tip that sticks to the film: not the force's.
    Stick,
    /// The pressing direction of a tip that slips on the film: not the force's.
    Slip,
}

/// Where the training data came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Origin {
    /// A simulated sensor.
    Simulated,
    /// The sensor whose microcontroller has this 96-bit unique number.
    Unit([u8; 12]),
}

/// A rest position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rest {
    /// Features of the untouched film.
    pub features: Features,
    /// Areas of its markers 0–3 in the mask, px.
    pub areas: [u32; 4],
}

/// x_i = sat16(rescale(f_i − tare_i + rest_i − mean_i, m_i, s_i)), in units of σ_i / 4096.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct InputScaling {
    /// Means of the training data.
    pub mean: Features,
    /// m_i, 1 to 2²⁴ − 1.
    pub multipliers: [u32; FEATURES],
    /// s_i, 1–62.
    pub shifts: [u8; FEATURES],
}

/// What the outputs of the last layer are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OutputKind {
    /// Fx, Fy, Fz in µN.
    ForceVector,
    /// α and β in thousandths of a degree, |F| in µN.
    AnglesMagnitude,
    /// Fx, Fy, Fz in µN, and p_x, p_y in µm: the point of the film that the tip is on, by where it
    /// rests, film frame.
    ForceAndPlace,
}

impl OutputKind {
    /// How many outputs there are: 3, or 5 with a place.
    pub const fn count(self) -> usize {
        match self {
            OutputKind::ForceVector | OutputKind::AnglesMagnitude => OUTPUTS,
            OutputKind::ForceAndPlace => OUTPUTS + PLACE_OUTPUTS,
        }
    }

    /// Whether the place of the tip is among them.
    pub const fn tells_place(self) -> bool {
        matches!(self, OutputKind::ForceAndPlace)
    }
}

/// The forces a model was trained or calibrated on: 0 to `magnitude`, both angles and both
/// coordinates of the place to ± their limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CalibratedRange {
    /// Largest |F|, > 0.
    pub magnitude: MicroNewtons,
    /// Largest |α|, 0–90°.
    pub alpha: MilliDegrees,
    /// Largest |β|, 0–90°.
    pub beta: MilliDegrees,
    /// Largest |p_x| and |p_y|, 1 to 1,000,000 µm; 0 in a model that does not tell places.
    pub place: Micrometres,
}

impl Rest {
    /// Whether it can be a rest position: inside the largest picture, with markers of at least a
    /// pixel.
    pub fn is_sound(&self) -> bool {
        let inside = |px: Px| (0..=LARGEST_SIDE << Px::FRACTION_BITS).contains(&px.0);
        let largest = (LARGEST_SIDE * LARGEST_SIDE) as u32;
        self.features
            .centroids
            .iter()
            .all(|c| inside(c.0) && inside(c.1))
            && self.areas.iter().all(|area| (1..=largest).contains(area))
    }

    /// Whether the markers are as far from their common centre as a film at rest shows them, to
    /// 15 %. That leaves room for a film 1.5 mm nearer or farther and for markers 0.7 mm off their
    /// places, and refuses a film that something presses: every force against such a rest would be
    /// wrong.
    pub fn fits(&self, geometry: &Geometry) -> bool {
        let center = Pattern::of_centroids(self.features.centroids).center;
        let sum: i64 = self
            .features
            .centroids
            .iter()
            .map(|&centroid| i64::from(distance(centroid, center).0))
            .sum();
        let expected = 4 * i64::from(geometry.rest_distance().0);
        (sum - expected).abs() * 100 <= expected * 15
    }
}

impl<'a> Model<'a> {
    /// Reads and proves a model file.
    ///
    /// # Errors
    /// [`ModelError`] says what is wrong and where: not a model file, another version, cut or
    /// damaged, a value outside its range, or a row of weights whose sum could overflow.
    pub fn parse(bytes: &'a [u8]) -> Result<Model<'a>, ModelError> {
        layout::parse(bytes)
    }

    /// The model's identity: the CRC-32 of its file.
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// Its layers, first to last: at least one.
    pub fn layers(&self) -> &[Layer<'a>] {
        &self.layers[..self.layer_count]
    }

    /// True when its file lies at a multiple of four, so that kernels can run it. Every layer then
    /// lies so, too.
    pub fn is_aligned(&self) -> bool {
        let lies_so = |layer: &Layer<'_>| layer.weights.as_ptr().cast::<u32>().is_aligned();
        self.layers().iter().all(lies_so)
    }

    /// True when the training data was simulated.
    pub fn is_simulated(&self) -> bool {
        self.conditions.origin == Origin::Simulated
    }

    /// Layer widths and preset, such as `11-64-64-5 ov7725`; cut after 32 bytes.
    pub fn name(&self) -> heapless::String<32> {
        let mut name = heapless::String::new();
        // A full string keeps what it has: the end of a very long name is cut.
        let _ = write!(name, "{FEATURES}");
        for layer in self.layers() {
            let _ = write!(name, "-{}", layer.outputs());
        }
        let _ = write!(name, " {}", self.conditions.preset.name());
        name
    }
}
