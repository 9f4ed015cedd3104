//! The messages of USB/IP, version 1.1.1, as bytes: those that a client sends are read, those that
//! a server sends are written. All numbers are big-endian.
//!
//! Linux' `Documentation/usb/usbip_protocol.rst` is the specification. Not supported: isochronous
//! transfers.

use std::collections::VecDeque;

use anyhow::{Context, bail, ensure};

use crate::usb_host::Description;
use crate::usb_host::urbs::{Done, Urb};

/// Version 1.1.1.
const VERSION: u16 = 0x0111;
const REQUEST_LIST: u16 = 0x8005;
const REQUEST_IMPORT: u16 = 0x8003;
const REPLY_LIST: u16 = 0x0005;
const REPLY_IMPORT: u16 = 0x0003;
const SUBMIT: u32 = 1;
const UNLINK: u32 = 2;
const SUBMITTED: u32 = 3;
const UNLINKED: u32 = 4;
/// Length of a command or of its answer, without data.
const HEADER: usize = 48;
/// Length of a name on the bus, closed with a zero.
const BUS_ID: usize = 32;
/// Length of a device's path, closed with a zero.
const PATH: usize = 256;
/// Largest transfer. Linux' drivers ask for less; a longer one is no memory's worth.
pub const LARGEST_TRANSFER: usize = 1 << 20;
/// Speed of a full-speed device.
const FULL_SPEED: u32 = 2;
const BUS_NUMBER: u32 = 1;
const DEVICE_NUMBER: u32 = 1;
/// Name of the device on its bus.
pub const NAME: &str = "1-1";

/// The status of an import.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Another client has the device.
    Busy = 2,
    /// The device did not answer as one.
    Failed = 3,
    /// There is no device of this name.
    Unknown = 4,
}

/// A client's request before it has the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// The list of devices.
    List,
    /// The device with this name.
    Import(String),
}

/// A client's request once it has the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// A transfer.
    Submit(Urb),
    /// The end of a transfer.
    Unlink {
        /// Number of this command.
        number: u32,
        /// Number of the transfer.
        target: u32,
    },
}

/// Takes the first request; `None` until it is complete.
///
/// # Errors
/// If the bytes are no request of this version.
pub fn request(bytes: &mut VecDeque<u8>) -> anyhow::Result<Option<Request>> {
    let Some(word) = word(bytes, 0) else {
        return Ok(None);
    };
    let (version, code) = ((word >> 16) as u16, word as u16);
    ensure!(
        version == VERSION,
        "the client speaks version {version:#06x} of USB/IP, the rig {VERSION:#06x}"
    );
    let (length, is_import) = match code {
        REQUEST_LIST => (8, false),
        REQUEST_IMPORT => (8 + BUS_ID, true),
        other => bail!("{other:#06x} is no request of USB/IP: import the device first"),
    };
    let Some(taken) = take(bytes, length) else {
        return Ok(None);
    };
    if !is_import {
        return Ok(Some(Request::List));
    }
    let name = taken[8..].split(|byte| *byte == 0).next().unwrap_or(&[]);
    let name = String::from_utf8_lossy(name).into_owned();
    Ok(Some(Request::Import(name)))
}

