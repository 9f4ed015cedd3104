//! The symmetry of a square: every way has a mirror image whose sideways part has 0 ≤ y ≤ x.

use super::{Bend, Shift, State};
use crate::film::curves::{Answer, DiscMotion};

type V3 = [f64; 3];

/// Mirrors a film into the octant 0 ≤ y ≤ x of ways, and back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Octant {
    /// −1 where x, or y, changes its sign.
    signs: [f64; 2],
    /// Whether x and y then change places.
    swapped: bool,
}

impl Octant {
    /// The octant of a way, by its sideways part.
    pub(super) fn of([x, y]: [f64; 2]) -> Octant {
        let sign = |part: f64| if part < 0.0 { -1.0 } else { 1.0 };
        Octant {
            signs: [sign(x), sign(y)],
            swapped: y.abs() > x.abs(),
        }
    }

    /// A vector along the film, mirrored into the octant.
    pub(super) fn mirrored(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.ordered([self.signs[0] * x, self.signs[1] * y])
    }

    /// An answer in the octant, mirrored back.
    #[inline(always)]
    pub(super) fn answer(&self, answer: &Answer) -> Answer {
        let disc = |k: usize| {
            let disc = &answer.discs[self.marker(k)];
            let [along_x, along_y] = self.slopes([disc.along_x, disc.along_y]);
            DiscMotion {
                moved_mm: self.vector(disc.moved_mm),
                along_x,
                along_y,
            }
        };
        Answer {
            tip: self.vector(answer.tip),
            discs: std::array::from_fn(disc),
        }
    }

    /// The tip's vector in the octant, mirrored back.
    pub(super) fn vector(&self, [x, y, z]: V3) -> V3 {
        let [x, y] = self.ordered([x, y]);
        [self.signs[0] * x, self.signs[1] * y, z]
    }

    pub(super) fn state(&self, state: &State) -> State {
        let by_offset = [0, 1].map(|k| self.shift(&state.by_offset[k]));
        let [x, y] = self.ordered([0, 1]).map(|k: usize| by_offset[k]);
        State {
            answer: self.answer(&state.answer),
            by_offset: [x.times(self.signs[0]), y.times(self.signs[1])],
        }
    }

    pub(super) fn bend(&self, bend: &Bend) -> Bend {
        let mut bend = bend.map(|shift| self.shift(&shift));
        if self.swapped {
            bend[..3].reverse();
            bend[3..].reverse();
        }
        let [x, y] = self.signs;
        let signs = [1.0, x * y, 1.0, x, y, x, y];
        std::array::from_fn(|k| bend[k].times(signs[k]))
    }

    fn shift(&self, shift: &Shift) -> Shift {
        Shift {
            tip: self.vector(shift.tip),
            moved_mm: std::array::from_fn(|k| self.vector(shift.moved_mm[self.marker(k)])),
        }
    }

    fn slopes(&self, [x, y]: [V3; 2]) -> [V3; 2] {
        let [x, y] = self.ordered([x, y]).map(|slope| self.vector(slope));
        [
            x.map(|part| self.signs[0] * part),
            y.map(|part| self.signs[1] * part),
        ]
    }

    /// Where a marker's image is in the octant, by identity.
    fn marker(&self, k: usize) -> usize {
        // By identity, x is − + + −, y is − − + +.
        let [x, y] = [k == 1 || k == 2, k >= 2];
        let [x, y] = self.ordered([x == (self.signs[0] > 0.0), y == (self.signs[1] > 0.0)]);
        match (x, y) {
            (false, false) => 0,
            (true, false) => 1,
            (true, true) => 2,
            (false, true) => 3,
        }
    }

    fn ordered<T>(&self, [x, y]: [T; 2]) -> [T; 2] {
        if self.swapped { [y, x] } else { [x, y] }
    }
}
