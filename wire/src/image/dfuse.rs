//! Writes firmware files for other tools that use the chip's loader: ST's DfuSe format (UM0391).

use super::Image;
use crate::image::{FIRST_STAGE, PROGRAM};

/// Identity of the loader: vendor, product.
const LOADER: [u16; 2] = [0x0483, 0xDF11];
/// Version of the format of the suffix, BCD.
const DFU: u16 = 0x011A;
/// Bytes of a target's name.
const NAME_BYTES: usize = 255;
const SUFFIX_BYTES: u8 = 16;

impl Image {
    /// The image as a `.dfu` file: first stage and program, each with its address, without the
    /// blank flash between them. For `dfu-util` and STM32CubeProgrammer, which erase the sectors
    /// that a file fills.
    pub fn dfuse(&self) -> Vec<u8> {
        let elements = [(FIRST_STAGE, self.first_stage()), (PROGRAM, self.program())];
        let mut target = Vec::new();
        for (address, bytes) in elements {
            target.extend(address.to_le_bytes());
            target.extend((bytes.len() as u32).to_le_bytes());
            target.extend(bytes);
        }
        let mut name = format!("{} {}", self.board(), self.version()).into_bytes();
        name.resize(NAME_BYTES, 0);
        let mut targets = b"Target\0".to_vec();
        targets.extend(1u32.to_le_bytes());
        targets.extend(name);
        targets.extend((target.len() as u32).to_le_bytes());
        targets.extend((elements.len() as u32).to_le_bytes());
        targets.extend(target);
        let mut file = b"DfuSe\x01".to_vec();
        // With the length itself and the number of targets.
        let length = file.len() + size_of::<u32>() + 1 + targets.len();
        file.extend((length as u32).to_le_bytes());
        file.push(1);
        file.extend(targets);
        let [vendor, product] = LOADER;
        // Any version of the device.
        for number in [0, product, vendor, DFU] {
            file.extend(number.to_le_bytes());
        }
        file.extend(b"UFD");
        file.push(SUFFIX_BYTES);
        // Without the inversion at the end that the usual CRC-32 has.
        let crc = !crc32fast::hash(&file);
        file.extend(crc.to_le_bytes());
        file
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::examples;

    /// The places of UM0391; `dfu-suffix -c` and `dfu-util` read such files.
    #[test]
    fn a_file_has_both_parts_with_their_addresses() {
        let image = examples::image("board", "1.2.3", 5_000, 3);
        let file = image.dfuse();
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        assert_eq!(&file[..6], b"DfuSe\x01");
        assert_eq!(word(6) as usize, file.len() - 16);
        assert_eq!(&file[11..18], b"Target\0");
        assert_eq!(&file[22..33], b"board 1.2.3");
        let (first, rest) = (word(289) as usize, 285);
        assert_eq!(
            (word(rest), first),
            (FIRST_STAGE, image.first_stage().len())
        );
        let program = 293 + first;
        assert_eq!(
            (word(program), word(program + 4) as usize),
            (PROGRAM, image.program().len())
        );
        assert_eq!(&file[program + 8..file.len() - 16], image.program());
        assert_eq!(word(277) as usize, file.len() - 16 - 285);
        assert_eq!(word(281), 2);
        let crc = word(file.len() - 4);
        assert_eq!(crc, !crc32fast::hash(&file[..file.len() - 4]));
    }
}
