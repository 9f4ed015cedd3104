//! Measures the worst cases of the sensing's arithmetic, and compares them with their bounds
//! (`docs/numerics.md`). Each test prints a row of that document's table: `cargo test --release -p
//! hivtac-sensor --lib numerics -- --nocapture`.

mod forces;
mod rescaling;

use std::{println, string::String};

/// A row of the table: stage, what was tried, bound, measured worst case.
fn row(stage: &str, tried: String, bound: &str, worst: String) {
    let cell = |text: &str| text.replace('|', "\\|");
    println!(
        "| {} | {} | {} | {} |",
        cell(stage),
        cell(&tried),
        cell(bound),
        cell(&worst)
    );
}
