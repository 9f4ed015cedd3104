//! A node of ROS 2: topics, diagnostics, a service that takes a tare, and a topic that receives the
//! direction of gravity.
//!
//! Writers are reliable, and therefore reach reliable and best-effort subscriptions. A slow
//! subscription loses the oldest of the last ten messages of a topic.

use super::outlet::{Outlet, Served};
use super::sensor::{Answer, NextDown, TareOrder};
use crate::output::note;
use hivtac_host::down::direction;
use hivtac_host::failure::Failure;
use hivtac_host::ros::channel::{Channel, GripChannel};
use hivtac_host::ros::{DIAGNOSTICS, Definition, trigger_reply, vector_stamped};
use hivtac_host::shown::shown;
use hivtac_terms::down::Down;
use ros2_client::dds::rustdds::{DomainParticipantBuilder, RTPSEntity};
use ros2_client::qos::{History, WhenFull};
use ros2_client::{
    Context, Message, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, QosProfile,
    RmwRequestId, Server, ServiceMapping, ServiceTypeName, Subscription,
};
use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};
use std::fmt;
use std::net::Ipv4Addr;
use std::sync::PoisonError;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

/// Messages of a topic that are kept for subscriptions that missed them.
const KEPT: usize = 10;
/// Bytes of CDR before a message: its encoding, which the writer adds.
const ENCODING: usize = 4;
/// Bytes before a request and its reply, by which Cyclone DDS's clients match them. Other clients
/// get these data outside the message.
const CYCLONES_HEADER: usize = 16;
/// Most bytes of a received message: a vector with the name of its frame.
const LONGEST_RECEIVED: usize = 512;
/// Time between two checks for another node of this name.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Time without any other program of the domain until that is reported.
const ALONE: Duration = Duration::from_secs(10);

/// A message as CDR, without its encoding; it is written and read unchanged.
#[derive(Clone)]
struct Body(Vec<u8>);

impl Body {
    /// The body of CDR with its encoding.
    fn of(data: &[u8]) -> Body {
        Body(data.get(ENCODING..).unwrap_or_default().to_vec())
    }
}

impl Message for Body {}

impl Serialize for Body {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut bytes = serializer.serialize_tuple(self.0.len())?;
        self.0
            .iter()
            .try_for_each(|byte| bytes.serialize_element(byte))?;
        bytes.end()
    }
}

impl<'de> Deserialize<'de> for Body {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Body, D::Error> {
        deserializer.deserialize_tuple(LONGEST_RECEIVED, ToTheEnd)
    }
}

/// Reads bytes to their end.
struct ToTheEnd;

impl<'de> Visitor<'de> for ToTheEnd {
    type Value = Body;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut bytes: A) -> Result<Body, A::Error> {
        let mut all = Vec::new();
        while let Ok(Some(byte)) = bytes.next_element() {
            all.push(byte);
        }
        Ok(Body(all))
    }
}

/// A request that waits for its device.
struct Waiting {
    request: RmwRequestId,
    /// The header that Cyclone DDS's clients expect in the reply.
    header: Vec<u8>,
    answer: Receiver<Answer>,
}

/// The topics and the service of a device.
struct Sensor {
    /// In the order of [`Channel::ALL`].
    publishers: Vec<Publisher<Body>>,
    tare: Server<Body, Body>,
    orders: SyncSender<TareOrder>,
    waiting: Vec<Waiting>,
    gravity: Subscription<Body>,
    /// The frame of vectors of gravity.
    frame: String,
    down: NextDown,
    /// Whether an unusable vector was reported.
    is_reported: bool,
}

/// The node.
pub struct Ros2 {
    sensors: Vec<Sensor>,
    /// In the order of [`GripChannel::ALL`]; none without a grip.
    grip: Vec<Publisher<Body>>,
    diagnostics: Publisher<Body>,
    looked: Instant,
    /// Since when no other program was seen; `None` once one was, or that was reported.
    alone: Option<Instant>,
    /// Whether another node of this name was reported.
    is_reported: bool,
    node: Node,
    context: Context,
    /// The topic that only this node should write, by its DDS name.
    own_topic: String,
    domain: u16,
}

