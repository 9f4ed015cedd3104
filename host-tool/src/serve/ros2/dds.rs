//! DDS as a node's middleware.

use super::{KEPT, Middleware, Trouble};
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

/// Bytes of CDR before a message: its encoding, which the writer adds.
const ENCODING: usize = 4;
/// Bytes before a request and its reply, by which Cyclone DDS's clients match them. Other clients
/// get these data outside the message.
const CYCLONES_HEADER: usize = 16;
/// Most bytes of a received message: a vector with the name of its frame.
const LONGEST_RECEIVED: usize = 512;

/// A message as CDR, without its encoding; it is written and read unchanged.
#[derive(Clone)]
pub(super) struct Body(Vec<u8>);

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

/// A participant of a domain, with its node.
pub(super) struct Dds {
    node: Node,
    context: Context,
    /// The first topic of this node, by its DDS name: no other node should write it.
    own_topic: Option<String>,
}

/// A request, with the header that Cyclone DDS's clients expect in the reply.
pub(super) struct Request {
    id: RmwRequestId,
    header: Vec<u8>,
}

/// Whether the environment, as for all of ROS 2, restricts traffic to this computer.
fn stays_here() -> bool {
    let is = |name: &str, value: &str| std::env::var_os(name).is_some_and(|it| it == value);
    is("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST") || is("ROS_LOCALHOST_ONLY", "1")
}

fn reliable() -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .history(History::KeepLast { depth: KEPT })
}

/// The name of a topic or a service.
fn name_of(path: &str) -> Result<Name, Trouble> {
    Ok(Name::parse(path)?)
}

/// Package and name of a type.
fn parts(kind: &str) -> (&str, &str) {
    let package = kind.split('/').next().unwrap_or_default();
    (package, kind.rsplit('/').next().unwrap_or_default())
}

impl Middleware for Dds {
    type Publisher = Publisher<Body>;
    type Subscription = Subscription<Body>;
    type Service = Server<Body, Body>;
    type Request = Request;

    const ON: &str = "";
    const ADVICE: &str = "is a network up, and is UDP allowed?";

    fn join(name: &str, domain: u16) -> Result<Dds, Trouble> {
        let mut participant = DomainParticipantBuilder::new(domain);
        if stays_here() {
            participant = participant.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let context = Context::from_domain_participant(participant.build()?)?;
        // A log topic and parameters would be empty.
        let options = NodeOptions::new().enable_rosout(false);
        let node = context.new_node(NodeName::new("/", name)?, options)?;
        Ok(Dds {
            node,
            context,
            own_topic: None,
        })
    }

    fn publisher(&mut self, topic: &str, kind: &str) -> Result<Self::Publisher, Trouble> {
        self.own_topic.get_or_insert_with(|| format!("rt{topic}"));
        let (package, kind) = parts(kind);
        let kind = MessageTypeName::new(package, kind);
        let topic = self
            .node
            .create_topic(&name_of(topic)?, kind, &reliable())?;
        Ok(self.node.create_publisher(&topic, None)?)
    }

    fn subscription(&mut self, topic: &str, kind: &str) -> Result<Self::Subscription, Trouble> {
        let (package, kind) = parts(kind);
        let qos = QosProfile::subscription_default().reliability_best_effort();
        let kind = MessageTypeName::new(package, kind);
        let topic = self.node.create_topic(&name_of(topic)?, kind, &qos)?;
        Ok(self.node.create_subscription(&topic, None)?)
    }

    fn service(&mut self, name: &str, kind: &str) -> Result<Self::Service, Trouble> {
        let (package, kind) = parts(kind);
        Ok(self.node.create_server(
            ServiceMapping::Enhanced,
            &name_of(name)?,
            &ServiceTypeName::new(package, kind),
            reliable(),
            reliable(),
        )?)
    }

    fn publish(publisher: &Self::Publisher, data: &[u8]) -> Result<(), Trouble> {
        let sent = publisher.publish(Body::of(data));
        sent.map_err(|error| error.to_string().into())
    }

    fn take(subscription: &Self::Subscription) -> Option<Vec<u8>> {
        let (body, _) = subscription.take().ok()??;
        Some(body.0)
    }

    fn request(service: &Self::Service) -> Option<Request> {
        let (id, body) = service.receive_request().ok()??;
        let is_cyclones = body.0.len() > CYCLONES_HEADER;
        let header = if is_cyclones { CYCLONES_HEADER } else { 0 };
        Some(Request {
            id,
            header: body.0[..header].to_vec(),
        })
    }

    fn reply(service: &Self::Service, request: &Request, data: &[u8]) -> Result<(), Trouble> {
        let body = [request.header.as_slice(), &Body::of(data).0].concat();
        let sent = service.send_response(request.id, Body(body));
        sent.map_err(|error| error.to_string().into())
    }

    fn has_company(&self) -> bool {
        let participant = self.context.domain_participant();
        let own = participant.guid().prefix;
        let writers = participant.discovered_writers().into_iter();
        let readers = participant.discovered_readers().into_iter();
        let mut all = writers
            .map(|it| it.publication_topic_data.key.prefix)
            .chain(readers.map(|it| it.reader_proxy.remote_reader_guid.prefix));
        all.any(|prefix| prefix != own)
    }

    fn has_namesake(&self) -> bool {
        let participant = self.context.domain_participant();
        let own = participant.guid().prefix;
        participant.discovered_writers().iter().any(|writer| {
            let data = &writer.publication_topic_data;
            Some(&data.topic_name) == self.own_topic.as_ref() && data.key.prefix != own
        })
    }

    fn advice(&self) -> String {
        "Do both reach one network? Nodes on Zenoh (rmw_zenoh_cpp) do not see this one \
         (docs/robots.md)"
            .to_owned()
    }
}
