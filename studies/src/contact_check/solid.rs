//! A rigid body as bricks for CalculiX: nodes, elements, and the faces that touch.

use std::f64::consts::FRAC_PI_2;

use hivtac_shell::{Body, Ends, Shape};

/// Sides of the faces that touch, mm.
const SIDE_MM: f64 = 0.12;
/// Radius of the rounding of a face's rim, mm: no corner is sharp in CalculiX.
const RIM_MM: f64 = 0.03;
/// Radius of the hole in the middle of a face, mm.
const HOLE_MM: f64 = 0.05;
/// Thickness of the layer of bricks, mm.
const LAYER_MM: f64 = 0.3;

/// A layer of bricks over a grid of points of a body's surface.
pub struct Solid {
    /// Nodes of the surface, then those within, mm; the foot is at (0, 0, 0).
    pub nodes: Vec<[f64; 3]>,
    /// The eight nodes of each brick, from 0. Its first face is the one that touches.
    pub bricks: Vec<[usize; 8]>,
}

/// A point of the surface and the one within, in the body's axes.
type Pair = [[f64; 3]; 2];
/// The numbers of rows and columns of a grid, and its points by parts of both.
type Net = (usize, usize, Box<dyn Fn(f64, f64) -> Pair>);

impl Solid {
    /// Returns the lower side of a body that its contact needs.
    pub fn new(body: &Body) -> Solid {
        let (rows, columns, pair): Net = match body.shape {
            Shape::Sphere { radius_mm } => {
                let half = (0.62 * radius_mm).min(6.5);
                let count = (2.0 * half / SIDE_MM).ceil() as usize;
                (
                    count,
                    count,
                    Box::new(move |a, b| ball(radius_mm, half, a, b)),
                )
            }
            Shape::Cylinder {
                radius_mm,
                length_mm,
                ends: Ends::Rounded,
            } => {
                let along = (length_mm / SIDE_MM).ceil() as usize;
                let around = (1.7 * radius_mm / SIDE_MM * 2.0).ceil() as usize;
                let half = length_mm / 2.0 - radius_mm;
                (
                    along,
                    around,
                    Box::new(move |a, b| bar(radius_mm, half, a, b)),
                )
            }
            Shape::Face { radius_mm } => {
                let out = face_stations(radius_mm);
                let count = out.len() - 1;
                let around = (6.3 * radius_mm / SIDE_MM).ceil() as usize;
                (count, around, Box::new(move |a, b| face(&out, a, b)))
            }
            _ => unreachable!("no such body is compared"),
        };
        Solid::of_grid(body, rows, columns, &*pair)
    }

    fn of_grid(body: &Body, rows: usize, columns: usize, pair: &dyn Fn(f64, f64) -> Pair) -> Solid {
        let at = |i: usize, j: usize| pair(i as f64 / rows as f64, j as f64 / columns as f64);
        let width = columns + 1;
        let (mut outer, mut inner) = (Vec::new(), Vec::new());
        for (i, j) in (0..=rows).flat_map(|i| (0..width).map(move |j| (i, j))) {
            let [on, within] = at(i, j);
            outer.push(turned(body, on));
            inner.push(turned(body, within));
        }
        let count = outer.len();
        let brick = |i: usize, j: usize| {
            let first = i * width + j;
            let quad = [first, first + 1, first + width + 1, first + width];
            let [a, b, c, d] = quad;
            // Its first face looks away from the second, into the body.
            [a, d, c, b, a + count, d + count, c + count, b + count]
        };
        let bricks = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        let mut bricks: Vec<_> = bricks.map(|(i, j)| brick(i, j)).collect();
        outer.extend(inner);
        for nodes in &mut bricks {
            if volume(&outer, nodes) < 0.0 {
                nodes.swap(1, 3);
                nodes.swap(5, 7);
            }
        }
        Solid {
            nodes: outer,
            bricks,
        }
    }
}

fn ball(radius: f64, half: f64, a: f64, b: f64) -> Pair {
    let [x, y] = [a, b].map(|part| (2.0 * part - 1.0) * half);
    let point = |radius_of: f64| {
        let high = (radius * radius - x * x - y * y).sqrt();
        let part = radius_of / radius;
        [x * part, y * part, radius - high * part]
    };
    [point(radius), point(radius - LAYER_MM)]
}

fn bar(radius: f64, half: f64, a: f64, b: f64) -> Pair {
    let all = half + radius * 1.35;
    let t = (2.0 * a - 1.0) * all;
    let turn = (t.abs() - half).max(0.0) / radius;
    let side = (2.0 * b - 1.0) * 1.5;
    let point = |radius_of: f64| {
        let out = radius_of * turn.cos();
        let x = t.signum() * (t.abs().min(half) + radius_of * turn.sin());
        [x, out * side.sin(), radius - out * side.cos()]
    };
    [point(radius), point(radius - LAYER_MM)]
}

/// Returns radius and height of each ring of a face.
fn face_stations(radius: f64) -> Vec<[f64; 2]> {
    let flat = radius - RIM_MM;
    let count = (flat / SIDE_MM).ceil();
    let rings = (0..=count as usize).map(|k| HOLE_MM + (flat - HOLE_MM) * k as f64 / count);
    let mut stations: Vec<_> = rings.map(|r| [r, 0.0]).collect();
    for k in 1..=4 {
        let (sin, cos) = (FRAC_PI_2 * f64::from(k) / 4.0).sin_cos();
        stations.push([flat + RIM_MM * sin, RIM_MM * (1.0 - cos)]);
    }
    stations.extend((1..=4).map(|k| [radius, RIM_MM + 0.15 * f64::from(k)]));
    stations
}

fn face(stations: &[[f64; 2]], a: f64, b: f64) -> Pair {
    let k = (a * (stations.len() - 1) as f64).round() as usize;
    let [r, z] = stations[k];
    let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
    let inner = 0.7 * r;
    [[r * cos, r * sin, z], [inner * cos, inner * sin, z + 0.4]]
}

fn turned(body: &Body, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = body.turned_deg.to_radians().sin_cos();
    let (rise, level) = body.tilt_deg.to_radians().sin_cos();
    let first = [cos * level, sin * level, rise];
    let second = [-sin, cos, 0.0];
    let third = [-rise * cos, -rise * sin, level];
    std::array::from_fn(|c| x * first[c] + y * second[c] + z * third[c])
}

fn volume(nodes: &[[f64; 3]], brick: &[usize; 8]) -> f64 {
    let from = nodes[brick[0]];
    let side = |k: usize| -> [f64; 3] { std::array::from_fn(|c| nodes[brick[k]][c] - from[c]) };
    let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (side(1), side(3), side(4));
    ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
}
