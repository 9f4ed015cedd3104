//! The memories after a power-on: contents on which no program may rely.

use rigless::emulator::Memory;
use rigless::soc::Width;

/// The end of DTCM, which programs use to keep data through a reset. By seed it has other contents
/// at each power-on. The rest is zero, so that `start_rules` sees writes that came too early.
const KEPT: std::ops::Range<u32> = 0x2001_FF80..0x2002_0000;
/// Memories, with their sizes in bytes.
const MEMORIES: [(u64, u64); 4] = [
    (0x0000_0000, 64 << 10),
    (0x2000_0000, 128 << 10),
    (0x2400_0000, 512 << 10),
    (0x3000_0000, 288 << 10),
];

/// Cuts the power of the memories for a moment.
pub fn forget(memory: &mut dyn Memory, seed: u64) {
    for (begin, bytes) in MEMORIES {
        for address in (begin..begin + bytes).step_by(8) {
            // All of them are memory.
            let _ = memory.write(address, Width::W64, 0);
        }
    }
    leave(memory, !seed);
}

/// Puts the contents after a power-on into memories of zeros.
pub fn leave(memory: &mut dyn Memory, seed: u64) {
    for (address, word) in KEPT.step_by(8).zip(noise(seed)) {
        let _ = memory.write(address.into(), Width::W64, word);
    }
}

/// Words by a linear congruence (Knuth's MMIX).
fn noise(seed: u64) -> impl Iterator<Item = u64> {
    let next = move |word: &u64| {
        Some(
            word.wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(seed | 1),
        )
    };
    let words = std::iter::successors(Some(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15)), next);
    words.skip(8).take(KEPT.len() / 8)
}
