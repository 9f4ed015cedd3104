//! A node of ROS 2: topics, diagnostics, a service that takes a tare, and a topic that receives the
//! direction of gravity. A middleware carries its messages: DDS or, where the environment chooses
//! it, Zenoh.

mod dds;
#[cfg(feature = "zenoh")]
mod zenoh;

#[cfg(feature = "zenoh")]
use super::is_on_zenoh;
use super::outlet::{Outlet, Served};
use super::sensor::{Answer, NextDown, TareOrder};
use crate::output::note;
use hivtac_host::down::direction;
use hivtac_host::failure::Failure;
use hivtac_host::ros::channel::{Channel, GripChannel};
use hivtac_host::ros::{DIAGNOSTICS, trigger_reply, vector_stamped};
use hivtac_host::shown::shown;
use hivtac_terms::down::Down;
use std::sync::PoisonError;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

/// The types of the node's service and of its subscriptions.
const TRIGGER: &str = "std_srvs/srv/Trigger";
const VECTOR: &str = "geometry_msgs/msg/Vector3Stamped";
/// Messages of a topic that are kept for subscriptions that missed them.
const KEPT: usize = 10;
/// Time between two checks for other nodes.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Time without any other program of the domain until that is reported.
const ALONE: Duration = Duration::from_secs(10);

/// Why an entity of the node could not be made, or a message not be sent.
type Trouble = Box<dyn std::error::Error + Send + Sync>;

/// The carrier of a node's messages. Names of topics and services are absolute; types are such as
/// `std_msgs/msg/Bool`.
trait Middleware: Sized + 'static {
    type Publisher;
    type Subscription;
    type Service;
    type Request;

    /// Its name in the message of a domain that cannot be joined, and advice for that.
    const ON: &str;
    const ADVICE: &str;

    /// Joins a domain as a node with this name.
    fn join(name: &str, domain: u16) -> Result<Self, Trouble>;

    /// A writer that is reliable and therefore reaches reliable and best-effort subscriptions. A
    /// slow subscription loses the oldest of the last [`KEPT`] messages.
    fn publisher(&mut self, topic: &str, kind: &str) -> Result<Self::Publisher, Trouble>;

    /// A best-effort subscription, which matches writers of either kind.
    fn subscription(&mut self, topic: &str, kind: &str) -> Result<Self::Subscription, Trouble>;

    /// A service.
    fn service(&mut self, name: &str, kind: &str) -> Result<Self::Service, Trouble>;

    /// Sends a message of CDR, which begins with its encoding.
    fn publish(publisher: &Self::Publisher, data: &[u8]) -> Result<(), Trouble>;

    /// The oldest message that was not taken, without its encoding.
    fn take(subscription: &Self::Subscription) -> Option<Vec<u8>>;

    /// The oldest request that was not taken.
    fn request(service: &Self::Service) -> Option<Self::Request>;

    /// Replies with CDR, which begins with its encoding.
    fn reply(service: &Self::Service, request: &Self::Request, data: &[u8]) -> Result<(), Trouble>;

    /// Whether another program of the domain is seen.
    fn has_company(&self) -> bool;

    /// Whether another node of this node's name is seen.
    fn has_namesake(&self) -> bool;

    /// Advice when no other program is seen.
    fn advice(&self) -> String;
}

/// A request that waits for its device.
struct Waiting<M: Middleware> {
    request: M::Request,
    answer: Receiver<Answer>,
}

/// The topics and the service of a device.
struct Sensor<M: Middleware> {
    /// In the order of [`Channel::ALL`].
    publishers: Vec<M::Publisher>,
    tare: M::Service,
    orders: SyncSender<TareOrder>,
    waiting: Vec<Waiting<M>>,
    gravity: M::Subscription,
    /// The frame of vectors of gravity.
    frame: String,
    down: NextDown,
    /// Whether an unusable vector was reported.
    is_reported: bool,
}

