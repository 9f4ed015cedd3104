//! `hivtac self-test`: what the device finds when it tests itself and its camera, with codes.

use crate::device::Device;
use crate::ended::Ended;
use crate::output;
use crate::request::show_log;
use clap::Args;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::shown::unit_number;
use hivtac_wire::health::{BrownOut, Health, Problem, ResetReason};
use hivtac_wire::message::{DeviceMessage, Request};
use serde::Serialize;
use std::time::Duration;

/// A device's report on its own state, for people and as JSON.
#[derive(Serialize)]
pub struct HealthJson {
    reset: &'static str,
    temperature_c: Option<f64>,
    stack_used: u32,
    stack_bytes: u32,
    problems: Vec<&'static str>,
    at_start: Vec<&'static str>,
    /// The supply voltage that resets it, V; `None` if no level is chosen.
    brown_out_v: Option<f64>,
    /// What ended the program in an earlier run.
    failure: Option<Ended>,
}

/// The result of a self-test.
#[derive(Serialize)]
struct Report {
    device_id: String,
    good: bool,
    problems: Vec<Found>,
    health: HealthJson,
}

#[derive(Serialize)]
struct Found {
    code: u8,
    name: &'static str,
}

impl HealthJson {
    /// From the device's message.
    pub fn of(health: &Health) -> HealthJson {
        HealthJson {
            reset: reset_name(health.reset),
            temperature_c: (health.temperature_centidegrees).map(|it| f64::from(it) / 100.0),
            stack_used: health.stack_used,
            stack_bytes: health.stack_bytes,
            problems: problems(health.problems).map(Problem::name).collect(),
            at_start: problems(health.at_start).map(Problem::name).collect(),
            brown_out_v: match health.brown_out {
                BrownOut::Off => None,
                level => Some(f64::from(level.millivolts()) / 1e3),
            },
            failure: health.failure.as_ref().map(Ended::of),
        }
    }

    /// Lines for a person.
    pub fn lines(&self) -> Vec<String> {
        let temperature = match self.temperature_c {
            Some(temperature) => format!("{temperature:.1} °C"),
            None => "temperature unknown".to_owned(),
        };
        let problems = match self.problems.as_slice() {
            [] => "none".to_owned(),
            names => format!("{}; `hivtac self-test` says what to do", names.join(", ")),
        };
        let at_start = match self.at_start.as_slice() {
            [] => "no problem".to_owned(),
            names => names.join(", "),
        };
        let supply = match self.brown_out_v {
            Some(volts) => format!("a reset below {volts:.1} V"),
            None => "no reset when it is low; docs/firmware.md, \"Supply\", says why".to_owned(),
        };
        let mut lines = vec![
            format!(
                "health     started by {}; {temperature}; {} of {} bytes of stack used",
                self.reset, self.stack_used, self.stack_bytes
            ),
            format!("problems   {problems}"),
            format!("at start   {at_start}"),
            format!("supply     {supply}"),
        ];
        lines.extend(self.failure.iter().flat_map(Ended::lines));
        lines
    }
}

/// Have the device test itself, and show its findings with their codes
///
/// Codes are those of docs/wire.md, "Health". Exit code 9 when something is not right.
///
/// Example: hivtac self-test
#[derive(Args)]
pub struct SelfTestArguments {
    #[command(flatten)]
    device: Device,
    /// One JSON object instead of lines
    #[arg(long)]
    json: bool,
}

/// Has the device test itself, and prints the result.
///
/// # Errors
/// [`Kind::NotRight`] when something is wrong; those of [`Link::connect`].
pub fn run(arguments: &SelfTestArguments) -> Result<(), Failure> {
    let (mut link, hello) = arguments.device.connect()?;
    let health = ask(&mut link, arguments.device.timeout)?;
    let found: Vec<Problem> = problems(health.problems).collect();
    let report = Report {
        device_id: unit_number(&hello.device_id),
        good: found.is_empty(),
        problems: found
            .iter()
            .map(|problem| Found {
                code: problem.code(),
                name: problem.name(),
            })
            .collect(),
        health: HealthJson::of(&health),
    };
    output::report(arguments.json, &report, || lines(&health).join("\n"))?;
    match found.len() {
        0 => Ok(()),
        count => Err(Failure::new(
            Kind::NotRight,
            format!(
                "the self-test found {count} of {} problems",
                Problem::ALL.len()
            ),
        )),
    }
}

/// Asks the device for its health.
///
/// # Errors
/// When the device refuses or does not answer.
pub fn ask(link: &mut Link, patience: Duration) -> Result<Health, Failure> {
    let mut health = None;
    link.request(Request::GetHealth, patience, |message| match message {
        DeviceMessage::Health(newest) => health = Some(newest),
        other => show_log(other),
    })?;
    health.ok_or_else(|| link.lost("its health did not come"))
}

fn problems(bits: u32) -> impl Iterator<Item = Problem> {
    let is_there = move |problem: &Problem| bits & problem.bit() != 0;
    Problem::ALL.into_iter().filter(is_there)
}

fn lines(health: &Health) -> Vec<String> {
    let line = |problem: Problem| {
        let is_in = |bits: u32| bits & problem.bit() != 0;
        let (state, advice) = match (is_in(health.problems), is_in(health.at_start)) {
            (true, _) => ("PROBLEM", format!(": {}", advice(problem))),
            (false, true) => ("good   ", ": not so at the start".to_owned()),
            (false, false) => ("good   ", String::new()),
        };
        format!("{:>2}  {state}  {}{advice}", problem.code(), problem.name())
    };
    Problem::ALL.into_iter().map(line).collect()
}

fn advice(problem: Problem) -> &'static str {
    match problem {
        Problem::CameraSilent => "look at its connector; `hivtac bring-up` says more",
        Problem::ModelMissing => "send one with `hivtac update model`",
        Problem::ModelFallback => {
            "the kept model is not usable, and the built-in one runs; send it again with \
             `hivtac update model`, or forget it with `--built-in`"
        }
        Problem::SettingsUnread => {
            "kept by other firmware; they stay until something is kept, or `hivtac settings reset`"
        }
        Problem::FlashFails => "it wears out: what is kept stays, new things may not",
        Problem::StackLow => "report it, with what the device was doing",
        Problem::WatchdogReset => {
            "the program stood still; report it with `hivtac info --json` and what the device was \
             doing"
        }
        Problem::SoftwareReset => {
            "a fault, of which `hivtac info` names the place, or a debug probe; report it with \
             `hivtac info --json` and what the device was doing"
        }
        Problem::Temperature => "above 105 °C, or the sensor for it does not tell; let it cool",
        Problem::AnotherCamera => {
            "fit the camera that this firmware is for, or flash that of the camera"
        }
        Problem::CameraRegisters => {
            "`hivtac bring-up` names it; while frames come as they should, the part is of another \
             revision; else look at its cable"
        }
        Problem::Clocks => {
            "the board's crystal or the camera's clock is wrong; `hivtac bring-up` measures them"
        }
        Problem::Arithmetic => {
            "its forces mean nothing; flash it again, and when it stays, use another board"
        }
        Problem::Exposure => {
            "the picture stayed too dark or too bright: change the light, then `hivtac expose`"
        }
    }
}

fn reset_name(reset: ResetReason) -> &'static str {
    match reset {
        ResetReason::PowerOn => "power-on",
        ResetReason::BrownOut => "brown-out",
        ResetReason::Pin => "reset-line",
        ResetReason::Software => "software",
        ResetReason::Watchdog => "watchdog",
        ResetReason::Other => "other",
    }
}
