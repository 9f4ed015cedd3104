//! Calls that the instruction counter (`xtask/instruction-counter`) knows by their names.

/// Tells the instruction counter, which knows this function by its name, to count from here on.
#[unsafe(no_mangle)]
#[inline(never)]
pub(super) extern "C" fn counting_begins() {
    core::hint::black_box(1);
}

/// Tells the instruction counter to count no longer.
#[unsafe(no_mangle)]
#[inline(never)]
pub(super) extern "C" fn counting_ends() {
    core::hint::black_box(2);
}

/// Tells the instruction counter that what comes is done after the frame's last pixel has arrived.
#[unsafe(no_mangle)]
#[inline(never)]
pub(super) extern "C" fn last_band_begins() {
    core::hint::black_box(3);
}
