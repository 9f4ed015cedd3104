//! Checks a picture: how sharp, bright and well placed its markers are.

pub mod checks;
pub mod dots;
mod glare;
mod rim;
pub mod seen;
#[cfg(test)]
mod simulated;
#[cfg(test)]
mod tests;

use crate::failure::Failure;
use crate::frame::Frame;
use checks::{Check, advice, checks};
use dots::Dots;
use hivtac_wire::message::DeviceHello;
use seen::look;
use serde::Serialize;

/// The order in which faults must be corrected: in the dark nothing is sharp.
const ORDER: [&str; 8] = [
    "brightness",
    "film",
    "colour",
    "size",
    "rim",
    "width",
    "centre",
    "turn",
];

/// The checks of a picture.
#[derive(Serialize)]
pub struct Focus {
    frame: u32,
    /// Whether everything is right.
    pub right: bool,
    /// The checks; empty if the picture does not show all markers.
    pub checks: Vec<Check>,
    /// Faults with advice, in the order in which to correct them.
    pub wrong: Vec<String>,
}

impl Focus {
    /// The checks of a frame of this device.
    ///
    /// # Errors
    /// When the layout of its dots is unknown.
    pub fn of(frame: &Frame, device: &DeviceHello) -> Result<Focus, Failure> {
        let dots = Dots::of(device)?;
        let mut wrong: Vec<String> = glare::advice(frame).into_iter().collect();
        let checks = match look(frame, device, dots) {
            Ok(seen) => {
                let checks = checks(frame, &seen);
                wrong.extend(ORDER.iter().filter_map(|what| said(&checks, what)));
                checks
            }
            Err(not_seen) => {
                wrong.push(advice(&not_seen));
                Vec::new()
            }
        };
        Ok(Focus {
            frame: frame.number,
            right: wrong.is_empty(),
            checks,
            wrong,
        })
    }

    /// A table of the markers with the limits, a line about the pattern, and the advice.
    pub fn text(&self) -> String {
        let mut lines = vec![format!("frame {}", self.frame)];
        if !self.checks.is_empty() {
            lines.push(row(
                "marker",
                ["rim, px", "width, px", "colour", "brightness", "film"],
            ));
            let ids = self.checks.iter().filter_map(|check| check.marker);
            let markers = ids.max().map_or(0, |last| last + 1);
            lines.extend((0..markers).map(|id| self.marker_row(id)));
            lines.push(self.limits_row());
            let pattern = self.checks.iter().filter(|check| check.marker.is_none());
            let pattern: Vec<_> = pattern.map(of_pattern).collect();
            lines.push(format!("  pattern  {}", pattern.join(", ")));
        }
        lines.extend(self.wrong.iter().map(|wrong| format!("  wrong    {wrong}")));
        if self.right {
            lines.push("  all is right".to_owned());
        }
        lines.join("\n")
    }

    fn of_marker(&self, id: usize) -> impl Iterator<Item = &Check> {
        let own = move |check: &&Check| check.marker == Some(id);
        self.checks.iter().filter(own)
    }

    fn marker_row(&self, id: usize) -> String {
        row(
            &id.to_string(),
            self.of_marker(id).map(|check| {
                let mark = if check.right { "" } else { "!" };
                format!("{mark}{}", number(check.value))
            }),
        )
    }

    /// The limits of the first marker: those of the others differ a little in width only.
    fn limits_row(&self) -> String {
        row("right", self.of_marker(0).map(limits))
    }
}

/// A row of the table of markers.
fn row(name: &str, cells: impl IntoIterator<Item = impl ToString>) -> String {
    let cells = cells
        .into_iter()
        .map(|cell| format!("{:>16}", cell.to_string()));
    format!("  {name:<7}{}", cells.collect::<String>())
}

/// A number with one decimal, as its limits have; a dash if it is missing.
fn number(value: Option<f64>) -> String {
    value.map_or("–".into(), |value| format!("{value:.1}"))
}

/// Text of a pattern's check, such as "centre 2.3 px (≤ 9)".
fn of_pattern(check: &Check) -> String {
    let places = if check.what == "size" { 2 } else { 1 };
    let value = check.value.unwrap_or(f64::NAN);
    format!(
        "{} {value:.places$}{} ({})",
        check.what,
        unit(check),
        limits(check)
    )
}

fn unit(check: &Check) -> String {
    match check.unit {
        "" | "°" => check.unit.to_owned(),
        unit => format!(" {unit}"),
    }
}

fn limits(check: &Check) -> String {
    let short = |limit: f64| {
        let text = format!("{limit:.2}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    match (check.least, check.most) {
        (Some(least), Some(most)) => format!("{} to {}", short(least), short(most)),
        (Some(least), None) => format!("≥ {}", short(least)),
        (None, Some(most)) => format!("≤ {}", short(most)),
        (None, None) => String::new(),
    }
}

/// Text such as "rim of marker 0, 2: 4.1, 4.3 px (≤ 3.5): turn the lens"; `None` if all are right.
fn said(checks: &[Check], what: &str) -> Option<String> {
    let wrong = checks
        .iter()
        .filter(|check| check.what == what && !check.right);
    let wrong: Vec<_> = wrong.collect();
    let first = wrong.first()?;
    let markers: Vec<_> = wrong.iter().filter_map(|check| check.marker).collect();
    let markers: Vec<_> = markers.iter().map(usize::to_string).collect();
    let of = match markers[..] {
        [] => String::new(),
        _ => format!(" of marker {}", markers.join(", ")),
    };
    let values: Vec<_> = wrong.iter().map(|check| number(check.value)).collect();
    let (values, unit, limits) = (values.join(", "), unit(first), limits(first));
    Some(format!(
        "{what}{of}: {values}{unit} ({limits}): {}",
        first.advice
    ))
}
