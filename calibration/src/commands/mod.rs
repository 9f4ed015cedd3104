//! The program's commands, one module for each kind of file that they write.

pub mod data;
pub mod default_model;
pub mod layout;
pub mod model;
pub mod network;
