//! The points of the film that may touch a body, and the energy of their penetration.

use crate::body::Body;
use crate::body::shape::{Gap, Shape};
use crate::cell::{CellStiffness, PAIRS, Row};
use crate::film::Film;
use crate::grid::Grid;
use crate::point::V3;
use crate::shell::LOCAL;
use crate::sparse::{COMPONENTS, Pattern};

/// The points of a film that may touch a body.
pub struct Points<'a> {
    grid: &'a Grid,
    shape: Shape,
    /// Pressure per penetration, N/mm³.
    pub stiffness: f64,
    /// The body's axes in the film's frame.
    axes: [V3; 3],
    cells: Vec<Cell>,
}

/// The points in a cell.
struct Cell {
    origin: [usize; 2],
    points: Vec<Point>,
}

/// A point of the middle surface.
struct Point {
    /// Its place on the mounted film, mm.
    at: [f64; 2],
    /// The cell's functions there.
    values: Row,
    /// The area for which it stands, mm².
    area: f64,
    /// Half of the thickness: the body is felt so far from the middle surface, mm.
    half: f64,
}

/// Energy of penetration, N·mm, and its gradient by unknowns and by the body's place, N.
pub struct First {
    pub energy: f64,
    pub by_film: Vec<f64>,
    pub by_body: V3,
}

/// Second derivatives of that energy, N/mm: by the body's place alone, and with each unknown.
pub struct Second {
    pub by_body: [V3; 3],
    pub mixed: [Vec<f64>; 3],
}

/// A point that touches.
#[derive(Clone, Copy, Debug)]
pub struct Bearing {
    /// Its place on the mounted film, mm.
    pub at: [f64; 2],
    /// Its place relative to the body's foot, in the body's axes, mm.
    pub on_body: V3,
    /// The size of its normal force, N.
    pub normal_n: f64,
    /// Its area, mm².
    pub area: f64,
    /// Its penetration, mm.
    pub deep: f64,
}

