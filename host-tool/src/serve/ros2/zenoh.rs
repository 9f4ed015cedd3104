//! Zenoh as a node's middleware, as `rmw_zenoh_cpp` speaks it: a key for each topic and service,
//! liveliness tokens that announce them, and an attachment of each message with its time and
//! sender.

use super::{KEPT, Middleware, Trouble};
use hivtac_host::clock::now_ns;
use hivtac_host::ros::type_hash;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use xxhash_rust::xxh3::xxh3_128;
use zenoh::handlers::{RingChannel, RingChannelHandler};
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Config, Session, Wait};

/// The environment variables with a file of the session's configuration, and with single settings.
const CONFIGURATION: &str = "ZENOH_SESSION_CONFIG_URI";
const OVERRIDE: &str = "ZENOH_CONFIG_OVERRIDE";
/// A session without such a file: it finds others through the router of this computer, and listens
/// to this computer alone.
const USUAL: [(&str, &str); 6] = [
    ("mode", r#""peer""#),
    ("connect/endpoints", r#"["tcp/localhost:7447"]"#),
    ("listen/endpoints", r#"["tcp/localhost:0"]"#),
    ("scouting/multicast/enabled", "false"),
    (
        "scouting/gossip/target",
        r#"{"router": ["router", "peer"], "peer": ["router"]}"#,
    ),
    ("timestamping/enabled", "true"),
];
/// The first part of all tokens' keys.
const TOKENS: &str = "@ros2_lv";
/// An empty part of a token's key.
const EMPTY: &str = "%";
/// Bytes of CDR before a message: its encoding.
const ENCODING: usize = 4;
/// Bytes that identify an endpoint.
const GID: usize = 16;

/// A session, with the node's identity and the tokens of its domain.
pub(super) struct Zenoh {
    session: Session,
    domain: u16,
    name: String,
    /// Number of entities until now.
    entities: usize,
    tokens: Tokens,
    _token: LivelinessToken,
    _watch: zenoh::pubsub::Subscriber<()>,
}

/// The keys of the tokens that are alive.
type Tokens = Arc<Mutex<BTreeSet<String>>>;

/// The role of an endpoint, as in its token.
#[derive(Clone, Copy)]
enum Role {
    Publisher,
    Subscription,
    Service,
}

impl Role {
    fn code(self) -> &'static str {
        match self {
            Role::Publisher => "MP",
            Role::Subscription => "MS",
            Role::Service => "SS",
        }
    }

    /// Its quality of service: reliable or best-effort, volatile, the newest messages.
    fn quality(self) -> String {
        let best_effort = match self {
            Role::Subscription => "2",
            Role::Publisher | Role::Service => "",
        };
        format!("{best_effort}::,{KEPT}:,:,:,,")
    }
}

/// A publisher, with its identity and the number of its messages.
pub(super) struct Publisher {
    publisher: zenoh::pubsub::Publisher<'static>,
    gid: [u8; GID],
    sent: AtomicI64,
    _token: LivelinessToken,
}

pub(super) struct Subscription {
    subscriber: zenoh::pubsub::Subscriber<RingChannelHandler<Sample>>,
    _token: LivelinessToken,
}

pub(super) struct Service {
    queryable: Queryable<RingChannelHandler<Query>>,
    _token: LivelinessToken,
}

/// A request: the number that its client gave it, and the client's identity.
pub(super) struct Request {
    query: Query,
    number: i64,
    client: [u8; GID],
}

/// The configuration, chosen by the environment as for `rmw_zenoh_cpp`.
fn configuration() -> Result<Config, Trouble> {
    let file = std::env::var(CONFIGURATION).unwrap_or_default();
    let mut config = match file.as_str() {
        "" => Config::default(),
        file => Config::from_file(file)?,
    };
    let usual = USUAL.iter().filter(|_| file.is_empty());
    for (key, value) in usual {
        config.insert_json5(key, value)?;
    }
    let settings = std::env::var(OVERRIDE).unwrap_or_default();
    for setting in settings.split(';').filter(|it| !it.trim().is_empty()) {
        let (key, value) = setting
            .split_once('=')
            .ok_or_else(|| format!("{OVERRIDE} has {setting:?}, which is not key=value"))?;
        let is_set = config.insert_json5(key.trim(), value.trim()).is_ok();
        if !is_set {
            return Err(format!("{OVERRIDE} has {setting:?}, which Zenoh does not take").into());
        }
    }
    Ok(config)
}

impl Zenoh {
    /// The keys of a new endpoint and of its token.
    fn endpoint(
        &mut self,
        role: Role,
        name: &str,
        type_name: &str,
    ) -> Result<[String; 2], Trouble> {
        let hash = type_hash::of(type_name);
        let hash = hash.ok_or_else(|| format!("the hash of {type_name} is unknown"))?;
        let type_name = dds_name(type_name);
        self.entities += 1;
        let session = self.session.zid().to_string();
        let node = token(
            self.domain,
            &session,
            self.entities,
            role.code(),
            &self.name,
        );
        let (mangled, quality) = (name.replace('/', "%"), role.quality());
        let token = format!("{node}/{mangled}/{type_name}/{hash}/{quality}");
        let topic = name.trim_start_matches('/');
        let key = format!("{}/{topic}/{type_name}/{hash}", self.domain);
        Ok([key, token])
    }

    fn declare(&self, token: String) -> Result<LivelinessToken, Trouble> {
        self.session.liveliness().declare_token(token).wait()
    }

    /// Whether a token of another session is alive whose parts fulfil a condition.
    fn has_other(&self, is_sought: impl Fn(&[&str]) -> bool) -> bool {
        let own = self.session.zid().to_string();
        let tokens = self.tokens.lock().unwrap_or_else(PoisonError::into_inner);
        tokens.iter().any(|token| {
            let parts: Vec<&str> = token.split('/').collect();
            parts.get(2).is_some_and(|session| *session != own) && is_sought(&parts)
        })
    }
}

/// The key of a node's token, or the beginning of that of its endpoint.
fn token(domain: u16, session: &str, entity: usize, code: &str, node: &str) -> String {
    // A session has one node, 0, without enclave and namespace.
    format!("{TOKENS}/{domain}/{session}/0/{entity}/{code}/{EMPTY}/{EMPTY}/{node}")
}

/// A type's name in keys: `std_msgs::msg::dds_::Bool_` of `std_msgs/msg/Bool`.
fn dds_name(type_name: &str) -> String {
    match type_name.rsplit_once('/') {
        Some((folder, name)) => format!("{}::dds_::{name}_", folder.replace('/', "::")),
        None => format!("{type_name}_"),
    }
}

/// A message's attachment: its number, its time, ns since 1970, and its sender, in the
/// serialization of Zenoh's libraries.
fn attachment(number: i64, gid: [u8; GID]) -> Vec<u8> {
    let sent_ns = i64::try_from(now_ns()).unwrap_or(i64::MAX);
    let numbers = [number, sent_ns].map(i64::to_le_bytes).concat();
    [numbers.as_slice(), &[GID as u8], &gid].concat()
}

/// The number and the author of an [`attachment`].
fn number_and_author(attachment: &[u8]) -> Option<(i64, [u8; GID])> {
    let (number, rest) = attachment.split_first_chunk()?;
    let (_sent_ns, rest) = rest.split_first_chunk::<8>()?;
    let author = rest.strip_prefix(&[GID as u8])?;
    Some((i64::from_le_bytes(*number), author.try_into().ok()?))
}

impl Middleware for Zenoh {
    type Publisher = Publisher;
    type Subscription = Subscription;
    type Service = Service;
    type Request = Request;

    const ON: &str = " on Zenoh";
    const ADVICE: &str =
        "are ZENOH_SESSION_CONFIG_URI and ZENOH_CONFIG_OVERRIDE as rmw_zenoh_cpp wants them?";

    /// Does not wait for a router, which is looked for in the background.
    fn join(name: &str, domain: u16) -> Result<Zenoh, Trouble> {
        let session = zenoh::open(configuration()?).wait()?;
        let tokens = Tokens::default();
        let alive = tokens.clone();
        let watch = session.liveliness();
        let watch = watch.declare_subscriber(format!("{TOKENS}/{domain}/**"));
        let watch = watch.history(true).callback(move |sample| {
            let mut alive = alive.lock().unwrap_or_else(PoisonError::into_inner);
            let key = sample.key_expr().as_str();
            match sample.kind() {
                SampleKind::Put => alive.insert(key.to_owned()),
                SampleKind::Delete => alive.remove(key),
            };
        });
        let watch = watch.wait()?;
        let key = token(domain, &session.zid().to_string(), 0, "NN", name);
        Ok(Zenoh {
            _token: session.liveliness().declare_token(key).wait()?,
            _watch: watch,
            session,
            domain,
            name: name.to_owned(),
            entities: 0,
            tokens,
        })
    }

    fn publisher(&mut self, topic: &str, kind: &str) -> Result<Publisher, Trouble> {
        let [key, token] = self.endpoint(Role::Publisher, topic, kind)?;
        // A link that is full loses messages: a reader that hangs must not stop the others.
        let publisher = self.session.declare_publisher(key);
        let publisher = publisher.congestion_control(CongestionControl::Drop);
        Ok(Publisher {
            publisher: publisher.wait()?,
            gid: xxh3_128(token.as_bytes()).to_le_bytes(),
            sent: AtomicI64::new(0),
            _token: self.declare(token)?,
        })
    }

    fn subscription(&mut self, topic: &str, kind: &str) -> Result<Subscription, Trouble> {
        let [key, token] = self.endpoint(Role::Subscription, topic, kind)?;
        let subscriber = self.session.declare_subscriber(key);
        Ok(Subscription {
            subscriber: subscriber.with(RingChannel::new(KEPT)).wait()?,
            _token: self.declare(token)?,
        })
    }

    fn service(&mut self, name: &str, kind: &str) -> Result<Service, Trouble> {
        let [key, token] = self.endpoint(Role::Service, name, kind)?;
        let queryable = self.session.declare_queryable(key).complete(true);
        Ok(Service {
            queryable: queryable.with(RingChannel::new(KEPT)).wait()?,
            _token: self.declare(token)?,
        })
    }

    fn publish(publisher: &Publisher, data: &[u8]) -> Result<(), Trouble> {
        let number = publisher.sent.fetch_add(1, Ordering::Relaxed) + 1;
        let put = publisher.publisher.put(data);
        put.attachment(attachment(number, publisher.gid)).wait()
    }

    fn take(subscription: &Subscription) -> Option<Vec<u8>> {
        let sample = subscription.subscriber.try_recv().ok()??;
        let data = sample.payload().to_bytes();
        data.get(ENCODING..).map(<[u8]>::to_vec)
    }

    fn request(service: &Service) -> Option<Request> {
        while let Ok(Some(query)) = service.queryable.try_recv() {
            let attachment = query.attachment().map(|it| it.to_bytes());
            let known = attachment.and_then(|it| number_and_author(&it));
            // A query without them is not of ROS 2.
            if let Some((number, client)) = known {
                return Some(Request {
                    query,
                    number,
                    client,
                });
            }
        }
        None
    }

    fn reply(_: &Service, request: &Request, data: &[u8]) -> Result<(), Trouble> {
        let Request {
            query,
            number,
            client,
        } = request;
        let reply = query.reply(query.key_expr().clone(), data);
        reply.attachment(attachment(*number, *client)).wait()
    }

    fn has_company(&self) -> bool {
        self.has_other(|_| true)
    }

    fn has_namesake(&self) -> bool {
        self.has_other(|parts| parts.get(5..) == Some(&["NN", EMPTY, EMPTY, &self.name]))
    }

    fn advice(&self) -> String {
        match self.session.info().routers_zid().wait().next() {
            Some(_) => "A router of Zenoh is there, but no node. Nodes on DDS do not see this \
                        one (docs/robots.md)"
                .to_owned(),
            None => "No router of Zenoh is there: start one with `ros2 run rmw_zenoh_cpp \
                     rmw_zenohd`, or name it in ZENOH_CONFIG_OVERRIDE (docs/robots.md)"
                .to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attachment_is_that_of_rmw_zenoh() {
        let gid = std::array::from_fn(|at| at as u8 + 100);
        let bytes = attachment(0x0102, gid);
        assert_eq!(bytes.len(), 33);
        assert_eq!(bytes[..8], [2, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(bytes[16], 16);
        assert_eq!(number_and_author(&bytes), Some((0x0102, gid)));
        for length in 0..bytes.len() {
            assert_eq!(number_and_author(&bytes[..length]), None);
        }
    }

    #[test]
    fn types_have_the_names_of_dds() {
        assert_eq!(
            dds_name("std_srvs/srv/Trigger"),
            "std_srvs::srv::dds_::Trigger_"
        );
    }
}
