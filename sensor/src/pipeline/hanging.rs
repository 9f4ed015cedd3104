//! Adapts to the way the sensor is held, which changes the film's sag by its own weight.

use super::Sensor;
use crate::force::forward::{Gravity, Turned};
use crate::force::rest::Rest;
use crate::markers::tables::Table;
use crate::rezero::Tare;
use hivtac_terms::down::{Direction, Down};

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Sets gravity, as far as known, from the next frame on; call it between two frames. The
    /// history of earlier frames is kept, since a finger may turn while it grips.
    pub fn set_down(&mut self, down: Down) {
        if self.down != down {
            self.down = down;
            let noise = self.noise;
            self.prepare();
            self.noise = noise;
        }
    }

    /// Gravity as far as known.
    pub fn down(&self) -> Down {
        self.down
    }

    /// Gravity when the rest position was taken; `None` if unknown.
    pub fn down_when_taken(&self) -> Option<Direction> {
        let down = self.tare.as_ref().and_then(Tare::down)?;
        Some(Direction::of_unit(down))
    }

    /// How the sensor was turned since its rest position was taken; `None` if it is never turned.
    pub(super) fn turned(&self) -> Option<Turned> {
        let now = match self.down {
            Down::Fixed => return None,
            Down::Unknown => return Some(Turned::AnyWay),
            Down::Told(now) => now.to_unit(),
        };
        let before = match &self.tare {
            Some(tare) => tare.down(),
            None => self.down_of_model(),
        };
        Some(before.map_or(Turned::AnyWay, |before| Turned::From { before, now }))
    }

    /// Gravity on the film of the model's own rest position.
    fn down_of_model(&self) -> Option<Gravity> {
        let forward = self.fitting_model()?.forward.as_ref()?;
        Some(forward.weight.as_ref()?.down)
    }

    /// Whether the film may hang differently than when the rest position was taken, by an unknown
    /// amount.
    pub(super) fn is_weight_unknown(&self) -> bool {
        match self.turned() {
            None => false,
            Some(Turned::AnyWay) => true,
            Some(Turned::From { before, now }) => before != now && self.down_of_model().is_none(),
        }
    }

    /// Converts the rest position to today's gravity.
    pub(super) fn hang(&mut self) {
        let forward = self.fitting_model().and_then(|model| model.forward);
        let turned = self.turned();
        let Some(tare) = &mut self.tare else {
            return;
        };
        tare.hang(match forward.zip(turned) {
            Some((forward, Turned::From { before, now })) => {
                forward.turned(tare.taken(), before, now)
            }
            _ => *tare.taken(),
        });
    }

    /// The model's own rest position under today's gravity.
    pub(super) fn rest_of_model(&self) -> Option<Rest> {
        let model = self.fitting_model()?;
        let forward = model.forward.as_ref();
        Some(match (forward, self.turned()) {
            (Some(forward), Some(Turned::From { now, .. })) => {
                let down = forward.weight.as_ref().map_or(now, |weight| weight.down);
                forward.turned(&model.rest, down, now)
            }
            _ => model.rest,
        })
    }
}
