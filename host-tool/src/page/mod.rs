//! A live page in a browser of this computer: its files, its server and its data. The owner of the
//! sensor's port fills the feeds: `hivtac view`, or `hivtac-calibrate` while it records.

mod events;
mod feed;
pub mod lights;
mod order;
mod press;
mod request;
mod response;
mod server;
mod token;
mod told;
mod unstalled;

pub use feed::Feed;
pub use order::{Answer, Order, Posted};
pub use press::{Hand, Press, Truth};
pub use server::{Sensor, Server};
pub use told::{Coverage, Covered, Limits, Map, Recording, Told};
