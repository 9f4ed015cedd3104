//! Tests a conversation with the device, message by message.

use super::Device;
use crate::live::camera::Kind;
use crate::live::eye::{Disturbances, Eye, Presses};
use crate::live::hand::Hand;
use crate::live::tested::Tested;
use hivtac_twin::Layout;
use hivtac_wire::message::{DeviceMessage, HostHello, HostMessage, ModelPart, Outcome, Request};

/// A device with its camera's view of a film at rest.
fn at_rest() -> Tested {
    let kind = Kind::Ov7725;
    let scene = kind.scene("rest", Layout::default(), 1).unwrap();
    let undisturbed = Disturbances::default();
    let eye = Eye::new(kind, scene, Presses::Scene, undisturbed, Hand::default());
    Tested::new(
        Device::new(kind, Layout::default(), [7; 12], 1.0),
        eye.unwrap(),
    )
}

/// The outcome of a command's reply among messages; `None` without one.
fn outcome(messages: &[DeviceMessage], id: u16) -> Option<Outcome> {
    messages.iter().find_map(|message| match message {
        DeviceMessage::Reply(reply) if reply.id == id => Some(reply.outcome),
        _ => None,
    })
}

#[test]
fn nothing_is_said_before_a_hello_and_after_one_of_another_version() {
    let mut tested = at_rest();
    assert_eq!(tested.ask(1, Request::GetInfo), []);
    let other = HostHello {
        protocol: u16::MAX,
        schema: 0,
    };
    let messages = tested.send(&HostMessage::Hello(other));
    assert!(
        matches!(messages[..], [DeviceMessage::Hello(_)]),
        "{messages:?}"
    );
    assert_eq!(tested.ask(2, Request::GetInfo), []);
    tested.greet();
    assert_eq!(
        outcome(&tested.ask(3, Request::GetInfo), 3),
        Some(Outcome::Done)
    );
}

#[test]
fn samples_come_of_frames_once_they_are_asked_for() {
    let mut tested = at_rest();
    tested.greet();
    assert_eq!(tested.frame().1, []);
    tested.ask(1, Request::StartWithMarkers);
    let (frame, messages) = tested.frame();
    let [DeviceMessage::Sample(sample)] = &messages[..] else {
        panic!("{messages:?}");
    };
    assert_eq!(sample.frame, frame.number);
    assert!(
        sample.found().is_some() && sample.force.is_some(),
        "{sample:?}"
    );
    tested.ask(2, Request::Stop);
    assert_eq!(tested.frame().1, []);
}

#[test]
fn there_is_one_tare_at_a_time_and_it_ends_with_its_host() {
    let mut tested = at_rest();
    tested.greet();
    assert_eq!(tested.ask(1, Request::Tare { frames: 3 }), []);
    let second = tested.ask(2, Request::Tare { frames: 3 });
    assert_eq!(outcome(&second, 2), Some(Outcome::Busy));
    assert_eq!(
        outcome(&tested.ask(3, Request::Tare { frames: 0 }), 3),
        Some(Outcome::Busy)
    );
    let messages: Vec<_> = (0..3).flat_map(|_| tested.frame().1).collect();
    assert!(
        matches!(messages[0], DeviceMessage::Tared(_)),
        "{messages:?}"
    );
    assert_eq!(outcome(&messages, 1), Some(Outcome::Done));
    tested.ask(4, Request::Tare { frames: 3 });
    tested.greet();
    let messages: Vec<_> = (0..6).flat_map(|_| tested.frame().1).collect();
    assert_eq!(messages, [], "the tare of the host before");
}

#[test]
fn a_snapshot_has_the_bytes_of_its_frame() {
    let mut tested = at_rest();
    tested.greet();
    assert_eq!(tested.ask(1, Request::Snapshot), []);
    assert_eq!(
        outcome(&tested.ask(2, Request::Snapshot), 2),
        Some(Outcome::Busy)
    );
    let (frame, messages) = tested.frame();
    let expected: Vec<u8> = frame
        .words
        .iter()
        .flat_map(|word| word.to_le_bytes())
        .collect();
    assert!(matches!(&messages[0], DeviceMessage::Snapshot(header)
        if header.frame == frame.number && header.bytes as usize == expected.len()));
    let bytes: Vec<u8> = (messages.iter())
        .filter_map(|message| match message {
            DeviceMessage::SnapshotPart(part) => Some(part.bytes.iter().copied()),
            _ => None,
        })
        .flatten()
        .collect();
    assert_eq!(bytes, expected);
    assert_eq!(outcome(&messages, 1), Some(Outcome::Done));
}

#[test]
fn an_upload_that_is_not_whole_changes_nothing() {
    let mut tested = at_rest();
    tested.greet();
    let part = |offset| {
        let bytes = [0; 8].into_iter().collect();
        Request::ModelPart(ModelPart { offset, bytes })
    };
    for (id, request, expected) in [
        (1, Request::UseModel, Outcome::InvalidArgument),
        (
            2,
            Request::BeginModel { bytes: 0 },
            Outcome::InvalidArgument,
        ),
        (
            3,
            Request::BeginModel { bytes: 1 << 20 },
            Outcome::InvalidArgument,
        ),
        (4, Request::BeginModel { bytes: 12 }, Outcome::Done),
        (5, part(4), Outcome::InvalidArgument),
        (6, part(0), Outcome::Done),
        (7, part(8), Outcome::InvalidArgument),
        (8, Request::UseModel, Outcome::InvalidArgument),
        (9, Request::BeginModel { bytes: 8 }, Outcome::Done),
        (10, part(0), Outcome::Done),
        (11, Request::UseModel, Outcome::ModelUnusable),
    ] {
        assert_eq!(
            outcome(&tested.ask(id, request), id),
            Some(expected),
            "{id}"
        );
    }
    assert!(tested.device.hello().model.is_some());
}
