//! Tests properties of framing, for any messages and any bytes.

use crate::decoder::{Decoder, Received};
use crate::examples::{any_device_message, any_host_message};
use crate::frame::*;
use crate::message::{DeviceMessage, HostMessage, Outcome, Reply};
use crate::version::{HelloPrefix, SCHEMA_HASH};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::collections::HashSet;
use std::mem::discriminant;
use std::vec::Vec;

type HostDecoder = Decoder<DEVICE_FRAME_LIMIT>;
type DeviceDecoder = Decoder<HOST_FRAME_LIMIT>;

fn frame(message: &impl Message) -> Vec<u8> {
    encode(message, &mut [0; DEVICE_FRAME_LIMIT])
        .unwrap()
        .to_vec()
}

fn frame_of_body(body: &impl serde::Serialize) -> Vec<u8> {
    encode_body(body, &mut [0; 512]).unwrap().to_vec()
}

/// Everything that the decoder returns for `bytes`.
fn decode_all<M: Message, const N: usize>(
    decoder: &mut Decoder<N>,
    mut bytes: &[u8],
) -> Vec<Received<M>> {
    core::iter::from_fn(|| decoder.feed(&mut bytes)).collect()
}

proptest! {
    #[test]
    fn device_messages_make_the_round_trip(
        messages in proptest::collection::vec(any_device_message(), 1..5),
    ) {
        let bytes: Vec<u8> = messages.iter().flat_map(frame).collect();
        let mut decoder = HostDecoder::new();
        let received: Vec<Received<DeviceMessage>> = decode_all(&mut decoder, &bytes);
        let sent: Vec<_> = messages.into_iter().map(Received::Message).collect();
        prop_assert_eq!(received, sent);
        prop_assert_eq!(decoder.rejected(), Default::default());
    }

    #[test]
    fn host_messages_make_the_round_trip(message in any_host_message()) {
        let bytes = frame(&message);
        prop_assert!(bytes.len() <= MAX_HOST_FRAME);
        let received: Vec<Received<HostMessage>> = decode_all(&mut DeviceDecoder::new(), &bytes);
        prop_assert_eq!(received, [Received::Message(message)]);
    }

    #[test]
    fn a_frame_has_no_zero_but_its_last_byte_and_keeps_its_bound(message in any_device_message()) {
        let bytes = frame(&message);
        prop_assert!(bytes.len() <= MAX_DEVICE_FRAME);
        prop_assert_eq!(bytes.iter().position(|byte| *byte == 0), Some(bytes.len() - 1));
    }

    #[test]
    fn slices_cut_anywhere_give_the_same(
        message in any_device_message(),
        cut in any::<prop::sample::Index>(),
    ) {
        let bytes = frame(&message);
        let (first, second) = bytes.split_at(cut.index(bytes.len()));
        let mut decoder = HostDecoder::new();
        let mut received: Vec<Received<DeviceMessage>> = decode_all(&mut decoder, first);
        received.extend(decode_all(&mut decoder, second));
        prop_assert_eq!(received, [Received::Message(message)]);
    }

    /// Garbage costs at most the frames that it touches: the message after its closing zero
    /// arrives.
    #[test]
    fn garbage_between_frames_is_dropped_and_counted(
        garbage in proptest::collection::vec(1_u8.., 1..600),
        message in any_device_message(),
    ) {
        let bytes: Vec<u8> =
            [frame(&message), garbage.clone(), [0].into(), frame(&message)].concat();
        let mut decoder = HostDecoder::new();
        let received: Vec<Received<DeviceMessage>> = decode_all(&mut decoder, &bytes);
        prop_assert_eq!(received, [Received::Message(message.clone()), Received::Message(message)]);
        prop_assert_eq!(decoder.rejected().frames(), 1);
        prop_assert_eq!(decoder.rejected().bytes as usize, garbage.len());
    }

    #[test]
    fn a_truncated_frame_is_no_message(
        message in any_device_message(),
        cut in any::<prop::sample::Index>(),
    ) {
        let whole = frame(&message);
        let kept = cut.index(whole.len() - 2) + 1;
        let bytes = [&whole[..kept], &[0], &whole].concat();
        let mut decoder = HostDecoder::new();
        let received: Vec<Received<DeviceMessage>> = decode_all(&mut decoder, &bytes);
        prop_assert_eq!(received, [Received::Message(message)]);
        prop_assert_eq!(decoder.rejected().frames(), 1);
    }

    /// In the content a flipped bit is one wrong bit, which CRC-32 always detects. In COBS' code
    /// bytes it moves zeros, and in the closing zero it joins two frames: the garbled content
    /// passes a CRC-32 once in 2³².
    #[test]
    fn a_flipped_bit_never_gives_a_wrong_message(
        message in any_device_message(),
        place in any::<prop::sample::Index>(),
        bit in 0_u8..8,
    ) {
        let mut bytes = frame(&message);
        bytes.push(0);
        let place = place.index(bytes.len() - 1);
        bytes[place] ^= 1 << bit;
        let mut decoder = HostDecoder::new();
        let received: Vec<Received<DeviceMessage>> = decode_all(&mut decoder, &bytes);
        prop_assert_eq!(received, []);
        prop_assert!(decoder.rejected().frames() >= 1);
    }

    /// For any later version, whatever follows the prefix, both versions can be named.
    #[test]
    fn any_later_hello_is_named(
        protocol in 2_u16..,
        schema in any::<u64>(),
        rest in proptest::collection::vec(any::<u8>(), 0..200),
    ) {
        let prefix = HelloPrefix { protocol, schema };
        let bytes = frame_of_body(&(0_u8, prefix, Raw(&rest)));
        let received: Vec<Received<DeviceMessage>> = decode_all(&mut HostDecoder::new(), &bytes);
        prop_assert_eq!(received, [Received::ForeignHello(prefix)]);
    }
}

