//! Reads files that a user names.

use std::fs::File;
use std::io::{self, Read};

/// All bytes of a file; `None` if it has more than `most` bytes, as an endless one has.
pub fn read_at_most(path: &str, most: u64) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= most).then_some(bytes))
}