impl<'a> Points<'a> {
    /// Returns the points of a film within reach of a body.
    pub fn new(film: &'a Film, body: &Body) -> Points<'a> {
        let grid = film.shell().grid();
        let [cx, cy] = body.place_mm;
        let (reach, spacing) = (body.shape.reach_mm(), body.shape.spacing_mm());
        let near = |at: [f64; 2]| {
            (at[0] - cx).hypot(at[1] - cy) < reach && film.design().check_pressed(at).is_ok()
        };
        let spans = [0, 1].map(|way| {
            let axis = &grid.axes[way];
            let within = move |span: &usize| {
                let [from, to] = axis.ends(*span);
                to > body.place_mm[way] - reach && from < body.place_mm[way] + reach
            };
            (0..axis.spans()).filter(within).collect::<Vec<_>>()
        });
        let mut cells = Vec::new();
        for (i, j) in spans[1]
            .iter()
            .flat_map(|j| spans[0].iter().map(move |i| (*i, *j)))
        {
            let [(xs, width), (ys, height)] =
                [middles(grid, 0, i, spacing), middles(grid, 1, j, spacing)];
            let places = ys.iter().flat_map(|y| xs.iter().map(move |x| [*x, *y]));
            let point = |at: [f64; 2]| Point {
                at,
                values: grid.place(at).values,
                area: width * height,
                half: film.half_thickness_mm(at),
            };
            let points: Vec<Point> = places.filter(|at| near(*at)).map(point).collect();
            if !points.is_empty() {
                let origin = [i, j];
                cells.push(Cell { origin, points });
            }
        }
        Points {
            grid,
            axes: body.axes(),
            shape: body.shape,
            stiffness: body.stiffness_n_per_mm3,
            cells,
        }
    }

    /// Returns the least gap of the film under displacements `u` from a body whose foot is at a
    /// place, mm.
    pub fn least_mm(&self, u: &[f64], foot: &V3) -> f64 {
        let mut least = f64::INFINITY;
        self.each(u, foot, |_, _, gap| least = least.min(gap.mm));
        least
    }

    /// Returns the energy and its first derivatives.
    pub fn first(&self, u: &[f64], foot: &V3) -> First {
        let mut sum = First {
            energy: 0.0,
            by_film: vec![0.0; u.len()],
            by_body: [0.0; 3],
        };
        self.each(u, foot, |cell, point, gap| {
            if gap.mm >= 0.0 {
                return;
            }
            let size = self.stiffness * point.area * gap.mm;
            sum.energy += 0.5 * size * gap.mm;
            for c in 0..3 {
                sum.by_body[c] -= size * gap.normal[c];
            }
            for (local, value) in point.values.iter().enumerate() {
                let first = COMPONENTS * self.grid.coefficient(cell.origin, local);
                for c in 0..3 {
                    sum.by_film[first + c] += size * gap.normal[c] * value;
                }
            }
        });
        sum
    }

    /// Returns the second derivatives. Those by two unknowns are added to `stiffness`.
    pub fn second(
        &self,
        (u, foot): (&[f64], &V3),
        (pattern, stiffness): (&Pattern, &mut [f64]),
    ) -> Second {
        let mut sum = Second {
            by_body: [[0.0; 3]; 3],
            mixed: std::array::from_fn(|_| vec![0.0; u.len()]),
        };
        for cell in &self.cells {
            let local = self.grid.gather(u, cell.origin);
            let mut own: Option<Box<CellStiffness>> = None;
            for point in &cell.points {
                let gap = self.gap(point, &local, foot);
                if gap.mm >= 0.0 {
                    continue;
                }
                let size = self.stiffness * point.area;
                let part = |i: usize, j: usize| {
                    size * (gap.normal[i] * gap.normal[j] + gap.mm * gap.bend[i][j])
                };
                let block: [V3; 3] = std::array::from_fn(|i| std::array::from_fn(|j| part(i, j)));
                add_block(own.get_or_insert_with(empty), &point.values, &block);
                for (i, row) in block.iter().enumerate() {
                    for (j, part) in row.iter().enumerate() {
                        sum.by_body[i][j] += part;
                        for (local, value) in point.values.iter().enumerate() {
                            let first = COMPONENTS * self.grid.coefficient(cell.origin, local);
                            sum.mixed[j][first + i] -= part * value;
                        }
                    }
                }
            }
            if let Some(own) = own {
                pattern.add_cell(stiffness, cell.origin, &own);
            }
        }
        sum
    }

    /// Returns the points that touch.
    pub fn bearing(&self, u: &[f64], foot: &V3) -> Vec<Bearing> {
        let mut bearing = Vec::new();
        self.each(u, foot, |cell, point, gap| {
            if gap.mm >= 0.0 {
                return;
            }
            let local = self.grid.gather(u, cell.origin);
            let size = gap
                .normal
                .iter()
                .map(|part| part * part)
                .sum::<f64>()
                .sqrt();
            bearing.push(Bearing {
                at: point.at,
                on_body: self.on_body(point, &local, foot),
                normal_n: -self.stiffness * point.area * gap.mm * size,
                area: point.area,
                deep: -gap.mm,
            });
        });
        bearing
    }

    /// Calls `each` with every point, its cell and its gap, in the film's frame.
    fn each(&self, u: &[f64], foot: &V3, mut each: impl FnMut(&Cell, &Point, Gap)) {
        for cell in &self.cells {
            let local = self.grid.gather(u, cell.origin);
            for point in &cell.points {
                each(cell, point, self.gap(point, &local, foot));
            }
        }
    }

    /// Returns a point's place on the body, in the body's axes, mm.
    fn on_body(&self, point: &Point, local: &[V3; LOCAL], foot: &V3) -> V3 {
        let [x, y] = point.at;
        let mut from = [x - foot[0], y - foot[1], -foot[2]];
        for (value, moved) in point.values.iter().zip(local) {
            for c in 0..3 {
                from[c] += value * moved[c];
            }
        }
        self.axes
            .map(|axis| (0..3).map(|c| axis[c] * from[c]).sum())
    }

    fn gap(&self, point: &Point, local: &[V3; LOCAL], foot: &V3) -> Gap {
        let own = self.shape.gap(&self.on_body(point, local, foot));
        let mm = own.mm - point.half;
        if mm >= 0.0 {
            return Gap { mm, ..own };
        }
        let a = &self.axes;
        let turned = |v: &V3, c: usize| a[0][c] * v[0] + a[1][c] * v[1] + a[2][c] * v[2];
        let half: [V3; 3] = own.bend.map(|row| std::array::from_fn(|c| turned(&row, c)));
        let column = |c: usize| [half[0][c], half[1][c], half[2][c]];
        Gap {
            mm,
            normal: std::array::from_fn(|c| turned(&own.normal, c)),
            bend: std::array::from_fn(|c| std::array::from_fn(|d| turned(&column(d), c))),
        }
    }
}

fn empty() -> Box<CellStiffness> {
    Box::new([[[0.0; LOCAL]; LOCAL]; PAIRS.len()])
}

/// Adds value · block · value.
fn add_block(cell: &mut CellStiffness, values: &Row, block: &[V3; 3]) {
    for (matrix, (c, e)) in cell.iter_mut().zip(PAIRS) {
        for (row, left) in matrix.iter_mut().zip(values) {
            let part = block[c][e] * left;
            for (slot, right) in row.iter_mut().zip(values) {
                *slot += part * right;
            }
        }
    }
}

/// Returns the middles of the even parts of a span that are small enough, and the parts' length.
fn middles(grid: &Grid, way: usize, span: usize, spacing: f64) -> (Vec<f64>, f64) {
    let [from, to] = grid.axes[way].ends(span);
    let count = ((to - from) / spacing).ceil().max(1.0);
    let width = (to - from) / count;
    let middle = |k: usize| from + (k as f64 + 0.5) * width;
    ((0..count as usize).map(middle).collect(), width)
}
