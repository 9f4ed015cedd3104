//! The energy of a whole film, with its gradient and stiffness.

use std::collections::BTreeMap;
use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use crate::answers::Change;
use crate::cell::{CellSum, Row, add_force};
use crate::grid::Grid;
use crate::point::{Laws, Point, Share, V3, VECTORS};
use crate::sheet::{Sheet, TERMS};
use crate::sparse::{COMPONENTS, Pattern};
use crate::spline::{Basis, SUPPORT};

/// Functions that are not zero on a cell.
pub const LOCAL: usize = SUPPORT * SUPPORT;
/// The largest number of Gauss points along one side of a cell.
const GAUSS: usize = 3;
/// Places in [−1, 1] and weights of two, 1/√3, and of three, √(3/5), 5/9 and 8/9.
const TWO: [(f64, f64); 2] = [
    (-0.577_350_269_189_625_8, 1.0),
    (0.577_350_269_189_625_8, 1.0),
];
const THREE: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];
/// Order of each vector as a derivative by x and by y.
const ORDERS: [[f64; 2]; VECTORS] = [[1.0, 0.0], [0.0, 1.0], [2.0, 0.0], [0.0, 2.0], [1.0, 1.0]];
/// Step of the stretch in the finite difference of a point's forces.
const STRETCH_STEP: f64 = 1e-4;

/// A span's Gauss points. Each has its weight (mm before the film was stretched), and the functions
/// with their derivatives by the place before it was stretched.
type Samples = Vec<(f64, Basis)>;
/// A vector in space and a zero: the width that the processor adds at once.
type Wide = [f64; 4];
/// Sums along x at one of its Gauss points, for each line of functions and derivative by x.
type Line = [[Wide; 3]; SUPPORT];
/// The sums at all Gauss points along x.
type Lines = [Line; GAUSS];
/// No stiffness.
const NOTHING: Share = Share {
    membrane: 0.0,
    bending: 0.0,
};
const NO_LINES: Lines = [[[[0.0; 4]; 3]; SUPPORT]; GAUSS];

/// A film on springs. Its energy is the sum of the points' energy over the cells and of the
/// springs' energy, minus the work of its weight.
///
/// Coefficients define the displacements: unknown 3 · k + c is component c of coefficient k, in mm.
pub struct Shell {
    grid: Grid,
    sheet: Sheet,
    laws: Laws,
    samples: [Vec<Samples>; 2],
    /// The shares of each cell's Gauss points.
    shares: Vec<[[Share; GAUSS]; GAUSS]>,
    /// Points of the dots, by cells.
    spots: BTreeMap<[usize; 2], Vec<Spot>>,
    /// The weight on each unknown, N.
    weight: Vec<f64>,
    pattern: Arc<Pattern>,
    hold: Hold,
    pins: Vec<(usize, f64)>,
}

/// A point of a dot.
struct Spot {
    slopes: [Row; VECTORS],
    at: [f64; 2],
    /// The share that a stiffening of 1 adds at this point.
    share: Share,
}

/// Springs that hold a film at its flat state, summed by cells.
pub struct Hold {
    cells: BTreeMap<[usize; 2], Box<[Row; LOCAL]>>,
}

/// Energy (N·mm), gradient (N) and the stiffness matrix's entries (N/mm).
#[cfg(test)]
pub struct Derivatives {
    pub energy: f64,
    pub gradient: Vec<f64>,
    pub stiffness: Vec<f64>,
}

impl Hold {
    /// Returns springs at points (mm, N/mm in every direction) of a film over `grid`.
    pub fn new(grid: &Grid, springs: impl IntoIterator<Item = ([f64; 2], f64)>) -> Hold {
        let mut cells = BTreeMap::new();
        for (point, stiffness) in springs {
            let place = grid.place(point);
            let cell = cells
                .entry(place.origin)
                .or_insert_with(|| Box::new([[0.0; LOCAL]; LOCAL]));
            for (row, value) in cell.iter_mut().zip(&place.values) {
                for (slot, other) in row.iter_mut().zip(&place.values) {
                    *slot += stiffness * value * other;
                }
            }
        }
        Hold { cells }
    }

