//! `hivtac serve`: the forces for other programs, as a node of ROS 2 or for Foxglove.

mod diagnosis;
#[cfg(feature = "foxglove")]
mod foxglove;
mod names;
#[cfg(feature = "ros2")]
mod node;
mod sensor;

use crate::follow::follow;
use crate::output::{Reader, print};
use crate::ros;
use crate::ros::channel::{Channel, Frames, messages};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::shown::shown;
use hivtac_host::stop;
use hivtac_wire::message::DeviceHello;
use sensor::{Event, Sensor, TareOrder, Told, What};
use serde_json::{Map, Value};
use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Events that wait for the outlets: some seconds of one device.
const EVENTS: usize = 1024;
/// Tares that wait for a device; whoever asks for more is told that it is busy.
const ORDERS: usize = 4;
/// Time between two turns of the outlets.
const TURN_EVERY: Duration = Duration::from_millis(20);
/// The environment variable by which all of ROS 2 knows its domain.
const DOMAIN: &str = "ROS_DOMAIN_ID";
/// The largest domain: a larger one would need a UDP port above the last.
pub const LAST_DOMAIN: u16 = 232;

/// What to serve, and how.
pub struct Options {
    /// Where the devices are.
    pub addresses: Vec<Address>,
    /// Longest wait for a device's answers.
    pub patience: Duration,
    /// As a node of ROS 2.
    pub ros2: bool,
    /// For Foxglove.
    pub foxglove: bool,
    /// The node's name.
    pub name: String,
    /// Its domain; that of the environment when none is given.
    pub domain: Option<u16>,
    /// Where Foxglove finds it.
    pub listen: SocketAddr,
    /// Where it is as one JSON object.
    pub json: bool,
}

/// Where messages go.
trait Outlet {
    /// Where it is: a word and its value, for the line that says so.
    fn told(&self) -> Vec<(&'static str, String)>;

    /// Publishes a device's message, CDR, that came at a time, ns since 1970; false when it could
    /// not.
    fn publish(&mut self, sensor: usize, channel: Channel, data: &[u8], came_ns: u64) -> bool;

    /// Publishes how a device stands, likewise.
    fn diagnostics(&mut self, data: &[u8], came_ns: u64);

    /// Does what there is to do besides.
    fn turn(&mut self) {}
}

/// A device, for the outlets.
struct Served {
    hello: DeviceHello,
    /// Its own part of names, when it is one of several.
    name: Option<String>,
    frames: Frames,
    orders: SyncSender<TareOrder>,
    down: Told,
    not_published: Arc<AtomicU64>,
}

/// Serves until it is interrupted. Prints `ready` and where.
///
/// # Errors
/// When this program was built without what is asked for, a device is not there to begin with, or
/// an outlet cannot be opened. A device that is lost later is waited for.
pub fn run(options: &Options) -> Result<(), Failure> {
    built_with(options)?;
    names::check(&options.name)?;
    let domain = match (options.ros2, options.domain) {
        (true, None) => domain()?,
        (_, domain) => domain.unwrap_or_default(),
    };
    let connect = |address| Link::connect(address, options.patience);
    let connected: Result<Vec<_>, _> = options.addresses.iter().map(connect).collect();
    let (links, hellos): (Vec<Link>, Vec<DeviceHello>) = connected?.into_iter().unzip();
    let units: BTreeSet<_> = hellos.iter().map(|hello| hello.device_id).collect();
    if units.len() < hellos.len() {
        return Err(usage("the same sensor is named twice"));
    }
    let (served, orders): (Vec<Served>, Vec<_>) = served(options, hellos).into_iter().unzip();
    let mut outlets = outlets(options, domain, &served)?;
    if tell(options.json, &outlets)? == Reader::Gone {
        return Ok(());
    }
    let (events, told) = sync_channel(EVENTS);
    std::thread::scope(|scope| {
        let each = links.into_iter().zip(orders).zip(&served).enumerate();
        for (number, ((link, orders), served)) in each {
            let about = (link.name.clone(), served.hello.clone());
            let count = served.not_published.clone();
            let mut sensor = Sensor::new(
                number,
                options.patience,
                about,
                events.clone(),
                (orders, served.down.clone()),
                count,
            );
            let address = &options.addresses[number];
            scope.spawn(move || follow(address, options.patience, link, &mut sensor));
        }
        drop(events);
        publish(&told, &served, &mut outlets);
    });
    stop::check()
}

/// Says when this program cannot do what is asked for.
fn built_with(options: &Options) -> Result<(), Failure> {
    for (is_wanted, is_there, what, feature) in [
        (options.ros2, cfg!(feature = "ros2"), "ROS 2", "ros2"),
        (
            options.foxglove,
            cfg!(feature = "foxglove"),
            "Foxglove",
            "foxglove",
        ),
    ] {
        if is_wanted && !is_there {
            return Err(usage(&format!(
                "this hivtac was built without {what}; build it with it: \
                 cargo install --path host-tool --features {feature}"
            )));
        }
    }
    Ok(())
}

fn usage(message: &str) -> Failure {
    Failure::new(Kind::Usage, message)
}

/// The domain of the environment; the first one when there is none.
fn domain() -> Result<u16, Failure> {
    let Some(text) = std::env::var_os(DOMAIN).filter(|text| !text.is_empty()) else {
        return Ok(0);
    };
    let text = text.to_string_lossy();
    let domain = text.parse().ok().filter(|domain| *domain <= LAST_DOMAIN);
    domain.ok_or_else(|| {
        usage(&format!(
            "{DOMAIN} is {}; a domain of ROS 2 is a number from 0 to {LAST_DOMAIN}: set it to \
             one, or choose with --domain",
            shown(&text)
        ))
    })
}

/// The devices by their names, each with where its orders arrive.
fn served(options: &Options, hellos: Vec<DeviceHello>) -> Vec<(Served, Receiver<TareOrder>)> {
    let names = names::of_devices(&hellos);
    let each = hellos.into_iter().zip(names).map(|(hello, name)| {
        let (orders, arriving) = sync_channel(ORDERS);
        let frames = match &name {
            None => options.name.clone(),
            Some(name) => format!("{}_{name}", options.name),
        };
        let served = Served {
            hello,
            name,
            frames: Frames::of(&frames),
            orders,
            down: Told::default(),
            not_published: Arc::default(),
        };
        (served, arriving)
    });
    each.collect()
}

/// Opens what is asked for.
#[cfg_attr(
    not(all(feature = "ros2", feature = "foxglove")),
    allow(
        unused_variables,
        unused_mut,
        reason = "only what these features add uses it"
    )
)]
fn outlets(
    options: &Options,
    domain: u16,
    served: &[Served],
) -> Result<Vec<Box<dyn Outlet>>, Failure> {
    let mut outlets: Vec<Box<dyn Outlet>> = Vec::new();
    #[cfg(feature = "ros2")]
    if options.ros2 {
        outlets.push(Box::new(node::Ros2::open(&options.name, domain, served)?));
    }
    #[cfg(feature = "foxglove")]
    if options.foxglove {
        outlets.push(Box::new(foxglove::Server::open(options.listen, served)?));
    }
    Ok(outlets)
}

