//! `hivtac view`: shows a live page in a browser of this computer.

mod gripping;
mod owner;
mod recorder;
#[cfg(feature = "twin")]
mod twin;

use crate::device::seconds;
use crate::grip_command::GripArguments;
use crate::output::{Reader, print};
use clap::Args;
use gripping::Gripping;
use hivtac_host::failure::Failure;
#[cfg(feature = "twin")]
use hivtac_host::failure::Kind;
use hivtac_host::link::Link;
use hivtac_host::page::{Feed, Sensor, Server};
use hivtac_host::port::Address;
use hivtac_host::stop;
use hivtac_wire::message::DeviceHello;
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
/// more than once shows several sensors side by side. `--twin` needs no device: press the
/// simulated film on the page.
///
/// Example: hivtac view
#[derive(Args)]
pub struct ViewArguments {
    /// Serial port, pseudo-terminal, tcp:HOST:PORT, or uart:PORT with an adapter for the sensor's
    /// UART; found by its USB id when not given
    #[arg(long, value_name = "PORT")]
    port: Vec<String>,
    #[command(flatten)]
    grip: GripArguments,
    /// A simulated sensor in place of a device: the page presses its film, and shows the true press
    /// next to the sensor's answer
    #[cfg(feature = "twin")]
    #[arg(long, conflicts_with_all = ["port", "grip"])]
    twin: bool,
    #[cfg(feature = "twin")]
    #[command(flatten)]
    simulated: crate::twin::Simulated,
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
    #[cfg(feature = "twin")]
    if arguments.twin {
        return serve(vec![twin::open_twin(arguments)?], arguments);
    } else if arguments.simulated != crate::twin::Simulated::default() {
        let why = "options of a simulated sensor need --twin";
        return Err(Failure::new(Kind::Usage, why));
    }
    let addresses = (arguments.grip).before(arguments.timeout, || {
        Ok(match arguments.port.as_slice() {
            [] => vec![Address::Find],
            ports => ports.iter().map(|port| Address::parse(port)).collect(),
        })
    })?;
    let connect = |address| Link::connect(address, arguments.timeout);
    let connected: Vec<_> = addresses.iter().map(connect).collect::<Result<_, _>>()?;
    let hellos: Vec<_> = connected.iter().map(|(_, hello)| hello.clone()).collect();
    let grip = arguments.grip.pair(&hellos)?.map(Gripping::new);
    let opened = addresses.iter().zip(connected).enumerate();
    let opened = opened.map(|(number, (address, connected))| {
        let (sensor, (mut owner, link)) =
            open(address, connected, Arc::new(Feed::default()), arguments);
        if let Some(grip) = grip.clone().filter(|_| number < 2) {
            owner.grips(number, grip);
        }
        (sensor, (owner, link))
    });
    serve(opened.collect(), arguments)
}

fn serve(opened: Vec<(Sensor, Opened)>, arguments: &ViewArguments) -> Result<(), Failure> {
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

fn open(
    address: &Address,
    (link, hello): (Link, DeviceHello),
    feed: Arc<Feed>,
    arguments: &ViewArguments,
) -> (Sensor, Opened) {
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
        hand: None,
    };
    (sensor, (owner, link))
}
