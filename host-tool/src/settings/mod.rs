//! `hivtac settings`: shows, changes, exports, imports and resets what a device keeps.

mod arguments;
mod camera;
mod conversation;
mod file;
mod gravity;
mod name;
pub mod temporal;

pub use arguments::SettingsCommand;
pub use conversation::{ask, rest_text};
