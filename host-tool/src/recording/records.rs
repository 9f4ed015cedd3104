//! Reads the records of an MCAP file, past damaged parts.
//!
//! A chunk begins with a header whose lengths must agree, and has a checksum. After damaged records
//! it searches for the next such header.

use std::fmt::{self, Display, Formatter};
use std::io::{self, Read, Seek, SeekFrom};

use mcap::records::{Channel, ChunkHeader, Record, op};
use mcap::{MAGIC, parse_record};

/// Longest chunk, packed or not, and longest message outside of chunks, bytes.
const LONGEST: u64 = 1 << 28;
/// Bytes before a record's body: its opcode and its length.
const HEAD: u64 = 9;
/// Bytes of a chunk's header without the name of its compression: two times, a size, a checksum,
/// the name's length, and the length of its records.
const CHUNK_HEADER: u64 = 8 + 8 + 8 + 4 + 4 + 8;
/// Bytes of a footer's body.
const FOOTER: u64 = 20;
/// Bytes of the body of the record that ends the data.
const DATA_END: u64 = 4;
/// Bytes that are read at once to look for a chunk.
const WINDOW: usize = 1 << 16;

/// Where a recording is read from.
pub trait Source: Read + Seek + Send {}
impl<T: Read + Seek + Send> Source for T {}

/// A damaged part of a recording, which is skipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The first byte of the part.
    pub from: u64,
    /// The first byte after it.
    pub to: u64,
    /// How it shows.
    pub why: String,
}

impl Display for Damage {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Damage { from, to, why } = self;
        write!(f, "bytes {from} to {to} are damaged, and skipped: {why}")
    }
}

/// The records of a file, in its order.
pub struct Records {
    source: Box<dyn Source>,
    length: u64,
    /// Where the next record begins.
    at: u64,
    /// Up to here, all is read.
    sure: u64,
    is_over: bool,
    /// Whether the file ends before its end.
    pub is_cut: bool,
    /// Its damaged parts up to now.
    pub damage: Vec<Damage>,
}

impl Records {
    /// Begins with the first record.
    ///
    /// # Errors
    /// When the source cannot be read.
    pub fn new(mut source: Box<dyn Source>) -> io::Result<Records> {
        let length = source.seek(SeekFrom::End(0))?;
        let begin = MAGIC.len() as u64;
        Ok(Records {
            source,
            length,
            at: begin,
            sure: begin,
            is_over: false,
            is_cut: false,
            damage: Vec::new(),
        })
    }

    /// Whether it begins or ends as an MCAP file does.
    pub fn is_mcap(&mut self) -> io::Result<bool> {
        let begin = self.bytes(0, MAGIC.len() as u64)?;
        Ok(begin == MAGIC || self.ends_as_mcap()?)
    }

    fn ends_as_mcap(&mut self) -> io::Result<bool> {
        let from = self.length.saturating_sub(MAGIC.len() as u64);
        Ok(self.bytes(from, MAGIC.len() as u64)? == MAGIC)
    }

    /// The channels that the summary at the file's end has; none if it is missing or damaged.
    pub fn summary(&mut self) -> io::Result<Vec<Channel>> {
        let end = MAGIC.len() as u64;
        let footer_at = self.length.saturating_sub(end + FOOTER + HEAD);
        let footer = self.bytes(footer_at, HEAD + FOOTER)?;
        let Some((op::FOOTER, FOOTER)) = head(&footer) else {
            return Ok(Vec::new());
        };
        let from = number(&footer, HEAD);
        let is_possible = from != 0 && from <= footer_at && footer_at - from < LONGEST;
        if !is_possible {
            return Ok(Vec::new());
        }
        let summary = self.bytes(from, footer_at - from)?;
        let expected =
            u32::from_le_bytes(footer[footer.len() - 4..].try_into().unwrap_or_default());
        let mut sum = crc32fast::Hasher::new();
        sum.update(&summary);
        sum.update(&footer[..footer.len() - 4]);
        if expected != 0 && expected != sum.finalize() {
            return Ok(Vec::new());
        }
        let records = records_of(&summary).0.into_iter();
        Ok(records
            .filter_map(|record| match record {
                Record::Channel(channel) => Some(channel),
                _ => None,
            })
            .collect())
    }

