//! The one error type of the tool: what went wrong, where, what to do, and the exit code it ends
//! with.

use std::fmt;

/// The kind of a failure; decides the exit code (`hivtac --help`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A file, an image or an argument is not usable.
    Input,
    /// No device: none found, the port cannot be opened, or nobody answers.
    NoDevice,
    /// The device speaks another version of the protocol.
    Version,
    /// The connection was lost.
    Lost,
    /// The device refused a command, or did not answer it.
    Refused,
    /// Fewer samples a second than asked for.
    Rate,
    /// More frames lost than allowed.
    Loss,
    /// Something about the sensor is not right.
    NotRight,
    /// Ctrl-C or a termination signal.
    Interrupted,
}

impl Kind {
    /// The exit code; part of the tool's interface.
    pub fn exit_code(self) -> u8 {
        match self {
            Kind::Input => 1,
            Kind::NoDevice => 3,
            Kind::Version => 4,
            Kind::Lost => 5,
            Kind::Refused => 6,
            Kind::Rate => 7,
            Kind::Loss => 8,
            Kind::NotRight => 9,
            Kind::Interrupted => 130,
        }
    }
}

/// A failure with its message for a person.
#[derive(Debug)]
pub struct Failure {
    /// What kind it is.
    pub kind: Kind,
    message: String,
}

impl Failure {
    /// A failure of `kind`; `message` says what, where and what to do.
    pub fn new(kind: Kind, message: impl Into<String>) -> Failure {
        Failure {
            kind,
            message: message.into(),
        }
    }

    /// A file, an image or an argument is not usable.
    pub fn input(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Input, message)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}
