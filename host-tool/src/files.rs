//! Files that somebody names.

use std::fs::File;
use std::io::{self, Read};

/// All of a file; `None` when it has more bytes than `most`, as one has that never ends.
pub fn read_at_most(path: &str, most: u64) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= most).then_some(bytes))
}