/// Bytes without postcard's length prefix.
struct Raw<'a>(&'a [u8]);

impl serde::Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0
            .iter()
            .try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

/// Feeds one frame and returns the counters.
fn rejected_by(bytes: &[u8]) -> crate::decoder::Rejected {
    let mut decoder = HostDecoder::new();
    let received: Vec<Received<DeviceMessage>> = decode_all(&mut decoder, bytes);
    assert_eq!(received, []);
    decoder.rejected()
}

#[test]
fn every_cause_has_its_counter() {
    let overlong = rejected_by(&[&[1; DEVICE_FRAME_LIMIT + 1][..], &[0]].concat());
    assert_eq!((overlong.overlong, overlong.frames()), (1, 1));
    let cobs = rejected_by(&[9, 1, 1, 0]);
    assert_eq!((cobs.cobs, cobs.frames()), (1, 1));
    let crc = rejected_by(&[6, 1, 1, 1, 1, 1, 0]);
    assert_eq!((crc.crc, crc.frames()), (1, 1));
    let short = rejected_by(&[2, 1, 0]);
    assert_eq!((short.crc, short.frames()), (1, 1));
    let unknown_variant = rejected_by(&frame_of_body(&5_u8));
    assert_eq!((unknown_variant.body, unknown_variant.frames()), (1, 1));
    let trailing = rejected_by(&frame_of_body(&(4_u8, 1_u8, 0_u8, 0_u8)));
    assert_eq!((trailing.trailing, trailing.frames()), (1, 1));
}

#[test]
fn a_frame_of_exactly_the_decoders_length_is_taken() {
    let message = DeviceMessage::Reply(Reply {
        id: 7,
        outcome: Outcome::Done,
    });
    let bytes = frame(&message);
    assert_eq!(bytes.len(), 9);
    let exact: Vec<Received<DeviceMessage>> = decode_all(&mut Decoder::<8>::new(), &bytes);
    assert_eq!(exact, [Received::Message(message)]);
    let short: Vec<Received<DeviceMessage>> = decode_all(&mut Decoder::<7>::new(), &bytes);
    assert_eq!(short, []);
}

#[test]
fn extra_zeros_are_not_rejects() {
    let mut decoder = HostDecoder::new();
    let received: Vec<Received<DeviceMessage>> = decode_all(&mut decoder, &[0; 9]);
    assert_eq!(received, []);
    assert_eq!(decoder.rejected(), Default::default());
}

#[test]
fn the_same_version_with_another_schema_is_foreign() {
    let prefix = HelloPrefix {
        schema: SCHEMA_HASH ^ 1,
        ..HelloPrefix::OURS
    };
    let bytes = frame(&HostMessage::Hello(prefix.into()));
    let received: Vec<Received<HostMessage>> = decode_all(&mut DeviceDecoder::new(), &bytes);
    assert_eq!(received, [Received::ForeignHello(prefix)]);
}

/// What the properties above are tested with.
#[test]
fn any_message_is_of_every_kind() {
    let mut runner = TestRunner::deterministic();
    let (mut device, mut host) = (HashSet::new(), HashSet::new());
    for _ in 0..500 {
        let message = any_device_message().new_tree(&mut runner);
        device.insert(discriminant(&message.unwrap().current()));
        let message = any_host_message().new_tree(&mut runner);
        if let HostMessage::Command(command) = message.unwrap().current() {
            host.insert(discriminant(&command.request));
        }
    }
    assert_eq!((device.len(), host.len()), (11, 24));
}
