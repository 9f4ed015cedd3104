//! The energy of a whole film, with its gradient and stiffness.

use crate::grid::{Grid, Place};
use crate::point::{Blocks, Laws, Material, Point, V3, VECTORS};
use crate::sparse::{COMPONENTS, Pattern};
use crate::spline::{Axis, Basis, SUPPORT};

/// Functions that are not zero on a cell.
pub const LOCAL: usize = SUPPORT * SUPPORT;
/// Gauss points along one side of a cell.
const GAUSS: usize = 3;
/// Their places in [−1, 1] and weights: √(3/5), 5/9 and 8/9.
const GAUSS_POINTS: [(f64, f64); GAUSS] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];

/// The five derivatives of one function: ,₁ ,₂ ,₁₁ ,₂₂ ,₁₂.
type Slopes = [f64; VECTORS];
/// A span's Gauss points: weight (mm) and functions.
type Samples = [(f64, Basis); GAUSS];

/// A film on springs: the sum of Koiter's energy over the cells and of what holds the film.
///
/// Displacements are given by coefficients: unknown 3 · k + c is component c of coefficient k, in
/// mm.
pub struct Shell {
    grid: Grid,
    laws: Laws,
    samples: [Vec<Samples>; 2],
    pattern: Pattern,
    springs: Vec<Spring>,
    pins: Vec<(usize, f64)>,
}

/// Holds a place of the film where it rests.
pub struct Spring {
    /// The place.
    pub place: Place,
    /// N/mm, in every direction.
    pub stiffness: f64,
}

/// Energy (N·mm), gradient (N) and the stiffness matrix's entries (N/mm).
pub struct Derivatives {
    /// Energy, N·mm.
    pub energy: f64,
    /// Its gradient by the unknowns, N.
    pub gradient: Vec<f64>,
    /// Its second derivatives in the order of [`Shell::pattern`], N/mm.
    pub stiffness: Vec<f64>,
}

impl Shell {
    /// A free film of `material` over `grid`.
    pub fn new(grid: Grid, material: &Material) -> Shell {
        let [columns, rows] = grid.functions();
        Shell {
            laws: Laws::new(material),
            samples: [samples(&grid.axes[0]), samples(&grid.axes[1])],
            pattern: Pattern::new(columns, rows),
            springs: Vec::new(),
            pins: Vec::new(),
            grid,
        }
    }

    /// Holds places.
    pub fn hold(&mut self, springs: impl IntoIterator<Item = Spring>) {
        self.springs.extend(springs);
    }

    /// Holds one unknown at zero by `stiffness` N/mm.
    #[cfg(test)]
    pub fn pin(&mut self, unknown: usize, stiffness: f64) {
        self.pins.push((unknown, stiffness));
    }

    /// Where the coefficients are.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Which unknowns meet.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// The energy of displacements `u`, N·mm.
    pub fn energy(&self, u: &[f64]) -> f64 {
        let mut energy = self.holding_energy(u);
        for cell in self.cells() {
            let local = self.grid.gather(u, cell.origin);
            for (weight, slopes) in self.points(&cell) {
                energy += weight * self.laws.energy(&surface(&slopes, &local));
            }
        }
        energy
    }

    /// The gradient of the energy of displacements `u`, N.
    pub fn gradient(&self, u: &[f64]) -> Vec<f64> {
        let mut sum = self.pull(u, &self.springs);
        for &(unknown, stiffness) in &self.pins {
            sum[unknown] += stiffness * u[unknown];
        }
        for cell in self.cells() {
            let local = self.grid.gather(u, cell.origin);
            let mut own = [[0.0; 3]; LOCAL];
            for (weight, slopes) in self.points(&cell) {
                let (_, first, _) = self.laws.derivatives(&surface(&slopes, &local));
                add_gradient(&mut own, &slopes, &first, weight);
            }
            for (a, part) in own.iter().enumerate() {
                let row = COMPONENTS * self.grid.coefficient(cell.origin, a);
                for (total, part) in sum[row..].iter_mut().zip(part) {
                    *total += part;
                }
            }
        }
        sum
    }

