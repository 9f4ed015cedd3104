//! Tests of the UART for samples: it sends USB's samples without a host, at its rate.

use crate::common::{Run, Setup, firmware, openmv};
use hivtac_rig::script::Action;
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::DEVICE_FRAME_LIMIT;
use hivtac_wire::message::{DeviceMessage, Sample};
use hivtac_wire::uart::BAUD;
use hivtac_wire::version::HelloPrefix;

/// Returns all messages of the line.
fn messages(run: &Run) -> Vec<DeviceMessage> {
    let bytes: Vec<u8> = run.report.uart.iter().map(|heard| heard.byte).collect();
    let (mut decoder, mut rest) = (Decoder::<DEVICE_FRAME_LIMIT>::new(), &bytes[..]);
    let mut messages = Vec::new();
    while let Some(received) = decoder.feed(&mut rest) {
        match received {
            Received::Message(message) => messages.push(message),
            Received::ForeignHello(prefix) => panic!("{prefix:?}"),
        }
    }
    assert_eq!(decoder.rejected().frames(), 0);
    messages
}

fn samples(messages: &[DeviceMessage]) -> Vec<Sample> {
    let samples = messages.iter().filter_map(|message| match message {
        DeviceMessage::Sample(sample) => Some(sample.clone()),
        _ => None,
    });
    samples.collect()
}

/// Asserts that no sample of the line was dropped.
fn assert_whole(samples: &[Sample]) {
    for pair in samples.windows(2) {
        assert_eq!(pair[1].sequence, pair[0].sequence + 1);
    }
}

#[test]
fn the_samples_are_those_of_usb() {
    for setup in [Setup::new(firmware(), 900), openmv(700)] {
        let run = setup.run();
        let over_uart = samples(&messages(&run));
        assert_whole(&over_uart);
        let over_usb = run.samples();
        assert!(over_usb.len() >= 100, "{}", over_usb.len());
        let first = over_uart
            .iter()
            .position(|sample| sample.frame == over_usb[0].frame)
            .expect("the first sample of USB");
        let same = over_uart[first..].iter().zip(over_usb);
        assert!(same.len() >= 100);
        for (uart, usb) in same {
            let sequence = usb.sequence;
            assert_eq!(
                &Sample {
                    sequence,
                    ..uart.clone()
                },
                usb
            );
        }
    }
}

/// Without a host, too, each second has one hello and one report of counters.
#[test]
fn it_needs_no_host() {
    let closed = Setup::new(firmware(), 1_700).at(0, Action::Close);
    let messages = messages(&closed.run());
    let hellos = messages.iter().filter_map(|message| match message {
        DeviceMessage::Hello(hello) => Some((hello.protocol, hello.schema)),
        _ => None,
    });
    let ours = (HelloPrefix::OURS.protocol, HelloPrefix::OURS.schema);
    assert_eq!(hellos.collect::<Vec<_>>(), [ours; 2]);
    let stats = |message: &&DeviceMessage| matches!(message, DeviceMessage::Stats(_));
    assert_eq!(messages.iter().filter(stats).count(), 1);
    assert!(samples(&messages).len() >= 100);
}

/// A byte takes ten bits: within a frame, each comes so long after the one before.
#[test]
fn it_has_its_rate() {
    let run = Setup::new(firmware(), 400).run();
    let heard = &run.report.uart;
    let pause = |pair: &[hivtac_rig::uart_line::UartByte]| pair[1].at_ns - pair[0].at_ns;
    let shortest = heard.windows(2).map(pause).min().expect("bytes");
    assert_eq!(shortest, 10 * 1_000_000_000 / u64::from(BAUD));
}
