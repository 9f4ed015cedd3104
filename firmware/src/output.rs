//! Drives the output pin, which shows contact, slip or a force limit without a host
//! ([`hivtac_terms::temporal::Output`]).

use crate::board::OUTPUT;

/// Makes the pin high or low. One write, from any task.
pub fn set(is_high: bool) {
    let (port, pin) = OUTPUT;
    port.bsrr().write(|register| match is_high {
        true => register.set_bs(pin, true),
        false => register.set_br(pin, true),
    });
}
