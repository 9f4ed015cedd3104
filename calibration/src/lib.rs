//! From data to a model on the chip.
//!
//! ```text
//! loads → scene → frames → sensing → data set (CSV) → train → weights (JSON, floats)
//!    → quantize → model file (.hvtm, integers) → check, on frames that no training saw
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `loads`, `dataset` | which forces; frames seen by `sensing` itself; the CSV file |
//! | `train`, `fit` | training with burn (feature `train`); from a data set to weights |
//! | `network`, `weights`, `conditions` | the network in floats, its file, and what it holds for |
//! | `quantize` | weights to a model file, the same bytes on every machine |
//! | `check`, `errors` | how far the model's forces are from the truth |

pub mod check;
pub mod conditions;
pub mod dataset;
pub mod errors;
#[cfg(feature = "train")]
pub mod fit;
pub mod loads;
pub mod network;
pub mod quantize;
#[cfg(feature = "train")]
pub mod train;
pub mod weights;
