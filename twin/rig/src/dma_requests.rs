//! Connects the emulator's DMA controllers to DMAMUX1's channels by plain wires, without
//! acknowledgements. (DMA1's slot has a model of its own, `peripherals::dma`, which needs none.)
//!
//! The emulator's controllers acknowledge each word that they move, and each acknowledgement goes
//! to about forty peripherals. With them, a frame takes a third longer. Only functions that an
//! acknowledgement releases or counts need it: requests of timers and of DMAMUX1's generators, and
//! synchronized channels (RM0433, chapter 17). A stream that is enabled on such a channel ends the
//! run with a message. For all other channels, DCMI's among them, an acknowledgement changes
//! nothing; the events that a channel generates only reach generators and synchronized channels.

use std::ops::RangeInclusive;

use rigless::device::RegisterFile;
use rigless::soc::st::dma::{Reach, Requests, STREAMS, Span, Wire};
use rigless::soc::stm32h743::generated::dmamux1::Register;
use rigless::soc::stm32h743::peripherals::dma::Dma;
use rigless::soc::{Access, FieldSpec};

use crate::dma_reach::{Stream, UNREACHABLE};
use crate::rules::Rules;

/// Fields of a channel's CCR.
const REQUEST: u64 = 0x7F;
const SYNCHRONIZED: u64 = 1 << 16;
/// Requests that last until they are acknowledged: the generators', TIM1 to TIM4, TIM8 and TIM5,
/// TIM6 and TIM7, TIM15 to TIM17 (RM0433, table 121).
const ACKNOWLEDGED: [RangeInclusive<u64>; 5] = [1..=8, 11..=32, 47..=60, 69..=70, 105..=112];

/// Reserved bits of a stream's control register. Other parts select the channel there.
const NO_SELECTION: FieldSpec = FieldSpec::new("reserved", 25, 3, Access::ReadOnly);
/// The streams, each in its own list.
const EACH: [[usize; 1]; STREAMS] = [[0], [1], [2], [3], [4], [5], [6], [7]];
const WIRES: [[Wire; STREAMS]; 2] = [wires(0), wires(STREAMS)];
const OUT_OF_REACH: [Span; 2] = [span(0), span(1)];

/// Returns the wires of DMAMUX1's channels from `first` on, one to each stream.
const fn wires(first: usize) -> [Wire; STREAMS] {
    let mut wires = [Wire {
        instance: "DMAMUX1",
        request: first,
        channel: 0,
        streams: &EACH[0],
    }; STREAMS];
    let mut stream = 1;
    while stream < STREAMS {
        wires[stream].request = first + stream;
        wires[stream].streams = &EACH[stream];
        stream += 1;
    }
    wires
}

const fn span(number: usize) -> Span {
    let (_, base, bytes) = UNREACHABLE[number];
    Span { base, bytes }
}

/// Returns DMA1 and DMA2, out of reset.
pub fn controllers() -> [Dma; 2] {
    WIRES.each_ref().map(|wiring| {
        let requests = Requests::Channels {
            wiring,
            last_data: &[],
            select: &NO_SELECTION,
        };
        let reach = Reach {
            memory_to_memory: true,
            unreachable: &OUT_OF_REACH,
        };
        Dma::wired(requests, reach)
    })
}

/// Notes a breach if an enabled stream would need acknowledgements. `multiplexer` are DMAMUX1's
/// registers.
pub fn check(stream: Stream, multiplexer: &RegisterFile, rules: &Rules) {
    let first = if stream.controller == "DMA1" {
        0
    } else {
        STREAMS
    };
    let channel = first + stream.number as usize;
    let control = multiplexer.get(Register::ALL[channel]);
    let request = control & REQUEST;
    let counts = control & SYNCHRONIZED != 0;
    if counts || ACKNOWLEDGED.iter().any(|range| range.contains(&request)) {
        rules.broken(|| {
            format!(
                "DMAMUX1 channel {channel} is set to {control:#x}: not simulated: requests of \
                 timers and generators, and synchronization"
            )
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::Mcu;
    use rigless::soc::stm32h743::Stm32h743;

    const DCMI: u64 = 75;
    const UART: u64 = 46;
    const EVENTS: u64 = 1 << 9;

    /// Returns whether a breach is noted when a stream is enabled on a channel with these settings.
    fn breach(controller: &'static str, number: u64, channel: Register, control: u64) -> bool {
        let mut part = Stm32h743::new().unwrap();
        let slot = part.bus().slot("DMAMUX1").unwrap();
        let registers = part.bus_mut().slot_mut(slot).registers_mut();
        registers.set(channel, control);
        let rules = Rules::default();
        check(Stream { controller, number }, registers, &rules);
        rules.first().is_some()
    }

    #[test]
    fn a_stream_of_dcmi_needs_no_acknowledgement() {
        assert!(!breach("DMA1", 1, Register::DmamuxC1cr, DCMI));
        assert!(!breach("DMA2", 1, Register::DmamuxC9cr, DCMI));
        assert!(!breach("DMA2", 0, Register::DmamuxC8cr, UART | EVENTS));
    }

    #[test]
    fn a_stream_that_would_wait_for_one_is_refused() {
        for control in [DCMI | SYNCHRONIZED, 1, 8, 11, 60, 70, 112] {
            assert!(
                breach("DMA1", 1, Register::DmamuxC1cr, control),
                "{control}"
            );
            assert!(
                breach("DMA2", 7, Register::DmamuxC15cr, control),
                "{control}"
            );
        }
    }
}
