//! Ctrl-C and termination: a flag that the loops look at, so that they end with their summary.

use crate::failure::{Failure, Kind};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);
static ASKED_BESIDES: OnceLock<fn() -> bool> = OnceLock::new();

/// Catches Ctrl-C, SIGTERM and SIGHUP from now on.
pub fn install() -> Result<(), Failure> {
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))
        .map_err(|error| Failure::input(format!("cannot catch Ctrl-C: {error}")))
}

/// Asks `is_over`, too, in a program whose signals something else catches. Every loop that waits
/// calls it again and again, at least every 0.1 s; the first function that was given stays.
pub fn ask_besides(is_over: fn() -> bool) {
    ASKED_BESIDES.get_or_init(|| is_over);
}

/// True once it was asked to end.
pub fn requested() -> bool {
    STOP.load(Ordering::Relaxed) || ASKED_BESIDES.get().is_some_and(|is_over| is_over())
}

/// An error once it was asked to end.
pub fn check() -> Result<(), Failure> {
    match requested() {
        true => Err(Failure::new(Kind::Interrupted, "interrupted")),
        false => Ok(()),
    }
}