    /// Adds `factor` times the gradient, N, of the springs' energy under displacements `u`. Returns
    /// that energy, N·mm.
    pub fn pull(&self, grid: &Grid, u: &[f64], factor: f64, sum: &mut [f64]) -> f64 {
        let mut energy = 0.0;
        for (&origin, matrix) in &self.cells {
            let local = grid.gather(u, origin);
            for (a, row) in matrix.iter().enumerate() {
                let first = COMPONENTS * grid.coefficient(origin, a);
                for c in 0..COMPONENTS {
                    let parts = row.iter().zip(&local).map(|(k, moved)| k * moved[c]);
                    let force: f64 = parts.sum();
                    sum[first + c] += factor * force;
                    energy += 0.5 * local[a][c] * force;
                }
            }
        }
        energy
    }
}

impl Shell {
    /// Returns a free film over `grid`.
    pub fn new(grid: Grid, sheet: &Sheet) -> Shell {
        let [columns, rows] = grid.functions();
        let pattern = Arc::new(Pattern::new(columns, rows));
        Shell::of(grid, sheet, pattern)
    }

    /// As [`Shell::new`], with the pattern of such grids.
    pub fn of(grid: Grid, sheet: &Sheet, pattern: Arc<Pattern>) -> Shell {
        let scales = sheet.scales();
        let samples = [0, 1].map(|way| samples(&grid, way, scales[way]));
        let mut shell = Shell {
            laws: Laws::new(&sheet.material, sheet.law),
            shares: shares(&grid, &samples, sheet),
            spots: spots(&grid, sheet),
            samples,
            weight: Vec::new(),
            pattern,
            hold: Hold {
                cells: BTreeMap::new(),
            },
            pins: Vec::new(),
            sheet: sheet.clone(),
            grid,
        };
        shell.weight = shell.weights();
        shell
    }

    /// Sets the springs that hold the film.
    pub fn hold(&mut self, hold: Hold) {
        self.hold = hold;
    }

    /// Holds one unknown at zero by `stiffness` N/mm.
    #[cfg(test)]
    pub fn pin(&mut self, unknown: usize, stiffness: f64) {
        self.pins.push((unknown, stiffness));
    }

    /// Returns the grid of the coefficients.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the film as a sheet.
    pub fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    /// Returns the pattern: which pairs of unknowns have a stiffness.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Returns the energy of displacements `u`, N·mm.
    #[cfg(test)]
    pub fn energy(&self, u: &[f64]) -> f64 {
        self.first(u).0
    }

    /// Returns the energy of displacements `u`, N·mm, and its gradient, N.
    pub fn first(&self, u: &[f64]) -> (f64, Vec<f64>) {
        Arch::new().dispatch(First { shell: self, u })
    }

    /// Returns the second derivatives of the energy of displacements `u`, N/mm, in the order of
    /// [`Shell::pattern`].
    pub fn stiffness(&self, u: &[f64]) -> Vec<f64> {
        Arch::new().dispatch(Assembly { shell: self, u })
    }

    #[cfg(test)]
    pub fn derivatives(&self, u: &[f64]) -> Derivatives {
        let (energy, gradient) = self.first(u);
        Derivatives {
            energy,
            gradient,
            stiffness: self.stiffness(u),
        }
    }

