//! Files of the host, read and written through semihosting.

use core::fmt;

use cortex_m_semihosting::{nr, syscall};
use hivtac_tests::golden::Source;

/// `fopen` mode "rb", in semihosting's numbering.
const READ_BINARY: usize = 1;
/// `fopen` mode "wb".
const WRITE_BINARY: usize = 5;
/// Semihosting's result after a failure.
const FAILED: usize = usize::MAX;

const CHUNK: usize = 4096;

/// A file of the host that is open for reading.
pub struct Reader {
    handle: usize,
    buffer: [u8; CHUNK],
    /// The range of unread bytes in the buffer.
    start: usize,
    end: usize,
}

impl Reader {
    /// Opens a file.
    pub fn open(path: &str) -> Result<Reader, &'static str> {
        let handle = open(path, READ_BINARY).ok_or("the script cannot be opened")?;
        Ok(Reader {
            handle,
            buffer: [0; CHUNK],
            start: 0,
            end: 0,
        })
    }

    fn refill(&mut self) {
        // SAFETY: the buffer is valid for as many bytes as are asked for.
        let missing = unsafe { syscall!(READ, self.handle, self.buffer.as_mut_ptr(), CHUNK) };
        self.start = 0;
        self.end = CHUNK.saturating_sub(missing);
    }
}

impl Source for Reader {
    fn read(&mut self, buffer: &mut [u8]) -> usize {
        let mut done = 0;
        while done < buffer.len() {
            if self.start == self.end {
                self.refill();
            }
            let length = (self.end - self.start).min(buffer.len() - done);
            if length == 0 {
                break;
            }
            buffer[done..done + length]
                .copy_from_slice(&self.buffer[self.start..self.start + length]);
            self.start += length;
            done += length;
        }
        done
    }
}

/// A file of the host that is open for writing.
pub struct Writer {
    handle: usize,
    buffer: [u8; CHUNK],
    length: usize,
}

impl Writer {
    /// Creates a file, or empties it.
    pub fn create(path: &str) -> Result<Writer, &'static str> {
        let handle = open(path, WRITE_BINARY).ok_or("the results cannot be created")?;
        Ok(Writer {
            handle,
            buffer: [0; CHUNK],
            length: 0,
        })
    }

    /// Writes the buffered bytes.
    pub fn flush(&mut self) -> Result<(), &'static str> {
        // SAFETY: the buffer is valid for as many bytes as are written.
        let missing = unsafe { syscall!(WRITE, self.handle, self.buffer.as_ptr(), self.length) };
        self.length = 0;
        if missing == 0 {
            Ok(())
        } else {
            Err("the results cannot be written")
        }
    }
}

impl fmt::Write for Writer {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for &byte in text.as_bytes() {
            if self.length == CHUNK {
                self.flush().map_err(|_| fmt::Error)?;
            }
            self.buffer[self.length] = byte;
            self.length += 1;
        }
        Ok(())
    }
}

/// Returns the program's name and arguments, separated by blanks.
pub fn command_line(buffer: &mut [u8]) -> Result<&str, &'static str> {
    let mut block = [buffer.as_mut_ptr() as usize, buffer.len()];
    // SAFETY: the block holds the address of the buffer and its length, which the host replaces by
    // the text's.
    let failed =
        unsafe { cortex_m_semihosting::syscall1(nr::GET_CMDLINE, block.as_mut_ptr() as usize) };
    let text = buffer.get(..block[1]).filter(|_| failed == 0);
    let text = text.ok_or("the command line cannot be read")?;
    let text = core::str::from_utf8(text).map_err(|_| "the command line is not text")?;
    Ok(text.trim_end_matches('\0'))
}

fn open(path: &str, mode: usize) -> Option<usize> {
    let mut name = [0; 512];
    // One byte stays zero: the end of the name.
    name[..511]
        .get_mut(..path.len())?
        .copy_from_slice(path.as_bytes());
    // SAFETY: the name ends with a zero byte within its array.
    let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, path.len()) };
    (handle != FAILED).then_some(handle)
}
