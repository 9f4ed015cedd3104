//! Measures the stack's largest use: the start paints it (`cortex-m-rt`), and use overwrites the
//! paint.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    /// From `memory.x`: the stack's lowest word, and the one above its highest.
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Size of the stack, bytes.
pub fn bytes() -> u32 {
    (&raw const _stack_start as u32).wrapping_sub(&raw const _stack_end as u32)
}

/// Largest number of bytes in use since the start.
pub fn used() -> u32 {
    let lowest = &raw const _stack_end;
    let words = bytes() / 4;
    let is_painted = |word: &u32| {
        let at = lowest.wrapping_add(*word as usize);
        // SAFETY: a word of the stack's own memory; volatile as it may change meanwhile.
        unsafe { at.read_volatile() == STACK_PAINT_VALUE }
    };
    let free = (0..words).take_while(is_painted).count() as u32;
    4 * (words - free)
}