    /// Returns the gradient of the springs' energy, N.
    pub fn pull(&self, u: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; u.len()];
        self.hold.pull(&self.grid, u, 1.0, &mut sum);
        sum
    }

    /// Returns the total force of the springs on the film, N.
    pub fn reaction(&self, u: &[f64]) -> V3 {
        let mut sum = [0.0; 3];
        for force in self.pull(u).chunks(COMPONENTS) {
            for (total, part) in sum.iter_mut().zip(force) {
                *total -= part;
            }
        }
        sum
    }

    /// Adds the gradient of the energy of springs, pins and weight. Returns that energy.
    fn held(&self, u: &[f64], gradient: &mut [f64]) -> f64 {
        let mut energy = self.hold.pull(&self.grid, u, 1.0, gradient);
        for &(unknown, stiffness) in &self.pins {
            gradient[unknown] += stiffness * u[unknown];
            energy += 0.5 * stiffness * u[unknown].powi(2);
        }
        for ((slot, weight), u) in gradient.iter_mut().zip(&self.weight).zip(u) {
            *slot -= weight;
            energy -= weight * u;
        }
        energy
    }

    fn add_holding_stiffness(&self, stiffness: &mut [f64]) {
        for &(unknown, size) in &self.pins {
            stiffness[self.pattern.diagonal()[unknown]] += size;
        }
        for (&origin, matrix) in &self.hold.cells {
            self.pattern.add_springs(stiffness, origin, matrix);
        }
    }

    /// Returns the weight on each unknown, N.
    fn weights(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.grid.unknowns()];
        if self.sheet.down == [0.0; 3] {
            return sum;
        }
        let down = self.sheet.down.map(|part| part * self.sheet.weight());
        for cell in self.cells() {
            let mut lines = NO_LINES;
            for (j, (_, y)) in cell.y.iter().enumerate() {
                for (line, share) in lines.iter_mut().zip(&cell.shares[j]) {
                    spread_value(line, y, &down.map(|part| share.membrane * part));
                }
            }
            self.scatter(&mut sum, cell.origin, &gathered(&lines, cell.x));
        }
        sum
    }

    /// Returns the gradient's derivatives by each of several changes of the sheet itself, in one
    /// pass. They are zero for any other change.
    pub fn by_sheet(&self, u: &[f64], changes: &[Change]) -> Vec<Vec<f64>> {
        Arch::new().dispatch(BySheet {
            shell: self,
            u,
            changes,
        })
    }

    #[inline(always)]
    fn scatter(&self, sum: &mut [f64], origin: [usize; 2], local: &[V3; LOCAL]) {
        for (a, force) in local.iter().enumerate() {
            let first = COMPONENTS * self.grid.coefficient(origin, a);
            for (slot, part) in sum[first..first + COMPONENTS].iter_mut().zip(force) {
                *slot += part;
            }
        }
    }

    /// Returns the surface's vectors at a point: those of the flat film, plus the displacement's
    /// derivatives.
    #[inline(always)]
    fn vectors(&self, line: &Line, y: &Basis) -> Point {
        let mut x = [[0.0; 4]; VECTORS];
        for j in 0..SUPPORT {
            for c in 0..4 {
                x[0][c] += y[0][j] * line[j][1][c];
                x[1][c] += y[1][j] * line[j][0][c];
                x[2][c] += y[0][j] * line[j][2][c];
                x[3][c] += y[2][j] * line[j][0][c];
                x[4][c] += y[1][j] * line[j][1][c];
            }
        }
        let mut point = self.flat();
        for (vector, x) in point.iter_mut().zip(&x) {
            for c in 0..3 {
                vector[c] += x[c];
            }
        }
        point
    }

    /// As [`Self::vectors`], at a point with known slopes.
    #[inline(always)]
    fn surface(&self, slopes: &[Row; VECTORS], local: &[V3; LOCAL]) -> Point {
        let mut x = self.flat();
        for (vector, row) in x.iter_mut().zip(slopes) {
            for (slope, moved) in row.iter().zip(local) {
                for (part, moved) in vector.iter_mut().zip(moved) {
                    *part += slope * moved;
                }
            }
        }
        x
    }

    #[inline(always)]
    fn flat(&self) -> Point {
        let [across, down] = self.sheet.scales();
        let mut x = [[0.0; 3]; VECTORS];
        (x[0][0], x[1][1]) = (across, down);
        x
    }

    #[inline(always)]
    fn spots_at(&self, origin: [usize; 2]) -> &[Spot] {
        if self.sheet.dot_stiffening == 0.0 {
            return &[];
        }
        self.spots.get(&origin).map_or(&[], |spots| spots)
    }

    fn cells<'a>(&'a self) -> impl Iterator<Item = Cell<'a>> {
        let [across, down] = &self.samples;
        down.iter().enumerate().flat_map(move |(j, y)| {
            let cell = move |(i, x): (usize, &'a Samples)| Cell {
                origin: [i, j],
                x,
                y,
                shares: &self.shares[j * across.len() + i],
                grid: &self.grid,
            };
            across.iter().enumerate().map(cell)
        })
    }
}

