//! Formats what ended a device's program in an earlier run, and how to find the source line.

use hivtac_host::shown::shown;
use hivtac_wire::failure::{Failure, FailureKind};
use serde::Serialize;

/// A failure, for people and as JSON.
#[derive(Serialize)]
pub struct Ended {
    kind: &'static str,
    /// Starts since; 1 if it ended the run before this one.
    starts_ago: u32,
    /// Failures since power-on.
    count: u32,
    program_counter: Option<String>,
    link_register: Option<String>,
    address: Option<String>,
    fault_status: String,
    exception: u16,
    place: Option<String>,
    /// The command that names the source lines; `None` without an address.
    find: Option<String>,
    #[serde(skip)]
    what: FailureKind,
}

fn hexadecimal(word: u32) -> String {
    format!("{word:#010x}")
}

impl Ended {
    /// From the device's message.
    pub fn of(failure: &Failure) -> Ended {
        let Failure {
            program_counter,
            link_register,
            ..
        } = *failure;
        Ended {
            kind: failure.kind.name(),
            starts_ago: failure.starts_ago,
            count: failure.count,
            program_counter: program_counter.map(hexadecimal),
            link_register: link_register.map(hexadecimal),
            address: failure.address.map(hexadecimal),
            fault_status: hexadecimal(failure.fault_status),
            exception: failure.exception,
            place: (!failure.place.is_empty()).then(|| shown(&failure.place)),
            find: program_counter.map(|at| command(at, link_register)),
            what: failure.kind,
        }
    }

    /// Lines for a person.
    pub fn lines(&self) -> Vec<String> {
        let mut at = String::new();
        for (name, value) in [
            ("", &self.place),
            ("address ", &self.program_counter),
            ("called from near ", &self.link_register),
        ] {
            at.extend(value.iter().map(|value| format!(", {name}{value}")));
        }
        let handler = match self.exception {
            0 => String::new(),
            number => format!(", in the handler of exception {number}"),
        };
        let mut lines = vec![
            format!("failure    {}: {}", self.when(), self.what()),
            format!("           {}{at}{handler}", self.kind),
        ];
        let find = self.find.iter();
        lines.extend(find.map(|command| format!("           its source line: {command}")));
        lines
    }

    fn when(&self) -> String {
        let when = match self.starts_ago {
            1 => "before this start".to_owned(),
            starts => format!("{starts} starts ago"),
        };
        match self.count {
            1 => when,
            count => format!("{when}, the last of {count} since power-on"),
        }
    }

    fn what(&self) -> String {
        let text = match self.what {
            FailureKind::Panic => "the program found that it must not go on",
            FailureKind::HardFault => "the core could not go on",
            FailureKind::MemoryFault => "the program used memory that it must not",
            FailureKind::BusFault => "nothing answered at an address, or memory is damaged",
            FailureKind::UsageFault => "the core could not execute an instruction",
            FailureKind::StackOverflow => "the stack was used up",
            FailureKind::UnknownInterrupt => "an interrupt came that nothing handles",
            FailureKind::Watchdog => "the program stood still for 2 s",
        };
        match &self.address {
            Some(address) => format!("{text} (it accessed {address})"),
            None => text.to_owned(),
        }
    }
}

/// The command that names the source lines of two addresses, inlined functions too. A return
/// address is odd, and behind the call.
fn command(program_counter: u32, link_register: Option<u32>) -> String {
    /// Values of the link register in a handler, which return from it (ARMv7-M, B1.5.8).
    const EXCEPTION_RETURNS: u32 = 0xFFFF_FF00;
    let caller = link_register.filter(|link| *link < EXCEPTION_RETURNS);
    let caller = caller.map_or(String::new(), |link| {
        format!(" {}", hexadecimal((link & !1).saturating_sub(2)))
    });
    format!(
        "addr2line -Cfie hivtac-firmware {}{caller}",
        hexadecimal(program_counter)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault() -> Failure {
        Failure {
            kind: FailureKind::BusFault,
            starts_ago: 1,
            count: 1,
            program_counter: Some(0x0806_1234),
            link_register: Some(0x0806_0ABD),
            address: Some(0x2600_0000),
            fault_status: 0x8200,
            exception: 0,
            place: "".try_into().unwrap(),
        }
    }

    #[test]
    fn a_fault_is_reported_with_the_command_that_finds_it() {
        let lines = Ended::of(&fault()).lines();
        let expected = [
            "failure    before this start: nothing answered at an address, or memory is damaged \
             (it accessed 0x26000000)",
            "           bus_fault, address 0x08061234, called from near 0x08060abd",
            "           its source line: addr2line -Cfie hivtac-firmware 0x08061234 0x08060aba",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn a_panic_is_reported_with_its_place() {
        let lines = Ended::of(&Failure {
            kind: FailureKind::Panic,
            starts_ago: 3,
            count: 2,
            program_counter: None,
            link_register: None,
            address: None,
            fault_status: 0,
            place: "firmware/src/usb.rs:123".try_into().unwrap(),
            ..fault()
        })
        .lines();
        let expected = [
            "failure    3 starts ago, the last of 2 since power-on: the program found that it must \
             not go on",
            "           panic, firmware/src/usb.rs:123",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn a_return_from_a_handler_is_no_caller() {
        let ended = Ended::of(&Failure {
            link_register: Some(0xFFFF_FFF9),
            exception: 69,
            ..fault()
        });
        let find = "addr2line -Cfie hivtac-firmware 0x08061234";
        assert_eq!(ended.find.as_deref(), Some(find));
        assert!(ended.lines()[1].ends_with(", in the handler of exception 69"));
    }
}
