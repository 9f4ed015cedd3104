//! What the host wants of the pipeline.

use crate::model::Chosen;
use crate::session::Asked;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::Outcome;
use hivtac_wire::settings::RestPosition;

/// Orders that wait. From the USB tasks and the memory task to the pipeline. A model in one makes
/// each a kilobyte long: too much for DTCM.
#[unsafe(link_section = ".sram.orders")]
pub static ORDERS: Channel<CriticalSectionRawMutex, Order, 4> = Channel::new();

/// What the host wants of the pipeline; done between two frames. Each is answered with its `id`.
pub enum Order {
    /// Use this threshold and its pixel format as soon as possible.
    SetThreshold {
        /// Of the command.
        id: u16,
        /// As it came, unchecked.
        threshold: Threshold,
    },
    /// Take the mean of the next good frames as the rest position.
    Tare {
        /// Of the command.
        id: u16,
        /// How many; unchecked.
        frames: u16,
        /// Also when something moves or touches the film.
        anyway: bool,
    },
    /// Take this as the rest position, or none.
    SetTare {
        /// Of the command.
        id: u16,
        /// As it came, unchecked.
        position: Option<RestPosition>,
    },
    /// Follow forces so from the next frame on.
    SetTemporal {
        /// Of the command.
        id: u16,
        /// As they came, unchecked.
        settings: TemporalSettings,
    },
    /// Keep the next whole frame and send it.
    Snapshot(Asked),
    /// Use another model.
    UseModel {
        /// Of the command.
        asked: Asked,
        /// The model.
        next: Chosen,
        /// With its threshold and no tare, whatever is in use.
        afresh: bool,
    },
}

/// Passes an order on; `Busy` when too many wait.
pub fn order(order: Order) -> Option<Outcome> {
    match ORDERS.try_send(order) {
        Ok(()) => None,
        Err(_) => Some(Outcome::Busy),
    }
}