/// Prints where everything is.
fn tell(json: bool, outlets: &[Box<dyn Outlet>]) -> Result<Reader, Failure> {
    let told = outlets.iter().flat_map(|outlet| outlet.told());
    print(&match json {
        true => {
            let object: Map<String, Value> = told
                .map(|(word, value)| (word.to_owned(), value.into()))
                .collect();
            Value::Object(object).to_string()
        }
        false => {
            let words = told.map(|(word, value)| format!(" {word}={value}"));
            format!("ready{}", words.collect::<String>())
        }
    })
}

/// Publishes what the devices tell, until nobody tells anything any more.
fn publish(told: &Receiver<Event>, served: &[Served], outlets: &mut [Box<dyn Outlet>]) {
    let mut turned = Instant::now();
    loop {
        match told.recv_timeout(TURN_EVERY) {
            Ok(event) => publish_one(&event, &served[event.sensor], outlets),
            Err(RecvTimeoutError::Timeout) => (),
            Err(RecvTimeoutError::Disconnected) => return,
        }
        if turned.elapsed() >= TURN_EVERY {
            turned = Instant::now();
            outlets.iter_mut().for_each(|outlet| outlet.turn());
        }
    }
}

fn publish_one(event: &Event, served: &Served, outlets: &mut [Box<dyn Outlet>]) {
    let Event {
        sensor,
        came_ns,
        what,
    } = event;
    match what {
        What::Sample(sample, stamp_ns) => {
            let messages = messages(sample, *stamp_ns, &served.frames);
            for outlet in outlets {
                let mut all = messages.iter();
                if !all.all(|(channel, data)| outlet.publish(*sensor, *channel, data, *came_ns)) {
                    served.not_published.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        What::Diagnosis(diagnosis) => {
            let data = ros::diagnostics(*came_ns, diagnosis);
            outlets
                .iter_mut()
                .for_each(|outlet| outlet.diagnostics(&data, *came_ns));
        }
    }
}
