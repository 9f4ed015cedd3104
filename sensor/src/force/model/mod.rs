//! Holds the model file: a quantized network with its input scaling, the forward model, and the
//! conditions that they were made for.
//!
//! [`Model::parse`] reads a file in place, from flash or from memory, without copying, and proves
//! it sound before use. The file may lie at any address; kernels run it if that is a multiple of
//! four ([`AlignedFile`]). Feature `encode` adds the writer, `encode::ModelSpec`. Both follow
//! `docs/model-file.md`.

mod aligned;
mod conditions;
#[cfg(any(test, feature = "encode"))]
pub mod encode;
mod error;
mod forward;
#[cfg(test)]
mod layer_tests;
mod layers;
mod layout;
mod place;
mod reader;
#[cfg(any(test, feature = "samples"))]
#[doc(hidden)]
pub mod samples;
#[cfg(test)]
mod tests;
mod uncertainty;

pub use aligned::AlignedFile;
pub use conditions::{Conditions, Origin};
pub use error::ModelError;
#[cfg(any(test, feature = "encode"))]
pub use forward::{
    CovarianceSpec, ForwardSpec, OthersSpec, ShapesSpec, TableSpec, TablesSpec, WeightSpec,
};
pub(crate) use uncertainty::{LARGEST_PLACE_UNCERTAINTY, NO_DIRECTION};
pub use uncertainty::{LARGEST_UNCERTAINTY, Uncertainty, UncertaintyKnot};

use crate::force::features::{FEATURES, Features};
use crate::force::forward::Forward;
use crate::force::layer::Layer;
use crate::force::rest::Rest;
use core::fmt::Write;
use hivtac_terms::units::{MicroNewtons, Micrometres, MilliDegrees};

/// The most layers a model may have.
pub const MAX_LAYERS: usize = 8;
/// Number of outputs that give the force, the first ones of every model.
pub const OUTPUTS: usize = 3;
/// Number of outputs that give the tip's place, after those of the force.
pub const PLACE_OUTPUTS: usize = 2;

/// A model, borrowed from the bytes of its file and proven sound.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    /// The conditions that it was made for; a frame made under others has no force.
    pub conditions: Conditions,
    /// The rest position of the sensor it was made on.
    pub rest: Rest,
    /// How features become the network's input.
    pub input: InputScaling,
    /// The meaning of the outputs.
    pub output: OutputKind,
    /// The forces it was trained or calibrated on.
    pub range: CalibratedRange,
    /// How uncertain its forces are.
    pub uncertainty: Uncertainty,
    /// The forward model, which improves the network's answer.
    pub forward: Option<Forward<'a>>,
    crc: u32,
    layers: [Layer<'a>; MAX_LAYERS],
    layer_count: usize,
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

impl Default for InputScaling {
    /// For a model without layers.
    fn default() -> InputScaling {
        InputScaling {
            mean: Features::default(),
            multipliers: [1; FEATURES],
            shifts: [1; FEATURES],
        }
    }
}

/// The meaning of the last layer's outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OutputKind {
    /// Fx, Fy, Fz in µN.
    ForceVector,
    /// α and β in thousandths of a degree, |F| in µN.
    AnglesMagnitude,
    /// Fx, Fy, Fz in µN, and p_x, p_y in µm: the point of the film under the tip, named by its
    /// position at rest, film frame.
    ForceAndPlace,
}

impl OutputKind {
    /// Number of outputs: 3, or 5 with a place.
    pub const fn count(self) -> usize {
        match self {
            OutputKind::ForceVector | OutputKind::AnglesMagnitude => OUTPUTS,
            OutputKind::ForceAndPlace => OUTPUTS + PLACE_OUTPUTS,
        }
    }

    /// Returns whether the outputs include the tip's place.
    pub const fn tells_place(self) -> bool {
        matches!(self, OutputKind::ForceAndPlace)
    }
}

/// The forces that a model was trained or calibrated on: |F| from 0 to `magnitude`, both angles and
/// both coordinates of the place within ± their limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CalibratedRange {
    /// Largest |F|, > 0.
    pub magnitude: MicroNewtons,
    /// Largest |α|, 0–90°.
    pub alpha: MilliDegrees,
    /// Largest |β|, 0–90°.
    pub beta: MilliDegrees,
    /// Largest |p_x| and |p_y|, 1 to 1,000,000 µm; 0 if the model has no place outputs.
    pub place: Micrometres,
}

impl<'a> Model<'a> {
    /// Reads and proves a model file.
    ///
    /// # Errors
    /// [`ModelError`] names the fault and its position: not a model file, another version, cut or
    /// damaged, a value outside its range, or a row of weights whose sum could overflow.
    pub fn parse(bytes: &'a [u8]) -> Result<Model<'a>, ModelError> {
        layout::parse(bytes)
    }

    /// The model's identity: the CRC-32 of its file.
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// Its layers, first to last; none if its steps begin without a network.
    pub fn layers(&self) -> &[Layer<'a>] {
        self.layers.get(..self.layer_count).unwrap_or_default()
    }

    /// True if its file begins at a multiple of four, so that kernels can run it. Every layer is
    /// then aligned, too.
    pub fn is_aligned(&self) -> bool {
        let lies_so = |layer: &Layer<'_>| layer.weights.as_ptr().cast::<u32>().is_aligned();
        self.layers().iter().all(lies_so)
    }

    /// True when the training data was simulated.
    pub fn is_simulated(&self) -> bool {
        self.conditions.origin == Origin::Simulated
    }

    /// Layer widths and preset, such as `11-64-64-5 ov7725`, or without a network the number of
    /// markers, such as `8 markers ov7725`; cut after 32 bytes.
    pub fn name(&self) -> heapless::String<32> {
        let mut name = heapless::String::new();
        // A full string keeps what it has: the end of a very long name is cut.
        let _ = match self.layers() {
            [] => write!(name, "{} markers", self.rest.areas.len()),
            _ => write!(name, "{FEATURES}"),
        };
        for layer in self.layers() {
            let _ = write!(name, "-{}", layer.outputs());
        }
        let _ = write!(name, " {}", self.conditions.preset.name());
        name
    }
}
