//! The part's ROM: its unique number, its temperature sensor's calibration, and the loader with its
//! jump to the program in flash.
//!
//! After `dfu-util …:leave` the loader sets the stack pointer and jumps, with its own vector table
//! still in use: the program has to set its own (AN3156). Every vector of the table here except the
//! first leads to a loop.

use std::path::Path;

use rigless::image::Image;

/// First address of the ROM and of its vector table.
pub const BASE: u32 = 0x1FF0_0000;
/// First address of the program.
pub const FLASH: u32 = 0x0800_0000;

/// Number of vectors: the core's 16 and more than the part's interrupts.
const VECTORS: u32 = 256;
const STACK: u32 = 0x2000_1000;
/// ldr r0, flash; ldr r1, [r0]; msr msp, r1; ldr r1, [r0, #4]; bx r1; flash: .word; trap: b trap
const JUMP: [u16; 6] = [0x4802, 0x6801, 0xF381, 0x8808, 0x6841, 0x4708];
const TRAP: u16 = 0xE7FE;
/// mov.w r2, #0x0400_0000; again: subs r2, #1; bne again: 134 million instructions. The number of
/// halfwords is even, because the jump reads its address at a multiple of four.
const WAIT: [u16; 4] = [0xF04F, 0x6280, 0x3A01, 0xD1FD];

/// Returns the 96-bit number that every part is made with, at its address in system memory (RM0433
/// chapter 61).
pub fn unique_id() -> Image {
    image("unique-id", b"hivtac-rig-1".to_vec(), 0x1FF1_E800)
}

/// Returns the temperature sensor's readings at 30 °C and 130 °C, at 3.3 V in 16 bits (TS_CAL1,
/// TS_CAL2). They follow DS12110's typical 0.62 V at 30 °C and 2 mV a degree (table 180), as the
/// emulator's sensor does. 130 °C is that of revision V (ST's HAL, `TEMPSENSOR_CAL2_TEMP`).
pub fn temperature_calibration() -> Image {
    let word = |millivolts: u32| (millivolts * 65_535 / 3_300) as u16;
    let mut bytes = vec![0xFF; 0x22];
    for (at, millivolts) in [(0, 620), (0x20, 820)] {
        bytes[at..at + 2].copy_from_slice(&word(millivolts).to_le_bytes());
    }
    image("temperature-calibration", bytes, 0x1FF1_E820)
}

/// Returns the loader's vectors for a program that starts it (ST, "Jump to bootloader from
/// application on STM32H7 devices"). The transfer of new firmware over USB is not simulated. The
/// part is absent from USB for a while. Then the program in flash is started by a jump, not by a
/// reset, as with `dfu-util …:leave`.
pub fn firmware_loader() -> Image {
    const VECTORS: u32 = 0x1FF0_9800;
    let words = [STACK, VECTORS + 9];
    let mut bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
    bytes.extend(WAIT.into_iter().flat_map(u16::to_le_bytes));
    bytes.extend(JUMP.into_iter().flat_map(u16::to_le_bytes));
    bytes.extend(FLASH.to_le_bytes());
    image("firmware-loader", bytes, VECTORS)
}

/// Returns the loader.
pub fn loader() -> Image {
    let code = BASE + 4 * VECTORS;
    let trap = code + 16;
    let mut bytes: Vec<u8> = [STACK, code + 1]
        .into_iter()
        .chain((2..VECTORS).map(|_| trap + 1))
        .flat_map(u32::to_le_bytes)
        .collect();
    bytes.extend(JUMP.into_iter().flat_map(u16::to_le_bytes));
    bytes.extend(FLASH.to_le_bytes());
    bytes.extend(TRAP.to_le_bytes());
    image("loader", bytes, BASE)
}

fn image(name: &str, bytes: Vec<u8>, address: u32) -> Image {
    Image::new(Path::new(name), bytes, Some(address.into())).expect("plain bytes are an image")
}
