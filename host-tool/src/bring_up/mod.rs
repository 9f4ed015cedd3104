//! `hivtac bring-up`: checks a new board in one command, in the order in which faults occur.

mod camera;
mod clocks;
pub mod colours;
mod complaints;
mod device;
mod film;
mod noise;
mod person;
mod press;
mod report;
mod samples;
#[cfg(test)]
mod tests;

use crate::device::Device;
use crate::output::print;
use crate::snapshot::snapshot;
use clap::Args;
use colours::Middle;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::focus::Focus;
use hivtac_host::focus::dots::Dots;
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::stop;
use hivtac_wire::message::DeviceHello;
use person::Person;
use report::{Report, Step};
use serde_json::json;

/// Check a new board step by step, the likeliest fault first
///
/// USB, the camera and its registers, clocks, white, the markers as `focus` has them, whether the
/// film keeps light out, tare and noise, and a finger's press; says what is wrong and what to do,
/// and asks for a person's help in between. Ends at the first fault that makes later steps
/// meaningless. The report is for your own notes, and to attach to a question.
///
/// Example: hivtac bring-up
#[derive(Args)]
pub struct BringUpArguments {
    #[command(flatten)]
    device: Device,
    /// Where the report goes
    #[arg(value_name = "FILE.json", default_value = "bring-up.json")]
    report: String,
    /// The report on standard output, too, instead of a line a step
    #[arg(long)]
    json: bool,
}

/// Goes through all steps and writes the report.
///
/// # Errors
/// [`Kind::NotRight`] when a step finds a fault; those of the link when it breaks, and of files.
pub fn run(arguments: &BringUpArguments) -> Result<(), Failure> {
    let address = arguments.device.address()?;
    let mut report = Report::new();
    let ended =
        BringUp::begin(arguments, &address, &mut report).and_then(|mut it| it.go(&mut report));
    report.finish();
    report.write(&arguments.report)?;
    match arguments.json {
        true => print(&report.json())?,
        false => print(&format!("report: {}", arguments.report))?,
    };
    ended?;
    match report.wrong() {
        names if names.is_empty() => Ok(()),
        names => Err(Failure::new(
            Kind::NotRight,
            format!(
                "not right: {}; mend the first, then run this again",
                names.join(", ")
            ),
        )),
    }
}

/// The state that the steps share.
struct BringUp<'a> {
    arguments: &'a BringUpArguments,
    link: Link,
    hello: DeviceHello,
    person: Person,
}

impl<'a> BringUp<'a> {
    fn begin(
        arguments: &'a BringUpArguments,
        address: &Address,
        report: &mut Report,
    ) -> Result<BringUp<'a>, Failure> {
        let begun = Link::connect(address, arguments.device.timeout);
        let (mut link, hello) = begun.inspect_err(|failure| {
            if !stop::requested() {
                show(arguments, report, device::not_there(failure));
            }
        })?;
        show(
            arguments,
            report,
            device::usb(&mut link, arguments.device.timeout)?,
        );
        report.device = device::described(&mut link, arguments.device.timeout, hello.clone())?;
        Ok(BringUp {
            arguments,
            link,
            hello,
            person: Person::listen(),
        })
    }

    /// Runs all steps from the camera on; a step is left out when another step that it depends on
    /// failed.
    fn go(&mut self, report: &mut Report) -> Result<(), Failure> {
        if !report.is_right() {
            return Ok(());
        }
        let patience = self.arguments.device.timeout;
        Dots::of(&self.hello)?;
        let (step, inspection) = camera::step(&mut self.link, patience)?;
        show(self.arguments, report, step);
        let Some(inspection) = inspection.filter(|_| report.is_right()) else {
            return Ok(());
        };
        let step = clocks::step(&mut self.link, patience, inspection.frame_time_us)?;
        show(self.arguments, report, step);
        if !report.is_right() {
            return Ok(());
        }
        let step = self.white()?;
        show(self.arguments, report, step);
        let (step, free) = self.markers()?;
        show(self.arguments, report, step);
        let step = self.film(&free)?;
        show(self.arguments, report, step);
        let step = noise::step(&mut self.link, patience, self.hello.threshold.format())?;
        let at_rest = step.is_right();
        show(self.arguments, report, step);
        if at_rest {
            let step = press::step(&mut self.link, patience)?;
            show(self.arguments, report, step);
        }
        Ok(())
    }

    fn white(&mut self) -> Result<Step, Failure> {
        self.person
            .ask("Hold a white card where the film is, or leave the film on where it is clear.")?;
        let taken = snapshot(&mut self.link, self.arguments.device.timeout)?;
        Ok(colours::step(&taken.frame))
    }

    /// Returns the film's middle, too.
    fn markers(&mut self) -> Result<(Step, Middle), Failure> {
        self.person
            .ask("Take the card away and put the film on; nothing touches it.")?;
        let taken = snapshot(&mut self.link, self.arguments.device.timeout)?;
        let focus = Focus::of(&taken.frame, &self.hello)?;
        let said = match focus.right {
            true => "sharp, bright, of the right size, in the right place (`hivtac focus`)",
            false => "not as they should be; `hivtac focus` shows them until they are",
        };
        let figures = json!({ "checks": focus.checks });
        let step = Step::new("markers", said.to_owned(), focus.wrong, figures);
        Ok((step, Middle::of(&taken.frame)))
    }

    fn film(&mut self, free: &Middle) -> Result<Step, Failure> {
        self.person
            .ask("Hold your hand over the film from outside, and do not touch it.")?;
        let taken = snapshot(&mut self.link, self.arguments.device.timeout)?;
        self.person.ask("Take your hand away.")?;
        Ok(film::judge(free, &Middle::of(&taken.frame)))
    }
}

/// Keeps a step, and shows it.
fn show(arguments: &BringUpArguments, report: &mut Report, step: Step) {
    if !arguments.json {
        // The report's file is written even if the reader of the output is gone.
        let _ = print(&step.text());
    }
    report.steps.push(step);
}
