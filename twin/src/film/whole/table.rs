//! Motions of the tip and of a grid of points around it, by places of the tip and functions of the
//! load.

use std::ops::Neg;

use crate::film::FilmError;
use crate::film::reduced::{Axis, SPAN};

use super::functions::LoadFunctions;

/// A coefficient is stored in steps; this many steps are the largest one of its function and
/// component.
const STEPS: f64 = 32_767.0;
/// Number of components of a motion.
const COMPONENTS: usize = 3;

/// The nodes of a table: of the tip's place from the middle, and of points from the tip. Both are
/// along x and along y, mm, from 0 on; their negatives are nodes, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nodes {
    /// Of the tip's place.
    pub places_mm: &'static [f64],
    /// Of the points around it.
    pub around_mm: &'static [f64],
}

/// Motions as splines over the tip's place and over the distance from it.
///
/// A row has the motions for one place and function: the tip's, then each point's, along y and,
/// within, along x.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    places: Axis,
    around: Axis,
    functions: usize,
    /// By place along y, place along x, function and number of the row.
    rows: Vec<f32>,
}

/// The weights of rows under a load.
pub struct Weights(Vec<(usize, f64)>);

/// The motions of a part of the grid under a load, as coefficients of splines.
pub struct Window<'a> {
    around: &'a Axis,
    first: [usize; 2],
    columns: usize,
    values: Vec<f64>,
}

impl Nodes {
    /// Returns the axis of the tip's places and that of the points around it.
    pub fn axes(&self) -> [Axis; 2] {
        [self.places_mm, self.around_mm].map(|half| {
            let below = half.iter().skip(1).rev().map(|node| -node);
            let all: Vec<f64> = below.chain(half.iter().copied()).collect();
            Axis::new(&all)
        })
    }

    /// Returns the count of numbers of a row.
    pub fn row(&self) -> usize {
        let count = 2 * self.around_mm.len() - 1;
        COMPONENTS * (1 + count * count)
    }

    /// Iterates over the places 0 ≤ y ≤ x whose mirror images are all places, as indices of nodes
    /// from 0 on.
    pub fn octant(&self) -> impl Iterator<Item = [usize; 2]> {
        (0..self.places_mm.len()).flat_map(|x| (0..=x).map(move |y| [x, y]))
    }

    /// Returns a row under a load that is mirrored: with the places exchanged if `swap`, then with
    /// these signs.
    pub fn mirrored<T>(&self, row: &[T], swap: bool, signs: [f64; 2]) -> Vec<T>
    where
        T: Copy + Neg<Output = T>,
    {
        let count = 2 * self.around_mm.len() - 1;
        let flip = |k: usize, sign: f64| if sign < 0.0 { count - 1 - k } else { k };
        let along = |part: T, sign: f64| if sign < 0.0 { -part } else { part };
        let turn = |from: &[T]| {
            let [x, y] = if swap {
                [from[1], from[0]]
            } else {
                [from[0], from[1]]
            };
            [along(x, signs[0]), along(y, signs[1]), from[2]]
        };
        let mut seen = turn(&row[..COMPONENTS]).to_vec();
        for j in 0..count {
            for i in 0..count {
                let [x, y] = [flip(i, signs[0]), flip(j, signs[1])];
                let [x, y] = if swap { [y, x] } else { [x, y] };
                let first = COMPONENTS * (1 + y * count + x);
                seen.extend(turn(&row[first..first + COMPONENTS]));
            }
        }
        seen
    }
}

impl Table {
    /// Makes a table from the coefficients at the places of [`Nodes::octant`], by place, function
    /// and number of the row.
    pub fn new(nodes: &Nodes, functions: &LoadFunctions, octant: &[f32]) -> Table {
        let [places, around] = nodes.axes();
        let (half, count, row) = (nodes.places_mm.len() - 1, functions.count(), nodes.row());
        let full = places.nodes().len();
        let mut rows = vec![0.0; full * full * count * row];
        for place in 0..full * full {
            let [x, y] = [place % full, place / full].map(|k| k as f64 - half as f64);
            let signs = [1.0_f64.copysign(x), 1.0_f64.copysign(y)];
            let swap = y.abs() > x.abs();
            let [most, least] = [x.abs().max(y.abs()), x.abs().min(y.abs())].map(|k| k as usize);
            let own = most * (most + 1) / 2 + least;
            for k in 0..count {
                let (other, sign) = functions.seen(k, swap, signs);
                let from = &octant[(own * count + k) * row..][..row];
                let to = &mut rows[(place * count + other) * row..][..row];
                for (to, from) in to.iter_mut().zip(nodes.mirrored(from, swap, signs)) {
                    *to = sign as f32 * from;
                }
            }
        }
        Table {
            places,
            around,
            functions: count,
            rows,
        }
    }

    /// Returns coefficients at the places of [`Nodes::octant`] as a file stores them: the size of a
    /// step by function and component, then the steps.
    pub fn to_bytes(nodes: &Nodes, functions: usize, octant: &[f32]) -> Vec<u8> {
        let row = nodes.row();
        let slot = |k: usize| (k / row) % functions * COMPONENTS + k % COMPONENTS;
        let mut sizes = vec![0.0_f32; functions * COMPONENTS];
        for (k, value) in octant.iter().enumerate() {
            sizes[slot(k)] = sizes[slot(k)].max(value.abs() / STEPS as f32);
        }
        let steps = octant
            .iter()
            .enumerate()
            .map(|(k, value)| match sizes[slot(k)] {
                0.0 => 0,
                size => (f64::from(*value) / f64::from(size)).round() as i16,
            });
        let sized = sizes.iter().flat_map(|size| size.to_le_bytes());
        sized.chain(steps.flat_map(i16::to_le_bytes)).collect()
    }

