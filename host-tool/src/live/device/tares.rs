//! Takes a tare over the next good frames.

use super::Device;
use hivtac_portable::device::answer::{given_up, refused};
use hivtac_portable::device::settings::tared;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::pipeline::Measurement;
use hivtac_sensor::tare::TareBuilder;
use hivtac_wire::message::{DeviceMessage, Outcome};

/// Allows every second frame to be bad, and some time more, µs.
const FRAME_TIMES_EACH: u64 = 2;
const EXTRA_US: u64 = 2_000_000;

/// Sums good frames.
#[derive(Debug)]
pub(super) struct Taring {
    id: u16,
    builder: TareBuilder,
    deadline_us: u64,
}

impl Device {
    /// Begins a tare for the command `id`; returns why not.
    pub(super) fn tare(&mut self, id: u16, frames: u16, anyway: bool) -> Option<Outcome> {
        if self.taring.is_some() {
            return Some(Outcome::Busy);
        }
        let Some(builder) = TareBuilder::new(frames) else {
            return Some(Outcome::InvalidArgument);
        };
        let patience_us = u64::from(self.camera.frame_us()) * FRAME_TIMES_EACH * u64::from(frames);
        self.taring = Some(Taring {
            id,
            builder: if anyway { builder.forced() } else { builder },
            deadline_us: self.now_us + patience_us + EXTRA_US,
        });
        None
    }

    /// Adds a measured frame to the tare, and ends it if it is whole or late.
    pub(super) fn tare_with(&mut self, measurement: &Measurement) {
        let Some(taring) = &mut self.taring else {
            return;
        };
        match self.sensor.tare_with(&mut taring.builder, measurement) {
            Some(outcome) => {
                let (id, spread) = (taring.id, taring.builder.spread());
                self.taring = None;
                if let Ok(rest) = outcome {
                    let report = tared(&rest, &self.sensor, spread);
                    self.out.answer(DeviceMessage::Tared(report));
                    self.sensor.set_tare(Some(rest), Drift::NONE);
                }
                let outcome = outcome.err().map_or(Outcome::Done, refused);
                self.out.reply(id, outcome);
            }
            None if taring.deadline_us <= self.now_us => self.give_up_tare(),
            None => {}
        }
    }

    pub(super) fn give_up_tare(&mut self) {
        if let Some(taring) = self.taring.take() {
            self.out.reply(taring.id, given_up(&taring.builder));
        }
    }
}
