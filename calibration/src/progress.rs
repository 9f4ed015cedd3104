//! Shows progress on the terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar on the standard error stream; hidden if that is not a terminal.
pub fn bar(what: &str, steps: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {eta} {msg}");
    let bar = ProgressBar::new(steps as u64).with_prefix(what.to_owned());
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
