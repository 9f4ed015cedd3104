//! Ctrl-C and termination: a flag that the loops look at, so that they end with their summary.

use crate::failure::{Failure, Kind};
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);

/// Catches Ctrl-C, SIGTERM and SIGHUP from now on.
pub fn install() -> Result<(), Failure> {
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))
        .map_err(|error| Failure::input(format!("cannot catch Ctrl-C: {error}")))
}

/// True once it was asked to end.
pub fn requested() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// An error once it was asked to end.
pub fn check() -> Result<(), Failure> {
    match requested() {
        true => Err(Failure::new(Kind::Interrupted, "interrupted")),
        false => Ok(()),
    }
}
