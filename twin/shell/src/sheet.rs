//! The film as a sheet: its material, stretch, thickness and weight, without its outline.

use crate::point::{Law, Material, Share, V3, WEIGHT_N_PER_MM3};

/// Number of terms in the variation of the thickness: X, Y, X², XY and Y².
pub const TERMS: usize = 5;
/// The distance from the middle at which X and Y are 1, mm.
pub const TERM_MM: f64 = 14.0;
/// Radius of a dot that stiffens the film, mm.
const DOT_RADIUS_MM: f64 = 0.5;
/// Radii of the rings of a dot's points, in parts of its radius: Gauss's two for sums over a disc.
/// Each ring stands for half of the area.
const DOT_RINGS: [f64; 2] = [0.459_700_843_380_983_1, 0.888_073_833_977_115_3];
const DOT_RAYS: usize = 8;

/// The properties of a film except for its outline: its stretch, its elasticity and its weight.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// The material.
    pub material: Material,
    /// The law of its elasticity when it is stretched.
    pub law: Law,
    /// The stretch with which it is mounted, along x and y.
    pub stretch: [f64; 2],
    /// Variation of the thickness, relative.
    pub terms: [f64; TERMS],
    /// Gravity, in parts of g.
    pub down: V3,
    /// Places of the dots that stiffen the film, mm.
    pub dots_mm: Vec<[f64; 2]>,
    /// The additional stiffness on a dot, in parts of the film's own.
    pub dot_stiffening: f64,
}

impl Sheet {
    /// Returns an even, weightless film of `material`, mounted without stretch.
    #[cfg(test)]
    pub fn of(material: &Material) -> Sheet {
        Sheet {
            material: *material,
            law: Law::default(),
            stretch: [0.0; 2],
            terms: [0.0; TERMS],
            down: [0.0; 3],
            dots_mm: Vec::new(),
            dot_stiffening: 0.0,
        }
    }

    /// Returns 1 + stretch along x and y.
    pub fn scales(&self) -> [f64; 2] {
        self.stretch.map(|part| 1.0 + part)
    }

    /// Returns the factors of the thickness's terms at a point of the mounted film.
    pub fn terms_at(point: [f64; 2]) -> [f64; TERMS] {
        let [x, y] = point.map(|part| part / TERM_MM);
        [x, y, x * x, x * y, y * y]
    }

    /// Returns the thickness at a point in parts of the nominal one.
    pub fn relative(&self, point: [f64; 2]) -> f64 {
        let terms = Sheet::terms_at(point).into_iter().zip(self.terms);
        1.0 + terms.map(|(at, size)| at * size).sum::<f64>()
    }

    /// Returns a place's share of the stiffness, times `area`.
    pub fn share(&self, point: [f64; 2], area: f64) -> Share {
        let relative = self.relative(point);
        Share {
            membrane: area * relative,
            bending: area * relative.powi(3),
        }
    }

    /// Returns the weight of the nominal film per area before it was stretched, N/mm², under 1 g.
    pub fn weight(&self) -> f64 {
        WEIGHT_N_PER_MM3 * self.material.thickness_mm
    }

    /// Iterates over the dots' points and the areas that they stand for, mm².
    pub fn dot_points(&self) -> impl Iterator<Item = ([f64; 2], f64)> {
        let area = std::f64::consts::PI * DOT_RADIUS_MM * DOT_RADIUS_MM;
        let each = area / (DOT_RAYS * DOT_RINGS.len()) as f64;
        let point = move |[cx, cy]: [f64; 2], ring: f64, ray: usize| {
            let angle = (ray as f64 + 0.5) * std::f64::consts::TAU / DOT_RAYS as f64;
            let (sin, cos) = angle.sin_cos();
            let r = ring * DOT_RADIUS_MM;
            ([cx + r * cos, cy + r * sin], each)
        };
        self.dots_mm.iter().flat_map(move |&centre| {
            DOT_RINGS
                .into_iter()
                .flat_map(move |ring| (0..DOT_RAYS).map(move |ray| point(centre, ring, ray)))
        })
    }
}
