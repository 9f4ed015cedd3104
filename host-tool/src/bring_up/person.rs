//! Asks the person at the bench to do something, and waits until it is done.

use crate::output::note;
use hivtac_host::failure::Failure;
use hivtac_host::stop;
use std::io::BufRead;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// Time between two checks whether the program must end.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// The lines typed at standard input. After its end there is no wait.
pub struct Person {
    lines: Receiver<()>,
}

impl Person {
    /// Starts to read standard input.
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

    /// Prints a request, and waits for Enter.
    ///
    /// # Errors
    /// When the program was interrupted.
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
