//! `hivtac list`: which sensors are plugged in, and which of them is meant by a name.

use crate::lines::to_json;
use crate::output::{note, print};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::port::{self, Address, Attached};
use hivtac_host::shown::shown;
use serde::Serialize;
use std::time::Duration;

/// A sensor, and what it says of itself; nothing when it does not answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Listed {
    port: String,
    serial: String,
    name: Option<String>,
    board: Option<String>,
    firmware: Option<String>,
    /// Why it does not answer.
    problem: Option<String>,
}

/// Prints a line, or a JSON object, for each sensor that is plugged in.
///
/// # Errors
/// When the ports cannot be listed.
pub fn run(patience: Duration, json: bool) -> Result<(), Failure> {
    let attached = port::attached()?;
    if attached.is_empty() {
        note("hivtac: no sensor is plugged in");
    }
    for sensor in attached {
        let listed = ask(sensor, patience);
        print(&match json {
            true => to_json(&listed),
            false => line(&listed),
        })?;
    }
    Ok(())
}

/// Which sensor a user means by its name or its serial number.
///
/// # Errors
/// [`Kind::NoDevice`] when it is none, or more than one.
pub fn find(wanted: &str, patience: Duration) -> Result<Address, Failure> {
    let attached = port::attached()?;
    let serial = wanted.to_lowercase();
    if attached.iter().any(|sensor| sensor.serial == serial) {
        return Ok(Address::Serial(serial));
    }
    let listed: Vec<Listed> = attached
        .into_iter()
        .map(|sensor| ask(sensor, patience))
        .collect();
    let found = called(&listed, wanted).map_err(|why| Failure::new(Kind::NoDevice, why))?;
    Ok(Address::Tty(found.port.clone()))
}

/// The one with this name.
fn called<'l>(listed: &'l [Listed], name: &str) -> Result<&'l Listed, String> {
    let has_it = |sensor: &&Listed| sensor.name.as_deref() == Some(name);
    let found: Vec<&Listed> = listed.iter().filter(has_it).collect();
    let all = || match listed {
        [] => "no sensor is plugged in".to_owned(),
        _ => format!(
            "there are: {}",
            listed.iter().map(line).collect::<Vec<_>>().join("; ")
        ),
    };
    match found[..] {
        [sensor] => Ok(sensor),
        [] => Err(format!(
            "no sensor has the name or serial number {}; {}",
            shown(name),
            all()
        )),
        _ => Err(format!(
            "more than one sensor is called {}; choose by serial number; {}",
            shown(name),
            all()
        )),
    }
}

fn ask(Attached { port, serial }: Attached, patience: Duration) -> Listed {
    let none = Listed {
        port,
        serial,
        name: None,
        board: None,
        firmware: None,
        problem: None,
    };
    match Link::connect(&Address::Tty(none.port.clone()), patience) {
        Ok((_, hello)) => Listed {
            name: Some(hello.name.as_str().to_owned()),
            board: Some(hello.board.as_str().to_owned()),
            firmware: Some(hello.firmware.as_str().to_owned()),
            ..none
        },
        Err(failure) => Listed {
            problem: Some(failure.to_string()),
            ..none
        },
    }
}

fn line(listed: &Listed) -> String {
    let text = |text: &Option<String>| shown(text.as_deref().unwrap_or_default());
    let start = format!("{} {}", listed.serial, shown(&listed.port));
    match &listed.problem {
        Some(problem) => format!("{start}: {}", shown(problem)),
        None => {
            let name = match listed.name.as_deref() {
                None | Some("") => "no name".to_owned(),
                Some(name) => shown(name),
            };
            format!(
                "{start} {name}, {}, {}",
                text(&listed.board),
                text(&listed.firmware)
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(port: &str, name: Option<&str>) -> Listed {
        Listed {
            port: port.to_owned(),
            serial: format!("0a{port}"),
            name: name.map(str::to_owned),
            board: name.map(|_| "weact-h743 + ov7725".to_owned()),
            firmware: name.map(|_| "hivtac 0.1.0".to_owned()),
            problem: name.is_none().then(|| "cannot open it".to_owned()),
        }
    }

    #[test]
    fn a_sensor_is_found_by_its_name_among_others() {
        let all = [
            sensor("A", Some("thumb")),
            sensor("B", Some("index")),
            sensor("C", Some("index")),
            sensor("D", None),
        ];
        assert_eq!(called(&all, "thumb").unwrap().port, "A");
        for (name, word) in [
            ("index", "more than one"),
            ("ring", "no sensor has the name"),
        ] {
            let error = called(&all, name).unwrap_err();
            assert!(error.contains(word), "{error}");
            assert!(error.contains("0aD D: cannot open it"), "{error}");
        }
        assert!(called(&[], "thumb").unwrap_err().contains("plugged in"));
    }

    #[test]
    fn lines_say_who_is_there() {
        let named = line(&sensor("A", Some("thumb")));
        assert_eq!(named, "0aA A thumb, weact-h743 + ov7725, hivtac 0.1.0");
        assert!(line(&sensor("A", Some(""))).contains("no name"));
    }
}
