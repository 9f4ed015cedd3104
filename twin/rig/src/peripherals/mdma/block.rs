//! Decodes and checks the transfer that a channel's registers describe.

use rigless::emulator::{Error, Memory};
use rigless::soc::Width;

use super::row;

/// ITCM and DTCM, on the controller's AHB port.
const TCM: [std::ops::Range<u64>; 2] = [0..64 << 10, 0x2000_0000..0x2002_0000];

/// One block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// First address of the source.
    pub source: u64,
    /// First address of the destination.
    pub destination: u64,
    /// Size in bytes.
    pub bytes: u64,
}

impl Block {
    /// Moves its bytes, a multiple of eight.
    pub fn copy(&self, memory: &mut dyn Memory) -> Result<(), Error> {
        for offset in (0..self.bytes).step_by(8) {
            let value = memory.read(self.source + offset, Width::W64)?;
            memory.write(self.destination + offset, Width::W64, value)?;
        }
        Ok(())
    }
}

/// Returns the transfer that the registers of a channel describe. `get` reads a register by its
/// row, `control` is the value written to CR. The error describes the fault.
pub fn asked_for(get: &dyn Fn(usize) -> u64, control: u64) -> Result<Block, String> {
    let (tcr, tbr) = (get(row::TCR), get(row::TBR));
    let field = |shift: u32, bits: u32| tcr >> shift & ((1 << bits) - 1);
    simulated(get, control)?;
    let bytes = get(row::BNDTR) & 0x1_FFFF;
    if bytes == 0 || bytes > 65_536 || !bytes.is_multiple_of(8) {
        return Err(format!(
            "a block of {bytes} bytes: use 8 to 65,536, in eights here"
        ));
    }
    let buffer = field(18, 7) + 1;
    let source = Port {
        name: "source",
        address: get(row::SAR),
        size: 1 << field(4, 2),
        burst: field(12, 3),
        ahb: tbr >> 16 & 1 == 1,
    };
    let destination = Port {
        name: "destination",
        address: get(row::DAR),
        size: 1 << field(6, 2),
        burst: field(15, 3),
        ahb: tbr >> 17 & 1 == 1,
    };
    source.check(bytes, buffer)?;
    destination.check(bytes, buffer)?;
    Ok(Block {
        source: source.address,
        destination: destination.address,
        bytes,
    })
}

/// Checks that the simulation supports the transfer.
fn simulated(get: &dyn Fn(usize) -> u64, control: u64) -> Result<(), String> {
    let tcr = get(row::TCR);
    let field = |shift: u32, bits: u32| tcr >> shift & ((1 << bits) - 1);
    let same_size = field(4, 2) == field(6, 2);
    let known = [
        (field(30, 1) == 1, "a hardware trigger (TCR.SWRM = 0)"),
        (field(28, 2) == 1, "another mode than one block (TCR.TRGM)"),
        (get(row::BNDTR) >> 20 == 0, "repeated blocks (BNDTR.BRC)"),
        (get(row::LAR) == 0, "a linked list (LAR)"),
        (
            control >> 12 & 7 == 0,
            "an exchange of bytes (CR.BEX, HEX, WEX)",
        ),
        (
            field(0, 4) == 0b1010,
            "addresses that do not go up (TCR.SINC, DINC)",
        ),
        (
            field(4, 4) == field(8, 4),
            "an offset other than the size (TCR.SINCOS, DINCOS)",
        ),
        (
            same_size || field(25, 1) == 1,
            "sizes without packing (TCR.PKE)",
        ),
    ];
    match known.iter().find(|(ok, _)| !ok) {
        Some((_, what)) => Err(format!("{what} is not simulated")),
        None => Ok(()),
    }
}

/// One end of a transfer.
struct Port {
    name: &'static str,
    address: u64,
    /// Bytes of one access.
    size: u64,
    /// TCR.SBURST or DBURST.
    burst: u64,
    /// Whether it is on the AHB port, as ITCM and DTCM are; otherwise on AXI.
    ahb: bool,
}

