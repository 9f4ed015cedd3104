//! Writes, reads back and compares tables of a camera's registers.

use super::identity::Identity;
use super::{Bus, Device, Error};
use crate::log;
use embassy_stm32::i2c;
use embassy_time::{Duration, Timer};
use heapless::Vec;
use hivtac_wire::message::{DIFFERENT_REGISTERS, DifferentRegister, LogLevel};

/// Pause between two register transfers while capture is stopped: lets tasks of lower priority run.
const PAUSE: Duration = Duration::from_micros(100);
/// The same while frames are captured. A transfer blocks the pipeline for a third of a millisecond,
/// and it must not fall behind.
const PAUSE_WHILE_CAPTURING: Duration = Duration::from_millis(5);

/// A register's value, and how it is transferred.
pub trait Value: Copy + PartialEq + Into<u16> {
    /// Writes it to a device's register.
    fn write(self, bus: &mut Bus, device: Device, register: u16) -> Result<(), i2c::Error>;
    /// Reads a device's register.
    fn read(bus: &mut Bus, device: Device, register: u16) -> Result<Self, i2c::Error>;
}

impl Value for u8 {
    fn write(self, bus: &mut Bus, device: Device, register: u16) -> Result<(), i2c::Error> {
        bus.write_byte(device, register, self)
    }

    fn read(bus: &mut Bus, device: Device, register: u16) -> Result<Self, i2c::Error> {
        bus.read_byte(device, register)
    }
}

impl Value for u16 {
    fn write(self, bus: &mut Bus, device: Device, register: u16) -> Result<(), i2c::Error> {
        bus.write_word(device, register, self)
    }

    fn read(bus: &mut Bus, device: Device, register: u16) -> Result<Self, i2c::Error> {
        bus.read_word(device, register)
    }
}

/// Registers and the values that are written to them, in this order.
pub type Table<V> = [(u16, V)];

/// Collects values; those for which there is no room are left out.
pub fn few<T, const N: usize>(values: impl IntoIterator<Item = T>) -> Vec<T, N> {
    let mut few = Vec::new();
    for value in values {
        if few.push(value).is_err() {
            break;
        }
    }
    few
}

/// Which registers must hold what was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// All: a camera that just lost its supply has lost each of them.
    All,
    /// Those without which no frame can be read. Reserved bits of the others may have values of
    /// their own.
    Needed,
}

/// The registers of the camera in use. All functions return an error if the camera does not answer.
pub struct Registers {
    /// The bus to the camera.
    pub bus: Bus,
    device: Device,
    /// Registers, and their bits without which no frame can be read.
    needed: &'static Table<u16>,
    demand: Demand,
    differ: bool,
}

impl Registers {
    /// Demands all registers.
    pub fn new(bus: Bus, of: &Identity) -> Self {
        Self {
            bus,
            device: of.device,
            needed: &[],
            demand: Demand::All,
            differ: false,
        }
    }

    /// Begins a set-up of this camera. `needed` has the registers, with their bits, without which
    /// no frame can be read.
    pub fn begin(&mut self, of: &Identity, needed: &'static Table<u16>, demand: Demand) {
        (self.device, self.needed) = (of.device, needed);
        (self.demand, self.differ) = (demand, false);
    }

    /// Returns whether a register read back otherwise than written since the set-up began.
    pub fn differ(&self) -> bool {
        self.differ
    }

    /// Writes one register.
    pub fn write(&mut self, register: u16, value: impl Value) -> Result<(), Error> {
        Ok(value.write(&mut self.bus, self.device, register)?)
    }

    /// Reads one register.
    pub fn read<V: Value>(&mut self, register: u16) -> Result<V, Error> {
        Ok(V::read(&mut self.bus, self.device, register)?)
    }

    /// Writes a table.
    pub async fn write_all(&mut self, table: &Table<impl Value>) -> Result<(), Error> {
        for (register, value) in table {
            self.write(*register, *value)?;
            Timer::after(PAUSE).await;
        }
        Ok(())
    }

    /// Writes a table and reads it back.
    ///
    /// # Errors
    /// A register that must hold what was written, and does not.
    pub async fn set<V: Value>(&mut self, table: &Table<V>) -> Result<(), Error> {
        self.write_all(table).await?;
        for (address, value) in table {
            let found = self.read::<V>(*address)?;
            if found != *value {
                self.judge(*address, (*value).into(), found.into())?;
            }
            Timer::after(PAUSE).await;
        }
        Ok(())
    }

    /// Judges a register that reads back otherwise than written.
    fn judge(&mut self, address: u16, written: u16, found: u16) -> Result<(), Error> {
        let mut needed = self.needed.iter();
        let needed = needed.find_map(|(register, bits)| (*register == address).then_some(*bits));
        let is_needed = (written ^ found) & needed.unwrap_or(0) != 0;
        let error = Error::Register { address, found };
        if is_needed || self.demand == Demand::All {
            return Err(error);
        }
        self.differ = true;
        log::say(LogLevel::Warning, format_args!("camera: {error}; used so"));
        Ok(())
    }

    /// Reads back registers that `tables` wrote one after the other, while frames are captured.
    pub async fn compare<V: Value>(&mut self, tables: &[&Table<V>]) -> Result<Comparison, Error> {
        let mut comparison = Comparison::default();
        for (written_so_far, table) in (1..).zip(tables) {
            let later = tables.get(written_so_far..).unwrap_or_default();
            for (address, value) in *table {
                let address = *address;
                if later.iter().any(|table| has(table, address)) {
                    continue;
                }
                comparison.count(address, *value, self.read(address)?);
                Timer::after(PAUSE_WHILE_CAPTURING).await;
            }
        }
        Ok(comparison)
    }
}

fn has<V>(table: &Table<V>, address: u16) -> bool {
    table.iter().any(|(register, _)| *register == address)
}

/// Registers compared with the written values.
#[derive(Default)]
pub struct Comparison {
    /// Number of registers that were compared.
    pub registers: u16,
    /// The first of those that differ.
    pub different: Vec<DifferentRegister, DIFFERENT_REGISTERS>,
}

impl Comparison {
    fn count<V: Value>(&mut self, address: u16, written: V, found: V) {
        self.registers = self.registers.saturating_add(1);
        if found != written {
            // Registers beyond the vector's capacity are not reported: the camera has then lost all
            // of them.
            let _ = self.different.push(DifferentRegister {
                address,
                written: written.into(),
                found: found.into(),
            });
        }
    }
}
