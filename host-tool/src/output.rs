//! Writing to standard output and standard error so that a closed pipe is an end, not a crash.

use hivtac_host::failure::{Failure, Kind};
use std::io::{self, ErrorKind, Write};

/// Whether there is still a reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// The text was written.
    There,
    /// The pipe is closed: nobody wants more.
    Gone,
}

/// Writes a line to standard output and flushes it.
pub fn print(line: &str) -> Result<Reader, Failure> {
    let mut output = io::stdout().lock();
    match writeln!(output, "{line}").and_then(|()| output.flush()) {
        Ok(()) => Ok(Reader::There),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(Reader::Gone),
        Err(error) => {
            let message = format!("cannot write to standard output: {error}");
            Err(Failure::new(Kind::Input, message))
        }
    }
}

/// Writes a line for a person to standard error; there is nothing to do when that fails.
pub fn note(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}
