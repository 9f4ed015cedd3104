//! Finds plugged-in sensors and their identities, and selects one by name.

use crate::failure::{Failure, Kind};
use crate::link::Link;
use crate::port::{self, Address, Attached};
use crate::shown::shown;
use serde::Serialize;
use std::time::Duration;

/// A plugged-in sensor with its identity; fields are `None` if it does not answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Listed {
    /// Its port's name.
    pub port: String,
    /// Its serial number, lower case.
    pub serial: String,
    /// The name that its user set.
    pub name: Option<String>,
    /// Its board and camera.
    pub board: Option<String>,
    /// Its firmware's version.
    pub firmware: Option<String>,
    /// Why there is no answer; `None` if it answered.
    pub problem: Option<String>,
}

impl Listed {
    /// Asks a plugged-in sensor for its identity.
    pub fn ask(Attached { port, serial }: Attached, patience: Duration) -> Listed {
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

    /// A line for a person.
    pub fn line(&self) -> String {
        let text = |text: &Option<String>| shown(text.as_deref().unwrap_or_default());
        let start = format!("{} {}", self.serial, shown(&self.port));
        match &self.problem {
            Some(problem) => format!("{start}: {}", shown(problem)),
            None => {
                let name = match self.name.as_deref() {
                    None | Some("") => "no name".to_owned(),
                    Some(name) => shown(name),
                };
                format!(
                    "{start} {name}, {}, {}",
                    text(&self.board),
                    text(&self.firmware)
                )
            }
        }
    }
}

/// The address of the sensor with this name or serial number.
///
/// # Errors
/// [`Kind::NoDevice`] when no sensor has it, or more than one.
pub fn find(wanted: &str, patience: Duration) -> Result<Address, Failure> {
    let attached = port::attached()?;
    let serial = wanted.to_lowercase();
    if attached.iter().any(|sensor| sensor.serial == serial) {
        return Ok(Address::Serial(serial));
    }
    let listed: Vec<Listed> = attached
        .into_iter()
        .map(|sensor| Listed::ask(sensor, patience))
        .collect();
    let found = called(&listed, wanted).map_err(|why| Failure::new(Kind::NoDevice, why))?;
    Ok(Address::Tty(found.port.clone()))
}

/// The sensor with this name; the error's text if it is missing or not unique.
fn called<'l>(listed: &'l [Listed], name: &str) -> Result<&'l Listed, String> {
    let has_it = |sensor: &&Listed| sensor.name.as_deref() == Some(name);
    let found: Vec<&Listed> = listed.iter().filter(has_it).collect();
    let all = || match listed {
        [] => "no sensor is plugged in".to_owned(),
        _ => format!(
            "there are: {}",
            listed
                .iter()
                .map(Listed::line)
                .collect::<Vec<_>>()
                .join("; ")
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

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(port: &str, name: Option<&str>) -> Listed {
        Listed {
            port: port.to_owned(),
            serial: format!("0a{port}"),
            name: name.map(str::to_owned),
            board: name.map(|_| "weact-h743 + ov7725".to_owned()),
            firmware: name.map(|_| "hivtac 0.2.0".to_owned()),
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
        let named = sensor("A", Some("thumb")).line();
        assert_eq!(named, "0aA A thumb, weact-h743 + ov7725, hivtac 0.2.0");
        assert!(sensor("A", Some("")).line().contains("no name"));
    }
}
