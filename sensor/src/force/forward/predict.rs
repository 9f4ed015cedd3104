//! Predicts the motion of the markers' images under a load, with its slopes.
//!
//! Each marker has its own table, finer where the tip is near the marker. All tables share a few
//! functions of size and tilt, which are sums of the terms. Each marker sees the tilt from its own
//! side, but the size is the same for all; its part is computed once. So are the functions, for
//! markers one after the other that see the tilt from the same side. A function keeps only terms
//! that are even, or only terms that are odd, under a mirror at the tilt's first axis. Films are
//! nearly symmetric there, and half of the terms are half of the work.

use super::pose::Pose;
use super::solve::{Column, MOST_DOTS, UNKNOWNS};
use super::table::{Answer, Table};
use super::terms::{Limits, OfSize, Powers, Sizes, Terms, Tilts};
use crate::force::kernels::Factors;
use heapless::Vec;
use hivtac_terms::list::List;

/// Most functions of size and tilt.
pub const MOST_FUNCTIONS: usize = 16;

/// Positions along x and y for each marker.
pub type Markers = List<[f32; 2], MOST_DOTS>;

/// The film's tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tables<'a> {
    terms: Terms,
    /// Coefficients by function and term, f32 each: functions of even powers of the tilt's second
    /// part, then those of odd powers.
    functions: [&'a [[u8; 4]]; 2],
    /// Number of functions.
    count: usize,
    /// The bytes of all markers' tables, one after the other.
    bytes: &'a [u8],
    dots: List<Dot, MOST_DOTS>,
    /// The first and the last place that all tables cover along both axes, mm.
    ends_mm: [f32; 2],
}

/// The place of a marker's table in the file, and values computed once from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dot {
    /// Index of its first byte.
    pub at: u32,
    /// Units of the slopes' weights along x and y, 1/mm.
    pub slope_units: [f32; 2],
}

/// The motion of the images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// x and y of the markers, focal lengths.
    pub moved: Column,
    /// Slopes by size, tilt along x and y (1/rad), place along x and y (1/mm).
    pub slopes: [Column; UNKNOWNS],
    /// Slope by the contact's width; without coordinates if that is no unknown.
    pub by_width: Column,
}

impl<'a> Tables<'a> {
    /// Takes the functions' coefficients of each term, functions of even powers of the tilt's
    /// second part first, and the tables of the markers, which [`Table::new`] has taken. Returns
    /// `None` if the numbers of terms and functions do not fit, or a coefficient is not within ±1.
    pub fn new(
        terms: Terms,
        functions: [&'a [u8]; 2],
        bytes: &'a [u8],
        dots: List<Dot, MOST_DOTS>,
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
            && parts
                .map(|part| f32::from_le_bytes(*part))
                .all(|part| part.abs() <= 1.0);
        let mut tables = Tables {
            terms,
            functions,
            count,
            bytes,
            dots,
            ends_mm: [f32::MIN, f32::MAX],
        };
        let axes = tables.tables().flat_map(|table| *table.axes());
        tables.ends_mm = axes.fold(tables.ends_mm, |[from, to], axis| {
            let [first, last] = axis.ends_mm();
            [from.max(first), to.min(last)]
        });
        sound.then_some(tables)
    }

    /// Number of markers.
    pub fn dots(&self) -> usize {
        self.dots.len()
    }

    /// The tables of all markers.
    fn tables(&self) -> impl Iterator<Item = Table<'a>> {
        self.dots.iter().map_while(|dot| {
            let bytes = self.bytes.get(dot.at as usize..)?;
            Table::taken(bytes, dot.slope_units, self.count)
        })
    }

    /// The first and the last place that all tables cover along both axes, mm.
    pub fn ends_mm(&self) -> [f32; 2] {
        self.ends_mm
    }

    /// Predicts the motion of markers that are glued `beside_mm` from their nominal places. That
    /// equals a nominal marker with the tip displaced by the opposite.
    pub fn predict(&self, pose: &Pose, limits: &Limits, beside_mm: &Markers) -> Prediction {
        let mut prediction = Prediction::zeros(2 * self.dots.len());
        self.put(pose, limits, beside_mm, &mut prediction);
        prediction
    }

    /// As [`Tables::predict`], in place.
    pub(super) fn put(
        &self,
        pose: &Pose,
        limits: &Limits,
        beside_mm: &Markers,
        prediction: &mut Prediction,
    ) {
        prediction.reset(2 * self.dots.len());
        let mut sizes = Vec::new();
        self.put_sizes(pose.size, limits, &mut sizes);
        let mut functions = Vec::<Factors, MOST_FUNCTIONS>::new();
        let mut side = None;
        for (dot, table) in self.tables().enumerate() {
            if side != Some(table.away()) {
                side = Some(table.away());
                put_functions(&sizes, table.tilt(pose.tilt), limits, &mut functions);
            }
            let beside_mm = beside_mm.get(dot).copied().unwrap_or_default();
            let [x, y] = [0, 1].map(|i| pose.place_mm[i] - beside_mm[i]);
            let at = table.place([x, y]);
            for axis in [0, 1] {
                prediction.set(2 * dot + axis, &table.answer(axis, &at, &functions));
            }
        }
    }

    /// The functions at a size, before the tilt, as each marker sees it, is put in.
    #[inline]
    fn put_sizes(&self, size: f32, limits: &Limits, functions: &mut Vec<OfSize, MOST_FUNCTIONS>) {
        let sizes = Sizes::at(size, limits);
        let [even, odd] = self.functions;
        let [terms_even, terms_odd] = self.terms.counts().map(|count| count.max(1));
        let even = even.chunks_exact(terms_even).map(|parts| (parts, false));
        let odd = odd.chunks_exact(terms_odd).map(|parts| (parts, true));
        for (parts, is_odd) in even.chain(odd) {
            // There are at most as many functions as fit.
            let _ = functions.push(OfSize::new(is_odd));
            if let Some(of_size) = functions.last_mut() {
                self.terms.put(parts, &sizes, of_size);
            }
        }
    }
}

/// The functions under a tilt as a marker sees it.
#[inline]
fn put_functions(
    sizes: &[OfSize],
    [a, b]: [f32; 2],
    limits: &Limits,
    functions: &mut Vec<Factors, MOST_FUNCTIONS>,
) {
    let tilts = Tilts::of(&Powers::at(a, limits), &Powers::at(b, limits));
    functions.clear();
    for function in sizes {
        // There are at most as many functions as fit.
        let _ = functions.push(function.at(&tilts));
    }
}

impl Prediction {
    /// No motion of this number of coordinates.
    pub fn zeros(coordinates: usize) -> Prediction {
        let column = Column::defaults(coordinates);
        Prediction {
            moved: column,
            slopes: [column; UNKNOWNS],
            by_width: Column::defaults(0),
        }
    }

    fn reset(&mut self, coordinates: usize) {
        self.moved.reset(coordinates, 0.0);
        for slope in &mut self.slopes {
            slope.reset(coordinates, 0.0);
        }
    }

    fn set(&mut self, equation: usize, answer: &Answer) {
        let columns = self.slopes.iter_mut().zip(answer.slopes);
        for (column, part) in columns.chain([(&mut self.moved, answer.value)]) {
            if let Some(place) = column.get_mut(equation) {
                *place = part;
            }
        }
    }
}
