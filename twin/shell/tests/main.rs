//! Tests of the committed tables against full solutions.

mod reduced;
mod whole;
