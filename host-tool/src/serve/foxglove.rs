//! Serves Foxglove over its WebSocket: the channels and schemas of a recording, live. Anyone who
//! can reach the port can read them, but nothing else.

use super::outlet::{Outlet, Served};
use foxglove::{ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema};
use hivtac_host::failure::Failure;
use hivtac_host::ros::channel::{Channel, GRIP_TOPIC, GripChannel, topic_of};
use hivtac_host::ros::{DIAGNOSTICS, Definition};
use hivtac_host::shown::unit_number;
use std::net::SocketAddr;
use std::sync::Arc;

/// A server on an open port.
pub struct Server {
    // The channels exist as long as it does.
    _context: Arc<Context>,
    address: SocketAddr,
    /// The channels of each sensor, in the order of [`Channel::ALL`].
    sensors: Vec<Vec<Arc<RawChannel>>>,
    /// Those of the grip, in the order of [`GripChannel::ALL`]; none without a grip.
    grip: Vec<Arc<RawChannel>>,
    diagnostics: Arc<RawChannel>,
}

impl Server {
    /// Opens a port, 0 for any free one, with the devices' channels, and those of a grip if there
    /// is one.
    ///
    /// # Errors
    /// When the port is taken.
    pub fn open(listen: SocketAddr, served: &[Served], has_grip: bool) -> Result<Server, Failure> {
        let failed = |error: FoxgloveError| {
            Failure::input(format!(
                "cannot listen at {listen}: {error}; choose another port with --listen"
            ))
        };
        let context = Context::new();
        let sensors = served.iter().map(|served| {
            let topic = topic_of(&unit_number(&served.hello.device_id));
            let channels = Channel::ALL.iter().map(|channel| {
                let topic = format!("{topic}/{}", channel.name());
                create(&context, topic, channel.definition())
            });
            channels.collect()
        });
        let sensors = sensors.collect::<Result<_, _>>().map_err(failed)?;
        let of_grip = GripChannel::ALL.iter().filter(|_| has_grip);
        let grip = of_grip.map(|channel| {
            let topic = format!("{GRIP_TOPIC}/{}", channel.name());
            create(&context, topic, channel.definition())
        });
        let grip = grip.collect::<Result<_, _>>().map_err(failed)?;
        let diagnostics = create(&context, "/diagnostics".to_owned(), &DIAGNOSTICS);
        let diagnostics = diagnostics.map_err(failed)?;
        let server = context.websocket_server().name("hivtac");
        let host = match listen {
            SocketAddr::V4(address) => address.ip().to_string(),
            SocketAddr::V6(address) => format!("[{}]", address.ip()),
        };
        let server = server.bind(host, listen.port());
        let handle = server.start_blocking().map_err(failed)?;
        Ok(Server {
            address: SocketAddr::new(listen.ip(), handle.port()),
            _context: context,
            sensors,
            grip,
            diagnostics,
        })
    }
}

fn create(
    context: &Arc<Context>,
    topic: String,
    definition: &Definition,
) -> Result<Arc<RawChannel>, FoxgloveError> {
    let text = definition.text.as_bytes();
    let schema = Schema::new(definition.name, "ros2msg", text);
    ChannelBuilder::new(topic)
        .context(context)
        .message_encoding("cdr")
        .schema(schema)
        .build_raw()
}

impl Outlet for Server {
    fn addresses(&self) -> Vec<(&'static str, String)> {
        vec![("foxglove", format!("ws://{}", self.address))]
    }

    fn publish(&mut self, sensor: usize, channel: Channel, data: &[u8], came_ns: u64) -> bool {
        let when = PartialMetadata::with_log_time(came_ns);
        self.sensors[sensor][channel as usize].log_with_meta(data, when);
        true
    }

    fn publish_grip(&mut self, channel: GripChannel, data: &[u8], came_ns: u64) -> bool {
        let when = PartialMetadata::with_log_time(came_ns);
        if let Some(topic) = self.grip.get(channel as usize) {
            topic.log_with_meta(data, when);
        }
        true
    }

    fn diagnostics(&mut self, data: &[u8], came_ns: u64) {
        let when = PartialMetadata::with_log_time(came_ns);
        self.diagnostics.log_with_meta(data, when);
    }
}
