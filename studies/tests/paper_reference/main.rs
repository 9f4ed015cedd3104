//! The paper's analytic model against a high-precision reference (`table.csv`, written by
//! `reference.py`), and the numbers that its documentation states.

mod accuracy;
mod claims;
mod domains;
mod picture;
mod readings;
mod scan;
mod table;
