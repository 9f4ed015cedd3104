//! Writes answers to a browser. Each ends its connection, is not cached, and admits no other page.

use std::io::{self, Write};

/// The result of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok,
    /// The request is invalid.
    Bad,
    /// The token, host or page is wrong.
    Forbidden,
    /// The token is right, but the rest of the path is unknown.
    NotFound,
    /// Neither GET nor POST, or not allowed for this path.
    Method,
    /// The request did not come in time.
    TooSlow,
    /// The body is too long.
    BodyTooLong,
    /// The head is too long.
    HeadTooLong,
    /// Too many requests at once.
    Busy,
}

impl Status {
    /// Code and words of the first line.
    pub fn line(self) -> &'static str {
        match self {
            Status::Ok => "200 OK",
            Status::Bad => "400 Bad Request",
            Status::Forbidden => "403 Forbidden",
            Status::NotFound => "404 Not Found",
            Status::Method => "405 Method Not Allowed",
            Status::TooSlow => "408 Request Timeout",
            Status::BodyTooLong => "413 Content Too Large",
            Status::HeadTooLong => "431 Request Header Fields Too Large",
            Status::Busy => "503 Service Unavailable",
        }
    }

    /// The text that a person sees.
    fn text(self) -> &'static str {
        match self {
            Status::Forbidden => "Open the whole address that `hivtac view` printed.\n",
            Status::Busy => "Too many connections at once: close other windows of this page.\n",
            _ => "This is no request of the page of `hivtac view`.\n",
        }
    }
}

/// Content types of bodies.
pub const HTML: &str = "text/html; charset=utf-8";
/// See [`HTML`].
pub const CSS: &str = "text/css; charset=utf-8";
/// See [`HTML`].
pub const SCRIPT: &str = "text/javascript; charset=utf-8";
/// See [`HTML`].
pub const JSON: &str = "application/json";
/// See [`HTML`].
pub const BYTES: &str = "application/octet-stream";
/// See [`HTML`].
pub const EVENTS: &str = "text/event-stream";
/// See [`HTML`].
const TEXT: &str = "text/plain; charset=utf-8";

/// Header fields of every answer. They forbid to load or run anything from elsewhere, to frame the
/// page, to learn its address, and to store anything.
const RULES: &str = "\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; \
    connect-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'\r\n\
    X-Content-Type-Options: nosniff\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Referrer-Policy: no-referrer\r\n\
    Cache-Control: no-store\r\n\
    Connection: close\r\n";

/// Begins an answer of unknown length.
pub fn begin(stream: &mut impl Write, kind: &str) -> io::Result<()> {
    let line = Status::Ok.line();
    let head = format!("HTTP/1.1 {line}\r\n{RULES}Content-Type: {kind}\r\n\r\n");
    stream.write_all(head.as_bytes())
}

/// Sends a whole answer.
pub fn send(stream: &mut impl Write, status: Status, kind: &str, body: &[u8]) -> io::Result<()> {
    let (line, length) = (status.line(), body.len());
    let head = format!(
        "HTTP/1.1 {line}\r\n{RULES}Content-Type: {kind}\r\nContent-Length: {length}\r\n\r\n"
    );
    stream.write_all(&[head.as_bytes(), body].concat())
}

/// Sends a refusal with its reason.
pub fn refuse(stream: &mut impl Write, status: Status) -> io::Result<()> {
    send(stream, status, TEXT, status.text().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_has_its_length_and_the_rules() {
        let mut answer = Vec::new();
        send(&mut answer, Status::Ok, JSON, b"{}").unwrap();
        let answer = String::from_utf8(answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        assert_eq!(body, "{}");
        assert!(head.starts_with("HTTP/1.1 200 OK\r\nContent-Security-Policy: default-src 'none'"));
        assert!(head.ends_with("Content-Type: application/json\r\nContent-Length: 2"));
        assert!(!head.contains('\n') || head.lines().all(|line| !line.starts_with(' ')));
    }
}
