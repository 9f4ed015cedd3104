//! Documents list all that the sources hold, and lead where they say; no text is too wide.

mod dependencies;
mod links;
mod shared_state;
mod unsafe_code;
mod width;
