//! Tests of the device by USB/IP: a client that is a USB host enumerates it over TCP and talks to
//! it as Linux' drivers do. `cargo xtask test --all "linux host"` does it with Linux itself.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Child;

use crate::command::{PATIENCE, end, start};
use crate::common::hello;
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::DEVICE_FRAME_LIMIT;
use hivtac_wire::message::DeviceMessage;
use serde_json::Value;

/// Linux' numbers for the ends of transfers.
const STALLED: i32 = -32;
const UNLINKED: i32 = -104;

/// A rig with the device by USB/IP.
struct Rig {
    process: Child,
    address: String,
    folder: tempfile::TempDir,
}

impl Rig {
    fn start(options: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let stats = folder.path().join("stats").display().to_string();
        let usual = [
            "--usbip",
            "0",
            "--fault",
            "camera-absent",
            "--stats-json",
            &stats,
        ];
        let (process, ready) = start(&[&usual[..], options].concat());
        let address = ready[0].strip_prefix("usbip=").unwrap().to_owned();
        Self {
            process,
            address,
            folder,
        }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// Asks for the device of a name. Returns the connection and the status.
    fn import(&self, name: &str) -> (Client, u32) {
        let mut stream = self.connect();
        let mut request = vec![1, 0x11, 0x80, 3, 0, 0, 0, 0];
        request.extend(name.as_bytes());
        request.resize(40, 0);
        stream.write_all(&request).unwrap();
        let mut reply = [0; 8];
        stream.read_exact(&mut reply).unwrap();
        assert_eq!(reply[..4], [1, 0x11, 0, 3]);
        let status = u32::from_be_bytes([reply[4], reply[5], reply[6], reply[7]]);
        if status == 0 {
            stream.read_exact(&mut [0; 312]).unwrap();
        }
        (Client { stream, number: 0 }, status)
    }

    /// Ends the rig; returns its counters of USB and its output.
    fn end(self) -> (Value, String) {
        let process = self.process.id().to_string();
        let kill = std::process::Command::new("kill")
            .args(["-TERM", &process])
            .status();
        assert!(kill.unwrap().success());
        let (code, error) = end(self.process);
        assert_eq!(code, Some(0), "{error}");
        let stats = std::fs::read(self.folder.path().join("stats")).unwrap();
        let stats: Value = serde_json::from_slice(&stats).unwrap();
        (stats["usb"].clone(), error)
    }
}

/// A client that has the device.
struct Client {
    stream: TcpStream,
    number: u32,
}

impl Client {
    fn send(&mut self, code: u32, [is_in, endpoint]: [u32; 2], rest: &[u8]) -> u32 {
        self.number += 1;
        let head = [code, self.number, 0x1_0001, is_in, endpoint];
        let mut bytes: Vec<u8> = head.into_iter().flat_map(u32::to_be_bytes).collect();
        bytes.extend(rest);
        bytes.resize(bytes.len().max(48), 0);
        self.stream.write_all(&bytes).unwrap();
        self.number
    }

    /// Submits a transfer; returns its number.
    fn submit(&mut self, endpoint: u8, setup: [u8; 8], length: u32, data: &[u8]) -> u32 {
        let mut rest: Vec<u8> = [0, length, 0, 0, 0]
            .into_iter()
            .flat_map(u32::to_be_bytes)
            .collect();
        rest.extend(setup);
        rest.extend(data);
        self.send(1, [endpoint >> 7, endpoint & 15].map(u32::from), &rest)
    }

    /// Takes a transfer back; returns the status. Transfers of the device may end before.
    fn unlink(&mut self, number: u32) -> i32 {
        let unlink = self.send(2, [0, 0], &number.to_be_bytes());
        loop {
            let (code, of, status, _) = self.answer(true);
            if code == 4 {
                assert_eq!(of, unlink);
                return status;
            }
        }
    }

    /// Returns the next answer: code, number, status, and the bytes of the device.
    fn answer(&mut self, is_in: bool) -> (u32, u32, i32, Vec<u8>) {
        let mut head = [0; 48];
        self.stream.read_exact(&mut head).unwrap();
        let word = |n: usize| u32::from_be_bytes([0, 1, 2, 3].map(|k| head[4 * n + k]));
        let mut data = Vec::new();
        if word(0) == 3 && is_in {
            data.resize(word(6) as usize, 0);
            self.stream.read_exact(&mut data).unwrap();
        }
        (word(0), word(1), word(5) as i32, data)
    }

