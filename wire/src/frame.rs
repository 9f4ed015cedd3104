//! Encodes frames: one message into one frame, `COBS(postcard(message) ++ CRC-32) ++ 0x00`.

use crate::message::{DeviceMessage, HostMessage};
use crc::{CRC_32_ISO_HDLC, Crc};
use postcard::ser_flavors::{Cobs, Slice, crc::CrcModifier};
use serde::{Serialize, de::DeserializeOwned};

/// CRC-32/ISO-HDLC (that of Ethernet and zip), sent little-endian after the body.
pub const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Bytes of the checksum.
pub(crate) const CRC_BYTES: usize = 4;

/// Longest body of a device in this protocol version: all its settings, each number with its
/// longest encoding.
pub const MAX_DEVICE_BODY: usize = 470;

/// Longest body of a sample in this protocol version: one with force, two contacts and markers.
pub const MAX_SAMPLE_BODY: usize = 470;

/// Longest body of a host in this protocol version: a rest position.
pub const MAX_HOST_BODY: usize = 280;

/// Longest frame from the device in this protocol version, closing zero included.
pub const MAX_DEVICE_FRAME: usize = frame_length(MAX_DEVICE_BODY);

/// Longest frame of a sample in this protocol version, closing zero included.
pub const MAX_SAMPLE_FRAME: usize = frame_length(MAX_SAMPLE_BODY);

/// Longest frame from the host in this protocol version, closing zero included.
pub const MAX_HOST_FRAME: usize = frame_length(MAX_HOST_BODY);

/// Longest frame from the device in any protocol version. A host's decoder holds this much, so that
/// it can name the version of any device.
pub const DEVICE_FRAME_LIMIT: usize = 512;

/// Longest frame from the host in any protocol version. A device's decoder holds this much.
pub const HOST_FRAME_LIMIT: usize = 320;

/// Length of the frame of a body: with checksum, one COBS byte for each 254 bytes begun, and
/// closing zero.
const fn frame_length(body: usize) -> usize {
    let content = body + CRC_BYTES;
    content + 1 + content / 254 + 1
}

/// A message that a frame can carry: [`DeviceMessage`] or [`HostMessage`].
pub trait Message: Serialize + DeserializeOwned + sealed::Sealed {
    /// Longest frame of this direction, closing zero included.
    const MAX_FRAME: usize;
}

impl Message for DeviceMessage {
    const MAX_FRAME: usize = MAX_DEVICE_FRAME;
}

impl Message for HostMessage {
    const MAX_FRAME: usize = MAX_HOST_FRAME;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for crate::message::DeviceMessage {}
    impl Sealed for crate::message::HostMessage {}
}

/// The buffer is shorter than the frame, which cannot happen with [`Message::MAX_FRAME`] bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferTooSmall;

/// Writes the frame of `message` to the front of `buffer` and returns it, closing zero included.
///
/// # Errors
/// [`BufferTooSmall`] if it does not fit; `buffer` is then in an unspecified state.
pub fn encode<'b, M: Message>(
    message: &M,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], BufferTooSmall> {
    encode_body(message, buffer)
}

/// [`encode`] for any value, so that tests can make frames that no protocol version has.
pub(crate) fn encode_body<'b>(
    body: &impl Serialize,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], BufferTooSmall> {
    let cobs = Cobs::try_new(Slice::new(buffer)).map_err(|_| BufferTooSmall)?;
    let flavor = CrcModifier::new(cobs, CRC32.digest());
    match postcard::serialize_with_flavor(body, flavor) {
        Ok(frame) => Ok(frame),
        Err(_) => Err(BufferTooSmall),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::examples;

    #[test]
    fn the_longest_messages_are_exactly_as_long_as_announced() {
        let device = examples::longest_device_messages();
        let lengths = device.iter().map(body_length);
        assert_eq!(lengths.max(), Some(MAX_DEVICE_BODY));
        let sample = DeviceMessage::Sample(examples::longest_sample());
        assert_eq!(body_length(&sample), MAX_SAMPLE_BODY);
        let host = examples::longest_host_messages();
        let lengths = host.iter().map(body_length);
        assert_eq!(lengths.max(), Some(MAX_HOST_BODY));
    }

    #[test]
    fn the_longest_messages_fit_their_frames() {
        for message in examples::longest_device_messages() {
            assert!(encode(&message, &mut [0; MAX_DEVICE_FRAME]).is_ok());
        }
        for message in examples::longest_host_messages() {
            assert!(encode(&message, &mut [0; MAX_HOST_FRAME]).is_ok());
        }
        const { assert!(MAX_DEVICE_FRAME <= DEVICE_FRAME_LIMIT) };
        const { assert!(MAX_HOST_FRAME <= HOST_FRAME_LIMIT) };
    }

    #[test]
    fn every_shorter_buffer_is_an_error() {
        for message in examples::longest_device_messages() {
            let mut buffer = [0; MAX_DEVICE_FRAME];
            let length = encode(&message, &mut buffer).unwrap().len();
            for short in 0..length {
                assert_eq!(
                    encode(&message, &mut buffer[..short]),
                    Err(BufferTooSmall),
                    "{short}"
                );
            }
        }
    }

    fn body_length(message: &impl Serialize) -> usize {
        postcard::to_slice(message, &mut [0; 512]).unwrap().len()
    }
}
