//! From data to a model on the chip.
//!
//! ```text
//! data set → train → weights (JSON, floats) → quantize → model file (.hvtm, integers)
//!    → evaluate, check, on frames that no training saw
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `train`, `fit` | networks; from a data set to weights |
//! | `forward` | the film run forwards, from what is known of a unit |
//! | `import` | networks trained in PyTorch |
//! | `network`, `weights` | the network in floats, and its file |
//! | `quantize` | weights to a model file, the same bytes on every machine |
//! | `uncertainty` | what a model's errors say of its next ones |
//! | `evaluate`, `check`, `errors` | how far the model's forces are from the truth |
//! | `unit` | a person led through a unit's loads, to its own model |
//! | `plot` | SVG |
//! | `progress` | bars on the terminal |

pub mod answer;
pub mod check;
pub mod errors;
pub mod evaluate;
pub mod fit;
pub mod forward;
pub mod import;
pub mod network;
pub mod plot;
pub mod progress;
pub mod quantize;
pub mod train;
pub mod uncertainty;
pub mod unit;
pub mod weights;
