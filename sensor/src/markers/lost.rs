//! The markers that a frame does not show.

use hivtac_terms::marker::MOST_MARKERS;

/// A set of identities below [`MOST_MARKERS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Lost(u16);

const _: () = assert!(MOST_MARKERS <= u16::BITS as usize);

impl Lost {
    /// No marker is lost.
    pub const NONE: Lost = Lost(0);

    /// Only this marker is lost.
    pub fn only(identity: usize) -> Lost {
        Lost::NONE.and(identity)
    }

    /// These and another marker. An identity of [`MOST_MARKERS`] or more is left out.
    #[must_use]
    pub fn and(self, identity: usize) -> Lost {
        Lost(self.0 | 1u16.checked_shl(identity as u32).unwrap_or(0))
    }

    /// Whether this marker is lost.
    pub fn contains(self, identity: usize) -> bool {
        self != Lost(self.0 & !Lost::only(identity).0)
    }

    /// Number of lost markers.
    pub fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether all of these are lost in `other`, too.
    pub fn is_within(self, other: Lost) -> bool {
        self.0 & !other.0 == 0
    }

    /// Sets their coordinates to 0, in a column of x and y of each marker.
    pub fn clear(self, coordinates: &mut [f32]) {
        for (identity, at) in coordinates.as_chunks_mut().0.iter_mut().enumerate() {
            if self.contains(identity) {
                *at = [0.0; 2];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_set_holds_what_was_added() {
        let lost = Lost::only(3).and(15).and(3).and(16).and(usize::MAX);
        let identities = (0..MOST_MARKERS).filter(|identity| lost.contains(*identity));
        assert_eq!(identities.collect::<Vec<_>>(), [3, 15]);
        assert_eq!((lost.count(), lost.contains(15)), (2, true));
        assert!(!lost.contains(16) && !Lost::NONE.contains(0));
        assert!(Lost::only(3).is_within(lost) && !lost.is_within(Lost::only(3)));
        assert!(Lost::NONE.is_within(Lost::NONE));
        let mut coordinates = [1.0; 8];
        lost.clear(&mut coordinates);
        assert_eq!(coordinates, [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    }
}
