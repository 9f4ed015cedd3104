//! Writes to a browser, and ends the connection if the browser does not read.

use std::io::{self, ErrorKind, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Longest time of one write.
const PATIENCE: Duration = Duration::from_secs(3);

/// A writer that fails with a timeout when a single write takes `PATIENCE`, even if part of it
/// succeeded.
pub struct Unstalled<'s>(&'s TcpStream);

impl Unstalled<'_> {
    /// A writer to a connection.
    pub fn new(stream: &TcpStream) -> io::Result<Unstalled<'_>> {
        stream.set_write_timeout(Some(PATIENCE))?;
        Ok(Unstalled(stream))
    }
}

impl Write for Unstalled<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let begun = Instant::now();
        let written = match self.0.write(bytes) {
            // Unix reports a timeout with this kind.
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                return Err(ErrorKind::TimedOut.into());
            }
            result => result?,
        };
        match begun.elapsed() < PATIENCE {
            true => Ok(written),
            false => Err(ErrorKind::TimedOut.into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::net::TcpListener;
    use std::thread;

    /// Much more than one read takes.
    const MUCH: usize = 64 << 20;

    /// Writes to a reader that runs `read`; returns the result and the time it took.
    fn write_to(read: impl FnOnce(TcpStream) + Send + 'static) -> (io::Result<()>, Duration) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let reader = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (stream, _) = listener.accept().unwrap();
        let reading = thread::spawn(move || read(reader));
        let begun = Instant::now();
        let result = Unstalled::new(&stream).unwrap().write_all(&vec![7; MUCH]);
        let lasted = begun.elapsed();
        drop(stream);
        reading.join().unwrap();
        (result, lasted)
    }

    #[test]
    fn a_reader_that_stalls_or_drips_is_cut() {
        for drips in [false, true] {
            let (result, lasted) = write_to(move |mut reader| {
                let end = Instant::now() + 2 * PATIENCE;
                while Instant::now() < end {
                    if drips {
                        reader.read_exact(&mut [0; 100]).unwrap();
                    }
                    thread::sleep(Duration::from_millis(50));
                }
            });
            assert_eq!(result.unwrap_err().kind(), ErrorKind::TimedOut);
            assert!(lasted < 2 * PATIENCE, "{lasted:?}, drips: {drips}");
        }
    }

    #[test]
    fn a_reader_that_reads_gets_all() {
        let (result, _) = write_to(|mut reader| {
            let mut all = Vec::new();
            assert_eq!(reader.read_to_end(&mut all).unwrap(), MUCH);
        });
        assert!(result.is_ok());
    }
}
