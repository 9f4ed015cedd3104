//! Tests of the command `hivtac-rig`: ready line, clients, hang-up, signals, limits and errors.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::{firmware, hello};
use hivtac_rig::peripherals::flash::Contents;
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::DEVICE_FRAME_LIMIT;
use hivtac_wire::message::DeviceMessage;

/// Longest wall time of a test's wait.
pub const PATIENCE: Duration = Duration::from_secs(120);

fn rig() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hivtac-rig"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Starts a rig and reads its ready line. Returns the words after `ready`.
pub fn start(arguments: &[&str]) -> (Child, Vec<String>) {
    let mut child = rig().arg(firmware()).args(arguments).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.as_mut().unwrap())
        .read_line(&mut line)
        .unwrap();
    let mut words = line.split_whitespace().map(str::to_owned);
    assert_eq!(words.next().as_deref(), Some("ready"), "{line}");
    (child, words.collect())
}

/// Waits for the end. Returns the exit code and the standard error.
pub fn end(mut child: Child) -> (Option<i32>, String) {
    let began = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if began.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("the rig did not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut error = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut error)
        .unwrap();
    (child.wait().unwrap().code(), error)
}

/// Sends hello again and again until the device answers, like a client that does not know when the
/// device listens.
fn greet(port: &mut (impl Read + Write)) -> DeviceMessage {
    let mut decoder = Decoder::<DEVICE_FRAME_LIMIT>::new();
    let began = Instant::now();
    loop {
        assert!(began.elapsed() < PATIENCE, "no hello");
        port.write_all(&hello()).unwrap();
        let mut buffer = [0; 512];
        let length = match port.read(&mut buffer) {
            Ok(0) => panic!("the rig hung up"),
            Ok(length) => length,
            Err(_) => continue,
        };
        let mut bytes = &buffer[..length];
        if let Some(Received::Message(message)) = decoder.feed(&mut bytes) {
            return message;
        }
    }
}

#[test]
#[ignore = "6 s"]
fn a_tcp_client_is_served_and_its_hangup_ends_the_run() {
    let (child, ready) = start(&["--tcp", "0", "--exit-on-hangup"]);
    let address = ready[0].strip_prefix("tcp=").unwrap();
    let mut client = TcpStream::connect(address).unwrap();
    client
        .set_read_timeout(Some(Duration::from_secs(2)))
        .unwrap();
    assert!(matches!(greet(&mut client), DeviceMessage::Hello(hello) if hello.width == 320));
    drop(client);
    let (code, error) = end(child);
    assert_eq!(code, Some(0), "{error}");
    assert!(error.contains("virtual time"), "{error}");
}

#[test]
#[ignore = "6 s: as over TCP"]
fn a_terminal_client_is_served_and_its_hangup_ends_the_run() {
    let directory = tempfile::tempdir().unwrap();
    let link = directory.path().join("port");
    let (child, ready) = start(&[
        "--pty",
        "--pty-link",
        link.to_str().unwrap(),
        "--exit-on-hangup",
    ]);
    assert!(ready[0].starts_with("pty=/dev/"), "{ready:?}");
    let mut client = std::fs::OpenOptions::new()
        .read(true)
        .write(true)
        .open(&link)
        .unwrap();
    assert!(matches!(greet(&mut client), DeviceMessage::Hello(_)));
    drop(client);
    let (code, error) = end(child);
    assert_eq!(code, Some(0), "{error}");
    assert!(!link.exists());
}

#[test]
fn a_signal_ends_a_rig_that_waits_for_its_client() {
    let (child, _) = start(&["--tcp", "0"]);
    let process = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-TERM", &process])
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(end(child).0, Some(0));
}

/// A signal while the firmware runs, and one while the rig waits for its client: both leave the
/// whole bank, and no other file.
#[test]
fn a_signal_keeps_the_flash() {
    for (signal, options) in [("-INT", &["--no-wait"][..]), ("-TERM", &[])] {
        let directory = tempfile::tempdir().unwrap();
        let flash = directory.path().join("flash");
        let mut before = Contents::default();
        *before.array.last_mut().unwrap() = 7;
        before.save(&flash).unwrap();
        let keep = ["--tcp", "0", "--flash", flash.to_str().unwrap()];
        let (child, _) = start(&[&keep, options].concat());
        let process = child.id().to_string();
        let sent = Command::new("kill").args([signal, &process]).status();
        assert!(sent.unwrap().success());
        let (code, error) = end(child);
        assert_eq!(code, Some(0), "{error}");
        let left = Contents::load(&flash).unwrap();
        assert_eq!(left.array.last(), Some(&7), "{signal}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}

/// Before the rig is ready, while the firmware runs, and while the file is written: the second
/// signal comes then.
#[test]
#[ignore = "10 s"]
fn a_signal_at_any_time_leaves_a_whole_flash() {
    let directory = tempfile::tempdir().unwrap();
    let flash = directory.path().join("flash");
    let mut before = Contents::default();
    *before.array.last_mut().unwrap() = 7;
    before.save(&flash).unwrap();
    for round in 0..60 {
        let signal = ["-INT", "-TERM", "-KILL"][round % 3];
        let mut rig = rig();
        rig.stdout(Stdio::null()).arg(firmware());
        rig.args(["--tcp", "0", "--no-wait", "--flash"]).arg(&flash);
        let child = rig.spawn().unwrap();
        for wait_ms in [round as u64 * 7, round as u64 % 11] {
            std::thread::sleep(Duration::from_millis(wait_ms));
            // It may have ended, which the second signal then says.
            let process = child.id().to_string();
            let mut kill = Command::new("kill");
            let _ = kill.args([signal, &process]).output();
        }
        let (code, error) = end(child);
        assert!(matches!(code, None | Some(0)), "{round} {signal}: {error}");
        let left = Contents::load(&flash).unwrap();
        assert_eq!(left.array.last(), Some(&7), "{round} {signal}");
    }
}

#[test]
fn a_script_gives_bytes_truth_and_counters() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let hello: String = hello().iter().map(|byte| format!("{byte:02x}")).collect();
    std::fs::write(path("script"), format!("0 open\n160 send {hello}\n")).unwrap();
    let output = rig()
        .arg(firmware())
        .args(["--scene", "test-picture", "--virtual-ms", "200"])
        .arg("--script")
        .arg(path("script"))
        .arg("--out")
        .arg(path("out"))
        .arg("--truth")
        .arg(path("truth"))
        .arg("--stats-json")
        .arg(path("stats"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let read = |name: &str| std::fs::read(path(name)).unwrap();
    assert!(!read("out").is_empty());
    let stats: serde_json::Value = serde_json::from_slice(&read("stats")).unwrap();
    // A run ends with the present instruction: a few nanoseconds after its time is over.
    let virtual_s = stats["virtual_s"].as_f64().unwrap();
    assert!((0.2..0.200_001).contains(&virtual_s), "{virtual_s}");
    assert_eq!(stats["usb"]["bytes_in"], read("out").len());
    let truth = String::from_utf8(read("truth")).unwrap();
    assert_eq!(
        truth.lines().count(),
        stats["camera"]["exposures"].as_u64().unwrap() as usize
    );
}

fn failing(arguments: &[&str]) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = rig().args(arguments).output().unwrap();
    (status.code(), String::from_utf8(stderr).unwrap())
}

#[test]
fn what_cannot_be_done_is_said() {
    for (arguments, code, word) in [
        (&["/nowhere.elf"][..], 1, "/nowhere.elf"),
        (&["x.elf", "--scene", "dance"], 1, "dance"),
        (&["x.elf", "--scene", "none.toml"], 1, "none.toml"),
        (&["x.elf", "--preset", "moon"], 1, "moon"),
        (&["x.elf", "--fault", "fire"], 2, "fire"),
        (
            &["x.elf", "--script", "/nowhere.txt", "--frames", "1"],
            1,
            "/nowhere.txt",
        ),
        (
            &["x.elf", "--instructions-per-second", "0"],
            1,
            "instructions-per-second",
        ),
        (&["x.elf", "--script", "x", "--tcp", "0"], 2, "--tcp"),
    ] {
        let script_only = arguments.contains(&"--script");
        let arguments: Vec<&str> = if code == 1 && !script_only {
            [arguments, &["--tcp", "0", "--no-wait"]].concat()
        } else {
            arguments.to_vec()
        };
        let (found, error) = failing(&arguments);
        assert!(
            found == Some(code) && error.contains(word),
            "{arguments:?}: {found:?} {error}"
        );
    }
}
