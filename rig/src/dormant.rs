//! Peripherals that the firmware never clocked need not hear of DMA requests.
//!
//! The emulator tells every change of a request line to every timer, converter and serial interface
//! of the part, and each of them searches its wiring. At several changes per DMA word that is most
//! of the time a frame takes. A peripheral whose clock has not been enabled since reset holds
//! nothing and answers nothing, so it is left out. Once enabled it is told everything, for good.

use rigless::soc::Bus;
use rigless::soc::stm32h743::generated::rcc::Register;

/// Peripherals that listen to every request: name, enable register, bit.
const LISTENERS: [(&str, Register, u32); 23] = [
    ("TIM1", Register::Apb2enr, 0),
    ("TIM2", Register::Apb1lenr, 0),
    ("TIM3", Register::Apb1lenr, 1),
    ("TIM4", Register::Apb1lenr, 2),
    ("TIM5", Register::Apb1lenr, 3),
    ("TIM6", Register::Apb1lenr, 4),
    ("TIM7", Register::Apb1lenr, 5),
    ("TIM8", Register::Apb2enr, 1),
    ("TIM12", Register::Apb1lenr, 6),
    ("TIM13", Register::Apb1lenr, 7),
    ("TIM14", Register::Apb1lenr, 8),
    ("TIM15", Register::Apb2enr, 16),
    ("TIM16", Register::Apb2enr, 17),
    ("TIM17", Register::Apb2enr, 18),
    ("SPI1", Register::Apb2enr, 12),
    ("SPI2", Register::Apb1lenr, 14),
    ("SPI3", Register::Apb1lenr, 15),
    ("SPI4", Register::Apb2enr, 13),
    ("SPI5", Register::Apb2enr, 20),
    ("SPI6", Register::Apb4enr, 5),
    ("ADC3", Register::Ahb4enr, 24),
    ("ADC3_Common", Register::Ahb4enr, 24),
    ("ADC12_Common", Register::Ahb1enr, 5),
];

/// Which listeners still sleep.
#[derive(Debug)]
pub struct Dormant {
    rcc: usize,
    asleep: Vec<bool>,
    listeners: Vec<(usize, Register, u32)>,
    /// The enables may have changed since they were looked at.
    stale: bool,
}

impl Dormant {
    /// Every listener of a part out of reset.
    pub fn new(bus: &Bus) -> Self {
        let place = |(name, register, bit)| Some((bus.slot_of(name)?, register, bit));
        let listeners: Vec<_> = LISTENERS.into_iter().filter_map(place).collect();
        let mut asleep = vec![false; bus.slots().len()];
        for (slot, ..) in &listeners {
            asleep[*slot] = true;
        }
        let rcc = bus.slot_of("RCC").expect("the part has an RCC");
        Self {
            rcc,
            asleep,
            listeners,
            stale: false,
        }
    }

    /// Whether the peripheral in a slot was never clocked. Asked before every access and event of
    /// the slot.
    pub fn sleeps(&mut self, slot: usize, bus: &Bus) -> bool {
        if slot == self.rcc {
            // The write, if it is one, lands after this.
            self.stale = true;
            return false;
        }
        let asleep = self.asleep.get(slot).copied().unwrap_or(false);
        if asleep && std::mem::take(&mut self.stale) {
            self.wake(bus);
            return self.asleep[slot];
        }
        asleep
    }

    fn wake(&mut self, bus: &Bus) {
        let registers = bus.slots()[self.rcc].registers();
        for &(slot, register, bit) in &self.listeners {
            if registers.get(register) >> bit & 1 == 1 {
                self.asleep[slot] = false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::{Mcu, Operate};
    use rigless::soc::Width;
    use rigless::soc::stm32h743::Stm32h743;
    use rigless::time::VirtualNanos;

    #[test]
    fn every_listener_is_an_instance_and_its_gate_is_the_named_bit() {
        for (name, register, bit) in LISTENERS {
            let mut part = Stm32h743::new().unwrap();
            let slot = part.bus().slot_of(name).unwrap_or_else(|| panic!("{name}"));
            let mut dormant = Dormant::new(part.bus());
            assert!(dormant.sleeps(slot, part.bus()), "{name}");
            let base = part.bus().slots()[slot].peripheral().base;
            let now = VirtualNanos(0);
            assert!(
                part.read(now, base, Width::W32).is_err(),
                "{name} answers without its clock"
            );
            part.write(now, 0x5802_4400 + offset(register), Width::W32, 1 << bit)
                .unwrap();
            assert!(
                part.read(now, base, Width::W32).is_ok(),
                "{name} does not answer with its clock"
            );
            dormant.sleeps(dormant.rcc, part.bus());
            assert!(!dormant.sleeps(slot, part.bus()), "{name}");
        }
    }

    fn offset(register: Register) -> u64 {
        use rigless::soc::Layout;
        register.spec().offset.into()
    }
}