    /// The gradient of the energy that displacements `u` give to `springs`, N.
    pub fn pull(&self, u: &[f64], springs: &[Spring]) -> Vec<f64> {
        let mut sum = vec![0.0; u.len()];
        for Spring { place, stiffness } in springs {
            let moved = self.grid.interpolate(u, place);
            for (a, value) in place.values.iter().enumerate() {
                let row = self.grid.coefficient(place.origin, a);
                for c in 0..COMPONENTS {
                    sum[COMPONENTS * row + c] += stiffness * value * moved[c];
                }
            }
        }
        sum
    }

    /// The energy of displacements `u` with its derivatives.
    pub fn derivatives(&self, u: &[f64]) -> Derivatives {
        let mut sum = Derivatives {
            energy: self.holding_energy(u),
            gradient: vec![0.0; u.len()],
            stiffness: vec![0.0; self.pattern.entries()],
        };
        self.add_holding(u, &mut sum);
        let mut cell_blocks = Box::new([[[[0.0; 3]; 3]; LOCAL]; LOCAL]);
        for cell in self.cells() {
            self.add_cell(&cell, u, &mut sum, &mut cell_blocks);
        }
        sum
    }

    /// What the springs pull the film with, N: the sum of their forces.
    pub fn reaction(&self, u: &[f64]) -> V3 {
        let mut sum = [0.0; 3];
        for spring in &self.springs {
            let moved = self.grid.interpolate(u, &spring.place);
            for (total, part) in sum.iter_mut().zip(moved) {
                *total -= spring.stiffness * part;
            }
        }
        sum
    }

    fn holding_energy(&self, u: &[f64]) -> f64 {
        let springs = self.springs.iter().map(|spring| {
            let moved = self.grid.interpolate(u, &spring.place);
            spring.stiffness * moved.iter().map(|part| part * part).sum::<f64>()
        });
        let pins = self
            .pins
            .iter()
            .map(|(unknown, stiffness)| stiffness * u[*unknown].powi(2));
        0.5 * (springs.sum::<f64>() + pins.sum::<f64>())
    }

    fn add_holding(&self, u: &[f64], sum: &mut Derivatives) {
        for &(unknown, stiffness) in &self.pins {
            sum.gradient[unknown] += stiffness * u[unknown];
            sum.stiffness[self.pattern.diagonal()[unknown]] += stiffness;
        }
        for Spring { place, stiffness } in &self.springs {
            let moved = self.grid.interpolate(u, place);
            for (a, value) in place.values.iter().enumerate() {
                let row = self.grid.coefficient(place.origin, a);
                for c in 0..COMPONENTS {
                    sum.gradient[COMPONENTS * row + c] += stiffness * value * moved[c];
                }
                for (b, other) in place.values.iter().enumerate().take(a + 1) {
                    let column = self.grid.coefficient(place.origin, b);
                    let k = stiffness * value * other;
                    let block = [[k, 0.0, 0.0], [0.0, k, 0.0], [0.0, 0.0, k]];
                    self.pattern
                        .add_block(&mut sum.stiffness, row, column, &block);
                }
            }
        }
    }

    fn add_cell(
        &self,
        cell: &Cell,
        u: &[f64],
        sum: &mut Derivatives,
        blocks: &mut [[[[f64; 3]; 3]; LOCAL]; LOCAL],
    ) {
        let local = self.grid.gather(u, cell.origin);
        let mut gradient = [[0.0; 3]; LOCAL];
        blocks
            .iter_mut()
            .flatten()
            .flatten()
            .flatten()
            .for_each(|part| *part = 0.0);
        for (weight, slopes) in self.points(cell) {
            let (energy, first, second) = self.laws.derivatives(&surface(&slopes, &local));
            sum.energy += weight * energy;
            add_gradient(&mut gradient, &slopes, &first, weight);
            add_blocks(blocks, &slopes, &second, weight);
        }
        for a in 0..LOCAL {
            let row = self.grid.coefficient(cell.origin, a);
            for c in 0..COMPONENTS {
                sum.gradient[COMPONENTS * row + c] += gradient[a][c];
            }
            for b in 0..=a {
                let column = self.grid.coefficient(cell.origin, b);
                self.pattern
                    .add_block(&mut sum.stiffness, row, column, &blocks[a][b]);
            }
        }
    }

