//! Catches Ctrl-C and termination in a flag; loops read it and end with their summary.

use crate::failure::{Failure, Kind};
use std::cell::OnceCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

static STOP: AtomicBool = AtomicBool::new(false);
static OTHER_CONDITION: OnceLock<fn() -> bool> = OnceLock::new();

thread_local! {
    static OWN: OnceCell<Arc<AtomicBool>> = const { OnceCell::new() };
}

/// In this thread, loops end by this flag alone.
pub(crate) fn only_by(flag: Arc<AtomicBool>) {
    OWN.with(|own| own.get_or_init(|| flag).clone());
}

/// Catches Ctrl-C, SIGTERM and SIGHUP from now on.
pub fn install() -> Result<(), Failure> {
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))
        .map_err(|error| Failure::input(format!("cannot catch Ctrl-C: {error}")))
}

/// Adds a second condition for the end, for a program that catches its signals elsewhere. Every
/// waiting loop calls `is_over` at least every 0.1 s. The first function stays; later ones are
/// ignored.
pub fn ask_besides(is_over: fn() -> bool) {
    OTHER_CONDITION.get_or_init(|| is_over);
}

/// True once the program, or this thread's work, should end.
pub fn requested() -> bool {
    let own = OWN.with(|own| own.get().map(|flag| flag.load(Ordering::Relaxed)));
    if let Some(is_over) = own {
        return is_over;
    }
    STOP.load(Ordering::Relaxed) || OTHER_CONDITION.get().is_some_and(|is_over| is_over())
}

/// An error once the program should end.
pub fn check() -> Result<(), Failure> {
    match requested() {
        true => Err(Failure::new(Kind::Interrupted, "interrupted")),
        false => Ok(()),
    }
}
