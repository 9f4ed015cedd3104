//! From one frame's force to the next: contact, slip, filter, and the rest position's drift.
//!
//! Every decision is by the frames' own times, so that it is the same at any frame rate and across
//! frames that were lost; state and work are bounded. Contact and slip are told from each frame's
//! own force, whatever the filter does to what is sent.

mod contact;
mod filter;
mod rezero;
mod slip;
#[cfg(test)]
mod tests;

use crate::pipeline::Measurement;
use contact::Contact;
use filter::ForceFilter;
use hivtac_force::force::Force;
use hivtac_force::rest::Rest;
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{ContactLimits, Filter, SlipLimits, TemporalError, TemporalSettings};
use hivtac_terms::units::Px;
pub use rezero::AtRest;
use rezero::Rezeroing;
use slip::Slip;

/// A rest position is said to have moved when a coordinate was seen farther from it than this, px:
/// 3 µm of film.
const MOVED_PX: f32 = 0.05;
/// Frames that do not show where the film rests. Nothing needs to explain them; but the markers of
/// another mask are no rest position's.
const NOT_AT_REST: Status =
    Status(Status::NO_FORCE.0 & !Status::UNEXPLAINED.0 | Status::FRAME_DISTURBED.0);

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
    /// The frame's status, with [`Status::CONTACT`], [`Status::SLIP`], [`Status::REZEROED`] and
    /// [`Status::REST_MOVED`] as they follow from all frames.
    pub status: Status,
    /// The filtered force, exactly when the frame has one.
    pub force: Option<Force>,
    /// What a second of the untouched film tells of where it rests
    /// ([`Sensor::follow`](crate::pipeline::Sensor::follow)).
    pub at_rest: Option<AtRest>,
}

/// What is known of the frames before.
#[derive(Clone, Debug)]
pub struct Temporal {
    settings: TemporalSettings,
    contact: Contact,
    slip: Slip,
    filter: ForceFilter,
    rezeroing: Rezeroing,
}

impl Temporal {
    /// With the usual settings, before the first frame.
    pub const fn new() -> Temporal {
        Temporal {
            settings: TemporalSettings::USUAL,
            contact: Contact::NONE,
            slip: Slip::NONE,
            filter: ForceFilter::EMPTY,
            rezeroing: Rezeroing::NONE,
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

    /// Forgets what was before: the next frames are seen in another way. The rest position stays.
    pub fn begin_anew(&mut self) {
        self.contact = Contact::NONE;
        self.slip = Slip::NONE;
        self.filter = ForceFilter::EMPTY;
        self.rezeroing.begin_anew();
    }

    /// A rest position was taken, or forgotten: forces are others from the next frame on.
    pub fn set_tare(&mut self, taken: Option<Rest>) {
        self.begin_anew();
        self.rezeroing.set(taken);
    }

    /// The rest position that was taken, without what re-zeroing made of it.
    pub fn tare(&self) -> Option<&Rest> {
        self.rezeroing.taken()
    }

    /// How far re-zeroing moved the coordinate of the rest position that it moved farthest.
    pub fn rezeroed(&self) -> Px {
        self.rezeroing.farthest()
    }

    /// Takes the next frame.
    pub fn follow(&mut self, at: Moment, measurement: &Measurement) -> Followed {
        let TemporalSettings {
            contact,
            slip,
            filter,
            rezero,
        } = self.settings;
        let own = measurement.force.as_ref();
        let touched = self.contact.follow(&contact, at.time_us, measurement);
        let slipping = self.slip.follow(&slip, at.time_us, own, touched);
        let mut status = Status(measurement.status.0 & !(Status::CONTACT.0 | Status::SLIP.0));
        for (set, bit) in [
            (touched == Some(true), Status::CONTACT),
            (slipping, Status::SLIP),
            (self.rezeroed() != Px(0), Status::REZEROED),
            (
                self.rezeroing.drift().farthest_px() > MOVED_PX,
                Status::REST_MOVED,
            ),
        ] {
            if set {
                status |= bit;
            }
        }
        let may_rest = touched != Some(true) && !measurement.status.intersects(NOT_AT_REST);
        let features = measurement.features.as_ref().filter(|_| may_rest);
        let at_rest = self.rezeroing.follow(rezero.as_ref(), at.time_us, features);
        Followed {
            status,
            force: self.filter.follow(filter, at, own, touched == Some(true)),
            at_rest,
        }
    }
}

impl Default for Temporal {
    fn default() -> Self {
        Temporal::new()
    }
}
