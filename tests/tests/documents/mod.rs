//! Documents that list what the sources hold list all of it, and nothing else; and no text is too
//! wide.

mod dependencies;
mod readme;
mod unsafe_code;
mod width;
