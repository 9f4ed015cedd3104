//! Shares the sensor's condition with LED and self-test.

use crate::output;
use core::sync::atomic::{AtomicU8, Ordering};

/// A [`Condition`]. Written by the pipeline and the capture task; read by the LED task and the
/// memory task.
static CONDITION: AtomicU8 = AtomicU8::new(Condition::NoCamera as u8);

/// The sensor's condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Condition {
    /// The camera does not answer or sends nothing.
    NoCamera = 0,
    /// Frames arrive but give no force.
    NoForce = 1,
    /// Frames give forces.
    Good = 2,
}

/// Sets the sensor's condition. Without a camera the output pin is low.
pub fn set(condition: Condition) {
    CONDITION.store(condition as u8, Ordering::Relaxed);
    if condition == Condition::NoCamera {
        output::set(false);
    }
}

/// Returns the sensor's condition.
pub fn get() -> Condition {
    match CONDITION.load(Ordering::Relaxed) {
        condition if condition == Condition::Good as u8 => Condition::Good,
        condition if condition == Condition::NoForce as u8 => Condition::NoForce,
        _ => Condition::NoCamera,
    }
}