/// One cell of the grid: its first coefficient, the Gauss points along its sides and their shares.
struct Cell<'a> {
    origin: [usize; 2],
    x: &'a [(f64, Basis)],
    y: &'a [(f64, Basis)],
    shares: &'a [[Share; GAUSS]; GAUSS],
    grid: &'a Grid,
}

impl Cell<'_> {
    /// Returns the place of Gauss point (i, j), mm.
    fn at(&self, i: usize, j: usize) -> [f64; 2] {
        [
            place_of(self.grid, 0, self.origin[0], i),
            place_of(self.grid, 1, self.origin[1], j),
        ]
    }
}

/// The pass for energy and gradient.
struct First<'a> {
    shell: &'a Shell,
    u: &'a [f64],
}

impl WithSimd for First<'_> {
    type Output = (f64, Vec<f64>);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (f64, Vec<f64>) {
        let First { shell, u } = self;
        let mut sum = vec![0.0; u.len()];
        let mut energy = shell.held(u, &mut sum);
        for cell in shell.cells() {
            let local = shell.grid.gather(u, cell.origin);
            let moved = contracted(&local, cell.x);
            let mut lines = NO_LINES;
            for (j, (_, y)) in cell.y.iter().enumerate() {
                for i in 0..cell.x.len() {
                    let x = shell.vectors(&moved[i], y);
                    let (part, gradient) = shell.laws.first(&x, cell.shares[j][i]);
                    energy += part;
                    spread(&mut lines[i], y, &gradient);
                }
            }
            let mut own = gathered(&lines, cell.x);
            for spot in shell.spots_at(cell.origin) {
                let share = times(spot.share, shell.sheet.dot_stiffening);
                let x = shell.surface(&spot.slopes, &local);
                let (part, gradient) = shell.laws.first(&x, share);
                energy += part;
                add_force(&mut own, &spot.slopes, &gradient);
            }
            shell.scatter(&mut sum, cell.origin, &own);
        }
        (energy, sum)
    }
}

/// The pass for the stiffness.
struct Assembly<'a> {
    shell: &'a Shell,
    u: &'a [f64],
}

impl WithSimd for Assembly<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let Assembly { shell, u } = self;
        let mut stiffness = vec![0.0; shell.pattern.entries()];
        shell.add_holding_stiffness(&mut stiffness);
        let mut sum = CellSum::new();
        for cell in shell.cells() {
            let local = shell.grid.gather(u, cell.origin);
            let moved = contracted(&local, cell.x);
            sum.clear();
            for (j, (_, y)) in cell.y.iter().enumerate() {
                for (i, (_, x)) in cell.x.iter().enumerate() {
                    let at = shell.vectors(&moved[i], y);
                    let second = shell.laws.second(&at, cell.shares[j][i]);
                    sum.add(simd, &slopes(x, y), &second);
                }
            }
            for spot in shell.spots_at(cell.origin) {
                let share = times(spot.share, shell.sheet.dot_stiffening);
                let at = shell.surface(&spot.slopes, &local);
                sum.add(simd, &spot.slopes, &shell.laws.second(&at, share));
            }
            sum.finish(simd);
            shell
                .pattern
                .add_cell(&mut stiffness, cell.origin, &sum.stiffness);
        }
        stiffness
    }
}

/// The pass for the gradient's derivatives by changes of the sheet.
struct BySheet<'a> {
    shell: &'a Shell,
    u: &'a [f64],
    changes: &'a [Change],
}

impl WithSimd for BySheet<'_> {
    type Output = Vec<Vec<f64>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<Vec<f64>> {
        let BySheet { shell, u, changes } = self;
        let any = |one: fn(&Change) -> bool| changes.iter().any(one);
        let needed = NeededRates {
            law: any(|change| matches!(change, Change::NeoHooke | Change::Stiffening)),
            stretch: any(|change| matches!(change, Change::Stretch(_))),
        };
        let heavy = shell.sheet.down != [0.0; 3];
        let mut sums = vec![vec![0.0; u.len()]; changes.len()];
        let mut lines = vec![NO_LINES; changes.len()];
        for cell in shell.cells() {
            let local = shell.grid.gather(u, cell.origin);
            let moved = contracted(&local, cell.x);
            lines.fill(NO_LINES);
            for (j, (_, y)) in cell.y.iter().enumerate() {
                for i in 0..cell.x.len() {
                    let x = shell.vectors(&moved[i], y);
                    let rates = Rates::new(shell, &x, cell.shares[j][i], cell.at(i, j), needed);
                    for (line, change) in lines.iter_mut().zip(changes) {
                        spread(&mut line[i], y, &rates.gradient(*change));
                        if heavy || matches!(change, Change::Down(_)) {
                            spread_value(&mut line[i], y, &rates.weight(*change));
                        }
                    }
                }
            }
            for (sum, line) in sums.iter_mut().zip(&lines) {
                shell.scatter(sum, cell.origin, &gathered(line, cell.x));
            }
        }
        shell.add_dots(u, changes, needed, &mut sums);
        sums
    }
}

