//! Predicts the motion of the markers' images under a load, with its slopes.
//!
//! Each marker has its own table, finer where the tip is near the marker. All tables share a few
//! functions of size and tilt, which are sums of the terms. Each marker sees the tilt from its own
//! side, but the size is the same for all; its part is computed once. A function keeps only terms
//! that are even, or only terms that are odd, under a mirror at the tilt's first axis. Films are
//! nearly symmetric there, and half of the terms are half of the work.

use super::pose::Pose;
use super::solve::{Column, EQUATIONS, UNKNOWNS};
use super::table::{Answer, Table};
use super::terms::{Limits, Powers, Sizes, Terms, Tilts};
use crate::force::kernels::Factors;

/// Number of markers.
pub const DOTS: usize = EQUATIONS / 2;
/// Most functions of size and tilt.
pub const MOST_FUNCTIONS: usize = 16;

/// Positions along x and y for each marker.
pub type Markers = [[f32; 2]; DOTS];

/// The film's tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tables<'a> {
    terms: Terms,
    /// Coefficients by function and term, f32 each: functions of even powers of the tilt's second
    /// part, then those of odd powers.
    functions: [&'a [[u8; 4]]; 2],
    dots: [Table<'a>; DOTS],
}

/// The motion of the images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prediction {
    /// x and y of the markers, focal lengths.
    pub moved: Column,
    /// Slopes by size, tilt along x and y (1/rad), place along x and y (1/mm).
    pub slopes: [Column; UNKNOWNS],
}

impl<'a> Tables<'a> {
    /// Takes the functions' coefficients of each term, functions of even powers of the tilt's
    /// second part first, and a table of each marker. Returns `None` if the numbers of terms and
    /// functions do not fit, or a coefficient is not within ±1.
    pub fn new(
        terms: Terms,
        functions: [&'a [u8]; 2],
        dots: [Table<'a>; DOTS],
    ) -> Option<Tables<'a>> {
        let functions = functions.map(|bytes| bytes.as_chunks());
        let whole = functions.iter().all(|(_, rest)| rest.is_empty());
        let functions = functions.map(|(parts, _)| parts);
        let mut count = 0;
        let mut fit = true;
        for (parts, terms) in functions.iter().zip(terms.counts()) {
            let own = parts.len() / terms.max(1);
            fit &= parts.len() == own * terms;
            count += own;
        }
        let parts = functions.iter().copied().flatten();
        let sound = whole
            && fit
            && (1..=MOST_FUNCTIONS).contains(&count)
            && dots.iter().all(|table| table.functions() == count)
            && parts
                .map(|part| f32::from_le_bytes(*part))
                .all(|part| part.abs() <= 1.0);
        sound.then_some(Tables {
            terms,
            functions,
            dots,
        })
    }

    /// The first and the last place that all tables cover along both axes, mm.
    pub fn ends_mm(&self) -> [f32; 2] {
        let axes = self.dots.iter().flat_map(Table::axes);
        axes.fold([f32::MIN, f32::MAX], |[from, to], axis| {
            let [first, last] = axis.ends_mm();
            [from.max(first), to.min(last)]
        })
    }

    /// Predicts the motion of markers that are glued `beside_mm` from their nominal places. That
    /// equals a nominal marker with the tip displaced by the opposite.
    pub fn predict(&self, pose: &Pose, limits: &Limits, beside_mm: &Markers) -> Prediction {
        let sizes = Sizes::at(pose.size, limits);
        let mut tilts = [Tilts::NONE; DOTS];
        for (table, tilts) in self.dots.iter().zip(&mut tilts) {
            let [a, b] = table.tilt(pose.tilt);
            tilts.set(&Powers::at(a, limits), &Powers::at(b, limits));
        }
        let mut functions = [[Factors::default(); MOST_FUNCTIONS]; DOTS];
        self.set_functions(&sizes, &tilts, &mut functions);
        let mut prediction = Prediction::default();
        let dots = self.dots.iter().zip(&functions).zip(beside_mm);
        for (dot, ((table, functions), beside_mm)) in dots.enumerate() {
            let [x, y] = [0, 1].map(|i| pose.place_mm[i] - beside_mm[i]);
            let at = table.place([x, y]);
            for axis in [0, 1] {
                prediction.set(2 * dot + axis, &table.answer(axis, &at, functions));
            }
        }
        prediction
    }

    /// Computes the functions under a load of a size, at the tilt as each marker sees it.
    fn set_functions(
        &self,
        sizes: &Sizes,
        tilts: &[Tilts; DOTS],
        functions: &mut [Functions; DOTS],
    ) {
        let [even, odd] = self.functions;
        let [terms_even, terms_odd] = self.terms.counts().map(|count| count.max(1));
        let mut number = 0;
        for parts in even.chunks_exact(terms_even) {
            let mut dots = functions.iter_mut();
            let each = |factors| set(dots.next(), number, factors);
            self.terms.even(parts, sizes, tilts, each);
            number += 1;
        }
        for parts in odd.chunks_exact(terms_odd) {
            let mut dots = functions.iter_mut();
            let each = |factors| set(dots.next(), number, factors);
            self.terms.odd(parts, sizes, tilts, each);
            number += 1;
        }
    }
}

#[inline]
fn set(functions: Option<&mut Functions>, number: usize, factors: Factors) {
    if let Some(place) = functions.and_then(|functions| functions.get_mut(number)) {
        *place = factors;
    }
}

/// Functions of size and tilt under a load, with their slopes.
type Functions = [Factors; MOST_FUNCTIONS];

impl Prediction {
    fn set(&mut self, equation: usize, answer: &Answer) {
        debug_assert!(equation < EQUATIONS);
        let columns = self.slopes.iter_mut().zip(answer.slopes);
        for (column, part) in columns.chain([(&mut self.moved, answer.value)]) {
            if let Some(place) = column.get_mut(equation) {
                *place = part;
            }
        }
    }
}
