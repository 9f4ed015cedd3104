//! From data to a model on the chip.
//!
//! ```text
//! loads → scene → frames → sensing → data set (CSV) → train → weights (JSON, floats)
//!    → quantize → model file (.hvtm, integers) → evaluate, check, on frames that no training saw
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `loads`, `dataset` | which forces; frames seen by `sensing` itself; the CSV file |
//! | `collect` | data from a real unit and a force gauge |
//! | `train`, `fit` | networks; from a data set to weights |
//! | `forward` | the film run forwards, from what is known of a unit |
//! | `import` | networks trained in PyTorch |
//! | `network`, `weights`, `conditions` | the network in floats, its file, and what it holds for |
//! | `quantize` | weights to a model file, the same bytes on every machine |
//! | `uncertainty` | what a model's errors say of its next ones |
//! | `evaluate`, `check`, `errors` | how far the model's forces are from the truth |
//! | `unit` | a person led through a unit's loads, to its own model |
//! | `plot` | SVG |
//! | `progress` | bars on the terminal |

pub mod answer;
pub mod check;
pub mod collect;
pub mod conditions;
pub mod dataset;
pub mod errors;
pub mod evaluate;
pub mod fit;
pub mod forward;
pub mod import;
pub mod loads;
pub mod network;
pub mod plot;
pub mod progress;
pub mod quantize;
pub mod range;
pub mod rest;
pub mod train;
pub mod uncertainty;
pub mod unit;
pub mod weights;
