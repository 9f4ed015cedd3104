//! Images for tests.

use crate::image::header::{CRC_AT, Header, Mark, UNSEALED};
use crate::image::{FIRST_STAGE, HEADER_AT, Image, MARK_AT, PROGRAM};

/// The loaded bytes of an ELF: 200 of the first stage, and a program of `length` bytes, at least
/// 0x460, which depend on `seed`.
pub fn loaded(board: &str, version: &str, length: usize, seed: u8) -> Vec<u8> {
    let begin = (PROGRAM - FIRST_STAGE) as usize;
    let mut bytes = vec![0xFF; begin];
    bytes[..200].fill(0x5A);
    put(
        &mut bytes[MARK_AT as usize..],
        &mark(&Mark::of_first_stage(board)),
    );
    bytes.extend((0..length).map(|at| ((at * 31) >> 3) as u8 ^ seed));
    let header = Header::unsealed(board, version);
    let program = &mut bytes[begin..];
    let place = &mut program[HEADER_AT as usize..];
    place[..size_of::<Header>()].fill(0);
    put(place, &mark(&header.mark));
    put(&mut place[size_of::<Mark>()..], &header.version);
    put(&mut program[CRC_AT as usize..], &UNSEALED.to_le_bytes());
    bytes
}

/// Its image.
///
/// # Panics If `length` is below 0x460 bytes or exceeds the flash.
pub fn image(board: &str, version: &str, length: usize, seed: u8) -> Image {
    let image = Image::of_loaded(loaded(board, version, length, seed));
    image.expect("a length in range")
}

fn mark(mark: &Mark) -> Vec<u8> {
    let numbers = [mark.layout, mark.chip].map(u32::to_le_bytes);
    [&mark.magic[..], numbers.as_flattened(), &mark.board].concat()
}

fn put(to: &mut [u8], bytes: &[u8]) {
    to[..bytes.len()].copy_from_slice(bytes);
}