/// The costly derivatives that the caller asked for.
#[derive(Clone, Copy)]
struct NeededRates {
    law: bool,
    stretch: bool,
}

impl Shell {
    /// Adds the dots' part of the gradient's derivatives by changes.
    fn add_dots(&self, u: &[f64], changes: &[Change], needed: NeededRates, sums: &mut [Vec<f64>]) {
        let stiffening = self.sheet.dot_stiffening;
        for (&origin, spots) in &self.spots {
            let local = self.grid.gather(u, origin);
            for spot in spots {
                let x = self.surface(&spot.slopes, &local);
                let rates = Rates::new(self, &x, spot.share, spot.at, needed);
                for (sum, change) in sums.iter_mut().zip(changes) {
                    let gradient = match change {
                        Change::DotStiffening => rates.gradient(Change::Youngs),
                        _ if stiffening == 0.0 => continue,
                        _ => scaled(&rates.gradient(*change), stiffening),
                    };
                    let mut own = [[0.0; 3]; LOCAL];
                    add_force(&mut own, &spot.slopes, &gradient);
                    self.scatter(sum, origin, &own);
                }
            }
        }
    }
}

/// Derivatives of a point's gradient and weight by changes of the sheet.
struct Rates<'a> {
    shell: &'a Shell,
    share: Share,
    /// The thickness's terms at the point, in parts of its thickness.
    terms: [f64; TERMS],
    parts: [Point; 2],
    by_law: [Point; 2],
    by_stretch: [Point; 2],
}

impl<'a> Rates<'a> {
    #[inline(always)]
    fn new(
        shell: &'a Shell,
        x: &Point,
        share: Share,
        at: [f64; 2],
        needed: NeededRates,
    ) -> Rates<'a> {
        let zero = [[[0.0; 3]; VECTORS]; 2];
        let (sheet, mut terms) = (&shell.sheet, Sheet::terms_at(at));
        let mut relative = 1.0;
        for k in 0..TERMS {
            relative += sheet.terms[k] * terms[k];
        }
        for term in &mut terms {
            *term /= relative;
        }
        Rates {
            shell,
            share,
            terms,
            parts: shell.laws.parts(x),
            by_law: match needed.law {
                true => shell.laws.by_law(x),
                false => zero,
            },
            by_stretch: match needed.stretch {
                true => [
                    by_stretch(shell, x, share, 0),
                    by_stretch(shell, x, share, 1),
                ],
                false => zero,
            },
        }
    }

    /// Returns the gradient's derivative by a change.
    #[inline(always)]
    fn gradient(&self, change: Change) -> Point {
        let Share { membrane, bending } = self.share;
        match change {
            Change::Youngs => self.sum(membrane, bending),
            Change::Thickness => {
                let t = self.shell.sheet.material.thickness_mm;
                self.sum(membrane / t, 3.0 * bending / t)
            }
            Change::ThicknessSlope(_) | Change::ThicknessCurve(_) => {
                let term = change.term().map_or(0.0, |k| self.terms[k]);
                self.sum(term * membrane, 3.0 * term * bending)
            }
            Change::NeoHooke => scaled(&self.by_law[0], membrane),
            Change::Stiffening => scaled(&self.by_law[1], membrane),
            Change::Stretch(way) => self.by_stretch[way],
            _ => [[0.0; 3]; VECTORS],
        }
    }

    /// Returns minus the weight's derivative by a change, N.
    #[inline(always)]
    fn weight(&self, change: Change) -> V3 {
        let sheet = &self.shell.sheet;
        let size = -self.share.membrane * sheet.weight();
        let part = match change {
            Change::Thickness => size / sheet.material.thickness_mm,
            Change::ThicknessSlope(_) | Change::ThicknessCurve(_) => {
                change.term().map_or(0.0, |k| size * self.terms[k])
            }
            Change::Stretch(way) => -size / sheet.scales()[way],
            Change::Down(axis) => {
                let mut weight = [0.0; 3];
                weight[axis] = size;
                return weight;
            }
            _ => 0.0,
        };
        let [x, y, z] = sheet.down;
        [part * x, part * y, part * z]
    }

    #[inline(always)]
    fn sum(&self, membrane: f64, bending: f64) -> Point {
        let mut sum = scaled(&self.parts[0], membrane);
        for (sum, bend) in sum.iter_mut().zip(&self.parts[1]) {
            for (sum, bend) in sum.iter_mut().zip(bend) {
                *sum += bending * bend;
            }
        }
        sum
    }
}