    /// Makes a control transfer; returns its status and the bytes of the device.
    fn control(&mut self, setup: [u8; 8], data: &[u8]) -> (i32, Vec<u8>) {
        let (is_in, length) = (
            setup[0] & 0x80 != 0,
            u16::from_le_bytes([setup[6], setup[7]]),
        );
        let endpoint = if is_in { 0x80 } else { 0 };
        let number = self.submit(endpoint, setup, length.into(), data);
        let (code, of, status, data) = self.answer(is_in);
        assert_eq!((code, of), (3, number));
        (status, data)
    }

    /// Enumerates a new device as Linux does. Returns the configuration.
    fn enumerate(&mut self) -> Vec<u8> {
        let (status, device) = self.control([0x80, 6, 0, 1, 0, 0, 64, 0], &[]);
        assert_eq!(
            (status, device.len(), device[..2].to_vec()),
            (0, 18, vec![18, 1])
        );
        let (_, again) = self.control([0x80, 6, 0, 1, 0, 0, 18, 0], &[]);
        assert_eq!(again, device);
        let (_, first) = self.control([0x80, 6, 0, 2, 0, 0, 9, 0], &[]);
        let (_, whole) = self.control([0x80, 6, 0, 2, 0, 0, first[2], first[3]], &[]);
        assert_eq!(whole.len(), usize::from(first[2]));
        assert_eq!(
            self.control([0, 9, whole[5], 0, 0, 0, 0, 0], &[]),
            (0, vec![])
        );
        whole
    }

    /// Opens the serial port as Linux' driver does.
    fn open(&mut self) {
        let coding = [0, 0xC2, 1, 0, 0, 0, 8];
        assert_eq!(self.control([0x21, 0x20, 0, 0, 0, 0, 7, 0], &coding).0, 0);
        assert_eq!(self.control([0x21, 0x22, 3, 0, 0, 0, 0, 0], &[]).0, 0);
    }

