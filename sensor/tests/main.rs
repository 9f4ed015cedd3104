//! Tests of the package from outside.

mod opencv;
mod scanner;
