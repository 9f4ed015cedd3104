//! `hivtac view`: a live page in a browser of this computer.

mod owner;
mod picture;
mod recorder;
pub mod state;

use crate::output::{Reader, print};
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_host::page::{Feed, Sensor, Server};
use hivtac_host::port::Address;
use hivtac_host::stop;
use owner::Owner;
use recorder::Recorder;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;
use std::time::Duration;

/// Orders that wait for a device; whoever gives more is told that it is busy.
const ORDERS: usize = 4;
/// How often is looked whether to end.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What to show, and where.
pub struct Options {
    /// Where the devices are, one or more.
    pub addresses: Vec<Address>,
    /// Longest wait for a device's answers.
    pub patience: Duration,
    /// The page's port on 127.0.0.1, 0 for any.
    pub port: u16,
    /// Where recordings go.
    pub folder: PathBuf,
    /// The page's address in a JSON object.
    pub json: bool,
}

/// Serves the page until it is interrupted. Prints `ready` and its address.
///
/// # Errors
/// When a device is not there to begin with; a lost one is waited for.
pub fn run(options: &Options) -> Result<(), Failure> {
    let opened = options
        .addresses
        .iter()
        .map(|address| open(address, options));
    let opened: Vec<(Sensor, Opened)> = opened.collect::<Result<_, _>>()?;
    let (sensors, opened): (Vec<_>, Vec<_>) = opened.into_iter().unzip();
    let server = Arc::new(Server::new(options.port, sensors, options.patience)?);
    let ready = match options.json {
        true => json!({ "address": server.address() }).to_string(),
        false => format!("ready {}", server.address()),
    };
    if print(&ready)? == Reader::Gone {
        return Ok(());
    }
    let owners: Vec<JoinHandle<()>> = opened
        .into_iter()
        .map(|(owner, link)| std::thread::spawn(move || owner.run(link)))
        .collect();
    std::thread::spawn(move || server.run());
    while !stop::requested() {
        std::thread::sleep(LOOK_EVERY);
    }
    for owner in owners {
        let ended = owner.join();
        ended.map_err(|_| Failure::input("the thread of a device has ended".to_owned()))?;
    }
    stop::check()
}

/// A device that is connected, for its thread.
type Opened = (Owner, Link);

fn open(address: &Address, options: &Options) -> Result<(Sensor, Opened), Failure> {
    let (link, hello) = Link::connect(address, options.patience)?;
    let feed = Arc::new(Feed::default());
    let (orders, posted) = sync_channel(ORDERS);
    let owner = Owner::new(
        address.clone(),
        options.patience,
        (&link, hello),
        feed.clone(),
        posted,
        Recorder::new(&options.folder),
    );
    let sensor = Sensor {
        feed,
        orders: Some(orders),
    };
    Ok((sensor, (owner, link)))
}
