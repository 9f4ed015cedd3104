//! The person at the bench: is asked to do something, and says when it is done.

use crate::output::note;
use hivtac_host::failure::Failure;
use hivtac_host::stop;
use std::io::BufRead;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// How often is looked whether the program is to end.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Who types at standard input. At its end nobody does, and nothing is waited for.
pub struct Person {
    lines: Receiver<()>,
}

impl Person {
    /// Listens from now on.
    pub fn listen() -> Person {
        let (typed, lines) = channel();
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                if line.is_err() || typed.send(()).is_err() {
                    return;
                }
            }
        });
        Person { lines }
    }

    /// Asks for something, and waits for Enter.
    ///
    /// # Errors
    /// It was interrupted.
    pub fn ask(&self, what: &str) -> Result<(), Failure> {
        note(&format!("→ {what} Then press Enter."));
        loop {
            stop::check()?;
            match self.lines.recv_timeout(LOOK_EVERY) {
                Ok(()) | Err(RecvTimeoutError::Disconnected) => return Ok(()),
                Err(RecvTimeoutError::Timeout) => (),
            }
        }
    }
}
