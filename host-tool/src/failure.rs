//! The tool's error type: what went wrong, where, what to do, and the exit code.

use std::fmt;

/// The kind of a failure, which sets the exit code (`hivtac --help`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A file, an image or an argument cannot be used.
    Input,
    /// An option that cannot be used this way, or that this build lacks.
    Usage,
    /// No device: not found, its port cannot be opened, or it does not answer.
    NoDevice,
    /// The device speaks another version of the protocol.
    Version,
    /// The connection was lost.
    Lost,
    /// The device refused a command or did not answer it.
    Refused,
    /// Fewer samples a second than asked for.
    Rate,
    /// More frames lost than allowed.
    Loss,
    /// Something about the sensor is wrong.
    NotRight,
    /// Ctrl-C or a termination signal.
    Interrupted,
}

impl Kind {
    /// All kinds, in the order of their exit codes.
    pub const ALL: [Kind; 10] = [
        Kind::Input,
        Kind::Usage,
        Kind::NoDevice,
        Kind::Version,
        Kind::Lost,
        Kind::Refused,
        Kind::Rate,
        Kind::Loss,
        Kind::NotRight,
        Kind::Interrupted,
    ];

    /// The meaning of its exit code.
    pub fn meaning(self) -> &'static str {
        match self {
            Kind::Input => "a file, a picture or the output cannot be used",
            Kind::Usage => "wrong usage",
            Kind::NoDevice => "no device: none found, the port cannot be opened, or nobody answers",
            Kind::Version => "the device speaks another version of the protocol",
            Kind::Lost => "the connection was lost",
            Kind::Refused => "the device refused a command or did not answer it",
            Kind::Rate => "`check`: fewer samples a second than --min-rate",
            Kind::Loss => "`check`: more frames lost than --max-loss",
            Kind::NotRight => "`bring-up`, `threshold auto`, `white`: something is not right",
            Kind::Interrupted => {
                "interrupted (Ctrl-C, SIGTERM, SIGHUP); the summary is printed all the same"
            }
        }
    }

    /// The exit code; part of the tool's interface.
    pub fn exit_code(self) -> u8 {
        match self {
            Kind::Input => 1,
            Kind::Usage => 2,
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
    /// Its kind.
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

    /// A file, an image or an argument that cannot be used.
    pub fn input(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Input, message)
    }

    /// A file that cannot be used, with the reason.
    pub fn of_file(path: &str, why: impl fmt::Display) -> Failure {
        Failure::input(format!("{path}: {why}"))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

#[cfg(test)]
mod tests {
    use super::*;

    /// `ALL` has each kind of the enumeration, with an exit code of its own.
    #[test]
    fn all_kinds_are_listed() {
        let source = include_str!("failure.rs");
        let (_, rest) = source.split_once("pub enum Kind {").unwrap();
        let (body, _) = rest.split_once('}').unwrap();
        let names = body.lines().filter(|line| line.trim_end().ends_with(','));
        assert_eq!(names.count(), Kind::ALL.len());
        let mut codes = Kind::ALL.map(Kind::exit_code).to_vec();
        codes.dedup();
        assert!(
            codes.is_sorted() && codes.len() == Kind::ALL.len(),
            "{codes:?}"
        );
    }
}