impl Port {
    fn check(&self, bytes: u64, buffer: u64) -> Result<(), String> {
        let Port {
            name,
            address,
            size,
            ahb,
            ..
        } = *self;
        if TCM.iter().any(|tcm| tcm.contains(&address)) != ahb {
            let bus = if ahb { "AHB" } else { "AXI" };
            return Err(format!(
                "the {name} {address:#010x} is not on the {bus} bus (TBR)"
            ));
        }
        if ahb && size == 8 {
            return Err(format!("double words at the {name}, on the AHB bus (TCR)"));
        }
        if !address.is_multiple_of(size) || !bytes.is_multiple_of(size) {
            return Err(format!(
                "the {name} {address:#010x} or {bytes} bytes are no multiple of {size}"
            ));
        }
        let burst = size * if self.burst == 0 { 1 } else { 2 << self.burst };
        if !buffer.is_multiple_of(burst) {
            return Err(format!(
                "bursts of {burst} bytes at the {name} do not fill buffers of {buffer} (TCR)"
            ));
        }
        if ahb && !address.is_multiple_of(burst) {
            return Err(format!(
                "the {name} {address:#010x} is no multiple of its bursts of {burst} bytes: one \
                 would cross 1 KiB on the AHB bus"
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decodes the transfer of a band from AXI SRAM to DTCM, with some registers changed.
    fn asked(changes: &[(usize, u64)]) -> Result<Block, String> {
        let tcr = 0b1010 | 3 << 4 | 2 << 6 | 3 << 8 | 2 << 10 | 3 << 12 | 3 << 15 | 127 << 18;
        let usual = [
            (row::TCR, tcr | 1 << 25 | 1 << 28 | 1 << 30),
            (row::BNDTR, 2560),
            (row::SAR, 0x2400_0A00),
            (row::DAR, 0x2000_8000),
            (row::TBR, 1 << 17),
        ];
        let get = |row: usize| {
            let all = changes.iter().chain(&usual);
            let found = all.into_iter().find(|(had, _)| *had == row);
            found.map_or(0, |(_, value)| *value)
        };
        asked_for(&get, 1 << 16 | 1)
    }

    #[test]
    fn a_band_is_a_block() {
        let expected = Block {
            source: 0x2400_0A00,
            destination: 0x2000_8000,
            bytes: 2560,
        };
        assert_eq!(asked(&[]), Ok(expected));
    }

    /// 64 bytes from 0x100 on.
    struct Bytes([u8; 64]);

    impl Bytes {
        fn place(address: u64, width: Width) -> Result<usize, Error> {
            let inside = (0x100..=0x138).contains(&address);
            inside
                .then(|| address as usize - 0x100)
                .ok_or(Error::Memory { address, width })
        }
    }

    impl Memory for Bytes {
        fn read(&mut self, address: u64, width: Width) -> Result<u64, Error> {
            let at = Self::place(address, width)?;
            let bytes = self.0[at..at + 8].try_into().expect("eight");
            Ok(u64::from_le_bytes(bytes))
        }

        fn write(&mut self, address: u64, width: Width, value: u64) -> Result<(), Error> {
            let at = Self::place(address, width)?;
            self.0[at..at + 8].copy_from_slice(&value.to_le_bytes());
            Ok(())
        }
    }

    #[test]
    fn a_block_is_copied_whole_or_an_address_is_no_memory() {
        let block = |source, destination| Block {
            source,
            destination,
            bytes: 24,
        };
        let mut memory = Bytes(std::array::from_fn(|at| at as u8));
        block(0x108, 0x120).copy(&mut memory).unwrap();
        let expected = |at| if (32..56).contains(&at) { at - 24 } else { at };
        assert_eq!(memory.0, std::array::from_fn(|at| expected(at) as u8));
        assert!(block(0x130, 0x100).copy(&mut memory).is_err());
        assert!(block(0x100, 0x130).copy(&mut memory).is_err());
    }

    #[test]
    fn what_the_manual_forbids_is_named() {
        for (change, word) in [
            ((row::TBR, 0), "AXI bus"),
            ((row::TBR, 3 << 16), "0x24000a00 is not on the AHB bus"),
            ((row::SAR, 0x2400_0A04), "no multiple of 8"),
            ((row::DAR, 0x2000_8020), "bursts of 64 bytes"),
            ((row::BNDTR, 2564), "in eights"),
            ((row::BNDTR, 0), "block of 0 bytes"),
            ((row::BNDTR, 2560 | 1 << 20), "BRC"),
            ((row::LAR, 0x2400_0000), "linked list"),
            ((row::TCR, 0), "hardware trigger"),
        ] {
            let error = asked(&[change]).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn double_words_and_long_bursts_in_dtcm_are_refused() {
        let double = 0b1010 | 0xFF0 | 127 << 18 | 1 << 28 | 1 << 30;
        assert!(asked(&[(row::TCR, double)]).unwrap_err().contains("double"));
        let long = 0b1010 | 0xAA0 | 6 << 15 | 127 << 18 | 1 << 28 | 1 << 30;
        assert!(asked(&[(row::TCR, long)]).unwrap_err().contains("bursts"));
    }
}
