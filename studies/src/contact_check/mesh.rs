//! The film cut into CalculiX's quadratic elements: bricks through its thickness, or its shells.

use std::collections::HashMap;

use hivtac_shell::Design;
use hivtac_twin::film::MARKER_REST_MM;

/// How fast elements grow away from tip and posts, mm per mm.
const GROWTH: f64 = 0.25;
/// Elements' sides at fineness 1, mm: under the tip, at a post, and anywhere.
const TIP_SIDE_MM: f64 = 0.2;
const POST_SIDE_MM: f64 = 0.35;
/// The same within a dot that stiffens the film, and its radius.
const DOT_SIDE_MM: f64 = 0.15;
const DOT_RADIUS_MM: f64 = 0.5;
const LARGEST_SIDE_MM: f64 = 1.6;
/// Steps along half an edge in which sides are summed up.
const SAMPLES: usize = 4000;

/// The nodes of C3D20R in CalculiX's order, in −1…1.
const BRICK: [[i8; 3]; 20] = [
    [-1, -1, -1],
    [1, -1, -1],
    [1, 1, -1],
    [-1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [1, 1, 1],
    [-1, 1, 1],
    [0, -1, -1],
    [1, 0, -1],
    [0, 1, -1],
    [-1, 0, -1],
    [0, -1, 1],
    [1, 0, 1],
    [0, 1, 1],
    [-1, 0, 1],
    [-1, -1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 1, 0],
];
/// Those of S8R; the third part counts for nothing.
const SHELL: [[i8; 3]; 8] = [
    [-1, -1, -1],
    [1, -1, -1],
    [1, 1, -1],
    [-1, 1, -1],
    [0, -1, -1],
    [1, 0, -1],
    [0, 1, -1],
    [-1, 0, -1],
];

/// What a film is cut into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// C3D20R, so many through the thickness.
    Bricks(usize),
    /// S8R, which CalculiX itself expands to one brick through the thickness.
    Shells,
}

/// Nodes and elements; CalculiX counts both from 1.
pub struct Mesh {
    /// What the film is cut into.
    pub cut: Cut,
    /// Borders of elements on the flat mounted film, mm.
    breaks: [Vec<f64>; 2],
    /// Where the nodes are before the film is mounted, mm.
    pub nodes: Vec<[f64; 3]>,
    /// Each element's nodes, counted from 0, in CalculiX's order.
    pub elements: Vec<Vec<usize>>,
}

impl Mesh {
    /// The mesh of a design, small at its tip and its posts; at `fineness` 2 elements have half the
    /// sides.
    pub fn new(design: &Design, cut: Cut, fineness: f64) -> Mesh {
        let breaks = design
            .tip_offset_mm
            .map(|tip| breaks(design, tip, fineness));
        let mut mesh = Mesh {
            cut,
            breaks,
            nodes: Vec::new(),
            elements: Vec::new(),
        };
        mesh.fill(design);
        mesh
    }

    /// Elements along x, along y and through the thickness.
    pub fn counts(&self) -> [usize; 3] {
        let [across, down] = [0, 1].map(|axis| self.breaks[axis].len() - 1);
        [across, down, self.layers()]
    }

    /// The nodes that move a point, with their weights: where it is on the flat mounted film, mm,
    /// and what part of the thickness it is above the middle surface, −½ to ½.
    pub fn place(&self, [x, y, side]: [f64; 3]) -> Vec<(usize, f64)> {
        let [across, _, layers] = self.counts();
        let (i, x) = within(&self.breaks[0], x);
        let (j, y) = within(&self.breaks[1], y);
        let height = (side + 0.5) * layers as f64;
        let layer = (height.max(0.0) as usize).min(layers - 1);
        let point = [x, y, 2.0 * (height - layer as f64) - 1.0];
        let element = &self.elements[(j * across + i) * layers + layer];
        let weights = corners(self.cut)
            .iter()
            .map(|node| weight(self.cut, node, &point));
        element.iter().copied().zip(weights).collect()
    }

    fn layers(&self) -> usize {
        match self.cut {
            Cut::Bricks(layers) => layers,
            Cut::Shells => 1,
        }
    }

