//! The rule that DMA buffers must lie within the reach of the chip's DMA controllers.
//!
//! RM0433 table 3: DMA1 and DMA2 reach the peripherals, AXI SRAM, SRAM1 to SRAM4, backup SRAM and
//! flash, but neither ITCM nor DTCM. Silicon ends such a transfer with a transfer error. Here it
//! ends the run with a message that names the stream and the address, even if no byte would move.

use rigless::device::RegisterFile;

use crate::memory_types::MemoryTypes;
use crate::rules::Rules;

/// Memory out of the DMA controllers' reach: name, start, bytes.
pub const UNREACHABLE: [(&str, u64, u64); 2] =
    [("ITCM", 0, 64 << 10), ("DTCM", 0x2000_0000, 128 << 10)];
/// Bases of DMA1 and DMA2.
const CONTROLLERS: [(&str, u64); 2] = [("DMA1", 0x4002_0000), ("DMA2", 0x4002_0400)];
/// Offset of the first stream's registers, and of each next one: CR, NDTR, PAR, M0AR, M1AR, FCR.
const FIRST_STREAM: u64 = 0x10;
const STREAM: u64 = 0x18;
/// DMA_SxCR bits.
const ENABLE: u64 = 1;
const DOUBLE_BUFFER: u64 = 1 << 18;
/// First bits of MSIZE, log2 of a word's bytes, and of DIR, 1 for memory to peripheral.
const MEMORY_SIZE: u32 = 13;
const DIRECTION: u32 = 6;

/// The registers of one stream, in rows of the vendor's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stream {
    /// The controller's name.
    pub controller: &'static str,
    /// The stream's number.
    pub number: u64,
}

/// Returns the stream that a write to its control register enables; `None` for any other write.
pub fn enabled_stream(address: u64, value: u64) -> Option<Stream> {
    let (controller, base) = *CONTROLLERS
        .iter()
        .find(|(_, base)| (*base..*base + 0x400).contains(&address))?;
    let offset = (address - base).checked_sub(FIRST_STREAM)?;
    let control = offset.is_multiple_of(STREAM) && offset / STREAM < 8;
    (control && value & ENABLE != 0).then_some(Stream {
        controller,
        number: offset / STREAM,
    })
}

/// Returns the value of a stream's register at an offset.
fn value_at(stream: Stream, offset: u64, registers: &[(u64, u64)]) -> u64 {
    let offset = FIRST_STREAM + stream.number * STREAM + offset;
    let mut had = registers.iter().filter(|(had, _)| *had == offset);
    had.next().map_or(0, |(_, value)| *value)
}

/// Notes a breach if a stream's memory addresses are out of reach. `registers` are those of its
/// controller; `control` is the value written to its control register.
pub fn check(stream: Stream, control: u64, registers: &[(u64, u64)], rules: &Rules) {
    let at = |offset: u64| value_at(stream, offset, registers);
    let second = (control & DOUBLE_BUFFER != 0).then(|| ("M1AR", at(0x10)));
    let addresses = [Some(("PAR", at(0x08))), Some(("M0AR", at(0x0C))), second];
    for (register, address) in addresses.into_iter().flatten() {
        let memory = UNREACHABLE
            .iter()
            .find(|(_, base, size)| (*base..base + size).contains(&address));
        if let Some((memory, ..)) = memory {
            let Stream { controller, number } = stream;
            rules.broken(|| {
                format!(
                    "{controller} stream {number} is enabled with {register} = {address:#010x}, \
                     which is in {memory}: DMA1 and DMA2 cannot reach it (RM0433 table 3). Put the \
                     buffer into AXI SRAM or SRAM1 to SRAM3"
                )
            });
        }
    }
}

/// Notes a breach if a stream's memory is cacheable.
pub fn check_types(
    stream: Stream,
    control: u64,
    registers: &[(u64, u64)],
    types: &MemoryTypes,
    rules: &Rules,
) {
    let Stream { controller, number } = stream;
    let bytes = value_at(stream, 0x04, registers) << (control >> MEMORY_SIZE & 3);
    let is_to_memory = control >> DIRECTION & 3 != 1;
    let second = (control & DOUBLE_BUFFER != 0).then_some(0x10);
    for offset in [Some(0x0C), second].into_iter().flatten() {
        let memory = Some((value_at(stream, offset, registers), bytes));
        let (source, target) = match is_to_memory {
            true => (None, memory),
            false => (memory, None),
        };
        let name = format_args!("{controller} stream {number}");
        types.check_dma(name, source, target, rules);
    }
}

/// Returns offsets and values of every register of a controller.
pub fn values(registers: &RegisterFile) -> Vec<(u64, u64)> {
    use rigless::soc::Layout;
    use rigless::soc::stm32h743::generated::dma1::Register;
    let row = |register: Register| (u64::from(register.spec().offset), registers.get(register));
    Register::ALL.into_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_enabling_write_of_a_control_register_counts() {
        let dma2_stream_1 = 0x4002_0400 + 0x28;
        assert_eq!(
            enabled_stream(dma2_stream_1, 1),
            Some(Stream {
                controller: "DMA2",
                number: 1
            })
        );
        assert_eq!(enabled_stream(dma2_stream_1, 2), None);
        assert_eq!(enabled_stream(dma2_stream_1 + 4, 1), None);
        assert_eq!(enabled_stream(0x4002_0008, 1), None);
        assert_eq!(enabled_stream(0x4002_0800, 1), None);
    }

    fn breach(control: u64, m0: u64, m1: u64) -> Option<String> {
        let rules = Rules::default();
        let registers = [(0x18, 0x4802_0028), (0x1C, m0), (0x20, m1)];
        check(
            Stream {
                controller: "DMA1",
                number: 0,
            },
            control,
            &registers,
            &rules,
        );
        rules.first()
    }

    #[test]
    fn a_buffer_in_dtcm_is_named_and_one_in_axi_sram_is_not() {
        assert_eq!(breach(1, 0x2400_0000, 0), None);
        assert_eq!(breach(1, 0x3000_0000, 0x2000_0000), None);
        let message = breach(1, 0x2001_FFFC, 0).unwrap();
        assert!(
            message.contains("DTCM")
                && message.contains("0x2001fffc")
                && message.contains("DMA1 stream 0"),
            "{message}"
        );
        assert!(
            breach(1 | DOUBLE_BUFFER, 0x2400_0000, 0x2000_0000)
                .unwrap()
                .contains("M1AR")
        );
    }
}
