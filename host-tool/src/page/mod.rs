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
#[cfg(not(target_family = "wasm"))]
mod server;
mod state;
#[cfg(not(target_family = "wasm"))]
mod token;
mod told;
#[cfg(not(target_family = "wasm"))]
mod unstalled;

pub use feed::{Cursor, Feed, News};
pub use order::{Answer, Asked, Order, Posted, parse as parse_order};
pub use press::{Fingers, Hand, Press, Truth};
#[cfg(not(target_family = "wasm"))]
pub use server::{Sensor, Server};
pub use state::State;
pub use told::{Coverage, Covered, Limits, Map, Recording, Told};