/// Returns the gradient's derivative by a stretch, through the slopes' factors, the vectors and the
/// area.
#[inline(always)]
fn by_stretch(shell: &Shell, x: &Point, share: Share, way: usize) -> Point {
    let scale = shell.sheet.scales()[way];
    let (mut longer, mut shorter) = (*x, *x);
    for p in 0..VECTORS {
        let part = ORDERS[p][way] * STRETCH_STEP / scale;
        for c in 0..3 {
            longer[p][c] *= 1.0 + part;
            shorter[p][c] *= 1.0 - part;
        }
    }
    let mut sum = shell.laws.first(x, share).1;
    let (forth, back) = (
        shell.laws.first(&longer, share).1,
        shell.laws.first(&shorter, share).1,
    );
    for p in 0..VECTORS {
        for c in 0..3 {
            sum[p][c] *= (ORDERS[p][way] - 1.0) / scale;
            sum[p][c] += (forth[p][c] - back[p][c]) / (2.0 * STRETCH_STEP);
        }
    }
    sum
}

#[inline(always)]
fn scaled(point: &Point, factor: f64) -> Point {
    let mut sum = *point;
    for part in sum.as_flattened_mut() {
        *part *= factor;
    }
    sum
}

#[inline(always)]
fn times(share: Share, factor: f64) -> Share {
    Share {
        membrane: factor * share.membrane,
        bending: factor * share.bending,
    }
}

fn samples(grid: &Grid, way: usize, scale: f64) -> Vec<Samples> {
    let axis = &grid.axes[way];
    let span_samples = |span| {
        let [from, to] = axis.ends(span);
        let sample = |k: usize| {
            let basis = axis.basis(span, place_of(grid, way, span, k));
            let weight = gauss(grid.points)[k].1 * (to - from) / 2.0;
            (weight / scale, stretched(basis, scale))
        };
        (0..grid.points).map(sample).collect()
    };
    (0..axis.spans()).map(span_samples).collect()
}

fn gauss(points: usize) -> &'static [(f64, f64)] {
    match points {
        2 => &TWO,
        _ => &THREE,
    }
}

/// Returns the place of Gauss point `k` of a span along x or y, mm.
fn place_of(grid: &Grid, way: usize, span: usize, k: usize) -> f64 {
    let [from, to] = grid.axes[way].ends(span);
    (from + to) / 2.0 + (to - from) / 2.0 * gauss(grid.points)[k].0
}

/// Converts to derivatives by the place before the film was stretched.
fn stretched([values, first, second]: Basis, scale: f64) -> Basis {
    [
        values,
        first.map(|part| scale * part),
        second.map(|part| scale * scale * part),
    ]
}

fn shares(grid: &Grid, samples: &[Vec<Samples>; 2], sheet: &Sheet) -> Vec<[[Share; GAUSS]; GAUSS]> {
    let [across, down] = samples;
    let mut shares = Vec::with_capacity(across.len() * down.len());
    for (row, y) in down.iter().enumerate() {
        for (column, x) in across.iter().enumerate() {
            let mut own = [[NOTHING; GAUSS]; GAUSS];
            for (j, (height, _)) in y.iter().enumerate() {
                for (i, (width, _)) in x.iter().enumerate() {
                    let at = [place_of(grid, 0, column, i), place_of(grid, 1, row, j)];
                    own[j][i] = sheet.share(at, width * height);
                }
            }
            shares.push(own);
        }
    }
    shares
}

