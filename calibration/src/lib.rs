//! From data to a model on the chip.
//!
//! ```text
//! data set → train → weights (JSON, floats) → quantize → model file (.hvtm, integers)
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `data` | forces with what the sensor saw: rendered, or of a unit and a force gauge |
//! | `evaluation` | how far a model's forces are from the truth |
//! | `train`, `fit` | networks; from a data set to weights |
//! | `forward` | the film run forwards, from what is known of a unit |
//! | `loads` | the loads that a data set shows, and how well each is known |
//! | `import` | networks trained in PyTorch |
//! | `network`, `weights` | the network in floats, and its file |
//! | `quantize` | weights to a model file, the same bytes on every machine |
//! | `uncertainty` | what a model's errors say of its next ones |
//! | `unit` | a person led through a unit's loads, to its own model |
//! | `progress` | bars on the terminal |

pub mod data;
pub mod evaluation;
pub mod fit;
pub mod forward;
pub mod import;
pub mod loads;
pub mod network;
pub mod progress;
pub mod quantize;
pub mod train;
pub mod uncertainty;
pub mod unit;
pub mod unit_fit;
pub mod weights;
