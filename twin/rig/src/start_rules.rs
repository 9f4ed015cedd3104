//! Rules for the start of a program: no memory before the supply, and no real-time clock on LSI.

use rigless::emulator::Memory;
use rigless::soc::Width;

use crate::rules::Rules;

/// RM0433: PWR_CR3, RCC_BDCR.
const PWR_CR3: u64 = 0x5802_480C;
const RCC_BDCR: u64 = 0x5802_4470;
/// ITCM, DTCM, and SRAM1 to SRAM3: the first double words that a program may use, and how many are
/// checked, at equal distances.
const MEMORIES: [(&str, u64, u64); 3] = [
    ("ITCM", 0x0000_0040, 0xFFC0),
    ("DTCM", 0x2000_0000, 0x2_0000),
    ("SRAM1", 0x3000_0000, 0x2_0000),
];
const LOOKS: u64 = 64;

/// Steps that must happen once after power-on.
#[derive(Debug, Default)]
pub struct StartRules {
    supplied: bool,
}

impl StartRules {
    /// Handles a write by the core, with the memory as it is then.
    pub fn written(&mut self, address: u64, value: u64, memory: &mut dyn Memory, rules: &Rules) {
        match address {
            PWR_CR3 if !std::mem::replace(&mut self.supplied, true) => {
                if let Some(name) = written_memory(memory) {
                    rules.broken(|| {
                        format!(
                            "PWR: {name} was written before the supply was set up (PWR_CR3), when \
                             its voltage may still be invalid (RM0433, 6.4.1)"
                        )
                    });
                }
            }
            RCC_BDCR if clocks_from_lsi(value) => rules.broken(|| {
                "RCC: the real-time clock runs from LSI (RCC_BDCR), which may then run fast after \
                 a reset, and the watchdog with it (ES0396, 2.2.19)"
                    .to_owned()
            }),
            _ => {}
        }
    }
}

/// Returns whether RCC_BDCR enables the real-time clock with LSI as its source.
fn clocks_from_lsi(value: u64) -> bool {
    value >> 15 & 1 == 1 && value >> 8 & 3 == 2
}

/// Returns the name of a memory that is not as it was at power-on; `None` if all are.
fn written_memory(memory: &mut dyn Memory) -> Option<&'static str> {
    let mut is_written = |base: u64, bytes: u64| {
        (0..LOOKS).any(|nth| {
            let address = base + nth * (bytes / LOOKS) / 8 * 8;
            memory.read(address, Width::W64).is_ok_and(|word| word != 0)
        })
    };
    let found = MEMORIES
        .iter()
        .find(|(_, base, bytes)| is_written(*base, *bytes));
    found.map(|(name, ..)| *name)
}