/// The node.
struct Node<M: Middleware> {
    sensors: Vec<Sensor<M>>,
    /// In the order of [`GripChannel::ALL`]; none without a grip.
    grip: Vec<M::Publisher>,
    diagnostics: M::Publisher,
    looked: Instant,
    /// Since when no other program was seen; `None` once one was, or that was reported.
    alone: Option<Instant>,
    /// Whether another node of this name was reported.
    is_reported: bool,
    middleware: M,
    name: String,
    domain: u16,
}

/// Joins a domain as a node with this name, with the devices' topics and services below it, and the
/// topics of a grip, if any.
///
/// # Errors When there is no network to join, not even this computer's own, or the environment has
/// invalid settings of Zenoh.
pub fn open(
    name: &str,
    domain: u16,
    served: &[Served],
    has_grip: bool,
) -> Result<Box<dyn Outlet>, Failure> {
    #[cfg(feature = "zenoh")]
    if is_on_zenoh() {
        return open_on::<zenoh::Zenoh>(name, domain, served, has_grip);
    }
    open_on::<dds::Dds>(name, domain, served, has_grip)
}

fn open_on<M: Middleware>(
    name: &str,
    domain: u16,
    served: &[Served],
    has_grip: bool,
) -> Result<Box<dyn Outlet>, Failure> {
    let joined = M::join(name, domain);
    let node = joined.and_then(|it| Node::open(it, name, domain, served, has_grip));
    let node = node.map_err(|error| {
        Failure::input(format!(
            "cannot take part in ROS 2's domain {domain}{}: {error}; {}",
            M::ON,
            M::ADVICE
        ))
    })?;
    Ok(Box::new(node))
}

impl<M: Middleware> Node<M> {
    fn open(
        mut middleware: M,
        name: &str,
        domain: u16,
        served: &[Served],
        has_grip: bool,
    ) -> Result<Node<M>, Trouble> {
        let sensors = served.iter().map(|served| {
            let folder = folder(name, served.name.as_deref());
            Sensor::open(&mut middleware, &folder, served)
        });
        let sensors = sensors.collect::<Result<_, _>>()?;
        let of_grip = GripChannel::ALL.iter().filter(|_| has_grip);
        let grip = of_grip.map(|channel| {
            let topic = format!("/{name}/grip/{}", channel.name());
            middleware.publisher(&topic, channel.definition().name)
        });
        Ok(Node {
            sensors,
            grip: grip.collect::<Result<_, _>>()?,
            diagnostics: middleware.publisher("/diagnostics", DIAGNOSTICS.name)?,
            looked: Instant::now(),
            alone: Some(Instant::now()),
            is_reported: false,
            middleware,
            name: format!("/{name}"),
            domain,
        })
    }

    /// Reports once when no other program of the domain is seen.
    fn look_for_company(&mut self) {
        let Some(since) = self.alone else {
            return;
        };
        if self.middleware.has_company() {
            self.alone = None;
        } else if since.elapsed() >= ALONE {
            self.alone = None;
            note(&format!(
                "hivtac: nothing else of ROS 2 is in domain {} so far; is ROS_DOMAIN_ID the same \
                 there? {}",
                self.domain,
                self.middleware.advice()
            ));
        }
    }

    /// Reports once when another node has this name, because their messages would mix.
    fn look_for_namesake(&mut self) {
        let is_anothers = self.middleware.has_namesake();
        if is_anothers && !self.is_reported {
            note(&format!(
                "hivtac: another node in domain {} is called {}, too, and their messages are \
                 mixed; end one, or start it with another --name",
                self.domain, self.name
            ));
        }
        self.is_reported = is_anothers;
    }
}

/// The prefix of a device's names.
fn folder(name: &str, sensor: Option<&str>) -> String {
    match sensor {
        None => format!("/{name}"),
        Some(sensor) => format!("/{name}/{sensor}"),
    }
}