    /// Says hello until the device answers, with two transfers that wait for its bytes.
    fn greet(&mut self, bulk_in: u8, bulk_out: u8) {
        let mut decoder = Decoder::<DEVICE_FRAME_LIMIT>::new();
        let hello = hello();
        for _ in 0..2 {
            self.submit(bulk_in, [0; 8], 128, &[]);
        }
        let out = self.submit(bulk_out, [0; 8], hello.len() as u32, &hello);
        assert_eq!(self.answer(false), (3, out, 0, vec![]));
        for _ in 0..50 {
            let (_, _, status, data) = self.answer(true);
            assert_eq!(status, 0);
            if let Some(Received::Message(DeviceMessage::Hello(hello))) =
                decoder.feed(&mut &data[..])
            {
                assert_eq!(hello.width, 320);
                return;
            }
            self.submit(bulk_in, [0; 8], 128, &[]);
        }
        panic!("no hello");
    }
}

/// Returns the bulk endpoints of a configuration: in, out.
fn bulk(configuration: &[u8]) -> [u8; 2] {
    let mut found = [0; 2];
    let mut rest = configuration;
    while let [length, kind, address, attributes, ..] = *rest {
        if (kind, attributes) == (5, 2) {
            found[usize::from(address & 0x80 == 0)] = address;
        }
        rest = &rest[usize::from(length)..];
    }
    found
}

#[test]
fn a_host_lists_enumerates_and_talks_to_the_device() {
    let rig = Rig::start(&[]);
    let mut visitor = rig.connect();
    visitor.write_all(&[1, 0x11, 0x80, 5, 0, 0, 0, 0]).unwrap();
    let mut list = Vec::new();
    visitor.read_to_end(&mut list).unwrap();
    assert_eq!(
        (list.len(), &list[..12]),
        (12 + 312 + 8, &[1, 0x11, 0, 5, 0, 0, 0, 0, 0, 0, 0, 1][..])
    );
    assert_eq!(list[0x138..0x13C], [0x12, 0x09, 0, 1]);

    let (mut client, status) = rig.import("1-1");
    assert_eq!(status, 0);
    assert_eq!(rig.import("1-1").1, 2, "another client has it");
    assert_eq!(rig.import("2-1").1, 4, "there is no such device");
    let [bulk_in, bulk_out] = bulk(&client.enumerate());
    assert_eq!(client.control([0x80, 6, 0, 6, 0, 0, 10, 0], &[]).0, STALLED);
    client.open();
    client.greet(bulk_in, bulk_out);
    // One transfer still waits; the interrupt endpoint never has anything.
    let waits = client.submit(0x81, [0; 8], 8, &[]);
    for number in [waits, client.number - 1] {
        assert!([UNLINKED, 0].contains(&client.unlink(number)));
    }
    assert_eq!(client.unlink(1), 0, "it ended long ago");
    drop(client);
    let (stats, _) = rig.end();
    assert_eq!(stats["failed_transfers"], 0);
    assert_eq!(stats["port_resets"], 1);
}

/// After a reset of the port, a suspend and a pulled cable the device answers again.
#[test]
fn a_port_is_reset_suspended_and_pulled() {
    let rig = Rig::start(&[]);
    let (mut client, _) = rig.import("1-1");
    let [bulk_in, bulk_out] = bulk(&client.enumerate());
    client.open();
    client.greet(bulk_in, bulk_out);
    let waits = client.number;
    for number in [waits, waits - 1] {
        client.unlink(number);
    }
    // Without a transfer the port is suspended, silently; the next one resumes it.
    std::thread::sleep(std::time::Duration::from_secs(2));
    assert_eq!(client.control([0x80, 0, 0, 0, 0, 0, 2, 0], &[]).0, 0);
    client.enumerate();
    client.open();
    client.greet(bulk_in, bulk_out);
    // With transfers under way.
    client.submit(bulk_in, [0; 8], 128, &[]);
    drop(client);
    let (mut client, status) = rig.import("1-1");
    assert_eq!(status, 0);
    client.enumerate();
    client.open();
    client.greet(bulk_in, bulk_out);
    let (stats, _) = rig.end();
    assert_eq!(stats["port_resets"], 3);
    assert!(stats["suspends"].as_u64() > Some(0), "{stats}");
    assert_eq!(stats["repeated_packets"], 0);
}

/// A client of another protocol is sent away, and why is said; the rig goes on.
#[test]
fn what_is_no_usbip_is_sent_away() {
    let rig = Rig::start(&[]);
    for (bytes, why) in [
        (&b"GET / HTTP/1.1\r\n\r\n"[..], "version 0x4745"),
        (&[1, 6, 0x80, 5, 0, 0, 0, 0], "version 0x0106"),
        (&[1, 0x11, 0, 1, 0, 0, 0, 0], "import the device first"),
    ] {
        let mut visitor = rig.connect();
        visitor.write_all(bytes).unwrap();
        let mut left = Vec::new();
        // The end may be a reset, if bytes were left.
        let _ = visitor.read_to_end(&mut left);
        assert!(left.is_empty(), "{why}");
    }
    let (mut client, _) = rig.import("1-1");
    client.enumerate();
    client.send(9, [0, 0], &[]);
    assert!(
        client
            .stream
            .read_to_end(&mut Vec::new())
            .is_ok_and(|read| read == 0)
    );
    let (_, said) = rig.end();
    for why in [
        "version 0x4745",
        "version 0x0106",
        "import the device first",
        "no command",
    ] {
        assert!(said.contains(why), "{why}: {said}");
    }
}

/// A client that never reads its answers is sent away; the rig goes on.
#[test]
#[ignore = "5 s"]
fn one_that_sends_and_never_reads_is_sent_away() {
    let rig = Rig::start(&[]);
    let (mut client, status) = rig.import("1-1");
    assert_eq!(status, 0);
    client.stream.set_write_timeout(Some(PATIENCE)).unwrap();
    let mut unlink: Vec<u8> = [2, 1, 0x1_0001, 0, 0, 1]
        .into_iter()
        .flat_map(u32::to_be_bytes)
        .collect();
    unlink.resize(48, 0);
    let many = unlink.repeat(1 << 14);
    let end = (0..128).find_map(|_| client.stream.write_all(&many).err());
    let end = end.expect("100 MB of answers wait").kind();
    assert_ne!(end, std::io::ErrorKind::WouldBlock);
    assert_eq!(rig.import("1-1").1, 0);
    let (_, said) = rig.end();
    assert!(said.contains("it does not read"), "{said}");
}

/// A device that leaves the bus ends the connection.
#[test]
#[ignore = "7 s"]
fn a_host_is_left_when_the_cable_is_pulled_at_the_device() {
    let rig = Rig::start(&["--fault", "cable-pulled@400-500"]);
    let (mut client, _) = rig.import("1-1");
    client.enumerate();
    client.submit(0x81, [0; 8], 8, &[]);
    assert!(
        client
            .stream
            .read_to_end(&mut Vec::new())
            .is_ok_and(|read| read == 0)
    );
    assert_eq!(rig.import("1-1").1, 0);
    rig.end();
}
