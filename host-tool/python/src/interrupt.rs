//! Ctrl-C while the tool's code waits without the interpreter's lock: Python's own handler decides.

use pyo3::{PyErr, Python};
use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

/// Time between two looks: each takes the interpreter's lock, for which it may have to wait.
const LOOK_EVERY: Duration = Duration::from_millis(50);

thread_local! {
    static LOOKED: Cell<Option<Instant>> = const { Cell::new(None) };
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// True when a signal's handler raised something in this thread, which [`take`] gives. Must be
/// called without the interpreter's lock.
pub fn is_interrupted() -> bool {
    if LOOKED
        .get()
        .is_some_and(|looked| looked.elapsed() < LOOK_EVERY)
    {
        return false;
    }
    LOOKED.set(Some(Instant::now()));
    let raised = Python::attach(|py| py.check_signals()).err();
    let is_raised = raised.is_some();
    if is_raised {
        RAISED.set(raised);
    }
    is_raised
}

/// What was raised, once.
pub fn take() -> Option<PyErr> {
    RAISED.take()
}
