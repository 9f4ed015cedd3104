//! `hivtac threshold auto`: finds the threshold that separates dots from film in the device's own
//! pictures, and sets it.

mod find;
mod levels;
#[cfg(test)]
mod tests;

use crate::device::Device;
use crate::output::print;
use crate::set_threshold::set_threshold;
use crate::snapshot::snapshot;
use clap::Args;
use find::{Found, find};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::focus::dots::Dots;
use hivtac_host::frame::Frame;
use hivtac_host::look::{self, PASSED};
use hivtac_host::shown::to_json;
use hivtac_host::threshold::{text, to_json as threshold_json};
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_wire::message::DeviceHello;
use serde_json::{Value, json};

/// Number of pictures; each has other noise.
const PICTURES: usize = 3;

/// Find the threshold that separates the dots from the film in the device's own pictures, show
/// why, and set it
///
/// It is the model's if that separates film and dots, since only that one gives forces; otherwise
/// half way between them. The pixel format stays. Nothing should touch the film.
///
/// Example: hivtac threshold auto --dry-run
#[derive(Args)]
pub struct AutoArguments {
    #[command(flatten)]
    device: Device,
    /// Keep it through restarts
    #[arg(long)]
    keep: bool,
    /// Set nothing
    #[arg(long, conflicts_with = "keep")]
    dry_run: bool,
    /// One JSON object instead of lines
    #[arg(long)]
    json: bool,
}

/// Finds the threshold, prints why it was chosen, and sets it.
///
/// # Errors
/// [`Kind::NotRight`] when the pictures do not separate dots from film; when the device refuses.
pub fn run(arguments: &AutoArguments) -> Result<(), Failure> {
    let (mut link, hello) = arguments.device.connect()?;
    Dots::of(&hello)?;
    let mut frames = Vec::new();
    for _ in 0..PICTURES {
        frames.push(snapshot(&mut link, arguments.device.timeout)?.frame);
    }
    let found = find(&frames, &hello).map_err(|why| {
        let message = format!("no threshold separates the dots from the film: {why}");
        Failure::new(Kind::NotRight, message)
    })?;
    let report = Report::new(&frames, &hello, found, arguments);
    if !arguments.json {
        print(&report.text())?;
    }
    if !arguments.dry_run {
        let wanted = report.wanted();
        set_threshold(
            &mut link,
            &hello,
            wanted,
            arguments.device.timeout,
            arguments.keep,
        )?;
    }
    if arguments.json {
        print(&to_json(&report.json()))?;
    }
    Ok(())
}

/// The threshold found, and how much of the pictures passes it.
struct Report<'a> {
    found: Found,
    frame: [u16; 2],
    /// Pixels of all pictures, and those that pass.
    pixels: usize,
    passed: usize,
    arguments: &'a AutoArguments,
}

impl<'a> Report<'a> {
    fn new(
        frames: &[Frame],
        device: &DeviceHello,
        found: Found,
        arguments: &'a AutoArguments,
    ) -> Report<'a> {
        let wanted = found.wanted();
        let masks = frames.iter().filter_map(|frame| {
            let frame = Frame {
                threshold: wanted,
                ..frame.clone()
            };
            look::mask(&frame, device.dilations)
        });
        let passed = masks.flatten().filter(|&level| level == PASSED).count();
        let [width, height] = [frames[0].width, frames[0].height];
        Report {
            found,
            frame: [width, height],
            pixels: frames.len() * usize::from(width) * usize::from(height),
            passed,
            arguments,
        }
    }

    fn wanted(&self) -> Threshold {
        self.found.wanted()
    }

    fn share(&self) -> f64 {
        self.passed as f64 / self.pixels as f64
    }

    fn text(&self) -> String {
        let (found, levels) = (&self.found, self.found.levels);
        let [width, height] = self.frame;
        let format = self.wanted().format().name();
        let scale = found.scale.name();
        let mut lines = vec![
            format!("pictures   {PICTURES} of {width} × {height} px, {format}"),
            format!(
                "film       {scale} {}, 99.9 % of it up to {}",
                levels.film, levels.film_high
            ),
            format!(
                "dots       {scale} {}, 99 % of them from {} up{}",
                levels.dots,
                levels.dots_low,
                self.colour_text()
            ),
            format!(
                "separable  from {scale} {} to {} the sensing finds {} dots",
                found.span[0],
                found.span[1],
                found.dots.in_words()
            ),
            format!("chosen     {}: {}", text(&self.wanted()), self.why()),
            format!(
                "passes     {:.2} % of the pixels ({} of {})",
                100.0 * self.share(),
                self.passed / PICTURES,
                self.pixels / PICTURES
            ),
        ];
        if self.arguments.dry_run {
            lines.push("nothing was set (--dry-run)".to_owned());
        }
        lines.join("\n")
    }

    fn colour_text(&self) -> String {
        self.found.colour.map_or(String::new(), |colour| {
            let [first, last] = colour.hues;
            format!("; hue {first}–{last}, value from {} up", colour.value_low)
        })
    }

    fn why(&self) -> String {
        let half_way = format!(
            "the {} half way between film and dots",
            self.found.scale.name()
        );
        match (self.found.model, self.wanted().format()) {
            (Some(_), _) => format!(
                "the model's, which separates them, and which forces need (without it {}: \
                 {half_way})",
                text(&self.found.chosen)
            ),
            (None, PixelFormat::Rgb565) => {
                format!("{half_way}, hues as the dots', and half of their value")
            }
            (None, PixelFormat::Yuv422 | PixelFormat::Mono) => half_way,
        }
    }

    fn json(&self) -> Value {
        let (found, levels) = (&self.found, self.found.levels);
        json!({
            "pictures": PICTURES,
            "scale": found.scale.name(),
            "film": { "median": levels.film, "high": levels.film_high },
            "dots": {
                "median": levels.dots,
                "low": levels.dots_low,
                "hues": found.colour.map(|colour| colour.hues),
                "value_low": found.colour.map(|colour| colour.value_low),
            },
            "separable": found.span,
            "half_way": threshold_json(&found.chosen),
            "chosen": threshold_json(&self.wanted()),
            "is_of_model": found.model.is_some(),
            "passed": self.share(),
            "set": !self.arguments.dry_run,
            "kept": self.arguments.keep,
        })
    }
}
