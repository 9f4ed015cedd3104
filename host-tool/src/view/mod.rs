//! `hivtac view`: shows a live page in a browser of this computer.

mod owner;
mod picture;
mod recorder;
pub mod state;

use crate::device::seconds;
use crate::output::{Reader, print};
use clap::Args;
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

/// Most orders that wait for a device; a further order gets the answer that it is busy.
const ORDERS: usize = 4;
/// Time between two checks whether the program must end.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Show a live page in a browser of this computer: forces, picture, threshold, status
///
/// Prints `ready` and the page's address, which holds a secret: nobody else on this computer or
/// in another page can open it. Ends with Ctrl-C; goes on after a lost connection. `--port`
/// more than once shows several sensors side by side.
///
/// Example: hivtac view
#[derive(Args)]
pub struct ViewArguments {
    /// Serial port, pseudo-terminal, or tcp:HOST:PORT; found by its USB id when not given
    #[arg(long, value_name = "PORT")]
    port: Vec<String>,
    /// Longest wait for the device's hello and replies, s
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    timeout: Duration,
    /// The page's port on 127.0.0.1; one that is free when not given
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    listen: u16,
    /// Where the page's recordings go, as hivtac-UNIT-NUMBER.mcap
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    recordings: PathBuf,
    /// The page's address in a JSON object
    #[arg(long)]
    json: bool,
}

/// Serves the page until the program is interrupted. Prints `ready` and the address.
///
/// # Errors
/// When a device is missing at the start; one that is lost later is waited for.
pub fn run(arguments: &ViewArguments) -> Result<(), Failure> {
    let addresses = match arguments.port.as_slice() {
        [] => vec![Address::Find],
        ports => ports.iter().map(|port| Address::parse(port)).collect(),
    };
    let opened = addresses.iter().map(|address| open(address, arguments));
    let opened: Vec<(Sensor, Opened)> = opened.collect::<Result<_, _>>()?;
    let (sensors, opened): (Vec<_>, Vec<_>) = opened.into_iter().unzip();
    let server = Arc::new(Server::new(arguments.listen, sensors, arguments.timeout)?);
    let ready = match arguments.json {
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

/// A connected device, for its thread.
type Opened = (Owner, Link);

fn open(address: &Address, arguments: &ViewArguments) -> Result<(Sensor, Opened), Failure> {
    let (link, hello) = Link::connect(address, arguments.timeout)?;
    let feed = Arc::new(Feed::default());
    let (orders, posted) = sync_channel(ORDERS);
    let owner = Owner::new(
        address.clone(),
        arguments.timeout,
        (&link, hello),
        feed.clone(),
        posted,
        Recorder::new(&arguments.recordings),
    );
    let sensor = Sensor {
        feed,
        orders: Some(orders),
    };
    Ok((sensor, (owner, link)))
}