    fn fill(&mut self, design: &Design) {
        let mut known = HashMap::new();
        let [across, down, layers] = self.counts();
        for j in 0..down {
            for i in 0..across {
                for layer in 0..layers {
                    let nodes = corners(self.cut).iter().map(|node| {
                        let key = [0, 1, 2]
                            .map(|axis| 2 * [i, j, layer][axis] + (node[axis] + 1) as usize);
                        *known.entry(key).or_insert_with(|| {
                            self.nodes
                                .push(cut_place(&self.breaks, self.cut, design, key));
                            self.nodes.len() - 1
                        })
                    });
                    self.elements.push(nodes.collect());
                }
            }
        }
    }
}

/// Where the node at so many half elements along each axis is before the film is mounted, mm.
fn cut_place(breaks: &[Vec<f64>; 2], cut: Cut, design: &Design, key: [usize; 3]) -> [f64; 3] {
    let [x, y] = [0, 1].map(|axis| {
        let (at, breaks) = (key[axis], &breaks[axis]);
        (breaks[at / 2] + breaks[at.div_ceil(2)]) / 2.0
    });
    let z = match cut {
        Cut::Bricks(layers) => {
            design.thickness_mm_at([x, y]) * (key[2] as f64 / (2 * layers) as f64 - 0.5)
        }
        Cut::Shells => 0.0,
    };
    let [along_x, along_y] = design.stretch;
    [x / (1.0 + along_x), y / (1.0 + along_y), z]
}

fn corners(cut: Cut) -> &'static [[i8; 3]] {
    match cut {
        Cut::Bricks(_) => &BRICK,
        Cut::Shells => &SHELL,
    }
}

/// A node's quadratic function at a point of its element (serendipity).
fn weight(cut: Cut, node: &[i8; 3], point: &[f64; 3]) -> f64 {
    let axes = match cut {
        Cut::Bricks(_) => 3,
        Cut::Shells => 2,
    };
    let pairs = || node[..axes].iter().map(|side| f64::from(*side)).zip(point);
    let product: f64 = pairs()
        .map(|(side, at)| match side {
            0.0 => 1.0 - at * at,
            side => (1.0 + side * at) / 2.0,
        })
        .product();
    let sum: f64 = pairs().map(|(side, at)| side * at).sum();
    if node[..axes].contains(&0) {
        product
    } else {
        product * (sum - (axes - 1) as f64)
    }
}

/// The element along one axis that holds a place, and where in it, in −1…1.
fn within(breaks: &[f64], at: f64) -> (usize, f64) {
    let last = breaks.len() - 2;
    let index = breaks
        .partition_point(|from| *from <= at)
        .clamp(1, last + 1)
        - 1;
    let [from, to] = [breaks[index], breaks[index + 1]];
    (index, (2.0 * at - from - to) / (to - from))
}

/// Borders of elements along one axis: even steps in the integral of 1 / (wanted side).
fn breaks(design: &Design, tip_mm: f64, fineness: f64) -> Vec<f64> {
    let edge = design.half_edge_mm();
    let step = edge / SAMPLES as f64;
    let place = |i: usize| i as f64 * step - edge;
    let mut counts = vec![0.0];
    for i in 0..2 * SAMPLES {
        let side = side_mm(design, tip_mm, place(i) + step / 2.0) / fineness;
        counts.push(counts[i] + step / side);
    }
    let elements = counts[2 * SAMPLES].ceil();
    let scale = counts[2 * SAMPLES] / elements;
    let border = |k: usize| {
        let wanted = k as f64 * scale;
        let i = counts
            .partition_point(|count| *count < wanted)
            .clamp(1, 2 * SAMPLES);
        let part = (wanted - counts[i - 1]) / (counts[i] - counts[i - 1]);
        place(i - 1) + part.min(1.0) * step
    };
    let inner = (1..elements as usize).map(border);
    [-edge].into_iter().chain(inner).chain([edge]).collect()
}

/// The wanted side of an element at a place along one axis, fineness 1.
fn side_mm(design: &Design, tip_mm: f64, at_mm: f64) -> f64 {
    let beyond = |distance: f64, radius: f64| GROWTH * (distance.abs() - radius).max(0.0);
    let tip = TIP_SIDE_MM + beyond(at_mm - tip_mm, design.tip_radius_mm);
    let post = POST_SIDE_MM + beyond(at_mm.abs() - design.span_mm / 2.0, design.post_radius_mm);
    let dot = if design.dot_stiffening == 0.0 {
        LARGEST_SIDE_MM
    } else {
        DOT_SIDE_MM + beyond(at_mm.abs() - MARKER_REST_MM, DOT_RADIUS_MM)
    };
    tip.min(post).min(dot).min(LARGEST_SIDE_MM)
}
