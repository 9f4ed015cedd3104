//! The chip's rules that firmware must not break. The first breach ends the run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The record of breaches.
#[derive(Clone, Debug, Default)]
pub struct Rules(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    broken: AtomicBool,
    what: Mutex<Option<String>>,
}

impl Rules {
    /// Notes a breach; only the first one is kept.
    pub fn broken(&self, what: impl FnOnce() -> String) {
        if !self.0.broken.swap(true, Ordering::Relaxed) {
            *self.0.what.lock().unwrap_or_else(PoisonError::into_inner) = Some(what());
        }
    }

    /// Returns whether a rule was broken.
    pub fn are_broken(&self) -> bool {
        self.0.broken.load(Ordering::Relaxed)
    }

    /// Returns the first breach; `None` if there was none.
    pub fn first(&self) -> Option<String> {
        self.0
            .what
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}
