//! `hivtac serve`: serves the forces to other programs, as a node of ROS 2, for Foxglove or Rerun.

mod diagnosis;
#[cfg(feature = "foxglove")]
mod foxglove;
mod names;
mod outlet;
mod rerun;
#[cfg(feature = "ros2")]
mod ros2;
mod sensor;

use crate::device::Devices;
use crate::follow::follow;
use crate::grip_command::{GripArguments, Paired};
use crate::output::{Reader, print};
use clap::Args;
use hivtac_host::clock::now_ns;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::grip::Reading;
use hivtac_host::ros;
use hivtac_host::ros::channel::{Frames, grip_messages, messages};
use hivtac_host::shown::shown;
use hivtac_host::stop;
use hivtac_wire::message::DeviceHello;
use outlet::{Outlet, Served};
use sensor::{Event, NextDown, Sensor, TareOrder, What};
use serde_json::{Map, Value};
use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

/// Most events that wait for the outlets: some seconds of one device.
const EVENTS: usize = 1024;
/// Most tares that wait for a device; a further request gets the answer that it is busy.
const ORDERS: usize = 4;
/// Time between two calls of [`Outlet::turn`].
const TURN_EVERY: Duration = Duration::from_millis(20);
/// The environment variable with ROS 2's domain.
const DOMAIN: &str = "ROS_DOMAIN_ID";
/// The largest domain; a larger one would need a UDP port above the last.
const LAST_DOMAIN: u16 = 232;

/// Serve forces to other programs, as a node of ROS 2, for Foxglove or Rerun, until Ctrl-C
///
/// For a hivtac that was built with it: `cargo install --path host-tool --features ros2,foxglove`,
/// or with `zenoh`, where RMW_IMPLEMENTATION is rmw_zenoh_cpp. Prints `ready` and the addresses;
/// goes on after a lost connection, which diagnostics show. Topics of the node, each below its
/// name: `wrench`, `place`, `contacts`, `markers`, `contact`, `slip`, `status`; service `tare`; and
/// `/diagnostics`. Those of several sensors are below /NODE/SENSOR, those of a grip below
/// /NODE/grip. Rerun needs no such build, but Python with `hivtac[rerun]`.
///
/// Example: hivtac serve --ros2 --foxglove
#[derive(Args)]
pub struct ServeArguments {
    #[command(flatten)]
    devices: Devices,
    #[command(flatten)]
    grip: GripArguments,
    #[command(flatten)]
    outlets: Outlets,
    /// The node's name in ROS 2
    #[arg(long, value_name = "NODE", default_value = "hivtac", requires = "ros2")]
    name: String,
    /// ROS 2's domain, 0–232; ROS_DOMAIN_ID when not given, else 0
    #[arg(
        long,
        value_name = "ID",
        requires = "ros2",
        value_parser = clap::value_parser!(u16).range(0..=i64::from(LAST_DOMAIN))
    )]
    domain: Option<u16>,
    /// Where Foxglove finds it; port 0 for any that is free. Only this computer can reach
    /// 127.0.0.1, others too 0.0.0.0: whoever reaches it can read everything
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        default_value = "127.0.0.1:8765",
        requires = "foxglove"
    )]
    listen: SocketAddr,
    /// Where it is as one JSON object
    #[arg(long)]
    json: bool,
    /// Options of Rerun's own: `-- --save press.rrd` writes a file, `-- --connect` uses a viewer
    /// that is open
    #[arg(last = true, value_name = "OPTIONS", requires = "rerun")]
    rerun_options: Vec<String>,
}

/// Which programs are served.
#[derive(Args)]
#[group(required = true, multiple = true)]
struct Outlets {
    /// As a node of ROS 2, which needs no ROS to be installed here
    #[arg(long)]
    ros2: bool,
    /// For Foxglove, over its WebSocket
    #[arg(long)]
    foxglove: bool,
    /// In Rerun's viewer
    #[arg(long, conflicts_with_all = ["ros2", "foxglove", "grip", "json"])]
    rerun: bool,
}

/// Serves until the program is interrupted. Prints `ready` and the addresses.
///
/// # Errors
/// When this build lacks an outlet, a device is missing at the start, or an outlet cannot be
/// opened. A device that is lost later is waited for.
pub fn run(arguments: &ServeArguments) -> Result<(), Failure> {
    if arguments.outlets.rerun {
        return rerun::run(arguments);
    }
    let (devices, grip) = (&arguments.devices, &arguments.grip);
    let addresses = grip.before(devices.timeout, || devices.addresses())?;
    built_with(&arguments.outlets)?;
    names::check(&arguments.name)?;
    let domain = match (arguments.outlets.ros2, arguments.domain) {
        (true, None) => domain()?,
        (_, domain) => domain.unwrap_or_default(),
    };
    let (links, hellos) = arguments.devices.connect(&addresses)?;
    let units: BTreeSet<_> = hellos.iter().map(|hello| hello.device_id).collect();
    if units.len() < hellos.len() {
        return Err(usage("the same sensor is named twice"));
    }
    let paired = grip.pair(&hellos)?;
    let (served, orders): (Vec<Served>, Vec<_>) =
        served(&arguments.name, hellos).into_iter().unzip();
    let mut outlets = outlets(arguments, domain, &served, paired.is_some())?;
    if tell(arguments.json, &outlets)? == Reader::Gone {
        return Ok(());
    }
    let (events, received) = sync_channel(EVENTS);
    std::thread::scope(|scope| {
        let each = links.into_iter().zip(orders).zip(&served).enumerate();
        for (number, ((link, orders), served)) in each {
            let about = (link.name.clone(), served.hello.clone());
            let count = served.not_published.clone();
            let mut sensor = Sensor::new(
                number,
                arguments.devices.timeout,
                about,
                events.clone(),
                (orders, served.down.clone()),
                count,
            );
            let address = &addresses[number];
            scope.spawn(move || follow(address, arguments.devices.timeout, link, &mut sensor));
        }
        drop(events);
        let frame = format!("{}_grip", arguments.name);
        let mut grips = paired.map(|paired| Grips { paired, frame });
        publish(&received, &served, &mut grips, &mut outlets);
    });
    stop::check()
}

