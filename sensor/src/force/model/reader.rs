//! Reads little-endian values and checks them.

use super::ModelError;

/// Takes little-endian values from a byte slice, one after the other.
pub(super) struct Reader<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) offset: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn take(&mut self, length: usize) -> Result<&'a [u8], ModelError> {
        let short = ModelError::TooShort {
            offset: self.offset,
            length: self.bytes.len(),
        };
        let taken = self
            .bytes
            .get(self.offset..self.offset + length)
            .ok_or(short)?;
        self.offset += length;
        Ok(taken)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], ModelError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn u8(&mut self) -> Result<u8, ModelError> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn u16(&mut self) -> Result<u16, ModelError> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub(super) fn u32(&mut self) -> Result<u32, ModelError> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(super) fn u8_in(
        &mut self,
        name: &'static str,
        high: u8,
        allowed: &'static str,
    ) -> Result<u8, ModelError> {
        let offset = self.offset;
        let value = self.u8()?;
        if value > high {
            return Err(ModelError::Field {
                name,
                offset,
                allowed,
            });
        }
        Ok(value)
    }

    pub(super) fn u16_in(
        &mut self,
        name: &'static str,
        low: u16,
        high: u16,
        allowed: &'static str,
    ) -> Result<u16, ModelError> {
        let offset = self.offset;
        let value = self.u16()?;
        if !(low..=high).contains(&value) {
            return Err(ModelError::Field {
                name,
                offset,
                allowed,
            });
        }
        Ok(value)
    }

    /// Reads a value from 0 to `high`.
    pub(super) fn i32_in(
        &mut self,
        name: &'static str,
        high: i32,
        allowed: &'static str,
    ) -> Result<i32, ModelError> {
        let offset = self.offset;
        let value = self.u32()? as i32;
        if !(0..=high).contains(&value) {
            return Err(ModelError::Field {
                name,
                offset,
                allowed,
            });
        }
        Ok(value)
    }

    pub(super) fn positive(&mut self, name: &'static str) -> Result<i32, ModelError> {
        let offset = self.offset;
        let value = self.u32()? as i32;
        if value < 1 {
            return Err(ModelError::Field {
                name,
                offset,
                allowed: "1 to 2147483647",
            });
        }
        Ok(value)
    }

    /// Reads one byte, an index into `choices`.
    pub(super) fn choice<T: Copy>(
        &mut self,
        name: &'static str,
        variants: &[T],
        allowed: &'static str,
    ) -> Result<T, ModelError> {
        let offset = self.offset;
        let number = self.u8()?;
        let chosen = variants.get(usize::from(number));
        chosen.copied().ok_or(ModelError::Field {
            name,
            offset,
            allowed,
        })
    }

    pub(super) fn zero(&mut self, name: &'static str) -> Result<(), ModelError> {
        self.u8_in(name, 0, "0").map(drop)
    }

    /// Skips zeros up to a multiple of four.
    pub(super) fn pad(&mut self) -> Result<(), ModelError> {
        while !self.offset.is_multiple_of(4) {
            self.zero("padding")?;
        }
        Ok(())
    }
}
