//! The device-mode registers, by offset from the core's base + 0x800.

use super::{Core, ENDPOINTS};

/// DCTL: D+ is not pulled up.
pub const SOFT_DISCONNECT: u32 = 1 << 1;
/// DSTS: enumerated at full speed.
const FULL_SPEED: u32 = 3 << 1;

/// Register offsets of one endpoint.
const CONTROL: u32 = 0x00;
const INTERRUPT: u32 = 0x08;
const SIZE: u32 = 0x10;
const FIFO_ROOM: u32 = 0x18;

/// Returns the endpoint and the register at an offset from the direction's base, 0x20 bytes each.
/// Returns `None` if the offset is outside.
fn endpoint(offset: u32, base: u32) -> Option<(usize, u32)> {
    let inside = offset.checked_sub(base)?;
    let number = (inside / 0x20) as usize;
    (number < ENDPOINTS).then_some((number, inside % 0x20))
}

impl Core {
    /// Handles a read by the firmware.
    pub(super) fn read_device(&self, offset: u32, now_ns: u64) -> u32 {
        match offset {
            0x00 => self.dcfg,
            0x04 => self.dctl,
            0x08 => {
                FULL_SPEED | u32::from(self.suspended) | ((now_ns / 1_000_000) as u32 & 0x3FFF) << 8
            }
            0x10 => self.diepmsk,
            0x14 => self.doepmsk,
            0x18 => self.endpoint_interrupts(),
            0x1C => self.daintmsk,
            0x34 => self.diepempmsk,
            0x100..=0x21F => endpoint(offset, 0x100)
                .map_or(0, |(number, register)| self.read_in(number, register)),
            0x300..=0x41F => endpoint(offset, 0x300)
                .map_or(0, |(number, register)| self.read_out(number, register)),
            _ => 0,
        }
    }

    fn read_in(&self, number: usize, register: u32) -> u32 {
        let sender = &self.ins[number];
        match register {
            CONTROL => sender.control(number),
            INTERRUPT => sender.interrupts | u32::from(sender.fifo_empty()) << 7,
            SIZE => sender.size,
            FIFO_ROOM => sender.room(self.transmit_fifo[number] >> 16),
            _ => 0,
        }
    }

    fn read_out(&self, number: usize, register: u32) -> u32 {
        let out = &self.outs[number];
        match register {
            CONTROL => out.control(number),
            INTERRUPT => out.interrupts,
            SIZE => out.size,
            _ => 0,
        }
    }

    /// Handles a write by the firmware.
    pub(super) fn write_device(&mut self, offset: u32, value: u32) {
        match offset {
            0x00 => {
                self.dcfg = value;
                if self.dcfg_address() == 0 {
                    self.address = 0;
                }
            }
            0x04 => {
                self.dctl = value;
                self.stuck &= value & SOFT_DISCONNECT == 0;
            }
            0x10 => self.diepmsk = value,
            0x14 => self.doepmsk = value,
            0x1C => self.daintmsk = value,
            0x34 => self.diepempmsk = value,
            0x100..=0x21F => {
                if let Some((number, register)) = endpoint(offset, 0x100) {
                    self.write_in(number, register, value);
                }
            }
            0x300..=0x41F => {
                if let Some((number, register)) = endpoint(offset, 0x300) {
                    self.write_out(number, register, value);
                }
            }
            _ => {}
        }
    }

    fn write_in(&mut self, number: usize, register: u32, value: u32) {
        let sender = &mut self.ins[number];
        match register {
            CONTROL => sender.write_control(value),
            INTERRUPT => sender.interrupts &= !value,
            SIZE => sender.size = value,
            _ => {}
        }
    }

