//! Describes the OmniVision OV5640.

use super::identity;
use super::omnivision::{Held, Light, Part};
use super::ov5640_registers::{
    BEGIN, CONTROL, END, LEVEL, LIGHT, MANUAL_EXPOSURE, MANUAL_GAIN, MOST_AUTOMATIC_GAIN, NEEDED,
    RESET, TABLE, clock, format, white,
};
use super::registers::few;
use hivtac_portable::device::camera::ov5640::{FACTS, ROWS, WHITE};
use hivtac_terms::units::Sixteenths;

/// The camera.
pub const PART: Part = Part {
    identity: identity::OV5640,
    facts: FACTS,
    white: WHITE,
    reset: RESET,
    begin: BEGIN,
    table: TABLE,
    end: END,
    needed: NEEDED,
    format,
    clock,
    whiten: white,
    control: CONTROL,
    automatic: |exposure, gain| {
        let bit = |is_automatic, bit| if is_automatic { 0 } else { bit };
        bit(exposure, MANUAL_EXPOSURE) | bit(gain, MANUAL_GAIN)
    },
    light: &LIGHT,
    light_of,
    held_of,
    level: LEVEL,
    most_automatic_gain: MOST_AUTOMATIC_GAIN,
    rows: ROWS,
};

/// Exposure has 20 bits, in sixteenths of a line; gain ten, in sixteenths.
fn light_of(held: &[u8]) -> Light {
    let at = |index| held.get(index).copied().map_or(0, u32::from);
    let sixteenths = at(0) << 16 | at(1) << 8 | at(2);
    Light {
        lines: (sixteenths >> 4) as u16,
        gain: Sixteenths((at(3) << 8 | at(4)) as u16),
    }
}

fn held_of(Light { lines, gain }: Light) -> Held {
    let [_, high, middle, low] = (u32::from(lines) << 4).to_be_bytes();
    let [gain_high, gain_low] = gain.0.to_be_bytes();
    few([high, middle, low, gain_high, gain_low])
}
