//! Reads a browser's request, with limits of time and length. It supports the part of HTTP/1.1 that
//! the page needs.

use super::response::Status;
use std::io::{self, ErrorKind, Read};
use std::net::TcpStream;
use std::time::Instant;

/// Longest request without its body, bytes.
pub const LONGEST_HEAD: usize = 8 << 10;
/// Longest body, bytes.
pub const LONGEST_BODY: usize = 1 << 10;
/// Most header fields; browsers send twenty.
const MOST_FIELDS: usize = 64;

/// The method of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Shows something.
    Get,
    /// Does something.
    Post,
}

/// A whole request.
#[derive(Debug, PartialEq, Eq)]
pub struct Request {
    /// Its method.
    pub method: Method,
    /// The path as sent, without decoding.
    pub path: String,
    /// The host that it names; exactly one.
    pub host: String,
    /// The page that it comes from, if the browser says so.
    pub origin: Option<String>,
    /// At most [`LONGEST_BODY`] bytes.
    pub body: Vec<u8>,
}

/// A stream whose reads end with an error at a deadline, however slowly bytes arrive.
pub struct Timed<'s> {
    /// Where bytes come from.
    pub stream: &'s TcpStream,
    /// The deadline.
    pub end: Instant,
}

impl Read for Timed<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        self.stream.set_read_timeout(Some(left))?;
        self.stream.read(buffer)
    }
}

/// Reads a request.
///
/// # Errors
/// The status of the refusal: 400 for an invalid request, 405 for another method, 408 after too
/// long a time, 413 and 431 for too long a body or head.
pub fn read(stream: &mut impl Read) -> Result<Request, Status> {
    let mut bytes = Vec::new();
    let (mut request, length, head) = loop {
        more(stream, &mut bytes, LONGEST_HEAD, Status::HeadTooLong)?;
        if let Some(parsed) = parse(&bytes)? {
            break parsed;
        }
    };
    let whole = head + length;
    while bytes.len() < whole {
        more(stream, &mut bytes, whole, Status::BodyTooLong)?;
    }
    request.body = bytes[head..whole].to_vec();
    Ok(request)
}

/// Reads the bytes that are there, up to `most` in all.
fn more(
    stream: &mut impl Read,
    bytes: &mut Vec<u8>,
    most: usize,
    too_long: Status,
) -> Result<(), Status> {
    let mut buffer = [0; 1024];
    let room = buffer.len().min(most.saturating_sub(bytes.len()));
    if room == 0 {
        return Err(too_long);
    }
    match stream.read(&mut buffer[..room]) {
        Ok(0) => Err(Status::Bad),
        Ok(count) => {
            bytes.extend_from_slice(&buffer[..count]);
            Ok(())
        }
        Err(error) if error.kind() == ErrorKind::Interrupted => Ok(()),
        Err(_) => Err(Status::TooSlow),
    }
}

/// The request without its body, the body's length and its start; `None` if the head is incomplete.
fn parse(bytes: &[u8]) -> Result<Option<(Request, usize, usize)>, Status> {
    let mut fields = [httparse::EMPTY_HEADER; MOST_FIELDS];
    let mut parsed = httparse::Request::new(&mut fields);
    let head = match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(head)) => head,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => return Err(Status::HeadTooLong),
        Err(_) => return Err(Status::Bad),
    };
    let method = match parsed.method {
        Some("GET") => Method::Get,
        Some("POST") => Method::Post,
        _ => return Err(Status::Method),
    };
    let field = |name: &str| one(parsed.headers, name);
    if field("transfer-encoding")?.is_some() {
        return Err(Status::Bad);
    }
    let length = match field("content-length")? {
        Some(digits) if digits.bytes().all(|digit| digit.is_ascii_digit()) => {
            digits.parse().map_err(|_| Status::BodyTooLong)?
        }
        Some(_) => return Err(Status::Bad),
        None => 0,
    };
    if length > LONGEST_BODY {
        return Err(Status::BodyTooLong);
    }
    let request = Request {
        method,
        path: parsed.path.unwrap_or_default().to_owned(),
        host: field("host")?.ok_or(Status::Bad)?,
        origin: field("origin")?,
        body: Vec::new(),
    };
    Ok(Some((request, length, head)))
}