impl<M: Middleware> Sensor<M> {
    fn open(middleware: &mut M, folder: &str, served: &Served) -> Result<Sensor<M>, Trouble> {
        let publishers = Channel::ALL.iter().map(|channel| {
            let topic = format!("{folder}/{}", channel.name());
            middleware.publisher(&topic, channel.definition().name)
        });
        Ok(Sensor {
            publishers: publishers.collect::<Result<_, _>>()?,
            tare: middleware.service(&format!("{folder}/tare"), TRIGGER)?,
            orders: served.orders.clone(),
            waiting: Vec::new(),
            gravity: middleware.subscription(&format!("{folder}/gravity"), VECTOR)?,
            frame: served.frames.film().to_owned(),
            down: served.down.clone(),
            is_reported: false,
        })
    }

    /// Passes on the newest direction of gravity.
    fn hear_gravity(&mut self) {
        while let Some(body) = M::take(&self.gravity) {
            match self.down_of(&body) {
                Ok(down) => {
                    *self.down.lock().unwrap_or_else(PoisonError::into_inner) = Some(down);
                }
                Err(why) if !self.is_reported => {
                    note(&format!("hivtac: a vector of gravity is left out: {why}"));
                    self.is_reported = true;
                }
                Err(_) => {}
            }
        }
    }

    fn down_of(&self, body: &[u8]) -> Result<Down, String> {
        let (frame, vector) = vector_stamped(body).ok_or("it cannot be read")?;
        if !["", &self.frame].contains(&frame) {
            let own = &self.frame;
            return Err(format!("it is in the frame {}, not in {own}", shown(frame)));
        }
        direction(vector).map(Down::Told)
    }

    /// Passes on the requests for a tare.
    fn pass_on(&mut self) {
        while let Some(request) = M::request(&self.tare) {
            let (answering, answer) = sync_channel(1);
            // A request beyond the queue is dropped; its reply comes when that is noticed.
            let _ = self.orders.try_send(TareOrder(answering));
            self.waiting.push(Waiting { request, answer });
        }
    }

    /// Replies to the requests that are done.
    fn answer(&mut self) {
        let tare = &self.tare;
        self.waiting.retain(|waiting| {
            let answer = match waiting.answer.try_recv() {
                Err(TryRecvError::Empty) => return true,
                Err(TryRecvError::Disconnected) => {
                    Err("the device is busy with other tares; try again later".to_owned())
                }
                Ok(answer) => answer,
            };
            let (Ok(text) | Err(text)) = &answer;
            let reply = trigger_reply(answer.is_ok(), text);
            if let Err(error) = M::reply(tare, &waiting.request, &reply) {
                note(&format!(
                    "hivtac: the answer to a tare could not be sent: {error}"
                ));
            }
            false
        });
    }
}

impl<M: Middleware> Outlet for Node<M> {
    fn addresses(&self) -> Vec<(&'static str, String)> {
        vec![
            ("ros2", self.name.clone()),
            ("domain", self.domain.to_string()),
        ]
    }

    fn publish(&mut self, sensor: usize, channel: Channel, data: &[u8], _: u64) -> bool {
        let publisher = &self.sensors[sensor].publishers[channel as usize];
        M::publish(publisher, data).is_ok()
    }

    fn publish_grip(&mut self, channel: GripChannel, data: &[u8], _: u64) -> bool {
        let publisher = self.grip.get(channel as usize);
        publisher.is_none_or(|publisher| M::publish(publisher, data).is_ok())
    }

    fn diagnostics(&mut self, data: &[u8], _: u64) {
        // An error is ignored: the next message comes in a second.
        let _ = M::publish(&self.diagnostics, data);
    }

    fn turn(&mut self) {
        for sensor in &mut self.sensors {
            sensor.pass_on();
            sensor.hear_gravity();
            sensor.answer();
        }
        if self.looked.elapsed() >= LOOK_EVERY {
            self.looked = Instant::now();
            self.look_for_namesake();
            self.look_for_company();
        }
    }
}
