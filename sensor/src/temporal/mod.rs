//! Follows forces from frame to frame: creep, contact, slip, the filter, and the output pin.
//!
//! Every decision uses the frames' own times, so it is the same at any frame rate and across lost
//! frames. State and work are bounded. Contact and slip depend on each frame's own force, not on
//! the filtered force that is sent.

mod contact;
mod creep;
mod filter;
mod output;
mod slip;
#[cfg(test)]
pub(crate) mod tests;

use crate::force::Force;
use crate::pipeline::Measurement;
use contact::Contact;
use creep::Memory;
use filter::ForceFilter;
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{ContactLimits, Filter, SlipLimits, TemporalError, TemporalSettings};
use output::Level;
use slip::Slip;

/// Contact and output are forgotten if no frame had a force for longer than this, µs.
const FORGOTTEN_US: u64 = 100_000;

/// A frame's number and exposure time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moment {
    /// Its number, which increases by 1 per frame, modulo 2³².
    pub frame: u32,
    /// The middle of its exposure, µs; never decreases.
    pub time_us: u64,
}

/// The result of a frame and those before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// The frame's status, with [`Status::CONTACT`] and [`Status::SLIP`] decided from all frames.
    /// [`Sensor::follow`](crate::pipeline::Sensor::follow) also sets [`Status::REZEROED`] and
    /// [`Status::REST_MOVED`].
    pub status: Status,
    /// The filtered force; present exactly if the frame has a force.
    pub force: Option<Force>,
    /// True if a second of the untouched film has just shown where it rests. Set by
    /// [`Sensor::follow`](crate::pipeline::Sensor::follow) only.
    pub tells_rest: bool,
    /// Whether the output pin is high.
    pub output: bool,
}

/// The state that earlier frames left.
#[derive(Clone, Debug)]
pub struct Temporal {
    settings: TemporalSettings,
    contact: Contact,
    slip: Slip,
    filter: ForceFilter,
    memory: Memory,
    output: Level,
}

impl Temporal {
    /// The state before the first frame, with the usual settings.
    pub const fn new() -> Temporal {
        Temporal {
            settings: TemporalSettings::USUAL,
            contact: Contact::NONE,
            slip: Slip::NONE,
            filter: ForceFilter::EMPTY,
            memory: Memory::NONE,
            output: Level::LOW,
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &TemporalSettings {
        &self.settings
    }

    /// Sets the settings, between two frames. Contact, slip and filter restart, so that no frame is
    /// judged by two settings.
    ///
    /// # Errors
    /// A setting out of its range; then nothing is changed.
    pub fn set(&mut self, settings: TemporalSettings) -> Result<(), TemporalError> {
        settings.check()?;
        self.settings = settings;
        self.begin_anew();
        Ok(())
    }

    /// Discards the history: the next frames are seen in a different way.
    pub fn begin_anew(&mut self) {
        self.contact = Contact::NONE;
        self.slip = Slip::NONE;
        self.filter = ForceFilter::EMPTY;
        self.memory = Memory::NONE;
        self.output = Level::LOW;
    }

    /// Takes the next frame.
    pub fn follow(&mut self, at: Moment, measurement: &Measurement) -> Followed {
        let TemporalSettings {
            contact,
            slip,
            filter,
            creep,
            output,
            ..
        } = self.settings;
        let undone = (self.memory).follow(&creep, at.time_us, measurement.force.as_ref());
        let mut seen = Measurement {
            force: undone.map(|undone| undone.force),
            ..*measurement
        };
        // A force that may be only the film's memory is not a contact.
        if undone.is_some_and(|undone| undone.is_remembered()) {
            seen.status = Status(seen.status.0 & !Status::CONTACT.0);
        }
        let own = seen.force.as_ref();
        let touched = self.contact.follow(&contact, at.time_us, &seen);
        // The place of a sum is a mean, which moves where neither contact does.
        let is_sum = measurement.status.contains(Status::TWO_CONTACTS);
        if is_sum {
            self.slip = Slip::NONE;
        }
        let of_one = own.filter(|_| !is_sum);
        let slipping = self.slip.follow(&slip, at.time_us, of_one, touched);
        let mut status = Status(measurement.status.0 & !(Status::CONTACT.0 | Status::SLIP.0));
        for (set, bit) in [
            (touched == Some(true), Status::CONTACT),
            (slipping, Status::SLIP),
        ] {
            if set {
                status |= bit;
            }
        }
        Followed {
            status,
            force: self.filter.follow(filter, at, own, touched == Some(true)),
            tells_rest: false,
            output: self.output.follow(output, at.time_us, own, status),
        }
    }
}

impl Default for Temporal {
    fn default() -> Self {
        Temporal::new()
    }
}
