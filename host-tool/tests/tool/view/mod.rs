//! Tests `hivtac view` as its browser and as unauthorized clients.

pub mod client;
mod orders;

use crate::fake::*;
use crate::run::*;
use crate::snapshot::rest_frame;
use client::View;
use hivtac_wire::message::*;
use serde_json::json;
use std::io::{Read, Write};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// A device that sends samples 0 to `count` after the start command, and then answers.
fn device(count: u32) -> Script {
    Box::new(move |device| {
        device.snapshots = [rest_frame()].into();
        serve(device, count);
    })
}

fn serve(device: &mut Conversation, count: u32) {
    while let Some(message) = device.next() {
        let is_start = is_start(&message);
        device.answer_to(message);
        if is_start {
            samples(0..count)
                .into_iter()
                .for_each(|message| device.send(message));
        }
    }
}

fn is_start(message: &HostMessage) -> bool {
    matches!(message, HostMessage::Command(command) if command.request == Request::StartWithMarkers)
}

#[test]
fn the_page_is_whole_and_takes_nothing_from_elsewhere() {
    let device = FakeDevice::on_tcp([device(1)]);
    let view = View::of(&[&device.port]);
    let (head, page) = view.get("/");
    assert!(head.starts_with("HTTP/1.1 200 OK"), "{head}");
    assert!(head.contains("default-src 'none'"), "{head}");
    let page = String::from_utf8(page).unwrap();
    let mut files = vec!["/style.css".to_owned(), "/main.js".to_owned()];
    let mut seen = 0;
    while let Some(file) = files.get(seen).cloned() {
        let (head, text) = view.get(&file);
        assert!(head.starts_with("HTTP/1.1 200 OK"), "{file}: {head}");
        let text = String::from_utf8(text).unwrap();
        assert!(
            !text.contains("http://") && !text.contains("https://"),
            "{file}"
        );
        assert!(
            !text.contains("innerHTML") && !text.contains("eval"),
            "{file}"
        );
        let imports = text.split("from \"./").skip(1);
        let imports = imports.map(|rest| format!("/{}", rest.split('"').next().unwrap()));
        for import in imports.collect::<Vec<_>>() {
            if !files.contains(&import) {
                files.push(import);
            }
        }
        seen += 1;
    }
    assert!(files.len() >= 7, "{files:?}");
    for name in &files[..2] {
        assert!(page.contains(&name[1..]), "{name}");
    }
    assert_eq!(view.interrupt(), Some(130));
}

