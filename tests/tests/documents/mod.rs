//! Documents that list what the sources hold list all of it, and nothing else.

mod dependencies;
mod readme;
mod shared_state;
mod unsafe_code;