/// A header field; refused if it is there twice, because readers may differ in which they take.
fn one(fields: &[httparse::Header], name: &str) -> Result<Option<String>, Status> {
    let mut own = fields
        .iter()
        .filter(|field| field.name.eq_ignore_ascii_case(name));
    match (own.next(), own.next()) {
        (None, _) => Ok(None),
        (Some(field), None) => {
            let text = std::str::from_utf8(field.value).map_err(|_| Status::Bad)?;
            Ok(Some(text.to_owned()))
        }
        (Some(_), Some(_)) => Err(Status::Bad),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns its bytes one at a time, as a slow browser may.
    struct Dripping<'b>(&'b [u8]);

    impl Read for Dripping<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let Some((first, rest)) = self.0.split_first() else {
                return Ok(0);
            };
            buffer[0] = *first;
            self.0 = rest;
            Ok(1)
        }
    }

    fn both_ways(text: &str) -> Result<Request, Status> {
        let whole = read(&mut text.as_bytes());
        assert_eq!(whole, read(&mut Dripping(text.as_bytes())), "{text:?}");
        whole
    }

    #[test]
    fn a_request_is_read_whole_and_in_drips() {
        let request = both_ways(
            "POST /t/order HTTP/1.1\r\nHost: 127.0.0.1:80\r\ncontent-length: 4\r\nOrigin: \
             http://a\r\n\r\nbody and more",
        );
        let expected = Request {
            method: Method::Post,
            path: "/t/order".to_owned(),
            host: "127.0.0.1:80".to_owned(),
            origin: Some("http://a".to_owned()),
            body: b"body".to_vec(),
        };
        assert_eq!(request, Ok(expected));
        assert!(both_ways("GET / HTTP/1.1\r\nHost: a\r\n\r\n").is_ok());
    }

    #[test]
    fn whatever_is_no_plain_request_is_refused() {
        let long = "x".repeat(LONGEST_HEAD);
        let many = "a: b\r\n".repeat(MOST_FIELDS + 1);
        let cases = [
            ("GET / HTTP/1.1\r\n\r\n".to_owned(), Status::Bad),
            (
                "PUT / HTTP/1.1\r\nHost: a\r\n\r\n".to_owned(),
                Status::Method,
            ),
            ("GET / HTTP/1.1\r\nHost: a".to_owned(), Status::Bad),
            ("\x16\x03\x01 no HTTP".to_owned(), Status::Bad),
            (format!("GET /{long}"), Status::HeadTooLong),
            (format!("GET / HTTP/1.1\r\n{many}\r\n"), Status::HeadTooLong),
        ];
        for (text, status) in cases {
            assert_eq!(both_ways(&text), Err(status), "{text:?}");
        }
        for (fields, status) in [
            ("Host: b\r\n", Status::Bad),
            ("Content-Length: 1025\r\n", Status::BodyTooLong),
            (
                "Content-Length: 99999999999999999999\r\n",
                Status::BodyTooLong,
            ),
            ("Content-Length: +1\r\n", Status::Bad),
            ("Content-Length: 1\r\nContent-Length: 1\r\n", Status::Bad),
            ("Transfer-Encoding: chunked\r\n", Status::Bad),
        ] {
            let text = format!("POST / HTTP/1.1\r\nHost: a\r\n{fields}\r\n");
            assert_eq!(both_ways(&text), Err(status), "{fields:?}");
        }
    }

    #[test]
    fn a_body_that_stays_away_is_an_end() {
        let text = "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\nshort";
        assert_eq!(both_ways(text), Err(Status::Bad));
    }
}
