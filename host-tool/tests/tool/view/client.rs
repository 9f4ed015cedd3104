//! A minimal browser for these tests.

use crate::run::*;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Longest wait for an answer or an event.
pub const PATIENCE: Duration = Duration::from_secs(20);

/// A running tool that serves its page.
pub struct View {
    pub run: Run,
    /// `127.0.0.1:PORT`.
    pub host: String,
    /// `/TOKEN`.
    pub token: String,
}

impl View {
    pub fn of(ports: &[&str]) -> View {
        View::with(ports, &[])
    }

    pub fn with(ports: &[&str], options: &[&str]) -> View {
        let mut arguments = [&["view"], options].concat();
        ports
            .iter()
            .for_each(|port| arguments.extend(["--port", port]));
        let mut run = start(&arguments);
        let mut said = String::new();
        let stdout = run.child().stdout.take().unwrap();
        BufReader::new(stdout).read_line(&mut said).unwrap();
        let address = said
            .trim()
            .strip_prefix("ready http://")
            .unwrap_or_else(|| {
                panic!("{said:?}: {:?}", run.child().wait());
            });
        let (host, token) = address.split_once('/').unwrap();
        View {
            host: host.to_owned(),
            token: format!("/{}", token.trim_end_matches('/')),
            run,
        }
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// The answer to these bytes, head and body.
    pub fn ask(&self, request: &[u8]) -> (String, Vec<u8>) {
        let mut stream = self.connect();
        stream.write_all(request).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer
            .windows(4)
            .position(|four| four == b"\r\n\r\n")
            .unwrap();
        let body = answer.split_off(end + 4);
        (String::from_utf8(answer).unwrap(), body)
    }

    /// The status code of the answer.
    pub fn status(&self, request: &str) -> u16 {
        let (head, _) = self.ask(request.as_bytes());
        head.split(' ').nth(1).unwrap().parse().unwrap()
    }

    pub fn get(&self, path: &str) -> (String, Vec<u8>) {
        let (host, token) = (&self.host, &self.token);
        self.ask(format!("GET {token}{path} HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes())
    }

    pub fn order(&self, order: &Value) -> Value {
        let (host, token, body) = (&self.host, &self.token, order.to_string());
        let length = body.len();
        let request = format!(
            "POST {token}/order HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n\
             Content-Length: {length}\r\n\r\n{body}"
        );
        let (head, body) = self.ask(request.as_bytes());
        assert!(head.starts_with("HTTP/1.1 200 "), "{head}");
        serde_json::from_slice(&body).unwrap()
    }

    pub fn events(&self) -> Events {
        let (host, token) = (&self.host, &self.token);
        let mut stream = self.connect();
        let request = format!("GET {token}/events HTTP/1.1\r\nHost: {host}\r\n\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        Events(BufReader::new(stream))
    }

    /// Ends the tool as Ctrl-C does, and returns its exit code.
    pub fn interrupt(mut self) -> Option<i32> {
        signal(self.run.child().id(), "INT");
        self.run.child().wait().unwrap().code()
    }
}

impl Drop for View {
    fn drop(&mut self) {
        // Fails only if it has ended already.
        let _ = self.run.child().kill();
        let _ = self.run.child().wait();
    }
}

/// A stream of events.
pub struct Events(BufReader<TcpStream>);

impl Events {
    /// Reads until `find` returns a value for an event of this name.
    pub fn until<T>(&mut self, name: &str, mut find: impl FnMut(&Value) -> Option<T>) -> T {
        let end = Instant::now() + PATIENCE;
        let mut own = false;
        while Instant::now() < end {
            let mut line = String::new();
            assert!(
                self.0.read_line(&mut line).unwrap() > 0,
                "the stream has ended"
            );
            if let Some(event) = line.strip_prefix("event: ") {
                own = event.trim() == name;
            } else if let (true, Some(data)) = (own, line.strip_prefix("data: "))
                && let Some(found) = find(&serde_json::from_str(data).unwrap())
            {
                return found;
            }
        }
        panic!("no such {name} within {PATIENCE:?}");
    }

    /// The first state of a sensor for which `is_so` is true.
    pub fn state(&mut self, sensor: u32, is_so: impl Fn(&Value) -> bool) -> Value {
        self.until("state", |event| {
            let is_own = event["sensor"] == sensor;
            (is_own && is_so(&event["state"])).then(|| event["state"].clone())
        })
    }

    /// The first sample with this or a later sequence number.
    pub fn sample(&mut self, sensor: u32, sequence: u64) -> Value {
        self.until("samples", |event| {
            let samples = event["samples"].as_array().unwrap().iter();
            let mut late = samples.filter(|row| row[0].as_u64().unwrap() >= sequence);
            let is_own = event["sensor"] == sensor;
            late.next().filter(|_| is_own).cloned()
        })
    }
}