impl Ros2 {
    /// Joins a domain as a node with this name, with the devices' topics and services below it, and
    /// the topics of a grip if there is one.
    ///
    /// # Errors
    /// When there is no network to join, not even this computer's own.
    pub fn open(
        name: &str,
        domain: u16,
        served: &[Served],
        has_grip: bool,
    ) -> Result<Ros2, Failure> {
        if std::env::var_os("RMW_IMPLEMENTATION").is_some_and(|it| it == "rmw_zenoh_cpp") {
            note(
                "hivtac: RMW_IMPLEMENTATION is rmw_zenoh_cpp, but this node speaks DDS, and nodes \
                 on Zenoh do not see it (docs/robots.md)",
            );
        }
        Ros2::try_to_open(name, domain, served, has_grip).map_err(|error| {
            Failure::input(format!(
                "cannot take part in ROS 2's domain {domain}: {error}; is a network up, and is \
                 UDP allowed?"
            ))
        })
    }

    fn try_to_open(
        name: &str,
        domain: u16,
        served: &[Served],
        has_grip: bool,
    ) -> Result<Ros2, Box<dyn std::error::Error>> {
        let mut participant = DomainParticipantBuilder::new(domain);
        if stays_here() {
            participant = participant.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let context = Context::from_domain_participant(participant.build()?)?;
        // A log topic and parameters would be empty.
        let options = NodeOptions::new().enable_rosout(false);
        let mut node = context.new_node(NodeName::new("/", name)?, options)?;
        let folders = served.iter().map(|it| folder(name, it.name.as_deref()));
        let folders: Vec<String> = folders.collect();
        let sensors = served.iter().zip(&folders);
        let sensors = sensors.map(|(served, folder)| Sensor::open(&mut node, folder, served));
        let sensors = sensors.collect::<Result<_, _>>()?;
        let of_grip = GripChannel::ALL.iter().filter(|_| has_grip);
        let grip = of_grip.map(|channel| {
            let name = Name::new(&format!("/{name}/grip"), channel.name())?;
            Ok(publisher(&mut node, &name, channel.definition())?)
        });
        let grip = grip.collect::<Result<_, Box<dyn std::error::Error>>>()?;
        let diagnostics = Name::new("/", "diagnostics")?;
        let first = folders.first().map_or("", String::as_str);
        Ok(Ros2 {
            sensors,
            grip,
            diagnostics: publisher(&mut node, &diagnostics, &DIAGNOSTICS)?,
            looked: Instant::now(),
            alone: Some(Instant::now()),
            is_reported: false,
            node,
            context,
            own_topic: format!("rt{first}/{}", Channel::Status.name()),
            domain,
        })
    }

    /// Reports once when no other program of the domain is seen.
    fn look_for_company(&mut self) {
        let Some(since) = self.alone else {
            return;
        };
        let participant = self.context.domain_participant();
        let own = participant.guid().prefix;
        let writers = participant.discovered_writers().into_iter();
        let readers = participant.discovered_readers().into_iter();
        let mut others = writers
            .map(|it| it.publication_topic_data.key.prefix)
            .chain(readers.map(|it| it.reader_proxy.remote_reader_guid.prefix));
        if others.any(|prefix| prefix != own) {
            self.alone = None;
        } else if since.elapsed() >= ALONE {
            self.alone = None;
            note(&format!(
                "hivtac: nothing else of ROS 2 is in domain {} so far; is ROS_DOMAIN_ID the same \
                 there, and do both reach one network? Nodes on Zenoh (rmw_zenoh_cpp) do not see \
                 this one (docs/robots.md)",
                self.domain
            ));
        }
    }

    /// Reports once when another node has this name, because their messages would mix.
    fn look_for_another(&mut self) {
        let participant = self.context.domain_participant();
        let own = participant.guid().prefix;
        let writers = participant.discovered_writers();
        let is_anothers = writers.iter().any(|writer| {
            let data = &writer.publication_topic_data;
            data.topic_name == self.own_topic && data.key.prefix != own
        });
        if is_anothers && !self.is_reported {
            note(&format!(
                "hivtac: another node in domain {} is called {}, too, and their messages are \
                 mixed; end one, or start it with another --name",
                self.domain,
                self.node.fully_qualified_name()
            ));
        }
        self.is_reported = is_anothers;
    }
}

/// Whether the environment, as for all of ROS 2, restricts traffic to this computer.
fn stays_here() -> bool {
    let is = |name: &str, value: &str| std::env::var_os(name).is_some_and(|it| it == value);
    is("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST") || is("ROS_LOCALHOST_ONLY", "1")
}

/// The prefix of a device's names.
fn folder(name: &str, sensor: Option<&str>) -> String {
    match sensor {
        None => format!("/{name}"),
        Some(sensor) => format!("/{name}/{sensor}"),
    }
}

fn qos() -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .history(History::KeepLast { depth: KEPT })
}