fn spots(grid: &Grid, sheet: &Sheet) -> BTreeMap<[usize; 2], Vec<Spot>> {
    let [across, down] = sheet.scales();
    let mut spots: BTreeMap<[usize; 2], Vec<Spot>> = BTreeMap::new();
    for (at, area) in sheet.dot_points() {
        let origin = [0, 1].map(|way| grid.axes[way].span_of(at[way]));
        let x = stretched(grid.axes[0].basis(origin[0], at[0]), across);
        let y = stretched(grid.axes[1].basis(origin[1], at[1]), down);
        spots.entry(origin).or_default().push(Spot {
            slopes: slopes(&x, &y),
            at,
            share: sheet.share(at, area / (across * down)),
        });
    }
    spots
}

/// Returns the derivatives of a cell's functions.
#[inline(always)]
fn slopes(x: &Basis, y: &Basis) -> [Row; VECTORS] {
    const ORDERS: [[usize; 2]; VECTORS] = [[1, 0], [0, 1], [2, 0], [0, 2], [1, 1]];
    let mut slopes = [[0.0; LOCAL]; VECTORS];
    for (row, [dx, dy]) in slopes.iter_mut().zip(ORDERS) {
        for (line, factor) in row.as_chunks_mut::<SUPPORT>().0.iter_mut().zip(y[dy]) {
            for (slot, value) in line.iter_mut().zip(x[dx]) {
                *slot = value * factor;
            }
        }
    }
    slopes
}

/// Sums a cell's coefficients along x.
#[inline(always)]
fn contracted(local: &[V3; LOCAL], x: &[(f64, Basis)]) -> Lines {
    let mut wide = [[0.0; 4]; LOCAL];
    for (wide, local) in wide.iter_mut().zip(local) {
        wide[..3].copy_from_slice(local);
    }
    let mut lines = NO_LINES;
    for (line, (_, basis)) in lines.iter_mut().zip(x) {
        for j in 0..SUPPORT {
            for d in 0..3 {
                for i in 0..SUPPORT {
                    for c in 0..4 {
                        line[j][d][c] += basis[d][i] * wide[SUPPORT * j + i][c];
                    }
                }
            }
        }
    }
    lines
}

/// The inverse pass: returns the force on each coefficient.
#[inline(always)]
fn gathered(lines: &Lines, x: &[(f64, Basis)]) -> [V3; LOCAL] {
    let mut wide = [[0.0; 4]; LOCAL];
    for (line, (_, basis)) in lines.iter().zip(x) {
        for j in 0..SUPPORT {
            for d in 0..3 {
                for i in 0..SUPPORT {
                    for c in 0..4 {
                        wide[SUPPORT * j + i][c] += basis[d][i] * line[j][d][c];
                    }
                }
            }
        }
    }
    let mut local = [[0.0; 3]; LOCAL];
    for (local, wide) in local.iter_mut().zip(&wide) {
        local.copy_from_slice(&wide[..3]);
    }
    local
}

/// Adds a gradient's part to the sums along x.
#[inline(always)]
fn spread(line: &mut Line, y: &Basis, gradient: &Point) {
    let mut wide = [[0.0; 4]; VECTORS];
    for (wide, vector) in wide.iter_mut().zip(gradient) {
        wide[..3].copy_from_slice(vector);
    }
    for j in 0..SUPPORT {
        for c in 0..4 {
            line[j][0][c] += y[1][j] * wide[1][c] + y[2][j] * wide[3][c];
            line[j][1][c] += y[0][j] * wide[0][c] + y[1][j] * wide[4][c];
            line[j][2][c] += y[0][j] * wide[2][c];
        }
    }
}

/// Adds a force's part to the sums along x.
#[inline(always)]
fn spread_value(line: &mut Line, y: &Basis, force: &V3) {
    for j in 0..SUPPORT {
        for c in 0..3 {
            line[j][0][c] += y[0][j] * force[c];
        }
    }
}
