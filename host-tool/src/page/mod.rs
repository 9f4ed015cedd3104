//! A live page in a browser of this computer: its files, its server, and what it is told. Who has
//! the sensor's port fills the feeds: `hivtac view`, and `hivtac-calibrate` while it records.

mod events;
mod feed;
pub mod lights;
mod order;
mod request;
mod response;
mod server;
mod token;
mod told;
mod unstalled;

pub use feed::Feed;
pub use order::{Answer, Order, Posted};
pub use server::{Sensor, Server};
pub use told::{Coverage, Covered, Limits, Map, Recording, Told};
