//! Forces with what the sensor saw: the data that models are made of and judged by.
//!
//! ```text
//! loads → scene → frames → sensing ─┐
//! a real unit and a force gauge ────┴→ data set (CSV)
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `loads`, `range` | which forces, and where |
//! | `dataset` | frames seen by the sensing itself; the CSV file |
//! | `collect` | data from a real unit and a force gauge |
//! | `rest` | the untouched film, which all else is compared with |
//! | `conditions` | what a data set and a model hold for |

pub mod collect;
pub mod conditions;
pub mod dataset;
pub mod loads;
pub mod range;
pub mod rest;
