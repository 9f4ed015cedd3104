//! Tests the live page of presses anywhere, as a browser reads it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::fake::start;
use super::free::{record, sensor};

/// The page's host and path, once the program has printed them.
fn address(here: &Path) -> (String, String) {
    let end = Instant::now() + Duration::from_secs(20);
    loop {
        let said = std::fs::read_to_string(here.join("said")).unwrap_or_default();
        let url = said
            .split("http://")
            .nth(1)
            .and_then(|rest| rest.split_once('\n'));
        if let Some((url, _)) = url {
            let (host, path) = url.split_once('/').unwrap();
            return (host.to_owned(), format!("/{path}"));
        }
        assert!(Instant::now() < end, "no address: {said}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Sends a request, and returns the connection from which its answer is read.
fn ask(host: &str, request: &str) -> TcpStream {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    stream
}

fn read(mut stream: TcpStream) -> String {
    let mut answer = Vec::new();
    // A program that has ended resets the connection.
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// The states in a stream of events, the oldest first.
fn states(events: &str) -> Vec<Value> {
    let states = events.split("event: state\ndata: ").skip(1);
    let states = states.filter_map(|rest| serde_json::from_str(rest.lines().next()?).ok());
    states
        .map(|reported: Value| reported["state"].clone())
        .collect()
}

/// Number of covered places among the needed ones: all but hard presses in corners.
fn covered(coverage: &Value) -> usize {
    let maps = coverage["maps"].as_array().unwrap().iter().enumerate();
    let places = maps.flat_map(|(size, map)| {
        let rows = map["places"].as_array().unwrap().iter().enumerate();
        rows.flat_map(move |(y, row)| {
            let row = row.as_array().unwrap().iter().enumerate();
            row.map(move |(x, place)| {
                let is_corner = [0, 4].contains(&x) && [0, 4].contains(&y);
                place == "covered" && !(size == 2 && is_corner)
            })
        })
    });
    places.filter(|is_covered| *is_covered).count()
}

#[test]
#[ignore = "15 s: guided once more"]
fn a_page_shows_what_the_terminal_says_and_orders_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let sensor = sensor(usize::MAX);
    let arguments = [&record(&sensor.port, "150")[..], &["--view"]].concat();
    let mut program = start(here, &arguments);
    let (host, path) = address(here);
    let get = format!("GET {path}events HTTP/1.1\r\nHost: {host}\r\n\r\n");
    let events = ask(&host, &get);
    // This test's sensor accepts only the requests of a recording.
    let body = r#"{"sensor":0,"order":"tare"}"#;
    let refused = read(ask(
        &host,
        &format!(
            "POST {path}order HTTP/1.1\r\nHost: {host}\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        ),
    ));
    assert!(refused.contains("it is being recorded"), "{refused}");
    let picture = format!("GET {path}picture/0 HTTP/1.1\r\nHost: {host}\r\n\r\n");
    assert!(read(ask(&host, &picture)).contains("it is being recorded"));
    program.stdin.take().unwrap().write_all(b"\n\n").unwrap();
    assert!(program.wait().unwrap().success());

    let events = read(events);
    assert!(events.contains(r#""obeys":false"#), "{events}");
    let states = states(&events);
    assert!(states[0]["coverage"].is_null(), "{}", states[0]);
    let live: Vec<&Value> = states.iter().map(|state| &state["coverage"]).collect();
    let live = live.iter().filter(|coverage| !coverage.is_null());
    let mut last = 0;
    for coverage in live {
        let line = coverage["line"].as_str().unwrap();
        let Some((count, _)) = line.split_once(" of 71 covered, ") else {
            continue;
        };
        assert_eq!(count.parse(), Ok(covered(coverage)), "{coverage}");
        last = last.max(covered(coverage));
        // The present press is marked in the map of its range.
        let marked = coverage["maps"].as_array().unwrap().iter();
        let marked = marked.filter(|map| !map["pressed"].is_null()).count();
        let now = coverage["now"].as_str().unwrap();
        let is_pressed = now
            .split_once(" mN at x ")
            .is_some_and(|(force_mn, _)| force_mn.trim().parse::<f64>().unwrap() > 20.5);
        assert!(marked == 1 || !is_pressed, "{coverage}");
    }
    assert!(last > 20, "{last} of 71: {} states", states.len());
    assert!(events.contains("event: samples"));
}