    /// Makes a table from the coefficients at all places, by place along y, place along x, function
    /// and number of the row.
    pub fn of_all(nodes: &Nodes, functions: &LoadFunctions, rows: Vec<f32>) -> Table {
        let [places, around] = nodes.axes();
        Table {
            places,
            around,
            functions: functions.count(),
            rows,
        }
    }

    /// Takes a table of an octant's places from the front of a file's bytes.
    ///
    /// # Errors
    /// If the bytes end too early.
    pub fn take(
        nodes: &Nodes,
        functions: &LoadFunctions,
        bytes: &mut &[u8],
    ) -> Result<Table, FilmError> {
        let octant = read(nodes, functions.count(), nodes.octant().count(), bytes)?;
        Ok(Table::new(nodes, functions, &octant))
    }

    /// Takes a table of all places from the front of a file's bytes.
    ///
    /// # Errors
    /// If the bytes end too early.
    pub fn take_all(
        nodes: &Nodes,
        functions: &LoadFunctions,
        bytes: &mut &[u8],
    ) -> Result<Table, FilmError> {
        let full = 2 * nodes.places_mm.len() - 1;
        let rows = read(nodes, functions.count(), full * full, bytes)?;
        Ok(Table::of_all(nodes, functions, rows))
    }

    /// Returns the count of numbers of a row.
    fn row(&self) -> usize {
        let count = self.around.nodes().len();
        COMPONENTS * (1 + count * count)
    }

    /// Returns the weights of rows with the tip at a place, mm, under a load whose functions have
    /// these values.
    pub fn weights(&self, place_mm: [f64; 2], values: &[f64]) -> Weights {
        let [along_x, along_y] = place_mm.map(|part| self.places.at(part));
        let full = self.places.nodes().len();
        let mut weights = Vec::with_capacity(SPAN * SPAN * self.functions);
        for (j, down) in along_y.values.into_iter().enumerate() {
            for (i, along) in along_x.values.into_iter().enumerate() {
                let place = (along_y.first + j) * full + along_x.first + i;
                for (k, value) in values.iter().enumerate() {
                    let row = place * self.functions + k;
                    weights.push((row * self.row(), down * along * value));
                }
            }
        }
        Weights(weights)
    }

    /// Returns the tip's motion.
    pub fn tip_mm(&self, weights: &Weights) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (first, part) in &weights.0 {
            for (sum, value) in sum.iter_mut().zip(&self.rows[*first..]) {
                *sum += part * f64::from(*value);
            }
        }
        sum
    }

    /// Returns the motions of the points within a distance of a point; both are from the tip, mm.
    pub fn window(&self, weights: &Weights, from_tip_mm: [f64; 2], within_mm: f64) -> Window<'_> {
        let begin = from_tip_mm.map(|part| self.around.at(part - within_mm).first);
        let end = from_tip_mm.map(|part| self.around.at(part + within_mm).first + SPAN);
        let [columns, lines] = [0, 1].map(|c| end[c] - begin[c]);
        let (count, length) = (self.around.nodes().len(), COMPONENTS * columns);
        let mut values = vec![0.0; length * lines];
        for (first, part) in &weights.0 {
            for (j, line) in values.chunks_exact_mut(length).enumerate() {
                let point = (begin[1] + j) * count + begin[0];
                let row = &self.rows[first + COMPONENTS * (1 + point)..][..length];
                for (sum, value) in line.iter_mut().zip(row) {
                    *sum += part * f64::from(*value);
                }
            }
        }
        Window {
            around: &self.around,
            first: begin,
            columns,
            values,
        }
    }
}

/// Takes the coefficients at a number of places from the front of a file's bytes.
fn read(
    nodes: &Nodes,
    functions: usize,
    places: usize,
    bytes: &mut &[u8],
) -> Result<Vec<f32>, FilmError> {
    let row = nodes.row();
    let sizes = 4 * functions * COMPONENTS;
    let length = sizes + 2 * places * functions * row;
    let Some((own, rest)) = bytes.split_at_checked(length) else {
        return Err(FilmError::Tables(format!(
            "a table of {length} bytes is cut off after {}: make the file anew",
            bytes.len()
        )));
    };
    *bytes = rest;
    let (sizes, steps) = own.split_at(sizes);
    let sizes = sizes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
    let sizes: Vec<f32> = sizes.collect();
    let steps = steps.as_chunks().0.iter().map(|b| i16::from_le_bytes(*b));
    let values = steps.enumerate().map(|(k, step)| {
        f32::from(step) * sizes[(k / row) % functions * COMPONENTS + k % COMPONENTS]
    });
    Ok(values.collect())
}

impl Window<'_> {
    /// Returns the motion of a point of the window, from the tip, mm.
    pub fn at(&self, from_tip_mm: [f64; 2]) -> [f64; 3] {
        let [along_x, along_y] = from_tip_mm.map(|part| self.around.at(part));
        let mut sum = [0.0; 3];
        for (j, down) in along_y.values.into_iter().enumerate() {
            let line = (along_y.first - self.first[1] + j) * self.columns;
            for (i, along) in along_x.values.into_iter().enumerate() {
                let point = COMPONENTS * (line + along_x.first - self.first[0] + i);
                for (sum, value) in sum.iter_mut().zip(&self.values[point..]) {
                    *sum += down * along * value;
                }
            }
        }
        sum
    }
}
