//! Handles Ctrl-C during waits without the interpreter's lock, with Python's own handler.

use pyo3::{PyErr, Python};
use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

/// Time between two checks: each takes the interpreter's lock, which may need a wait.
const LOOK_EVERY: Duration = Duration::from_millis(50);

thread_local! {
    static LOOKED: Cell<Option<Instant>> = const { Cell::new(None) };
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// True when a signal's handler raised an exception in this thread, which [`take`] returns. Must be
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

/// The raised exception, which is then forgotten.
pub fn take() -> Option<PyErr> {
    RAISED.take()
}
