//! Describes the OmniVision OV7725.

use super::identity;
use super::omnivision::{Held, Light, Part};
use super::ov7725_registers::{
    AUTOMATIC_EXPOSURE, AUTOMATIC_GAIN, COM7, COM7_RESET, COM8, EXPOSURE, LEVEL, LOCKED,
    MOST_AUTOMATIC_GAIN, NEEDED, TABLE, clock, format, white,
};
use super::registers::few;
use hivtac_portable::device::camera::ov7725::{FACTS, ROWS};
use hivtac_terms::camera::White;
use hivtac_terms::units::Sixteenths;

/// The camera.
pub const PART: Part = Part {
    identity: identity::OV7725,
    facts: FACTS,
    white: White::USUAL,
    reset: &[(COM7, COM7_RESET)],
    begin: &[],
    table: TABLE,
    end: &[],
    needed: NEEDED,
    format,
    clock,
    whiten: white,
    control: COM8,
    automatic: |exposure, gain| {
        let bit = |is_automatic, bit| if is_automatic { bit } else { 0 };
        LOCKED | bit(exposure, AUTOMATIC_EXPOSURE) | bit(gain, AUTOMATIC_GAIN)
    },
    light: &EXPOSURE,
    light_of,
    held_of,
    level: LEVEL,
    most_automatic_gain: MOST_AUTOMATIC_GAIN,
    rows: ROWS,
};

fn light_of(held: &[u8]) -> Light {
    let at = |index| held.get(index).copied().unwrap_or_default();
    Light {
        lines: u16::from_le_bytes([at(1), at(2)]),
        gain: gain_of(at(0)),
    }
}

fn held_of(Light { lines, gain }: Light) -> Held {
    let [low, high] = lines.to_le_bytes();
    few([register_of(gain), low, high])
}

/// The gain of a register value: each of the upper four bits doubles it, the lower four add
/// sixteenths.
fn gain_of(register: u8) -> Sixteenths {
    Sixteenths((16 + u16::from(register & 0x0F)) << (register >> 4).count_ones())
}

/// The register value of the next lower gain, at most four.
fn register_of(Sixteenths(gain): Sixteenths) -> u8 {
    match gain {
        ..32 => gain.saturating_sub(16) as u8,
        32..64 => 0x10 | (gain / 2 - 16) as u8,
        64.. => 0x30,
    }
}