/// Whether the environment chooses Zenoh as the middleware of ROS 2's programs.
fn is_on_zenoh() -> bool {
    std::env::var_os("RMW_IMPLEMENTATION").is_some_and(|it| it == "rmw_zenoh_cpp")
}

/// An error if this build lacks a wanted outlet.
fn built_with(outlets: &Outlets) -> Result<(), Failure> {
    let ros2 = match is_on_zenoh() {
        true => (
            cfg!(feature = "zenoh"),
            "Zenoh, and RMW_IMPLEMENTATION is rmw_zenoh_cpp",
            "zenoh",
        ),
        false => (cfg!(feature = "ros2"), "ROS 2", "ros2"),
    };
    let foxglove = (cfg!(feature = "foxglove"), "Foxglove", "foxglove");
    for (is_wanted, (is_there, what, feature)) in
        [(outlets.ros2, ros2), (outlets.foxglove, foxglove)]
    {
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

/// The domain from the environment; 0 if it is not set.
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

/// The devices with their names, each with the receiver of its orders.
fn served(node: &str, hellos: Vec<DeviceHello>) -> Vec<(Served, Receiver<TareOrder>)> {
    let names = names::of_devices(&hellos);
    let each = hellos.into_iter().zip(names).map(|(hello, name)| {
        let (orders, arriving) = sync_channel(ORDERS);
        let frames = match &name {
            None => node.to_owned(),
            Some(name) => format!("{node}_{name}"),
        };
        let served = Served {
            hello,
            name,
            frames: Frames::of(&frames),
            orders,
            down: NextDown::default(),
            not_published: Arc::default(),
        };
        (served, arriving)
    });
    each.collect()
}

/// Opens the wanted outlets.
#[cfg_attr(
    not(all(feature = "ros2", feature = "foxglove")),
    allow(
        unused_variables,
        unused_mut,
        reason = "only what these features add uses it"
    )
)]
fn outlets(
    arguments: &ServeArguments,
    domain: u16,
    served: &[Served],
    has_grip: bool,
) -> Result<Vec<Box<dyn Outlet>>, Failure> {
    let mut outlets: Vec<Box<dyn Outlet>> = Vec::new();
    #[cfg(feature = "ros2")]
    if arguments.outlets.ros2 {
        outlets.push(ros2::open(&arguments.name, domain, served, has_grip)?);
    }
    #[cfg(feature = "foxglove")]
    if arguments.outlets.foxglove {
        outlets.push(Box::new(foxglove::Server::open(
            arguments.listen,
            served,
            has_grip,
        )?));
    }
    Ok(outlets)
}

/// Prints the address of each outlet.
fn tell(json: bool, outlets: &[Box<dyn Outlet>]) -> Result<Reader, Failure> {
    let addresses = outlets.iter().flat_map(|outlet| outlet.addresses());
    print(&match json {
        true => {
            let object: Map<String, Value> = addresses
                .map(|(word, value)| (word.to_owned(), value.into()))
                .collect();
            Value::Object(object).to_string()
        }
        false => {
            let words = addresses.map(|(word, value)| format!(" {word}={value}"));
            format!("ready{}", words.collect::<String>())
        }
    })
}

/// Publishes the devices' events until all their threads have ended.
fn publish(
    received: &Receiver<Event>,
    served: &[Served],
    grips: &mut Option<Grips>,
    outlets: &mut [Box<dyn Outlet>],
) {
    let mut turned = Instant::now();
    loop {
        match received.recv_timeout(TURN_EVERY) {
            Ok(event) => {
                publish_one(&event, &served[event.sensor], outlets);
                if let Some(grips) = grips {
                    grips.publish(&event, served, outlets);
                }
            }
            Err(RecvTimeoutError::Timeout) => (),
            Err(RecvTimeoutError::Disconnected) => return,
        }
        if turned.elapsed() >= TURN_EVERY {
            turned = Instant::now();
            outlets.iter_mut().for_each(|outlet| outlet.turn());
        }
    }
}

/// The grip of the first two devices, and its coordinate frame.
struct Grips {
    paired: Paired,
    frame: String,
}

impl Grips {
    /// Publishes the grips that are known by an event. One that an outlet does not take counts as
    /// a sample of the first finger.
    fn publish(&mut self, event: &Event, served: &[Served], outlets: &mut [Box<dyn Outlet>]) {
        let What::Sample(sample, stamp_ns) = &event.what else {
            return;
        };
        if event.sensor > 1 {
            return;
        }
        let reading = Reading::of(sample, *stamp_ns, event.came_ns);
        let Paired { pair, names } = &mut self.paired;
        for grip in pair.push(event.sensor, reading) {
            let now_ns = now_ns();
            for (channel, data) in grip_messages(&grip, &self.frame, names) {
                let mut all = outlets.iter_mut();
                if !all.all(|outlet| outlet.publish_grip(channel, &data, now_ns)) {
                    served[0].not_published.fetch_add(1, Ordering::Relaxed);
                }
            }
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
