//! Encodes a record in words. The first word holds the sector's generation, the length and the
//! checksum; the others continue the payload. The first byte of each word states its kind, so no
//! word is ever blank, and a continuing word is never taken for a first one.

use crate::storage::flash::{WORD_BYTES, Word};
use crc::{CRC_32_ISO_HDLC, Crc};

/// The CRC-32 of Ethernet and zip.
const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// First byte of a record's first word. A different layout of records uses a different byte.
const BEGIN: u8 = 0x49;
/// First byte of a seal, which states that the record before it is whole.
const SEAL: u8 = 0x5A;
/// Bytes of a record's first word before the payload: [`BEGIN`], length, generation, checksum.
const HEADER_BYTES: usize = 11;
/// Bytes of the payload in each further word.
const CONTINUED_BYTES: usize = WORD_BYTES - 1;
const FIRST_BYTES: usize = WORD_BYTES - HEADER_BYTES;

/// Longest payload.
pub const PAYLOAD_LIMIT: usize = 400;

/// The content of a record's first word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Higher than the generation of all older records in the other sector.
    pub generation: u32,
    /// Bytes of the payload.
    pub length: u16,
    checksum: u32,
}

impl Header {
    /// Returns the header for this payload; `None` if it is longer than [`PAYLOAD_LIMIT`].
    pub fn new(generation: u32, payload: &[u8]) -> Option<Self> {
        let length = u16::try_from(payload.len()).ok();
        let length = length.filter(|length| usize::from(*length) <= PAYLOAD_LIMIT)?;
        let checksum = checksum(generation, payload);
        Some(Self {
            generation,
            length,
            checksum,
        })
    }

    /// Returns the header in a record's first word; `None` for any other word.
    pub fn of(word: &Word) -> Option<Self> {
        let [BEGIN, l0, l1, n0, n1, n2, n3, c0, c1, c2, c3, ..] = *word else {
            return None;
        };
        Some(Self {
            generation: u32::from_le_bytes([n0, n1, n2, n3]),
            length: u16::from_le_bytes([l0, l1]),
            checksum: u32::from_le_bytes([c0, c1, c2, c3]),
        })
    }

    /// Number of words of the record, without its seal.
    pub fn words(&self) -> u32 {
        words(usize::from(self.length))
    }

    /// Returns whether this is the payload that belongs to the header.
    pub fn fits(&self, payload: &[u8]) -> bool {
        payload.len() == usize::from(self.length)
            && checksum(self.generation, payload) == self.checksum
    }
}

/// Number of words of a record with a payload of `bytes` bytes, without its seal.
pub const fn words(bytes: usize) -> u32 {
    1 + bytes.saturating_sub(FIRST_BYTES).div_ceil(CONTINUED_BYTES) as u32
}

fn checksum(generation: u32, payload: &[u8]) -> u32 {
    let mut digest = CRC32.digest();
    digest.update(&generation.to_le_bytes());
    digest.update(payload);
    digest.finalize()
}

/// Where the payload lies in a record's `nth` word: the first byte in the word, and the first byte
/// in the payload.
fn share(nth: u32) -> (usize, usize) {
    match nth {
        0 => (HEADER_BYTES, 0),
        _ => (1, FIRST_BYTES + (nth as usize - 1) * CONTINUED_BYTES),
    }
}

/// Returns the `nth` word of a record, of [`Header::words`].
pub fn word(header: &Header, payload: &[u8], nth: u32) -> Word {
    let mut word = [0; WORD_BYTES];
    let (at, from) = share(nth);
    if nth == 0 {
        word = first_word(header);
    } else if let Some(first) = word.first_mut() {
        *first = nth as u8;
    }
    let rest = payload.get(from..).unwrap_or(&[]);
    for (byte, value) in word.iter_mut().skip(at).zip(rest) {
        *byte = *value;
    }
    word
}

fn first_word(header: &Header) -> Word {
    let mut word = [0; WORD_BYTES];
    let fields = [BEGIN]
        .into_iter()
        .chain(header.length.to_le_bytes())
        .chain(header.generation.to_le_bytes())
        .chain(header.checksum.to_le_bytes());
    for (byte, value) in word.iter_mut().zip(fields) {
        *byte = value;
    }
    word
}

/// Copies the payload's bytes out of a record's word. Returns false if it is not the `nth` word of
/// a record.
pub fn take(word: &Word, nth: u32, payload: &mut [u8]) -> bool {
    let (at, from) = share(nth);
    let rest = payload.get_mut(from..).unwrap_or(&mut []);
    for (byte, value) in rest.iter_mut().zip(word.iter().skip(at)) {
        *byte = *value;
    }
    nth == 0 || word.first() == Some(&(nth as u8))
}

/// Returns the word that follows a whole record.
pub fn seal() -> Word {
    [SEAL; WORD_BYTES]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::flash::BLANK;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn a_payload_comes_back(
            payload in proptest::collection::vec(any::<u8>(), 0..=PAYLOAD_LIMIT),
            generation: u32,
        ) {
            let header = Header::new(generation, &payload).unwrap();
            let nth_word = |nth| word(&header, &payload, nth);
            let words: Vec<Word> = (0..header.words()).map(nth_word).collect();
            prop_assert_eq!(Header::of(&words[0]), Some(header));
            let mut read = std::vec![0; payload.len()];
            for (nth, word) in (0..).zip(&words) {
                prop_assert!(*word != BLANK);
                prop_assert!(nth == 0 || Header::of(word).is_none());
                prop_assert!(take(word, nth, &mut read));
            }
            prop_assert!(header.fits(&read));
            prop_assert_eq!(read, payload);
        }
    }

    #[test]
    fn a_payload_that_is_too_long_has_no_header() {
        assert_eq!(Header::new(0, &[0; PAYLOAD_LIMIT + 1]), None);
        let longest = Header::new(0, &[0; PAYLOAD_LIMIT]).unwrap();
        assert_eq!(longest.words(), 14);
        assert_eq!(words(FIRST_BYTES), 1);
        assert_eq!(words(FIRST_BYTES + 1), 2);
    }

    #[test]
    fn another_payload_or_generation_does_not_fit() {
        let header = Header::new(7, b"rest").unwrap();
        assert!(header.fits(b"rest"));
        assert!(!header.fits(b"resT"));
        assert!(!header.fits(b"res"));
        assert!(
            !Header {
                generation: 8,
                ..header
            }
            .fits(b"rest")
        );
    }
}
