//! Forces with the sensor's view of them: the data by which models are made and judged.
//!
//! ```text
//! loads → scene → frames → sensing ─┐
//! a real unit and a force gauge ────┴→ data set (CSV)
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `loads`, `range` | which forces, and where |
//! | `dataset` | frames measured by the sensing itself; the CSV file |
//! | `collect` | data from a real unit and a force gauge |
//! | `rest` | the untouched film, the reference of all displacements |
//! | `conditions` | the conditions under which a data set and a model hold |

pub mod collect;
pub mod conditions;
pub mod dataset;
pub mod loads;
pub mod range;
pub mod rest;
