//! A camera's registers: tables of them written, read back and compared.

use super::{Bus, Error, IDENTITY};
use embassy_stm32::i2c;
use embassy_time::{Duration, Timer};
use heapless::Vec;
use hivtac_wire::message::{DIFFERENT_REGISTERS, DifferentRegister};

/// Between two register transfers while nothing is captured: lets tasks of lower priority run.
const PAUSE: Duration = Duration::from_micros(100);
/// The same while frames are captured: a transfer holds the pipeline up for a third of a
/// millisecond, and it must not fall behind.
const PAUSE_WHILE_CAPTURING: Duration = Duration::from_millis(5);

/// What a register holds, and how that travels.
pub trait Value: Copy + PartialEq + Into<u16> {
    /// Writes it to a device's register.
    fn write(self, bus: &mut Bus, device: u8, register: u8) -> Result<(), i2c::Error>;
    /// Reads a device's register.
    fn read(bus: &mut Bus, device: u8, register: u8) -> Result<Self, i2c::Error>;
}

impl Value for u8 {
    fn write(self, bus: &mut Bus, device: u8, register: u8) -> Result<(), i2c::Error> {
        bus.write_byte(device, register, self)
    }

    fn read(bus: &mut Bus, device: u8, register: u8) -> Result<Self, i2c::Error> {
        bus.read_byte(device, register)
    }
}

impl Value for u16 {
    fn write(self, bus: &mut Bus, device: u8, register: u8) -> Result<(), i2c::Error> {
        bus.write_word(device, register, self)
    }

    fn read(bus: &mut Bus, device: u8, register: u8) -> Result<Self, i2c::Error> {
        bus.read_word(device, register)
    }
}

/// Register, value: what is written, in this order.
pub type Table<V> = [(u8, V)];

/// The registers of the camera in use. All of it fails when the camera does not answer.
pub struct Registers(pub Bus);

impl Registers {
    /// Writes one.
    pub fn write(&mut self, register: u8, value: impl Value) -> Result<(), Error> {
        Ok(value.write(&mut self.0, IDENTITY.address, register)?)
    }

    /// Reads one.
    pub fn read<V: Value>(&mut self, register: u8) -> Result<V, Error> {
        Ok(V::read(&mut self.0, IDENTITY.address, register)?)
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
    pub async fn set<V: Value>(&mut self, table: &Table<V>) -> Result<(), Error> {
        self.write_all(table).await?;
        for (address, value) in table {
            let (address, found) = (*address, self.read::<V>(*address)?);
            if found != *value {
                let found = found.into();
                return Err(Error::Register { address, found });
            }
            Timer::after(PAUSE).await;
        }
        Ok(())
    }

    /// Reads back what tables wrote that were written one after the other, while frames are
    /// captured.
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

fn has<V>(table: &Table<V>, address: u8) -> bool {
    table.iter().any(|(register, _)| *register == address)
}

/// What registers hold beside what was written.
#[derive(Default)]
pub struct Comparison {
    /// How many were compared.
    pub registers: u16,
    /// Those that differ, the first of them.
    pub different: Vec<DifferentRegister, DIFFERENT_REGISTERS>,
}

impl Comparison {
    fn count<V: Value>(&mut self, address: u8, written: V, found: V) {
        self.registers = self.registers.saturating_add(1);
        if found != written {
            // What there is no room for is not told: the camera has lost all of them.
            let _ = self.different.push(DifferentRegister {
                address,
                written: written.into(),
                found: found.into(),
            });
        }
    }
}
