//! A live page in a browser: its files, its data, and its server on this computer. The owner of the
//! sensor's port fills the feeds: `hivtac view`, or `hivtac-calibrate` while it records. The page
//! without a server (`web/`) has the same files and the same data.

#[cfg(not(target_family = "wasm"))]
mod events;
mod feed;
pub mod lights;
mod order;
pub mod picture;
mod press;
#[cfg(not(target_family = "wasm"))]
mod request;
#[cfg(not(target_family = "wasm"))]
mod response;
pub mod rows;
mod sensor_state;
#[cfg(not(target_family = "wasm"))]
mod server;
mod state;
#[cfg(not(target_family = "wasm"))]
mod token;
#[cfg(not(target_family = "wasm"))]
mod unstalled;

pub use feed::{Cursor, Feed, News};
pub use order::{Answer, DeviceCommand, Order, Posted, parse as parse_order};
pub use press::{Fingers, Hand, Press, Truth};
pub use sensor_state::{Coverage, Covered, Limits, Map, Recording, SensorState};
#[cfg(not(target_family = "wasm"))]
pub use server::{Sensor, Server};
pub use state::State;
