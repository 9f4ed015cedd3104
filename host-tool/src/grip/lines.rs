//! A grip as a line for a person, and as JSON.

use super::{Cause, Grip, Held};
use crate::decimal::Decimal;
use crate::shown::{shown, to_json, unit_number};
use hivtac_terms::status::Status;
use hivtac_wire::message::DeviceHello;
use serde::Serialize;
use std::collections::BTreeMap;

/// The columns of [`line`], with their units.
pub fn header() -> String {
    let columns = ["grip", "±", "margin", "±", "Fx", "Fy", "Fz", "±"];
    let names: String = columns.map(|name| format!("{name:>9}")).concat();
    let units = format!("{:>9}", "mN").repeat(columns.len());
    let first = format!("{:>17}{names}{:>9}  status", "time", "contact");
    format!("{first}\n{:>17}{units}", "s")
}

/// A finger's name: its own, or its number.
pub fn finger(hello: &DeviceHello) -> String {
    match hello.name.as_str() {
        "" => unit_number(&hello.device_id),
        name => shown(name),
    }
}

/// Why there is no grip, with the finger's name.
pub fn cause(grip: &Grip, names: &[String; 2]) -> Option<String> {
    let (number, why) = match grip.held.err()? {
        Cause::Silent(number) => (number, "no samples".to_owned()),
        Cause::NoForce(number) => {
            let status = Status(grip.status[number].0 & Status::NO_FORCE.0);
            let why: Vec<_> = status.names().collect();
            (number, why.join(" "))
        }
    };
    Some(format!("{}: {why}", names[number]))
}

/// The status of both fingers but for contact: each name of a bit behind that of its finger.
pub fn status(grip: &Grip, names: &[String; 2]) -> String {
    let each = grip.status.iter().zip(names).flat_map(|(status, finger)| {
        let but_contact = Status(status.0 & !Status::CONTACT.0);
        but_contact
            .names()
            .map(move |name| format!("{finger}:{name}"))
    });
    each.collect::<Vec<_>>().join(" ")
}

/// A line for a person.
pub fn line(grip: &Grip, names: &[String; 2]) -> String {
    let numbers = match &grip.held {
        Err(_) => format!("{:>9}", "–").repeat(8),
        Ok(held) => {
            let [x, y, z] = held.common;
            let sigma = held.common_sigma.iter().copied().fold(0.0, f64::max);
            let force = [held.force, held.force_sigma, held.margin, held.margin_sigma];
            let all = [force, [x, y, z, sigma]].concat();
            let cell = |it: f64| format!("{:>9}", Decimal::thousandths(micro(it)));
            all.into_iter().map(cell).collect()
        }
    };
    let contact = match grip.contact() {
        None => "–",
        Some(true) => "yes",
        Some(false) => "no",
    };
    let text = cause(grip, names).unwrap_or_else(|| status(grip, names));
    let text = if text.is_empty() { "ok" } else { &text };
    format!(
        "{:>17}{numbers}{contact:>9}  {text}",
        seconds(grip.stamp_ns).to_string()
    )
}

/// A sentence for a person: grip force, friction margin and common wrench.
pub fn sentence(grip: &Grip, names: &[String; 2]) -> String {
    let [first, second] = names;
    let Ok(held) = &grip.held else {
        let why = cause(grip, names).unwrap_or_default();
        return format!("grip of {first} and {second}: unknown ({why})");
    };
    let thousandths = |value: f64| format!("{:.1}", 1e3 * value);
    let known = |value: f64, sigma: f64| format!("{} ± {}", thousandths(value), thousandths(sigma));
    format!(
        "grip of {first} and {second}: {} mN; margin {} mN; together {} mN",
        known(held.force, held.force_sigma),
        known(held.margin, held.margin_sigma),
        held.common.map(thousandths).join(", "),
    )
}

fn seconds(ns: u64) -> Decimal {
    Decimal::new(ns / 1_000, 6)
}

/// A value in millionths.
fn micro(value: f64) -> i64 {
    (value * 1e6).round() as i64
}

#[derive(Serialize)]
struct GripJson<'a> {
    time_s: Decimal,
    grip: Option<HeldJson>,
    cause: Option<String>,
    contact: Option<bool>,
    status: BTreeMap<&'a str, Vec<&'static str>>,
}

#[derive(Serialize)]
struct HeldJson {
    force_n: Decimal,
    force_sigma_n: Decimal,
    margin_n: Decimal,
    margin_sigma_n: Decimal,
    common_n: [Decimal; 3],
    common_sigma_n: [Decimal; 3],
    torque_nm: Option<[Decimal; 3]>,
    torque_sigma_nm: Option<[Decimal; 3]>,
}

impl From<&Held> for HeldJson {
    fn from(held: &Held) -> HeldJson {
        let newtons = |value: f64| Decimal::new(micro(value), 6);
        let torque = |value: f64| Decimal::new((value * 1e9).round() as i64, 9);
        HeldJson {
            force_n: newtons(held.force),
            force_sigma_n: newtons(held.force_sigma),
            margin_n: newtons(held.margin),
            margin_sigma_n: newtons(held.margin_sigma),
            common_n: held.common.map(newtons),
            common_sigma_n: held.common_sigma.map(newtons),
            torque_nm: held.torque.map(|(all, _)| all.map(torque)),
            torque_sigma_nm: held.torque.map(|(_, sigmas)| sigmas.map(torque)),
        }
    }
}

/// A JSON object, on one line.
pub fn json(grip: &Grip, names: &[String; 2]) -> String {
    let each = names.iter().zip(grip.status);
    to_json(&GripJson {
        time_s: seconds(grip.stamp_ns),
        grip: grip.held.as_ref().ok().map(HeldJson::from),
        cause: cause(grip, names),
        contact: grip.contact(),
        status: each
            .map(|(name, status)| (name.as_str(), status.names().collect()))
            .collect(),
    })
}
