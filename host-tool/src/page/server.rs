//! Serves the page, on this computer's own address only, to browsers that have the token.

use super::events;
use super::feed::Feed;
use super::order::{self, Answer, Order, Posted};
use super::press::Hand;
use super::request::{self, Method, Request, Timed};
use super::response::{self, BYTES, CSS, HTML, JSON, SCRIPT, Status};
use super::token::Token;
use super::unstalled::Unstalled;
use crate::failure::Failure;
use serde_json::json;
use std::io;
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::{Duration, Instant};

/// Most connections at once; each has a thread.
const MOST_CONNECTIONS: usize = 32;
/// Longest time for a request to arrive.
const REQUEST_PATIENCE: Duration = Duration::from_secs(5);
/// Longest wait for an order, such as a tare, in addition to the device's patience.
const ORDER_PATIENCE: Duration = Duration::from_secs(15);

/// The page's files: path, content type and text.
const FILES: [(&str, &str, &str); 14] = [
    ("/", HTML, include_str!("files/index.html")),
    ("/style.css", CSS, include_str!("files/style.css")),
    ("/main.js", SCRIPT, include_str!("files/main.js")),
    ("/sensor.js", SCRIPT, include_str!("files/sensor.js")),
    ("/arrow.js", SCRIPT, include_str!("files/arrow.js")),
    ("/chart.js", SCRIPT, include_str!("files/chart.js")),
    ("/coverage.js", SCRIPT, include_str!("files/coverage.js")),
    ("/press.js", SCRIPT, include_str!("files/press.js")),
    ("/picture.js", SCRIPT, include_str!("files/picture.js")),
    ("/threshold.js", SCRIPT, include_str!("files/threshold.js")),
    ("/paint.js", SCRIPT, include_str!("files/paint.js")),
    ("/sample.js", SCRIPT, include_str!("files/sample.js")),
    ("/settings.js", SCRIPT, include_str!("files/settings.js")),
    ("/source.js", SCRIPT, include_str!("files/source.js")),
];

/// A device as the page shows it.
pub struct Sensor {
    /// Its samples and state.
    pub feed: Arc<Feed>,
    /// The queue of its orders; `None` if the page only shows it.
    pub orders: Option<SyncSender<Posted>>,
    /// The hand that presses its film, if it is simulated in this program.
    pub hand: Option<Hand>,
}

/// A server on an open port.
pub struct Server {
    listener: TcpListener,
    port: u16,
    token: Token,
    sensors: Vec<Sensor>,
    patience: Duration,
    connections: AtomicUsize,
}

impl Server {
    /// Opens a port of 127.0.0.1, 0 for any.
    ///
    /// # Errors
    /// When the port is taken, or when there are no random numbers.
    pub fn new(port: u16, sensors: Vec<Sensor>, patience: Duration) -> Result<Server, Failure> {
        let failed = |error: io::Error| {
            Failure::input(format!(
                "cannot listen at port {port} of this computer: {error}; choose another with \
                 --listen"
            ))
        };
        let listener = TcpListener::bind(("127.0.0.1", port)).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        Ok(Server {
            listener,
            port,
            token: Token::random()?,
            sensors,
            patience,
            connections: AtomicUsize::new(0),
        })
    }

    /// The address to open in a browser.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token.text())
    }

    /// Answers requests while the program runs.
    pub fn run(self: Arc<Server>) {
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else {
                // Too many open files, for example: later there may be fewer.
                std::thread::sleep(Duration::from_millis(50));
                continue;
            };
            let visit = Visit::new(self.clone());
            let begun = std::thread::Builder::new().spawn(move || visit.answer(&stream));
            // Without a thread the connection is closed, and the browser may try again.
            drop(begun);
        }
    }

    /// The path behind the token if the request may be answered; `None` if host, origin or token is
    /// wrong.
    fn is_own<'r>(&self, request: &'r Request) -> Option<&'r str> {
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let origin = request.origin.as_deref();
        let is_own_origin =
            origin.is_none_or(|origin| origin == format!("http://{}", request.host));
        let rest = self.token.rest(&request.path)?;
        (hosts.contains(&request.host) && is_own_origin).then_some(rest)
    }
}

/// A connection, counted while it lasts.
struct Visit {
    server: Arc<Server>,
    is_one_too_many: bool,
}