#[test]
fn only_its_own_address_and_token_are_answered() {
    let device = FakeDevice::on_tcp([device(1)]);
    let view = View::of(&[&device.port]);
    let (host, token) = (&view.host, &view.token);
    let port = host.split(':').nth(1).unwrap();
    let get = |path: &str, host: &str| {
        view.status(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
    };
    let own = format!("{token}/");
    assert_eq!(get(&own, host), 200);
    assert_eq!(get(&own, &format!("localhost:{port}")), 200);
    let other_token = format!("/{}/", "0".repeat(32));
    for path in [
        "/",
        "/events",
        "/main.js",
        token,
        &token[..20],
        &other_token,
    ] {
        assert_eq!(get(path, host), 403, "{path}");
    }
    for name in [
        "evil.example",
        "127.0.0.1",
        "localhost:1",
        "127.0.0.1.evil:80",
        "",
    ] {
        assert_eq!(get(&own, name), 403, "{name:?}");
    }
    assert_eq!(get(&format!("{token}/../secret"), host), 404);
    assert_eq!(get(&format!("{token}/picture/7"), host), 404);
    let post = |origin: &str| {
        let body = r#"{"sensor":0,"order":"tare"}"#;
        let length = body.len();
        view.status(&format!(
            "POST {token}/order HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\n\
             Content-Length: {length}\r\n\r\n{body}"
        ))
    };
    assert_eq!(post("http://evil.example"), 403);
    let mut asked = device.commands.try_iter();
    assert!(asked.all(|request| !matches!(request, Request::Tare { .. })));
    assert_eq!(post(&format!("http://{host}")), 200);
}

#[test]
fn what_is_too_long_or_no_request_is_refused() {
    let device = FakeDevice::on_tcp([device(1)]);
    let view = View::of(&[&device.port]);
    let (host, token) = (&view.host, &view.token);
    let long = "x".repeat(1 << 20);
    assert_eq!(
        view.status(&format!("GET {token}/ HTTP/1.1\r\nX: {long}")),
        431
    );
    let head = format!("POST {token}/order HTTP/1.1\r\nHost: {host}\r\n");
    assert_eq!(
        view.status(&format!("{head}Content-Length: 1025\r\n\r\n{long}")),
        413
    );
    assert_eq!(
        view.status(&format!("{head}Transfer-Encoding: chunked\r\n\r\n")),
        400
    );
    assert_eq!(
        view.status(&format!("DELETE {token}/ HTTP/1.1\r\nHost: {host}\r\n\r\n")),
        405
    );
    assert_eq!(view.status("\0\0\0\0\r\n\r\n"), 400);
    // A client that never completes its request gets a refusal; others are served meanwhile.
    let mut slow = view.connect();
    slow.write_all(b"GET / HT").unwrap();
    assert_eq!(view.get("/").0.split(' ').nth(1), Some("200"));
    let mut answer = String::new();
    slow.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 408 "), "{answer}");
}

#[test]
fn events_carry_forces_and_how_the_device_stands() {
    let script: Script = Box::new(|device| {
        device.stats.latency_us = 4785;
        serve(device, 60);
    });
    let device = FakeDevice::on_tcp([script]);
    let view = View::of(&[&device.port]);
    let mut events = view.events();
    let lights = events.until("hello", |hello| Some(hello["lights"].clone()));
    assert_eq!(lights[0]["name"], "markers_missing");
    let row = events.sample(0, 59);
    let force = json!([
        -8707,
        4362,
        -99525,
        100_000,
        900,
        -5000,
        2500,
        480,
        [1250, -730, 85],
        null
    ]);
    let status = 1 << 13 | 1 << 16;
    assert_eq!(row, json!([59, 59, 59 * 33_333, status, force, []]));
    let state = view.events().state(0, |state| state["rate_hz"].is_f64());
    let rate = state["rate_hz"].as_f64().unwrap();
    assert!((rate - 30.0).abs() < 0.01, "{state}");
    assert_eq!(
        (&state["lost"], &state["latency_us"], &state["board"]),
        (&json!(0), &json!(4785), &json!("fake board"))
    );
    // A browser that connects later gets the last half minute.
    assert_eq!(view.events().sample(0, 0)[0], 0);
}

#[test]
fn readers_that_stall_stop_nobody() {
    let (stop, stopped) = mpsc::channel::<()>();
    let endless: Script = Box::new(move |device| {
        while let Some(message) = device.next() {
            let is_start = is_start(&message);
            device.answer_to(message);
            let mut number = 0;
            while is_start && !device.host_is_gone {
                // 2 MB of events a second.
                samples(number..number + 100)
                    .into_iter()
                    .for_each(|message| device.send(message));
                number += 100;
                match stopped.recv_timeout(Duration::from_millis(5)) {
                    Err(mpsc::RecvTimeoutError::Timeout) => (),
                    _ => return,
                }
            }
        }
    });
    let device = FakeDevice::on_tcp([endless]);
    let view = View::of(&[&device.port]);
    let _stalled = [(); 4].map(|()| view.events());
    let mut reader = view.events();
    let begun = Instant::now();
    let mut newest = 0;
    while begun.elapsed() < Duration::from_secs(4) {
        // The device goes on, which shows that its port is read.
        newest = reader.sample(0, newest + 1000)[0].as_u64().unwrap();
    }
    assert!(newest > 5_000, "{newest}");
    assert!(view.get("/").0.starts_with("HTTP/1.1 200"));
    drop(stop);
}

#[test]
fn a_lost_connection_is_shown_and_comes_back() {
    let vanish: Script = Box::new(|device| {
        while !device.next().is_some_and(|message| {
            let is_start = is_start(&message);
            device.answer_to(message);
            is_start
        }) {}
    });
    let fake = FakeDevice::on_tcp([vanish, device(9)]);
    let view = View::of(&[&fake.port]);
    let mut events = view.events();
    let state = events.state(0, |state| state["trouble"].is_string());
    assert!(
        state["trouble"].as_str().unwrap().contains("lost"),
        "{state}"
    );
    assert_eq!(events.sample(0, 8)[0], 8);
    events.state(0, |state| state["trouble"].is_null());
}

#[test]
fn no_device_and_a_port_that_is_taken_are_said() {
    let nobody = run(&["view", "--port", "tcp:127.0.0.1:1"]);
    assert_eq!(nobody.code, Some(3), "{nobody:?}");
    let device = FakeDevice::on_tcp([device(1)]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let run = run(&["view", "--port", &device.port, "--listen", &port]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(
        run.stderr.contains("choose another with --listen"),
        "{run:?}"
    );
}
