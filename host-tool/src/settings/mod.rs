//! `hivtac settings`: what a device keeps through restarts, shown, named, saved, given back and
//! forgotten.

mod arguments;
mod camera;
mod conversation;
mod file;
mod gravity;
mod name;
pub mod temporal;

pub use arguments::SettingsCommand;
pub use conversation::{ask, rest_text};
