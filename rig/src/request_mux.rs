//! The DMA request multiplexer, spared what the camera interface's words tell it.
//!
//! The emulator's DMA acknowledges each word that it moves, and its multiplexer then searches all
//! wires and passes the acknowledgement on to the peripheral. DCMI has no use for it: of a channel
//! that carries DCMI's request, neither synchronized nor generating events, an acknowledgement
//! changes nothing (RM0433 chapter 17), and is dropped.

use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::stm32h743::generated::dmamux1::Register;
use rigless::soc::stm32h743::peripherals::dmamux::Dmamux1;

/// The request of DCMI (RM0433, table 121).
const DCMI_REQUEST: u64 = 75;
/// Fields of a channel's CCR.
const REQUEST: u64 = 0x7F;
const EVENTS: u64 = 1 << 9;
const SYNCHRONIZED: u64 = 1 << 16;
/// Streams of a controller, each with a channel.
const STREAMS: usize = 8;

/// The multiplexer of DMA1 and DMA2.
#[derive(Debug, Default)]
pub struct RequestMux(Dmamux1);

/// Whether a change is one that changes nothing.
fn is_needless(change: &RequestChange, registers: &RegisterFile) -> bool {
    let first = match change.instance {
        "DMA1" => 0,
        "DMA2" => STREAMS,
        _ => return false,
    };
    if change.request >= STREAMS {
        return false;
    }
    let control = registers.get(Register::ALL[first + change.request]);
    control & (REQUEST | EVENTS | SYNCHRONIZED) == DCMI_REQUEST
}

impl Device for RequestMux {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        Device::write(&mut self.0, register, value, registers, context);
    }

    fn on_request(
        &mut self,
        change: RequestChange,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if !is_needless(&change, registers) {
            Device::on_request(&mut self.0, change, registers, context);
        }
    }

    fn reset(&mut self) {
        Device::reset(&mut self.0);
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.0, registers, context);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::device::Level;
    use rigless::mcu::Mcu;
    use rigless::soc::stm32h743::Stm32h743;

    /// Whether an acknowledgement is needless while channel 9 is set up so.
    fn needless(instance: &'static str, request: usize, control: u64) -> bool {
        let mut part = Stm32h743::new().unwrap();
        let slot = part.bus().slot("DMAMUX1").unwrap();
        let registers = part.bus_mut().slot_mut(slot).registers_mut();
        registers.set(Register::DmamuxC9cr, control);
        let change = RequestChange {
            instance,
            request,
            level: Level::High,
        };
        is_needless(&change, registers)
    }

    #[test]
    fn what_the_controller_says_of_a_word_of_dcmi_is_needless() {
        assert!(needless("DMA2", 1, DCMI_REQUEST));
    }

    #[test]
    fn what_anything_else_says_is_heard() {
        for (instance, request, control) in [
            ("DMA2", 0, DCMI_REQUEST),
            ("DMA1", 1, DCMI_REQUEST),
            ("DMA2", 9, DCMI_REQUEST),
            ("DCMI", 1, DCMI_REQUEST),
            ("DMA2", 1, DCMI_REQUEST + 1),
            ("DMA2", 1, DCMI_REQUEST | EVENTS),
            ("DMA2", 1, DCMI_REQUEST | SYNCHRONIZED),
        ] {
            assert!(
                !needless(instance, request, control),
                "{instance} {request} {control:#x}"
            );
        }
    }
}
