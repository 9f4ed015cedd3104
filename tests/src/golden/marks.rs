//! Marker functions for the instruction counter (`xtask/instruction-counter`), which knows their
//! names.

/// Makes the instruction counter, which knows this function by its name, count from here on.
#[unsafe(no_mangle)]
#[inline(never)]
pub(super) extern "C" fn counting_begins() {
    core::hint::black_box(1);
}

/// Makes the instruction counter stop.
#[unsafe(no_mangle)]
#[inline(never)]
pub(super) extern "C" fn counting_ends() {
    core::hint::black_box(2);
}

/// Marks the work after this for the instruction counter as done after the frame's last pixel.
#[unsafe(no_mangle)]
#[inline(never)]
pub(super) extern "C" fn last_band_begins() {
    core::hint::black_box(3);
}
