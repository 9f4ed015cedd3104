//! Attacks on both directions of the wire: for any stream, messages are whole or counted as
//! rejected.

use hivtac_wire::decoder::{Decoder, Received, Rejected};
use hivtac_wire::frame::{CRC32, DEVICE_FRAME_LIMIT, HOST_FRAME_LIMIT, Message, encode};
use hivtac_wire::message::{DeviceMessage, HostMessage};

/// Attacks the host's receiver.
pub fn from_device(input: &[u8]) -> bool {
    attack::<DeviceMessage, DEVICE_FRAME_LIMIT>(input)
}

/// Attacks the device's receiver.
pub fn from_host(input: &[u8]) -> bool {
    attack::<HostMessage, HOST_FRAME_LIMIT>(input)
}

/// If the first byte of an input is even, the rest is the raw stream. Otherwise the rest is the
/// body of a frame with the right framing, because random bytes never have a right checksum.
fn attack<M: Message, const N: usize>(input: &[u8]) -> bool {
    let Some((kind, rest)) = input.split_first() else {
        return false;
    };
    let stream = match kind % 2 {
        0 => rest.to_vec(),
        _ => framed(rest),
    };
    let (messages, rejected) = at_once::<M, N>(&stream);
    assert_eq!((messages.clone(), rejected), byte_by_byte::<M, N>(&stream));
    assert!(rejected.bytes as usize <= stream.len());
    let zeros = stream.iter().filter(|byte| **byte == 0).count();
    assert!(messages.len() + rejected.frames() as usize <= zeros);
    for message in &messages {
        comes_back::<M, N>(message);
    }
    !messages.is_empty()
}

fn framed(body: &[u8]) -> Vec<u8> {
    let content = [body, &CRC32.checksum(body).to_le_bytes()].concat();
    let mut frame = vec![0; cobs::max_encoding_length(content.len()) + 1];
    let length = cobs::encode(&content, &mut frame);
    frame.truncate(length + 1);
    frame
}

/// Returns the messages of a stream as frames, and the count of rejected data.
fn at_once<M: Message, const N: usize>(mut stream: &[u8]) -> (Vec<Vec<u8>>, Rejected) {
    let mut decoder = Decoder::<N>::new();
    let mut messages = Vec::new();
    while let Some(received) = decoder.feed::<M>(&mut stream) {
        messages.extend(frame_of(&received));
    }
    (messages, decoder.rejected())
}

fn byte_by_byte<M: Message, const N: usize>(stream: &[u8]) -> (Vec<Vec<u8>>, Rejected) {
    let mut decoder = Decoder::<N>::new();
    let received = stream.iter().filter_map(|&byte| decoder.push::<M>(byte));
    let messages = received
        .filter_map(|received| frame_of(&received))
        .collect();
    (messages, decoder.rejected())
}

/// Returns the frame of one of our messages, which fits the announced limit; `None` for a foreign
/// hello.
fn frame_of<M: Message>(received: &Received<M>) -> Option<Vec<u8>> {
    let Received::Message(message) = received else {
        return None;
    };
    let mut buffer = vec![0; M::MAX_FRAME];
    let frame = encode(message, &mut buffer).expect("a message fits the longest frame");
    Some(frame.to_vec())
}

fn comes_back<M: Message, const N: usize>(frame: &[u8]) {
    let (messages, rejected) = at_once::<M, N>(frame);
    assert_eq!(messages, [frame.to_owned()]);
    assert_eq!(rejected, Rejected::default());
}
