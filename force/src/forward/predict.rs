//! Where the markers' images go under a load, with the slopes of that.
//!
//! Each marker has a table of its own, finer where the tip is near it. All are made of the same few
//! functions of size and tilt, which are sums of the terms. Each marker sees the tilt from its own
//! side, but the size is the same for all: what follows from that is worked out once.

use super::pose::Pose;
use super::solve::{Column, EQUATIONS, UNKNOWNS};
use super::table::{Answer, Table};
use super::terms::{Limits, MOST_GROUPS, Powers, Sizes, Terms, Tilts};
use crate::kernels::Factors;
use heapless::Vec;

/// Markers.
pub const DOTS: usize = EQUATIONS / 2;
/// Functions of size and tilt at most.
pub const MOST_FUNCTIONS: usize = 24;

/// Positions along x and y for each marker.
pub type Markers = [[f32; 2]; DOTS];

/// Functions of size and tilt under a load, with their slopes.
pub type Functions = Vec<Factors, MOST_FUNCTIONS>;

/// The film's tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tables<'a> {
    terms: Terms,
    /// By function and term, f32 each.
    functions: &'a [[u8; 4]],
    dots: [Table<'a>; DOTS],
}

/// Where the images go.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prediction {
    /// x and y of the markers, in focal lengths.
    pub moved: Column,
    /// Slopes by size, tilt along x and y (1/rad), place along x and y (1/mm).
    pub slopes: [Column; UNKNOWNS],
}

impl<'a> Tables<'a> {
    /// Of functions' parts of each term, and tables of as many functions each; `None` where their
    /// numbers do not fit, or a part is not within ±10⁶.
    pub fn new(terms: Terms, functions: &'a [u8], dots: [Table<'a>; DOTS]) -> Option<Tables<'a>> {
        let (functions, rest) = functions.as_chunks();
        let count = functions.len() / terms.count();
        let sound = rest.is_empty()
            && functions.len() == count * terms.count()
            && (1..=MOST_FUNCTIONS).contains(&count)
            && dots.iter().all(|table| table.functions() == count)
            && functions
                .iter()
                .all(|part| f32::from_le_bytes(*part).abs() <= 1e6);
        sound.then_some(Tables {
            terms,
            functions,
            dots,
        })
    }

    /// The first and the last place along both axes that all tables hold, mm.
    pub fn ends_mm(&self) -> [f32; 2] {
        let axes = self.dots.iter().flat_map(Table::axes);
        axes.fold([f32::MIN, f32::MAX], |[from, to], axis| {
            let [first, last] = axis.ends_mm();
            [from.max(first), to.min(last)]
        })
    }

    /// Where the images of markers go that are glued `beside_mm` of the tables': a marker beside its
    /// place is as one in its place, with the tip as far beside the other way.
    pub fn predict(&self, pose: &Pose, limits: &Limits, beside_mm: &Markers) -> Prediction {
        let sized = self.sized(&Sizes::at(pose.size, limits));
        let mut prediction = Prediction::default();
        for (dot, (table, beside_mm)) in self.dots.iter().zip(beside_mm).enumerate() {
            let [a, b] = table.tilt(pose.tilt).map(|part| Powers::at(part, limits));
            let functions = tilted(&sized, &Tilts::of(&a, &b).0[..self.terms.groups()]);
            let [x, y] = [0, 1].map(|i| pose.place_mm[i] - beside_mm[i]);
            let at = table.place([x, y]);
            for axis in [0, 1] {
                prediction.set(2 * dot + axis, &table.answer(axis, &at, &functions));
            }
        }
        prediction
    }

    /// What each product of powers of the tilt counts in each function under a load of a size.
    fn sized(&self, sizes: &Sizes) -> Sized {
        let mut all = Sized::new();
        for mut parts in self.functions.chunks_exact(self.terms.count()) {
            let mut of_function = [[0.0; 2]; MOST_GROUPS];
            let mut groups = of_function.iter_mut();
            for (count, of_degree) in self.terms.sizes_of_degrees() {
                for group in groups.by_ref().take(of_degree) {
                    let (own, rest) = parts.split_at(count.min(parts.len()));
                    parts = rest;
                    let sizes = sizes.values.iter().zip(&sizes.slopes);
                    for (part, (value, slope)) in own.iter().zip(sizes) {
                        let part = f32::from_le_bytes(*part);
                        *group = [group[0] + part * value, group[1] + part * slope];
                    }
                }
            }
            // There is room for all.
            let _ = all.push(of_function);
        }
        all
    }
}

/// By function and product of powers of the tilt: what it counts, and the slope of that by the size.
type Sized = Vec<[[f32; 2]; MOST_GROUPS], MOST_FUNCTIONS>;

/// Functions under a tilt.
fn tilted(sized: &Sized, tilts: &[[f32; 3]]) -> Functions {
    let function = |groups: &[[f32; 2]; MOST_GROUPS]| {
        let mut sums = Factors::default();
        for ([value, slope], [whole, by_a, by_b]) in groups.iter().zip(tilts) {
            let products = [value * whole, slope * whole, value * by_a, value * by_b];
            for (sum, product) in sums.iter_mut().zip(products) {
                *sum += product;
            }
        }
        sums
    };
    sized.iter().map(function).collect()
}

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
