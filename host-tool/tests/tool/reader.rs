//! Tests the library's reader: arrival times, newest sample, bounded queue.

use crate::fake::*;
use hivtac_host::failure::Kind;
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::reader::{Arrived, ROOM, Reader};
use hivtac_wire::message::{HostMessage, Request};
use std::sync::mpsc;
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(20);
/// Time between two samples.
const PERIOD: Duration = Duration::from_millis(5);

/// A device that sends this many samples, `PERIOD` apart, then says so; then it serves requests.
fn device(count: u32, period: Duration, sent: mpsc::Sender<()>) -> FakeDevice {
    FakeDevice::on_tcp([Box::new(move |device: &mut Conversation| {
        while let Some(message) = device.next() {
            let is_start = matches!(&message, HostMessage::Command(command)
                if command.request == Request::StartWithMarkers);
            device.answer_to(message);
            if is_start {
                for number in 0..count {
                    device.send(sample(number, number));
                    std::thread::sleep(period);
                }
                sent.send(()).unwrap();
            }
        }
    })])
}

fn reader(port: &str) -> Reader {
    let (link, _) = Link::connect(&Address::parse(port), PATIENCE).unwrap();
    let reader = Reader::start(link);
    reader.stream(PATIENCE).unwrap();
    reader
}

/// A request's answer comes after all samples, so that they have arrived.
fn ask(reader: &Reader) {
    let ask = |link: &mut Link, others: hivtac_host::reader::Others<'_>| {
        link.request(Request::GetInfo, PATIENCE, others)
    };
    reader.with(ask).unwrap();
}

#[test]
fn samples_have_the_time_of_their_arrival_however_late_they_are_taken() {
    let (sent, is_sent) = mpsc::channel();
    let device = device(40, PERIOD, sent);
    let reader = reader(&device.port);
    is_sent.recv_timeout(PATIENCE).unwrap();
    ask(&reader);
    let all: Vec<_> = (0..40).map(|_| reader.next_sample().unwrap()).collect();
    assert!(all.iter().map(|arrived| arrived.sample.sequence).eq(0..40));
    let lasted_ns = all[39].came_ns - all[0].came_ns;
    assert!(lasted_ns >= 150_000_000, "{lasted_ns}");
    assert!(
        all.iter()
            .all(|arrived| arrived.exposed_ns <= arrived.came_ns)
    );
    assert_eq!(reader.missed(), 0);
}

#[test]
fn the_newest_passes_over_those_before_and_the_queue_has_an_end() {
    let (sent, is_sent) = mpsc::channel();
    let count = ROOM as u32 + 10;
    let device = device(count, Duration::ZERO, sent);
    let reader = reader(&device.port);
    is_sent.recv_timeout(PATIENCE).unwrap();
    ask(&reader);
    assert_eq!(reader.missed(), 10);
    assert_eq!(reader.next_sample().unwrap().sample.sequence, 10);
    assert_eq!(reader.newest().unwrap().sample.sequence, count - 1);
    assert_eq!(reader.missed(), u64::from(count) - 2);
}

#[test]
fn a_wait_has_an_end_and_takes_what_is_there() {
    let (sent, is_sent) = mpsc::channel();
    let device = device(3, Duration::ZERO, sent);
    let reader = reader(&device.port);
    is_sent.recv_timeout(PATIENCE).unwrap();
    ask(&reader);
    let sequence = |arrived: Option<Arrived>| arrived.map(|arrived| arrived.sample.sequence);
    let none = Duration::ZERO;
    assert_eq!(sequence(reader.next_within(none).unwrap()), Some(0));
    assert_eq!(sequence(reader.newest_within(PATIENCE).unwrap()), Some(2));
    assert_eq!(sequence(reader.newest_within(none).unwrap()), None);
    let (began, wait) = (Instant::now(), Duration::from_millis(120));
    assert_eq!(sequence(reader.next_within(wait).unwrap()), None);
    assert!(began.elapsed() >= wait, "{:?}", began.elapsed());
    assert_eq!(reader.missed(), 1);
}

#[test]
fn a_lost_connection_is_reported_after_the_last_sample() {
    let device = FakeDevice::on_tcp([Box::new(|device: &mut Conversation| {
        assert!((0..3).all(|_| device.answer_one()));
        device.send(sample(0, 0));
        device.end_after_what_was_sent();
    })]);
    let reader = reader(&device.port);
    assert_eq!(reader.next_sample().unwrap().sample.sequence, 0);
    assert_eq!(reader.next_sample().unwrap_err().kind, Kind::Lost);
    let at_once = reader.newest_within(Duration::ZERO);
    assert_eq!(at_once.unwrap_err().kind, Kind::Lost);
    let asked = reader.with(|link, others| link.request(Request::GetInfo, PATIENCE, others));
    assert_eq!(asked.unwrap_err().kind, Kind::Lost);
}