impl Drop for Visit {
    fn drop(&mut self) {
        self.server.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Visit {
    fn new(server: Arc<Server>) -> Visit {
        let before = server.connections.fetch_add(1, Ordering::Relaxed);
        Visit {
            server,
            is_one_too_many: before >= MOST_CONNECTIONS,
        }
    }

    /// Answers the request; ignores a browser that goes away or stalls.
    fn answer(self, stream: &TcpStream) {
        let _ = self.try_to_answer(stream);
    }

    fn try_to_answer(&self, stream: &TcpStream) -> io::Result<()> {
        stream.set_nodelay(true)?;
        let mut out = Unstalled::new(stream)?;
        if self.is_one_too_many {
            return response::refuse(&mut out, Status::Busy);
        }
        let end = Instant::now() + REQUEST_PATIENCE;
        let request = match request::read(&mut Timed { stream, end }) {
            Ok(request) => request,
            Err(status) => return refuse_unread(stream, status),
        };
        match self.server.is_own(&request) {
            Some(path) => self.route(&mut out, &request, path),
            None => response::refuse(&mut out, Status::Forbidden),
        }
    }

    fn route(&self, out: &mut Unstalled<'_>, request: &Request, path: &str) -> io::Result<()> {
        let file = FILES.iter().find(|(name, ..)| *name == path);
        let picture = path.strip_prefix("/picture/");
        match (request.method, file, picture) {
            (Method::Get, Some((_, kind, text)), _) => {
                response::send(out, Status::Ok, kind, text.as_bytes())
            }
            (Method::Get, _, Some(sensor)) => match sensor.parse() {
                Ok(sensor) => self.picture(out, sensor),
                Err(_) => response::refuse(out, Status::NotFound),
            },
            (Method::Get, ..) if path == "/events" => {
                let feeds = self.server.sensors.iter().map(|sensor| sensor.feed.clone());
                let mut orders = self.server.sensors.iter().map(|sensor| &sensor.orders);
                let obeys = orders.all(Option::is_some);
                let mut sensors = self.server.sensors.iter();
                let presses = sensors.all(|sensor| sensor.hand.is_some());
                events::stream(out, &feeds.collect::<Vec<_>>(), obeys, presses)
            }
            (Method::Post, ..) if path == "/order" => self.order(out, &request.body),
            (Method::Post, Some(_), _) => response::refuse(out, Status::Method),
            _ => response::refuse(out, Status::NotFound),
        }
    }

    fn picture(&self, out: &mut Unstalled<'_>, sensor: usize) -> io::Result<()> {
        match self.ask(sensor, Order::Picture) {
            Ok(Answer::Picture(picture)) => response::send(out, Status::Ok, BYTES, &picture()),
            Ok(Answer::Failed(why)) => said(out, false, &why),
            Ok(Answer::Done(_)) => response::refuse(out, Status::NotFound),
            Err(status) => response::refuse(out, status),
        }
    }

    fn order(&self, out: &mut Unstalled<'_>, body: &[u8]) -> io::Result<()> {
        let answer = match order::parse(body) {
            Ok((sensor, order)) => self.ask(sensor, order),
            Err(why) => return said(out, false, &why),
        };
        match answer {
            Ok(Answer::Done(text)) => said(out, true, &text),
            Ok(Answer::Failed(why)) => said(out, false, &why),
            Ok(Answer::Picture(_)) => response::refuse(out, Status::NotFound),
            Err(status) => response::refuse(out, status),
        }
    }

    /// Sends an order to a device, and waits for its answer.
    fn ask(&self, sensor: usize, order: Order) -> Result<Answer, Status> {
        let sensor = self.server.sensors.get(sensor).ok_or(Status::NotFound)?;
        if let Order::Press(press) = order {
            let Some(hand) = &sensor.hand else {
                let why = "only the film of `hivtac view --twin` can be pressed".to_owned();
                return Ok(Answer::Failed(why));
            };
            hand(press);
            return Ok(Answer::Done(String::new()));
        }
        let Some(orders) = &sensor.orders else {
            let why = "this page shows the sensor and no more: it is being recorded".to_owned();
            return Ok(Answer::Failed(why));
        };
        let (posted, answers) = Posted::new(order);
        match orders.try_send(posted) {
            Ok(()) => (),
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => return Err(Status::Busy),
        }
        let late = |_| Answer::Failed("the device did not answer in time".to_owned());
        let patience = ORDER_PATIENCE + 2 * self.server.patience;
        Ok(answers.recv_timeout(patience).unwrap_or_else(late))
    }
}

/// Sends an answer in words.
fn said(out: &mut Unstalled<'_>, done: bool, text: &str) -> io::Result<()> {
    let body = json!({ "done": done, "text": text }).to_string();
    response::send(out, Status::Ok, JSON, body.as_bytes())
}

/// Refuses a request before all its bytes have come. A connection closed on unread bytes resets,
/// and the browser might never see the answer: therefore the rest is read first.
fn refuse_unread(stream: &TcpStream, status: Status) -> io::Result<()> {
    response::refuse(&mut Unstalled::new(stream)?, status)?;
    stream.shutdown(std::net::Shutdown::Write)?;
    let end = Instant::now() + Duration::from_millis(500);
    let mut rest = Timed { stream, end };
    let mut buffer = [0; 4096];
    while io::Read::read(&mut rest, &mut buffer)? > 0 {}
    Ok(())
}