    fn cells(&self) -> impl Iterator<Item = Cell<'_>> {
        let [across, down] = &self.samples;
        down.iter().enumerate().flat_map(move |(j, y)| {
            let cell = move |(i, x)| Cell {
                origin: [i, j],
                x,
                y,
            };
            across.iter().enumerate().map(cell)
        })
    }

    /// The Gauss points of a cell: weight (mm²) and the slopes of its functions.
    fn points(&self, cell: &Cell) -> impl Iterator<Item = (f64, [Slopes; LOCAL])> {
        cell.y.iter().flat_map(move |(height, y)| {
            cell.x
                .iter()
                .map(move |(width, x)| (width * height, slopes(x, y)))
        })
    }
}

/// One cell of the grid: its first coefficient and the Gauss points along its sides.
struct Cell<'a> {
    origin: [usize; 2],
    x: &'a Samples,
    y: &'a Samples,
}

fn samples(axis: &Axis) -> Vec<Samples> {
    let span_samples = |span| {
        let [from, to] = axis.ends(span);
        let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
        GAUSS_POINTS.map(|(at, weight)| (weight * half, axis.basis(span, middle + half * at)))
    };
    (0..axis.spans()).map(span_samples).collect()
}

fn slopes(x: &Basis, y: &Basis) -> [Slopes; LOCAL] {
    std::array::from_fn(|k| {
        let (i, j) = (k % SUPPORT, k / SUPPORT);
        [
            x[1][i] * y[0][j],
            x[0][i] * y[1][j],
            x[2][i] * y[0][j],
            x[0][i] * y[2][j],
            x[1][i] * y[1][j],
        ]
    })
}

/// The surface's vectors at a point: those of the film at rest, plus the displacement's
/// derivatives.
fn surface(slopes: &[Slopes; LOCAL], local: &[V3; LOCAL]) -> Point {
    let mut x = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0; 3],
        [0.0; 3],
        [0.0; 3],
    ];
    for (slope, u) in slopes.iter().zip(local) {
        for (vector, d) in x.iter_mut().zip(slope) {
            for (part, moved) in vector.iter_mut().zip(u) {
                *part += d * moved;
            }
        }
    }
    x
}

fn add_gradient(sum: &mut [V3; LOCAL], slopes: &[Slopes; LOCAL], first: &Point, weight: f64) {
    for (total, slope) in sum.iter_mut().zip(slopes) {
        for (d, vector) in slope.iter().zip(first) {
            for (part, force) in total.iter_mut().zip(vector) {
                *part += weight * d * force;
            }
        }
    }
}

/// Adds the lower triangle of the cell's stiffness.
fn add_blocks(
    sum: &mut [[[[f64; 3]; 3]; LOCAL]; LOCAL],
    slopes: &[Slopes; LOCAL],
    second: &Blocks,
    weight: f64,
) {
    for (b, right) in slopes.iter().enumerate() {
        let half = half_block(second, right, weight);
        for (a, left) in slopes.iter().enumerate().skip(b) {
            let block = &mut sum[a][b];
            for (d, part) in left.iter().zip(&half) {
                for c in 0..3 {
                    for e in 0..3 {
                        block[c][e] += d * part[c][e];
                    }
                }
            }
        }
    }
}

/// Σ_q slope_q · second[p][q], for each p.
fn half_block(second: &Blocks, slope: &Slopes, weight: f64) -> [[[f64; 3]; 3]; VECTORS] {
    let mut half = [[[0.0; 3]; 3]; VECTORS];
    for (sum, row) in half.iter_mut().zip(second) {
        for (d, block) in slope.iter().zip(row) {
            for c in 0..3 {
                for e in 0..3 {
                    sum[c][e] += weight * d * block[c][e];
                }
            }
        }
    }
    half
}
