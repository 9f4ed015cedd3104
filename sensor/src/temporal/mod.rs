//! From one frame's force to the next: what the film remembers, contact, slip, and the filter of
//! what is sent.
//!
//! Every decision is by the frames' own times, so that it is the same at any frame rate and across
//! frames that were lost; state and work are bounded. Contact and slip are told from each frame's
//! own force, whatever the filter does to what is sent.

mod contact;
mod creep;
mod filter;
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
use slip::Slip;

/// Which frame, and when it was exposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moment {
    /// Its number, which goes on by 1, modulo 2³².
    pub frame: u32,
    /// The middle of its exposure, µs; never back.
    pub time_us: u64,
}

/// What follows from a frame and those before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// The frame's status, with [`Status::CONTACT`] and [`Status::SLIP`] as they follow from all
    /// frames; of [`Sensor::follow`](crate::pipeline::Sensor::follow) with [`Status::REZEROED`] and
    /// [`Status::REST_MOVED`], too.
    pub status: Status,
    /// The filtered force, exactly when the frame has one.
    pub force: Option<Force>,
    /// Whether a second of the untouched film told where it rests, which
    /// [`Sensor::follow`](crate::pipeline::Sensor::follow) alone asks.
    pub tells_rest: bool,
}

/// What is known of the frames before.
#[derive(Clone, Debug)]
pub struct Temporal {
    settings: TemporalSettings,
    contact: Contact,
    slip: Slip,
    filter: ForceFilter,
    memory: Memory,
}

impl Temporal {
    /// With the usual settings, before the first frame.
    pub const fn new() -> Temporal {
        Temporal {
            settings: TemporalSettings::USUAL,
            contact: Contact::NONE,
            slip: Slip::NONE,
            filter: ForceFilter::EMPTY,
            memory: Memory::NONE,
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &TemporalSettings {
        &self.settings
    }

    /// Sets them between two frames; contact, slip and filter begin anew, so that no frame is
    /// judged by two settings.
    ///
    /// # Errors
    /// A setting outside its range; nothing is changed then.
    pub fn set(&mut self, settings: TemporalSettings) -> Result<(), TemporalError> {
        settings.check()?;
        self.settings = settings;
        self.begin_anew();
        Ok(())
    }

    /// Forgets what was before: the next frames are seen in another way.
    pub fn begin_anew(&mut self) {
        self.contact = Contact::NONE;
        self.slip = Slip::NONE;
        self.filter = ForceFilter::EMPTY;
        self.memory = Memory::NONE;
    }

    /// Takes the next frame.
    pub fn follow(&mut self, at: Moment, measurement: &Measurement) -> Followed {
        let TemporalSettings {
            contact,
            slip,
            filter,
            creep,
            ..
        } = self.settings;
        let undone = (self.memory).follow(&creep, at.time_us, measurement.force.as_ref());
        let mut seen = Measurement {
            force: undone.map(|undone| undone.force),
            ..*measurement
        };
        // What the film may only remember does not touch it.
        if undone.is_some_and(|undone| undone.is_remembered()) {
            seen.status = Status(seen.status.0 & !Status::CONTACT.0);
        }
        let own = seen.force.as_ref();
        let touched = self.contact.follow(&contact, at.time_us, &seen);
        let slipping = self.slip.follow(&slip, at.time_us, own, touched);
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
        }
    }
}

impl Default for Temporal {
    fn default() -> Self {
        Temporal::new()
    }
}