    fn write_out(&mut self, number: usize, register: u32, value: u32) {
        let out = &mut self.outs[number];
        match register {
            CONTROL => out.write_control(value),
            INTERRUPT => out.interrupts &= !value,
            SIZE => out.size = value,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Answer, Packet};
    use super::*;

    /// Returns a device that is set up as far as the transceiver and the connection.
    fn attached() -> Core {
        let mut core = Core {
            clock_hz: 48_000_000,
            wired: true,
            ..Core::default()
        };
        core.write_global(0x0C, 1 << 30);
        core.write_global(0x38, 1 << 16);
        core.write_global(0x00, 1 << 6 | 1 << 7);
        core.write_device(0x04, 0);
        core
    }

    #[test]
    fn attaches_only_with_clock_wires_transceiver_and_soft_connect() {
        assert!(attached().attached());
        assert!(
            !Core {
                clock_hz: 0,
                ..attached()
            }
            .attached()
        );
        assert!(
            !Core {
                wired: false,
                ..attached()
            }
            .attached()
        );
        let mut core = attached();
        core.write_device(0x04, SOFT_DISCONNECT);
        assert!(!core.attached());
        let mut core = attached();
        core.write_global(0x38, 1 << 16 | 1 << 21);
        assert!(!core.attached(), "VBUS is not wired");
    }

    #[test]
    fn a_setup_packet_comes_through_the_receive_fifo() {
        let mut core = attached();
        core.write_global(0x08, 1);
        core.write_global(0x18, 1 << 4);
        assert!(!core.interrupt());
        assert_eq!(core.setup(0, [0x80, 6, 0, 1, 0, 0, 8, 0]), Answer::Ack(()));
        assert!(core.interrupt());
        assert_eq!(core.read_global(0x20), 6 << 17 | 8 << 4);
        assert_eq!(
            [core.read_fifo(), core.read_fifo()],
            [0x0100_0680, 0x0008_0000]
        );
        assert_eq!(core.read_global(0x20), 4 << 17);
        assert_eq!(core.read_device(0x308, 0) & 8, 8);
        assert!(!core.interrupt());
    }

    #[test]
    fn a_new_address_holds_once_the_status_stage_is_over() {
        let mut core = attached();
        core.write_device(0x00, 5 << 4);
        assert_eq!(core.setup(5, [0; 8]), Answer::Silence);
        core.write_device(0x100, 1 << 31 | 1 << 26);
        assert_eq!(core.transmit(0, 0), Answer::Ack(Packet::default()));
        assert_eq!(core.setup(0, [0; 8]), Answer::Silence);
        assert_eq!(core.setup(5, [0; 8]), Answer::Ack(()));
        core.bus_reset();
        assert_eq!(core.setup(0, [0; 8]), Answer::Silence, "not cleared yet");
        core.write_device(0x00, 0);
        assert_eq!(core.setup(0, [0; 8]), Answer::Ack(()));
        core.suspend();
        assert_eq!(core.setup(0, [0; 8]), Answer::Silence);
    }

    #[test]
    fn a_full_receive_fifo_answers_nak() {
        let mut core = attached();
        core.write_global(0x24, 10);
        assert_eq!(core.setup(0, [0; 8]), Answer::Ack(()));
        assert_eq!(core.setup(0, [0; 8]), Answer::Ack(()));
        assert_eq!(core.setup(0, [0; 8]), Answer::Nak);
    }

    #[test]
    fn what_does_not_fit_the_transmit_fifo_is_lost_and_counted() {
        let mut core = attached();
        core.write_global(0x104, 2 << 16);
        (0..3).for_each(|word| core.write_fifo(1, word));
        assert_eq!(core.lost_words, 1);
        assert_eq!(core.read_device(0x138, 0), 0);
    }

    #[test]
    fn reset_suspend_and_resume_raise_their_interrupts() {
        let mut core = attached();
        core.bus_reset();
        core.enumerated();
        assert_eq!(core.read_global(0x14) >> 12 & 3, 3);
        core.write_global(0x14, 3 << 12);
        core.suspend();
        core.suspend();
        assert_eq!(core.read_global(0x14) >> 10 & 3, 3);
        core.write_global(0x14, !0);
        core.resume();
        assert_eq!(core.read_global(0x14) >> 31, 1);
    }
}