/// Quality of service for data that change often: it matches writers of either kind.
fn best_effort() -> QosProfile {
    QosProfile::subscription_default().reliability_best_effort()
}

fn publisher(
    node: &mut Node,
    name: &Name,
    definition: &Definition,
) -> ros2_client::CreateResult<Publisher<Body>> {
    let mut parts = definition.name.split('/');
    let package = parts.next().unwrap_or_default();
    let kind = MessageTypeName::new(package, parts.next_back().unwrap_or_default());
    let topic = node.create_topic(name, kind, &qos())?;
    node.create_publisher(&topic, None)
}

impl Sensor {
    fn open(
        node: &mut Node,
        folder: &str,
        served: &Served,
    ) -> Result<Sensor, Box<dyn std::error::Error>> {
        let publishers = Channel::ALL.iter().map(|channel| {
            let name = Name::new(folder, channel.name())?;
            Ok(publisher(node, &name, channel.definition())?)
        });
        let publishers = publishers.collect::<Result<_, Box<dyn std::error::Error>>>()?;
        let tare = node.create_server(
            ServiceMapping::Enhanced,
            &Name::new(folder, "tare")?,
            &ServiceTypeName::new("std_srvs", "Trigger"),
            qos(),
            qos(),
        )?;
        let kind = MessageTypeName::new("geometry_msgs", "Vector3Stamped");
        let topic = node.create_topic(&Name::new(folder, "gravity")?, kind, &best_effort())?;
        Ok(Sensor {
            publishers,
            tare,
            orders: served.orders.clone(),
            waiting: Vec::new(),
            gravity: node.create_subscription(&topic, None)?,
            frame: served.frames.film().to_owned(),
            down: served.down.clone(),
            is_reported: false,
        })
    }

    /// Passes on the newest direction of gravity.
    fn hear_gravity(&mut self) {
        while let Ok(Some((body, _))) = self.gravity.take() {
            match self.down_of(&body.0) {
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
        while let Ok(Some((request, body))) = self.tare.receive_request() {
            let is_cyclones = body.0.len() > CYCLONES_HEADER;
            let header = if is_cyclones { CYCLONES_HEADER } else { 0 };
            let (answering, answer) = sync_channel(1);
            // A request beyond the queue is dropped; its reply comes when that is noticed.
            let _ = self.orders.try_send(TareOrder(answering));
            self.waiting.push(Waiting {
                request,
                header: body.0[..header].to_vec(),
                answer,
            });
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
            waiting.reply(tare, &answer);
            false
        });
    }
}

impl Waiting {
    fn reply(&self, tare: &Server<Body, Body>, answer: &Answer) {
        let (Ok(text) | Err(text)) = answer;
        let reply = trigger_reply(answer.is_ok(), text);
        let body = [self.header.as_slice(), &Body::of(&reply).0].concat();
        if let Err(error) = tare.send_response(self.request, Body(body)) {
            note(&format!(
                "hivtac: the answer to a tare could not be sent: {error}"
            ));
        }
    }
}

impl Outlet for Ros2 {
    fn addresses(&self) -> Vec<(&'static str, String)> {
        vec![
            ("ros2", self.node.fully_qualified_name()),
            ("domain", self.domain.to_string()),
        ]
    }

    fn publish(&mut self, sensor: usize, channel: Channel, data: &[u8], _: u64) -> bool {
        let publisher = &self.sensors[sensor].publishers[channel as usize];
        publisher.publish(Body::of(data)).is_ok()
    }

    fn publish_grip(&mut self, channel: GripChannel, data: &[u8], _: u64) -> bool {
        let publisher = self.grip.get(channel as usize);
        publisher.is_none_or(|publisher| publisher.publish(Body::of(data)).is_ok())
    }

    fn diagnostics(&mut self, data: &[u8], _: u64) {
        // An error is ignored: the next message comes in a second.
        let _ = self.diagnostics.publish(Body::of(data));
    }

    fn turn(&mut self) {
        for sensor in &mut self.sensors {
            sensor.pass_on();
            sensor.hear_gravity();
            sensor.answer();
        }
        if self.looked.elapsed() >= LOOK_EVERY {
            self.looked = Instant::now();
            self.look_for_another();
            self.look_for_company();
        }
    }
}
