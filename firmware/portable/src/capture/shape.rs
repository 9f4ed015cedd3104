//! Defines how frames, bands and slots relate.

/// The number of bands of a frame, and of slots of the ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Shape {
    bands: u16,
    slots: u16,
}

impl Shape {
    /// Frames of `bands` bands, in a ring of `slots` slots.
    ///
    /// # Panics
    /// If `bands` is 0, or `slots` is not a power of two of at least 4. Meant for constants, where
    /// a panic is a build error.
    pub const fn new(bands: u16, slots: u16) -> Self {
        assert!(bands > 0, "a frame has at least one band");
        // Sequence numbers wrap at 2³², so the number of slots must divide it. The DMA holds two
        // slots.
        assert!(slots >= 4 && slots.is_power_of_two());
        Shape { bands, slots }
    }

    /// Number of bands of a frame.
    pub const fn bands(&self) -> u16 {
        self.bands
    }

    /// The slot of a band.
    pub const fn slot(&self, sequence: u32) -> u16 {
        // With a power of two the remainder is the lower bits.
        sequence as u16 & (self.slots - 1)
    }

    /// Returns whether the band `sequence` was still whole at a moment *after which*
    /// [`Tracker::finished`] was read as `finished`.
    ///
    /// The DMA writes band `finished`, or already the next one if its interrupt has not been
    /// handled yet. So the last `slots − 2` finished bands are safe.
    ///
    /// [`Tracker::finished`]: crate::capture::Tracker::finished
    pub const fn intact(&self, sequence: u32, finished: u32) -> bool {
        let age = finished.wrapping_sub(sequence);
        age >= 1 && age <= self.slots as u32 - 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_intact_until_the_dma_may_be_in_its_slot() {
        let shape = Shape::new(3, 8);
        assert!(!shape.intact(5, 5), "not finished");
        assert!(shape.intact(5, 6) && shape.intact(5, 11));
        // Slot 5 is band 13's, which the DMA may write once band 12 ends, handled or not.
        assert!(!shape.intact(5, 12));
        assert!(shape.intact(u32::MAX, 0) && !shape.intact(u32::MAX - 7, 0));
    }

    #[test]
    fn slots_follow_one_another_across_the_wrap() {
        let shape = Shape::new(3, 8);
        assert_eq!((shape.slot(u32::MAX), shape.slot(0)), (7, 0));
    }
}
