//! Tests that documents list what the sources hold, that their links are valid, and that no line is
//! too wide.

mod dependencies;
mod links;
mod shared_state;
mod unsafe_code;
mod width;