/// Takes the first command; `None` until it is complete.
///
/// # Errors
/// If the bytes are no command, or one that is not supported.
pub fn command(bytes: &mut VecDeque<u8>) -> anyhow::Result<Option<Command>> {
    let Some(header) = header(bytes) else {
        return Ok(None);
    };
    let [code, number, _device, direction, endpoint] = [0, 1, 2, 3, 4].map(|n| header[n]);
    match code {
        UNLINK => {
            take(bytes, HEADER);
            let target = header[5];
            return Ok(Some(Command::Unlink { number, target }));
        }
        SUBMIT => {}
        other => bail!("{other:#010x} is no command of USB/IP"),
    }
    ensure!(direction <= 1, "direction {direction} is none");
    let endpoint = u8::try_from(endpoint).ok().filter(|number| *number < 16);
    let endpoint = endpoint.context("an endpoint above 15")?;
    let [flags, length, _frame, packets, interval] = [5, 6, 7, 8, 9].map(|n| header[n]);
    ensure!(
        packets == 0 || packets == u32::MAX,
        "isochronous transfers are not supported"
    );
    let length = usize::try_from(length)?;
    ensure!(
        length <= LARGEST_TRANSFER,
        "a transfer of {length} bytes; at most {LARGEST_TRANSFER} are possible"
    );
    let is_in = direction == 1;
    let Some(taken) = take(bytes, HEADER + if is_in { 0 } else { length }) else {
        return Ok(None);
    };
    let mut setup = [0; 8];
    setup.copy_from_slice(&taken[40..HEADER]);
    Ok(Some(Command::Submit(Urb {
        number,
        packets,
        endpoint: endpoint | if is_in { 0x80 } else { 0 },
        setup,
        data: taken[HEADER..].to_vec(),
        length,
        interval_ms: interval,
        refuses_short: flags & 1 != 0,
        ends_with_empty: flags & 0x40 != 0,
    })))
}

/// Returns the first ten words of a command; `None` until its header is complete.
fn header(bytes: &VecDeque<u8>) -> Option<[u32; 10]> {
    let mut header = [0; 10];
    for (n, to) in header.iter_mut().enumerate() {
        *to = word(bytes, 4 * n)?;
    }
    (bytes.len() >= HEADER).then_some(header)
}

/// Returns the word at an offset, if it is there.
fn word(bytes: &VecDeque<u8>, at: usize) -> Option<u32> {
    let byte = |n| bytes.get(at + n).copied();
    Some(u32::from_be_bytes([byte(0)?, byte(1)?, byte(2)?, byte(3)?]))
}

/// Takes this many bytes, if they are there.
fn take(bytes: &mut VecDeque<u8>, length: usize) -> Option<Vec<u8>> {
    (bytes.len() >= length).then(|| bytes.drain(..length).collect())
}

/// Returns the answer to a request for the list: one device, or none.
pub fn list(device: Option<&Description>) -> Vec<u8> {
    let mut bytes = reply(REPLY_LIST, 0);
    bytes.extend(u32::from(device.is_some()).to_be_bytes());
    if let Some(device) = device {
        bytes.extend(record(device));
        for &[class, subclass, protocol] in &device.interfaces {
            bytes.extend([class, subclass, protocol, 0]);
        }
    }
    bytes
}

/// Returns the answer to an import that succeeded.
pub fn imported(device: &Description) -> Vec<u8> {
    let mut bytes = reply(REPLY_IMPORT, 0);
    bytes.extend(record(device));
    bytes
}

/// Returns the answer to an import that did not.
pub fn refused(why: Refusal) -> Vec<u8> {
    reply(REPLY_IMPORT, why as u32)
}

fn reply(code: u16, status: u32) -> Vec<u8> {
    let mut bytes = [VERSION.to_be_bytes(), code.to_be_bytes()].concat();
    bytes.extend(status.to_be_bytes());
    bytes
}

/// Returns a device's 312 bytes in both answers.
fn record(device: &Description) -> Vec<u8> {
    let mut bytes = text::<PATH>("/hivtac-rig/usb1/1-1").to_vec();
    bytes.extend(text::<BUS_ID>(NAME));
    for word in [BUS_NUMBER, DEVICE_NUMBER, FULL_SPEED] {
        bytes.extend(word.to_be_bytes());
    }
    let of = &device.device;
    // Vendor, product and version are little-endian in a descriptor.
    bytes.extend([of[9], of[8], of[11], of[10], of[13], of[12]]);
    bytes.extend([of[4], of[5], of[6], device.configuration, of[17]]);
    bytes.push(device.interfaces.len() as u8);
    bytes
}

fn text<const LENGTH: usize>(text: &str) -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    let length = text.len().min(LENGTH - 1);
    bytes[..length].copy_from_slice(&text.as_bytes()[..length]);
    bytes
}

