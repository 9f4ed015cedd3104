//! Decodes frames: bytes as they arrive become messages, and garbage is counted.

use crate::frame::{CRC_BYTES, CRC32, Message};
use crate::version::HelloPrefix;

/// The content of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Received<M> {
    /// A message of this protocol version.
    Message(M),
    /// A hello of another protocol version or schema. No other message of such a peer can be
    /// understood.
    ForeignHello(HelloPrefix),
}

/// Everything that a decoder has rejected since it was created. The counters saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rejected {
    /// Frames longer than the decoder holds.
    pub overlong: u32,
    /// Frames whose COBS code exceeds their end.
    pub cobs: u32,
    /// Frames with a wrong checksum, or too short to have one.
    pub crc: u32,
    /// Frames with a right checksum around an invalid message: unknown variant, bad string, too
    /// short.
    pub body: u32,
    /// Frames with a right checksum and bytes after the message.
    pub trailing: u32,
    /// Bytes of all these frames, without their closing zeros.
    pub bytes: u32,
}

impl Rejected {
    /// Number of rejected frames, for all causes.
    pub fn frames(&self) -> u32 {
        [self.overlong, self.cobs, self.crc, self.body, self.trailing]
            .iter()
            .fold(0, |sum: u32, count| sum.saturating_add(*count))
    }
}

/// Why a frame was rejected.
enum Reject {
    Cobs,
    Crc,
    Body,
    Trailing,
}

/// Splits a byte stream at zero bytes and decodes the parts. After any garbage it resynchronizes at
/// the next zero byte. Empty frames are ignored: a sender may insert any number of zero bytes
/// between frames.
///
/// `N`: longest frame it accepts, without the closing zero;
/// [`DEVICE_FRAME_LIMIT`](crate::frame::DEVICE_FRAME_LIMIT) on a host,
/// [`HOST_FRAME_LIMIT`](crate::frame::HOST_FRAME_LIMIT) on a device.
#[derive(Clone, Debug)]
pub struct Decoder<const N: usize> {
    buffer: [u8; N],
    /// Bytes of the frame so far; those beyond `N` are only counted.
    length: usize,
    rejected: Rejected,
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Decoder<N> {
    /// A decoder before the first byte.
    pub const fn new() -> Self {
        let rejected = Rejected {
            overlong: 0,
            cobs: 0,
            crc: 0,
            body: 0,
            trailing: 0,
            bytes: 0,
        };
        Decoder {
            buffer: [0; N],
            length: 0,
            rejected,
        }
    }

    /// Returns what was rejected so far.
    pub fn rejected(&self) -> Rejected {
        self.rejected
    }

    /// Takes bytes from the front of `bytes`, up to the end of the next message, which it returns,
    /// or all of them. Call it until `bytes` is empty and it returns `None`.
    pub fn feed<M: Message>(&mut self, bytes: &mut &[u8]) -> Option<Received<M>> {
        while let Some((&byte, rest)) = bytes.split_first() {
            *bytes = rest;
            if let Some(received) = self.push(byte) {
                return Some(received);
            }
        }
        None
    }

    /// Takes one byte; returns a message if the byte ends one.
    pub fn push<M: Message>(&mut self, byte: u8) -> Option<Received<M>> {
        if byte != 0 {
            if let Some(free) = self.buffer.get_mut(self.length) {
                *free = byte;
            }
            self.length = self.length.saturating_add(1);
            return None;
        }
        let length = core::mem::take(&mut self.length);
        match self.buffer.get_mut(..length) {
            Some([]) => None,
            Some(frame) => match decode(frame) {
                Ok(received) => Some(received),
                Err(cause) => self.reject(length, cause),
            },
            None => self.reject_overlong(length),
        }
    }

    /// Discards an incomplete frame after the connection was lost; counts its bytes as rejected.
    pub fn reset(&mut self) {
        let length = core::mem::take(&mut self.length);
        self.count_bytes(length);
    }

    fn reject<T>(&mut self, length: usize, cause: Reject) -> Option<T> {
        let counter = match cause {
            Reject::Cobs => &mut self.rejected.cobs,
            Reject::Crc => &mut self.rejected.crc,
            Reject::Body => &mut self.rejected.body,
            Reject::Trailing => &mut self.rejected.trailing,
        };
        *counter = counter.saturating_add(1);
        self.count_bytes(length);
        None
    }

    fn reject_overlong<T>(&mut self, length: usize) -> Option<T> {
        self.rejected.overlong = self.rejected.overlong.saturating_add(1);
        self.count_bytes(length);
        None
    }

    fn count_bytes(&mut self, length: usize) {
        let length = u32::try_from(length).unwrap_or(u32::MAX);
        self.rejected.bytes = self.rejected.bytes.saturating_add(length);
    }
}

/// Decodes a frame of any protocol version in place, without its closing zero. Returns its body;
/// `None` if it is damaged.
pub fn body(frame: &mut [u8]) -> Option<&[u8]> {
    checked_body(frame).ok()
}

/// Decodes a frame in place, without its closing zero.
fn decode<M: Message>(frame: &mut [u8]) -> Result<Received<M>, Reject> {
    let body = checked_body(frame)?;
    if let Some(hello) = HelloPrefix::of(body)
        && !hello.is_ours()
    {
        return Ok(Received::ForeignHello(hello));
    }
    match postcard::take_from_bytes(body) {
        Ok((message, [])) => Ok(Received::Message(message)),
        Ok(_) => Err(Reject::Trailing),
        Err(_) => Err(Reject::Body),
    }
}

/// Decodes COBS, then checks and removes the checksum.
fn checked_body(frame: &mut [u8]) -> Result<&[u8], Reject> {
    let length = cobs::decode_in_place(frame).map_err(|_| Reject::Cobs)?;
    let content = frame.get(..length).ok_or(Reject::Cobs)?;
    let (body, sum) = content.split_last_chunk::<CRC_BYTES>().ok_or(Reject::Crc)?;
    if CRC32.checksum(body) != u32::from_le_bytes(*sum) {
        return Err(Reject::Crc);
    }
    Ok(body)
}
