//! The paper's analytic model, which studies and their tests share.

pub mod paper_model;