/// Returns the answer to a transfer that ended.
pub fn submitted(done: &Done) -> Vec<u8> {
    let body = [done.status as u32, done.length as u32, 0, done.packets, 0];
    let mut bytes = answer(SUBMITTED, done.number, &body);
    bytes.extend(&done.data);
    bytes
}

/// Returns the answer to a command that ended a transfer, or came too late to.
pub fn unlinked(number: u32, status: i32) -> Vec<u8> {
    answer(UNLINKED, number, &[status as u32])
}

fn answer(code: u32, number: u32, body: &[u32]) -> Vec<u8> {
    // The device, the direction and the endpoint are zero in answers.
    let words = [code, number, 0, 0, 0]
        .into_iter()
        .chain(body.iter().copied());
    let mut bytes: Vec<u8> = words.flat_map(u32::to_be_bytes).collect();
    bytes.resize(HEADER, 0);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns bytes from words of hexadecimal digits.
    fn bytes(text: &str) -> VecDeque<u8> {
        let digits: Vec<u8> = text.bytes().filter(u8::is_ascii_hexdigit).collect();
        let pairs = digits
            .chunks(2)
            .map(|pair| std::str::from_utf8(pair).unwrap());
        pairs
            .map(|pair| u8::from_str_radix(pair, 16).unwrap())
            .collect()
    }

    fn device() -> Description {
        Description {
            device: [
                18, 1, 0x10, 2, 0xEF, 2, 1, 64, 0x09, 0x12, 0x02, 0x00, 0x34, 0x01, 1, 2, 3, 1,
            ],
            configuration: 1,
            interfaces: vec![[2, 2, 1], [10, 0, 0]],
        }
    }

    /// The example of the specification: an interrupt transfer in.
    #[test]
    fn a_transfer_in_is_read() {
        let mut bytes = bytes(
            "00000001 00000d05 0001000f 00000001 00000001 00000200 00000040 ffffffff 00000000 \
             00000004 00000000 00000000",
        );
        let urb = Urb {
            number: 0xD05,
            packets: 0,
            endpoint: 0x81,
            setup: [0; 8],
            data: Vec::new(),
            length: 64,
            interval_ms: 4,
            refuses_short: false,
            ends_with_empty: false,
        };
        assert_eq!(command(&mut bytes).unwrap(), Some(Command::Submit(urb)));
        assert!(bytes.is_empty());
    }

    /// The example of the specification: an interrupt transfer out, with its data. Each part of it
    /// is incomplete.
    #[test]
    fn a_transfer_out_is_read_with_its_data_once_it_is_complete() {
        let mut whole = bytes(
            "00000001 00000d06 0001000f 00000000 00000001 00000000 00000040 ffffffff 00000000 \
             00000004 00000000 00000000 ffffffff860008a784ce5ae21237630000000000 \
             0000000000000000000000000000000000000000000000000000000000000000 \
             0000000000000000000000000000000000",
        );
        whole.resize(HEADER + 64, 0);
        for length in 0..whole.len() {
            let mut part: VecDeque<u8> = whole.iter().take(length).copied().collect();
            assert_eq!(command(&mut part).unwrap(), None);
            assert_eq!(part.len(), length);
        }
        let Some(Command::Submit(urb)) = command(&mut whole).unwrap() else {
            panic!("no transfer")
        };
        assert_eq!((urb.endpoint, urb.length, urb.data.len()), (1, 64, 64));
        assert_eq!(urb.data[..8], [0xFF, 0xFF, 0xFF, 0xFF, 0x86, 0, 8, 0xA7]);
    }

    /// The two answers to them in the specification; a server's start frame is free.
    #[test]
    fn the_end_of_a_transfer_is_written() {
        let done = Done {
            number: 0xD06,
            packets: 0,
            status: 0,
            length: 64,
            data: Vec::new(),
        };
        let expected = bytes(
            "00000003 00000d06 00000000 00000000 00000000 00000000 00000040 00000000 00000000 \
             00000000 00000000 00000000",
        );
        assert_eq!(expected, submitted(&done));
        let read = Done {
            number: 0xD05,
            length: 3,
            data: vec![1, 2, 3],
            ..done
        };
        assert_eq!(submitted(&read)[HEADER..], [1, 2, 3]);
    }

    #[test]
    fn an_unlink_and_its_answer() {
        let mut bytes_in = bytes(
            "00000002 00000010 00010001 00000000 00000000 0000000e 00000000 00000000 00000000 \
             00000000 00000000 00000000",
        );
        let unlink = Command::Unlink {
            number: 16,
            target: 14,
        };
        assert_eq!(command(&mut bytes_in).unwrap(), Some(unlink));
        let expected = bytes(
            "00000004 00000010 00000000 00000000 00000000 ffffff98 00000000 00000000 00000000 \
             00000000 00000000 00000000",
        );
        assert_eq!(expected, unlinked(16, -104));
    }

    #[test]
    fn requests_are_read() {
        let mut list = bytes("0111 8005 00000000");
        assert_eq!(request(&mut list).unwrap(), Some(Request::List));
        let mut import = bytes("0111 8003 00000000 312d31 00");
        assert_eq!(request(&mut import).unwrap(), None);
        import.resize(40, 0);
        let named = Request::Import("1-1".to_owned());
        assert_eq!(request(&mut import).unwrap(), Some(named));
        let why = |text| request(&mut bytes(text)).unwrap_err().to_string();
        assert!(why("0106 8005 00000000").contains("version 0x0106"));
        assert!(why("0111 0001 00000000").contains("import the device first"));
    }

    #[test]
    fn a_device_has_312_bytes_and_each_interface_four() {
        let with = list(Some(&device()));
        assert_eq!(with.len(), 12 + 312 + 8);
        assert_eq!(with[..12], [1, 0x11, 0, 5, 0, 0, 0, 0, 0, 0, 0, 1]);
        assert_eq!(with[12 + 256..][..4], *b"1-1\0");
        assert_eq!(with[0x12C..0x138], [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2]);
        assert_eq!(with[0x138..0x13E], [0x12, 0x09, 0, 2, 1, 0x34]);
        assert_eq!(with[0x13E..0x144], [0xEF, 2, 1, 1, 1, 2]);
        assert_eq!(with[0x144..], [2, 2, 1, 0, 10, 0, 0, 0]);
        assert_eq!(list(None), [1, 0x11, 0, 5, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(imported(&device())[..8], [1, 0x11, 0, 3, 0, 0, 0, 0]);
        assert_eq!(imported(&device())[8..], with[12..12 + 312]);
        assert_eq!(refused(Refusal::Unknown), [1, 0x11, 0, 3, 0, 0, 0, 4]);
    }

    #[test]
    fn what_cannot_be_served_is_named() {
        let rest = "00000000 00000000 00000000";
        for (words, why) in [
            (
                "00000001 00000001 00000000 40000000 00000000 00000000",
                "1073741824 bytes",
            ),
            (
                "00000001 00000001 00000000 00000040 00000000 00000008",
                "isochronous",
            ),
            (
                "00000001 00000010 00000000 00000040 00000000 00000000",
                "endpoint",
            ),
            (
                "00000002 00000001 00000000 00000040 00000000 00000000",
                "direction",
            ),
        ] {
            let text = format!("00000001 00000001 00010001 {words} {rest}");
            let error = command(&mut bytes(&text)).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(mut any in prop::collection::vec(any::<u8>(), 0..200)) {
            for start in [&[][..], &[1, 0x11, 0x80, 3], &[0, 0, 0, 1], &[0, 0, 0, 2]] {
                any.splice(..start.len().min(any.len()), start.iter().copied());
                let mut bytes: VecDeque<u8> = any.iter().copied().collect();
                while let Ok(Some(_)) = request(&mut bytes) {}
                let mut bytes: VecDeque<u8> = any.iter().copied().collect();
                while let Ok(Some(_)) = command(&mut bytes) {}
            }
        }
    }
}
