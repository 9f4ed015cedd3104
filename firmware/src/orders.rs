//! Defines the host's orders for the pipeline.

use crate::model::ModelFile;
use crate::session::Origin;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::Outcome;
use hivtac_wire::settings::RestPosition;

/// Orders that wait. From the USB tasks and the memory task to the pipeline.
#[unsafe(link_section = ".sram.orders")]
pub static ORDERS: Channel<CriticalSectionRawMutex, Order, 3> = Channel::new();

/// An order for the pipeline, carried out between two frames. Each is answered with its `id`.
pub enum Order {
    /// Use this threshold and its pixel format as soon as possible.
    SetThreshold {
        /// The command's number.
        id: u16,
        /// The threshold, unchecked.
        threshold: Threshold,
    },
    /// Take the mean of the next good frames as the rest position.
    Tare {
        /// The command's number.
        id: u16,
        /// Number of frames, unchecked.
        frames: u16,
        /// True to accept frames in which something moves or touches the film.
        anyway: bool,
    },
    /// Set the rest position, or remove it.
    SetTare {
        /// The command's number.
        id: u16,
        /// The rest position, unchecked.
        position: Option<RestPosition>,
    },
    /// Set how forces are followed, from the next frame on.
    SetTemporal {
        /// The command's number.
        id: u16,
        /// The settings, unchecked.
        settings: TemporalSettings,
    },
    /// Keep the next whole frame and send it.
    Snapshot(Origin),
    /// Use a different model.
    UseModel {
        /// Who requested it.
        origin: Origin,
        /// The model.
        next: ModelFile,
        /// True to use its threshold and no tare, regardless of those in use.
        afresh: bool,
    },
}

/// Passes an order on; returns `Busy` if too many wait.
pub fn order(order: Order) -> Option<Outcome> {
    match ORDERS.try_send(order) {
        Ok(()) => None,
        Err(_) => Some(Outcome::Busy),
    }
}