    /// The channels and messages of the next chunk; `None` at the end.
    ///
    /// # Errors
    /// When the source cannot be read.
    pub fn next(&mut self) -> io::Result<Option<Vec<Record<'static>>>> {
        while !self.is_over {
            let records = self.step()?;
            if !records.is_empty() {
                return Ok(Some(records));
            }
        }
        Ok(None)
    }

    fn step(&mut self) -> io::Result<Vec<Record<'static>>> {
        let at = self.at;
        if let Some(end) = self.chunk_end(at)? {
            return self.chunk(at, end);
        }
        let start = self.bytes(at, HEAD)?;
        let Some((opcode, length)) = head(&start) else {
            return self.look_for_chunk("it is no record");
        };
        let end = at.saturating_add(HEAD).saturating_add(length);
        let is_known = matches!(opcode, op::HEADER..=op::DATA_END | 0x80..) && opcode != op::CHUNK;
        if !is_known || end > self.length {
            return self.look_for_chunk("it is no record");
        }
        match opcode {
            op::FOOTER if length == FOOTER => self.is_over = true,
            op::DATA_END if length == DATA_END => self.is_over = true,
            op::FOOTER | op::DATA_END => return self.look_for_chunk("it is no record"),
            op::CHANNEL | op::MESSAGE if length <= LONGEST => {
                let body = self.bytes(at + HEAD, length)?;
                let Ok(record) = parse_record(opcode, &body) else {
                    return self.look_for_chunk("a record cannot be read");
                };
                (self.at, self.sure) = (end, end);
                return Ok(vec![record.into_owned()]);
            }
            _ => self.at = end,
        }
        Ok(Vec::new())
    }

    /// The records of a chunk; none if it is damaged.
    fn chunk(&mut self, at: u64, end: u64) -> io::Result<Vec<Record<'static>>> {
        let body = self.bytes(at + HEAD, end - at - HEAD)?;
        if end > self.length {
            (self.is_over, self.is_cut) = (true, true);
            return Ok(beginning(&body));
        }
        (self.at, self.sure) = (end, end);
        unpacked(&body).or_else(|why| {
            self.damage.push(Damage {
                from: at,
                to: end,
                why,
            });
            Ok(Vec::new())
        })
    }

    /// Goes on at the next chunk after the last sound record, or at the end.
    fn look_for_chunk(&mut self, why: &str) -> io::Result<Vec<Record<'static>>> {
        let from = self.sure;
        let mut at = from;
        while at < self.length {
            let window = self.bytes(at, WINDOW as u64)?;
            let candidates = (0..window.len()).filter(|&i| window[i] == op::CHUNK);
            for candidate in candidates {
                let begins = at + candidate as u64;
                let end = self.chunk_end(begins)?;
                if end.is_some_and(|end| end <= self.length) {
                    self.skipped(from, begins, why);
                    (self.at, self.sure) = (begins, begins);
                    return Ok(Vec::new());
                }
            }
            at += window.len() as u64;
        }
        self.is_over = true;
        match self.ends_as_mcap()? {
            true => self.skipped(from, self.length, why),
            false => self.is_cut = true,
        }
        Ok(Vec::new())
    }

    fn skipped(&mut self, from: u64, to: u64, why: &str) {
        let why = why.to_owned();
        self.damage.push(Damage { from, to, why });
    }

    /// The end of the chunk that begins here; `None` if none does. It checks the chunk's lengths,
    /// not its opcode.
    fn chunk_end(&mut self, at: u64) -> io::Result<Option<u64>> {
        let bytes = self.bytes(at, HEAD + CHUNK_HEADER + 4)?;
        let Some((_, length)) = head(&bytes) else {
            return Ok(None);
        };
        let name_at = HEAD + 32;
        if (bytes.len() as u64) < HEAD + CHUNK_HEADER || length > LONGEST {
            return Ok(None);
        }
        let name_length = number(&bytes, name_at - 4) & 0xffff_ffff;
        if name_length > 4 || (bytes.len() as u64) < HEAD + CHUNK_HEADER + name_length {
            return Ok(None);
        }
        let name = &bytes[name_at as usize..(name_at + name_length) as usize];
        let is_name = matches!(name, b"" | b"lz4" | b"zstd");
        let records = number(&bytes, name_at + name_length);
        let is_chunk = is_name && records.checked_add(CHUNK_HEADER + name_length) == Some(length);
        Ok(is_chunk.then_some(at + HEAD + length))
    }

    /// Up to `count` bytes from here.
    fn bytes(&mut self, at: u64, count: u64) -> io::Result<Vec<u8>> {
        self.source.seek(SeekFrom::Start(at))?;
        let mut bytes = Vec::new();
        self.source.by_ref().take(count).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

/// A record's opcode and the length of its body.
fn head(bytes: &[u8]) -> Option<(u8, u64)> {
    (bytes.len() as u64 >= HEAD).then(|| (bytes[0], number(bytes, 1)))
}

fn number(bytes: &[u8], at: u64) -> u64 {
    let bytes = bytes.get(at as usize..).and_then(|rest| rest.first_chunk());
    bytes.map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

/// The records of a chunk's body.
fn unpacked(body: &[u8]) -> Result<Vec<Record<'static>>, String> {
    let record = parse_record(op::CHUNK, body).map_err(|error| error.to_string())?;
    let Record::Chunk { header, data } = record else {
        return Err("it is no chunk".to_owned());
    };
    let bytes = decompressed(&header, &data).map_err(|error| error.to_string())?;
    let expected = header.uncompressed_crc;
    if expected != 0 && expected != crc32fast::hash(&bytes) {
        return Err("the chunk's checksum is wrong".to_owned());
    }
    match records_of(&bytes) {
        (records, true) => Ok(records),
        _ => Err("the chunk's records do not fill it".to_owned()),
    }
}

fn decompressed(header: &ChunkHeader, data: &[u8]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut unpack = |from: &mut dyn Read| from.take(LONGEST).read_to_end(&mut bytes);
    match header.compression.as_str() {
        "lz4" => unpack(&mut lz4_flex::frame::FrameDecoder::new(data))?,
        "zstd" => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(data);
            unpack(&mut decoder.map_err(io::Error::other)?)?
        }
        _ => unpack(&mut &*data)?,
    };
    Ok(bytes)
}

/// The whole records at the beginning of a chunk that is cut.
fn beginning(body: &[u8]) -> Vec<Record<'static>> {
    let is_plain = number(body, 28) & 0xffff_ffff == 0;
    let records = body.get(CHUNK_HEADER as usize..).filter(|_| is_plain);
    records.map_or_else(Vec::new, |records| records_of(records).0)
}

/// Channels and messages, and whether the bytes are whole records.
fn records_of(mut bytes: &[u8]) -> (Vec<Record<'static>>, bool) {
    let mut records = Vec::new();
    while let Some((opcode, length)) = head(bytes) {
        let rest = &bytes[HEAD as usize..];
        let body = usize::try_from(length)
            .ok()
            .and_then(|n| rest.split_at_checked(n));
        let Some((body, after)) = body else { break };
        if matches!(opcode, op::CHANNEL | op::MESSAGE) {
            let Ok(record) = parse_record(opcode, body) else {
                break;
            };
            records.push(record.into_owned());
        }
        bytes = after;
    }
    (records, bytes.is_empty())
}
