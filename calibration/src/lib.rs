//! Calibration: from data to a model on the chip.
//!
//! ```text
//! data set → train → weights (JSON, floats) → quantize → model file (.hvtm, integers)
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `data` | forces with what the sensor saw: rendered, or from a unit and a force gauge |
//! | `evaluation` | errors of a model's forces |
//! | `train`, `fit` | networks; from a data set to weights |
//! | `forward` | the forward model, from the known numbers of a unit |
//! | `loads` | the loads of a data set, and their uncertainties |
//! | `unit_fit` | a unit's film and camera, fitted to its loads |
//! | `import` | networks trained in PyTorch |
//! | `network`, `weights` | the network in floats, and its file |
//! | `quantize` | weights to a model file, the same bytes on every machine |
//! | `uncertainty` | a model's stated uncertainties, from its errors |
//! | `unit` | guides a person through a unit's loads, to its own model |
//! | `parallel` | work that all processors share |
//! | `progress` | bars on the terminal |

pub mod data;
pub mod evaluation;
pub mod fit;
pub mod forward;
pub mod import;
pub mod loads;
pub mod network;
mod parallel;
pub mod progress;
pub mod quantize;
pub mod train;
pub mod uncertainty;
pub mod unit;
pub mod unit_fit;
pub mod weights;
