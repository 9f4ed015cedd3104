//! The energy of one point of the shell, with its first and second derivatives.
//!
//! A Kirchhoff–Love shell with an energy per unit of undeformed area of
//!
//! ψ = m · W(E) + b · ½ Kᵀ D K,
//!
//! E = (ε₁₁, ε₂₂, 2ε₁₂) with Green's membrane strain ε = (a_α·a_β − δ_αβ)/2. K = (κ₁₁, κ₂₂, 2κ₁₂)
//! with the curvature κ_αβ = x,αβ · n of a film that rests flat. m and b are a place's shares of
//! the film's stiffness. W goes from Koiter's ½ Eᵀ A E to rubber's t C₁ (I + s I²). The former is
//! St Venant–Kirchhoff's plane stress, A = E t/(1−ν²) · [1 ν 0; ν 1 0; 0 0 (1−ν)/2]. The latter has
//! I = I₁ − 3 of an incompressible film in plane stress and C₁ = E/6. Bending is Koiter's with the
//! modulus at rest, D = A t²/12, for either. No term is linearized.

/// A vector in space.
pub type V3 = [f64; 3];
/// A matrix of three rows.
pub type M3 = [V3; 3];

/// The vectors that ψ depends on: a₁ = x,₁, a₂ = x,₂, x,₁₁, x,₂₂ and x,₁₂.
pub const VECTORS: usize = 5;
/// One vector for each of them.
pub type Point = [V3; VECTORS];

/// Density of silicone rubber, kg/m³.
pub const DENSITY_KG_PER_M3: f64 = 1070.0;
/// Its weight, N/mm³.
pub const WEIGHT_N_PER_MM3: f64 = DENSITY_KG_PER_M3 * 9.806_65e-9;

/// A film's material: an isotropic elastic sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus at rest, MPa (= N/mm²), > 0.
    pub youngs_mpa: f64,
    /// Poisson's ratio, −1 < ν ≤ 0.5. A neo-Hookean film has 0.5 independent of this value, except
    /// in bending.
    pub poisson: f64,
    /// Thickness before it is mounted, mm, > 0.
    pub thickness_mm: f64,
}

impl Material {
    /// Returns the membrane stiffness E t/(1−ν²), N/mm.
    pub fn membrane_n_per_mm(&self) -> f64 {
        self.youngs_mpa * self.thickness_mm / (1.0 - self.poisson * self.poisson)
    }

    /// Returns the bending stiffness E t³/(12 (1−ν²)), N·mm.
    pub fn bending_n_mm(&self) -> f64 {
        self.membrane_n_per_mm() * self.thickness_mm * self.thickness_mm / 12.0
    }

    /// Returns [1 ν 0; ν 1 0; 0 0 (1−ν)/2], times `stiffness`.
    fn law(&self, stiffness: f64) -> M3 {
        let nu = self.poisson;
        [
            [stiffness, stiffness * nu, 0.0],
            [stiffness * nu, stiffness, 0.0],
            [0.0, 0.0, stiffness * (1.0 - nu) / 2.0],
        ]
    }
}

/// The law of a film's elasticity under stretch; 0 and 0 is St Venant–Kirchhoff's law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Law {
    /// The part of rubber in the law, 0 (St Venant–Kirchhoff) to 1. At 1, W = C₁ (I₁−3) + C₂
    /// (I₁−3)² of an incompressible film, which also gets thinner as it is stretched.
    pub neo_hooke: f64,
    /// C₂/C₁ of the rubber part, 0 (neo-Hooke) to 0.5 (Yeoh).
    pub stiffening: f64,
}

/// The membrane and bending laws of a material, ready for use.
#[derive(Clone, Copy, Debug)]
pub struct Laws {
    membrane: M3,
    bending: M3,
    /// C₁ times the thickness, N/mm.
    rubber: f64,
    law: Law,
}

/// A place's share of the film's stiffness, for membrane and bending, times its area, mm².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Share of the membrane's stiffness.
    pub membrane: f64,
    /// Share of the bending stiffness.
    pub bending: f64,
}

/// The whole stiffness, for a unit of area.
#[cfg(test)]
pub const WHOLE: Share = Share {
    membrane: 1.0,
    bending: 1.0,
};

/// The second derivatives of ψ: a 3×3 block for each pair of vectors.
pub struct Second {
    /// Blocks of a₁ and a₂.
    pub plane: [[M3; 2]; 2],
    /// Blocks of a_k with x,₁₁ x,₂₂ x,₁₂.
    pub mixed: [[M3; 3]; 2],
    /// Blocks of two of the last three vectors: these factors times the products of the normal.
    pub far: M3,
    /// The normal.
    pub normal: V3,
}

/// I = I₁ − 3 of an incompressible film in plane stress with its derivatives by E.
struct Invariant {
    value: f64,
    /// det C and its derivatives.
    det: f64,
    by: V3,
    slopes: V3,
}

impl Invariant {
    #[inline(always)]
    fn new([e1, e2, g]: &V3) -> Invariant {
        let (sum, product) = (2.0 * (e1 + e2), 4.0 * e1 * e2 - g * g);
        let det = 1.0 + sum + product;
        let by = [2.0 + 4.0 * e2, 2.0 + 4.0 * e1, -2.0 * g];
        let square = det * det;
        Invariant {
            value: (sum * (sum + product) - product) / det,
            det,
            by,
            slopes: [2.0 - by[0] / square, 2.0 - by[1] / square, -by[2] / square],
        }
    }

    #[inline(always)]
    fn second(&self) -> M3 {
        let square = self.det * self.det;
        let mut second = scaled(&outer(&self.by, &self.by), 2.0 / (square * self.det));
        second[0][1] -= 4.0 / square;
        second[1][0] -= 4.0 / square;
        second[2][2] += 2.0 / square;
        second
    }
}

impl Laws {
    /// Returns the laws of `material`.
    pub fn new(material: &Material, law: Law) -> Laws {
        Laws {
            membrane: material.law(material.membrane_n_per_mm()),
            bending: material.law(material.bending_n_mm()),
            rubber: material.youngs_mpa * material.thickness_mm / 6.0,
            law,
        }
    }

    /// Returns W and its derivatives by E, N/mm.
    #[inline(always)]
    fn tension(&self, strain: &V3) -> (f64, V3) {
        let linear = apply(&self.membrane, strain);
        let energy = 0.5 * dot(strain, &linear);
        if self.law.neo_hooke == 0.0 {
            return (energy, linear);
        }
        let (rubber, by) = self.rubber(&Invariant::new(strain));
        let part = self.law.neo_hooke;
        (
            energy + part * (rubber - energy),
            less(&times(&linear, 1.0 - part), &by, -part),
        )
    }

    #[inline(always)]
    fn rubber(&self, i: &Invariant) -> (f64, V3) {
        let s = self.law.stiffening;
        let slope = self.rubber * (1.0 + 2.0 * s * i.value);
        (
            self.rubber * i.value * (1.0 + s * i.value),
            times(&i.slopes, slope),
        )
    }

    /// Returns the second derivatives of W by E, N/mm.
    #[inline(always)]
    fn tangent(&self, strain: &V3) -> M3 {
        if self.law.neo_hooke == 0.0 {
            return self.membrane;
        }
        let (part, s) = (self.law.neo_hooke, self.law.stiffening);
        let i = Invariant::new(strain);
        let mut tangent = scaled(&self.membrane, 1.0 - part);
        let slope = part * self.rubber * (1.0 + 2.0 * s * i.value);
        add_scaled(&mut tangent, &i.second(), slope);
        add_outer(
            &mut tangent,
            &i.slopes,
            &i.slopes,
            2.0 * s * part * self.rubber,
        );
        tangent
    }

    /// Returns ψ at a point.
    #[cfg(test)]
    pub fn energy(&self, x: &Point, share: Share) -> f64 {
        self.first(x, share).0
    }

    /// Returns ψ and its gradient.
    #[inline(always)]
    pub fn first(&self, x: &Point, share: Share) -> (f64, Point) {
        let (stretched, tension) = self.tension(&strain(x));
        let (bent, gradient) = self.bend(x, share.bending);
        let energy = share.membrane * stretched + bent;
        (energy, stretched_by(x, &tension, share.membrane, gradient))
    }

    /// Returns the gradients of membrane and bending, each for the whole stiffness.
    #[inline(always)]
    pub fn parts(&self, x: &Point) -> [Point; 2] {
        let (_, tension) = self.tension(&strain(x));
        let zero = [[0.0; 3]; VECTORS];
        [stretched_by(x, &tension, 1.0, zero), self.bend(x, 1.0).1]
    }

    /// Returns the derivatives of the membrane's gradient by the law's two numbers.
    #[inline(always)]
    pub fn by_law(&self, x: &Point) -> [Point; 2] {
        let strain = strain(x);
        let i = Invariant::new(&strain);
        let (_, rubber) = self.rubber(&i);
        let linear = apply(&self.membrane, &strain);
        let rubbery = less(&rubber, &linear, 1.0);
        let stiffer = 2.0 * self.law.neo_hooke * self.rubber * i.value;
        let zero = [[0.0; 3]; VECTORS];
        [
            stretched_by(x, &rubbery, 1.0, zero),
            stretched_by(x, &times(&i.slopes, stiffer), 1.0, zero),
        ]
    }

    /// Returns the energy and the gradient of bending.
    #[inline(always)]
    fn bend(&self, x: &Point, share: f64) -> (f64, Point) {
        let [a1, a2, ..] = x;
        let surface = Surface::new(x);
        let curvature = surface.curvature(x);
        let moment = times(&apply(&self.bending, &curvature), share);
        let weights = [moment[0], moment[1], 2.0 * moment[2]];
        let pull = sum_of(&weights, x);
        let along = dot(&pull, &surface.normal);
        let n = &surface.normal;
        let turned = times(&less(&pull, n, along), 1.0 / surface.area);
        (
            0.5 * dot(&curvature, &moment),
            [
                cross(a2, &turned),
                cross(&turned, a1),
                times(n, weights[0]),
                times(n, weights[1]),
                times(n, weights[2]),
            ],
        )
    }

    /// Returns the second derivatives of ψ.
    #[inline(always)]
    pub fn second(&self, x: &Point, share: Share) -> Second {
        let strain = strain(x);
        let (_, tension) = self.tension(&strain);
        let surface = Surface::new(x);
        let bending = scaled(&self.bending, share.bending);
        let moment = apply(&bending, &surface.curvature(x));
        let mut second = surface.second(x, &bending, &moment);
        let tangent = scaled(&self.tangent(&strain), share.membrane);
        let tension = times(&tension, share.membrane);
        add_stretch(&mut second.plane, x, &tangent, &tension);
        second.plane[1][0] = transposed(&second.plane[0][1]);
        second
    }
}

#[inline(always)]
fn strain([a1, a2, ..]: &Point) -> V3 {
    [
        0.5 * (dot(a1, a1) - 1.0),
        0.5 * (dot(a2, a2) - 1.0),
        dot(a1, a2),
    ]
}

/// Adds the part of the tension to a gradient.
#[inline(always)]
fn stretched_by([a1, a2, ..]: &Point, tension: &V3, share: f64, mut gradient: Point) -> Point {
    let [t1, t2, t12] = times(tension, share);
    for c in 0..3 {
        gradient[0][c] += t1 * a1[c] + t12 * a2[c];
        gradient[1][c] += t2 * a2[c] + t12 * a1[c];
    }
    gradient
}

/// Adds the membrane's second derivatives; the block of a₂ and a₁ is left out.
#[inline(always)]
fn add_stretch(plane: &mut [[M3; 2]; 2], [a1, a2, ..]: &Point, law: &M3, tension: &V3) {
    for (k, own, other, at) in [(0, a1, a2, 0), (1, a2, a1, 1)] {
        let block = &mut plane[k][k];
        add_outer(block, own, own, law[at][at]);
        add_outer(block, own, other, law[at][2]);
        add_outer(block, other, own, law[2][at]);
        add_outer(block, other, other, law[2][2]);
    }
    let both = &mut plane[0][1];
    add_outer(both, a1, a2, law[0][1]);
    add_outer(both, a1, a1, law[0][2]);
    add_outer(both, a2, a2, law[2][1]);
    add_outer(both, a2, a1, law[2][2]);
    for c in 0..3 {
        plane[0][0][c][c] += tension[0];
        plane[1][1][c][c] += tension[1];
        plane[0][1][c][c] += tension[2];
    }
}

/// The quantities of the deformed surface in the curvatures.
struct Surface {
    /// |a₁ × a₂|.
    area: f64,
    normal: V3,
    /// ∂n/∂a₁ and ∂n/∂a₂.
    turns: [M3; 2],
    /// ∂(a₁ × a₂)/∂a₁ and ∂(a₁ × a₂)/∂a₂.
    swings: [M3; 2],
}

impl Surface {
    #[inline(always)]
    fn new([a1, a2, ..]: &Point) -> Surface {
        let m = cross(a1, a2);
        let area = dot(&m, &m).sqrt();
        let normal = times(&m, 1.0 / area);
        let swings = [skew(&times(a2, -1.0)), skew(a1)];
        let flat = scaled(&across(&normal), 1.0 / area);
        let turns = [product(&flat, &swings[0]), product(&flat, &swings[1])];
        Surface {
            area,
            normal,
            turns,
            swings,
        }
    }

    #[inline(always)]
    fn curvature(&self, [_, _, x11, x22, x12]: &Point) -> V3 {
        let n = &self.normal;
        [dot(x11, n), dot(x22, n), 2.0 * dot(x12, n)]
    }

    /// Returns the second derivatives of ½ Kᵀ law K. The block of a₂ and a₁ is left out.
    #[inline(always)]
    fn second(&self, x: &Point, law: &M3, moment: &V3) -> Second {
        let n = &self.normal;
        // ∂K_i/∂a_k.
        let mut gradients = [[[0.0; 3]; 3]; 2];
        for k in 0..2 {
            for i in 0..3 {
                gradients[k][i] = times(&apply_transposed(&self.turns[k], &x[2 + i]), TWICE[i]);
            }
        }
        let mut plane = [[[[0.0; 3]; 3]; 2]; 2];
        let mut mixed = [[[[0.0; 3]; 3]; 3]; 2];
        for k in 0..2 {
            // law · gradients: the weights of each curvature's gradient by a_k.
            let weighted = product(&transposed(law), &gradients[k]);
            for l in k..2 {
                for j in 0..3 {
                    add_outer(&mut plane[k][l], &weighted[j], &gradients[l][j], 1.0);
                }
            }
            for j in 0..3 {
                mixed[k][j] = scaled(&transposed(&self.turns[k]), moment[j] * TWICE[j]);
                add_outer(&mut mixed[k][j], &weighted[j], n, TWICE[j]);
            }
        }
        let weights = [moment[0], moment[1], 2.0 * moment[2]];
        let mut far = *law;
        for i in 0..3 {
            for j in 0..3 {
                far[i][j] *= TWICE[i] * TWICE[j];
            }
        }
        self.add_turning(&mut plane, x, &sum_of(&weights, x));
        Second {
            plane,
            mixed,
            far,
            normal: *n,
        }
    }

    /// Adds the second derivative of pull · n by (a₁, a₂), of S/J with S = pull · (a₁ × a₂) and J =
    /// |a₁ × a₂|.
    #[inline(always)]
    fn add_turning(&self, plane: &mut [[M3; 2]; 2], [a1, a2, ..]: &Point, pull: &V3) {
        let (j, n) = (self.area, &self.normal);
        let s_over_j = dot(pull, n);
        let ds = [cross(a2, pull), cross(pull, a1)];
        let dj = [cross(a2, n), cross(n, a1)];
        let square = 1.0 / (j * j);
        for k in 0..2 {
            for l in k..2 {
                let block = &mut plane[k][l];
                add_outer(block, &ds[k], &dj[l], -square);
                add_outer(block, &dj[k], &ds[l], -square);
                add_outer(block, &dj[k], &dj[l], 2.0 * s_over_j * square);
                let bent = product(&transposed(&self.swings[k]), &self.turns[l]);
                add_scaled(block, &bent, -s_over_j / j);
            }
        }
        // The mixed second derivatives of v · (a₁ × a₂), for v = pull in S and v = n in J.
        let mixed = times(&less(pull, n, s_over_j), 1.0 / j);
        add_scaled(&mut plane[0][1], &skew(&mixed), -1.0);
    }
}

/// K's third entry is 2κ₁₂.
const TWICE: V3 = [1.0, 1.0, 2.0];

/// Returns Σ weight_i · x_(2 + i).
#[inline(always)]
fn sum_of(weights: &V3, x: &Point) -> V3 {
    let mut sum = [0.0; 3];
    for c in 0..3 {
        sum[c] = weights[0] * x[2][c] + weights[1] * x[3][c] + weights[2] * x[4][c];
    }
    sum
}

/// Returns a · b.
#[inline(always)]
pub fn dot(a: &V3, b: &V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns a × b.
#[inline(always)]
pub fn cross(a: &V3, b: &V3) -> V3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns the matrix of v ×.
#[inline(always)]
fn skew(v: &V3) -> M3 {
    [[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]]
}

/// Returns I − n nᵀ.
#[inline(always)]
fn across(n: &V3) -> M3 {
    let mut matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    add_outer(&mut matrix, n, n, -1.0);
    matrix
}

#[inline(always)]
fn apply(m: &M3, v: &V3) -> V3 {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

#[inline(always)]
fn apply_transposed(m: &M3, v: &V3) -> V3 {
    let mut sum = [0.0; 3];
    for c in 0..3 {
        sum[c] = m[0][c] * v[0] + m[1][c] * v[1] + m[2][c] * v[2];
    }
    sum
}

#[inline(always)]
fn product(a: &M3, b: &M3) -> M3 {
    [
        apply_transposed(b, &a[0]),
        apply_transposed(b, &a[1]),
        apply_transposed(b, &a[2]),
    ]
}

#[inline(always)]
fn transposed([a, b, c]: &M3) -> M3 {
    [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]]
}

#[inline(always)]
fn scaled(m: &M3, factor: f64) -> M3 {
    [
        times(&m[0], factor),
        times(&m[1], factor),
        times(&m[2], factor),
    ]
}

#[inline(always)]
fn times([a, b, c]: &V3, factor: f64) -> V3 {
    [factor * a, factor * b, factor * c]
}

#[inline(always)]
fn outer(a: &V3, b: &V3) -> M3 {
    [times(b, a[0]), times(b, a[1]), times(b, a[2])]
}

/// Returns a − factor · b.
#[inline(always)]
fn less(a: &V3, b: &V3, factor: f64) -> V3 {
    [
        a[0] - factor * b[0],
        a[1] - factor * b[1],
        a[2] - factor * b[2],
    ]
}

#[inline(always)]
fn add_scaled(sum: &mut M3, m: &M3, factor: f64) {
    for (row, add) in sum.iter_mut().zip(m) {
        for (slot, part) in row.iter_mut().zip(add) {
            *slot += factor * part;
        }
    }
}

#[inline(always)]
fn add_outer(sum: &mut M3, a: &V3, b: &V3, factor: f64) {
    for (row, left) in sum.iter_mut().zip(a) {
        let left = factor * left;
        for (slot, right) in row.iter_mut().zip(b) {
            *slot += left * right;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FILM: Material = Material {
        youngs_mpa: 1.0,
        poisson: 0.49,
        thickness_mm: 0.5,
    };

    /// Generates surfaces that are stretched, sheared, turned and bent, and far from degenerate.
    fn any_point() -> impl Strategy<Value = Point> {
        prop::array::uniform5(prop::array::uniform3(-0.4..0.4)).prop_map(|mut x| {
            x[0][0] += 1.0;
            x[1][1] += 1.0;
            x
        })
    }

    /// Returns a less stretched surface, at which rubber's law is not steep.
    fn calm(mut x: Point) -> Point {
        for (k, vector) in x.iter_mut().enumerate().take(2) {
            for (c, part) in vector.iter_mut().enumerate() {
                let rest = if k == c { 1.0 } else { 0.0 };
                *part = rest + 0.5 * (*part - rest);
            }
        }
        x
    }

    fn any_law() -> impl Strategy<Value = Laws> {
        (0.0..=1.0, 0.0..0.5).prop_map(|(neo_hooke, stiffening)| {
            let law = Law {
                neo_hooke,
                stiffening,
            };
            Laws::new(&FILM, law)
        })
    }

    fn linear() -> Laws {
        Laws::new(&FILM, Law::default())
    }

    const SHARE: Share = Share {
        membrane: 0.7,
        bending: 1.3,
    };

    fn stepped(x: &Point, p: usize, c: usize, step: f64) -> Point {
        let mut moved = *x;
        moved[p][c] += step;
        moved
    }

    /// Returns the blocks of all pairs.
    fn blocks(second: &Second) -> [[M3; VECTORS]; VECTORS] {
        let far = outer(&second.normal, &second.normal);
        std::array::from_fn(|p| {
            std::array::from_fn(|q| match (p, q) {
                (0..2, 0..2) => second.plane[p][q],
                (0..2, _) => second.mixed[p][q - 2],
                (_, 0..2) => transposed(&second.mixed[q][p - 2]),
                _ => scaled(&far, second.far[p - 2][q - 2]),
            })
        })
    }

    fn hold_together(laws: &Laws, x: &Point) {
        let (_, gradient) = laws.first(x, SHARE);
        let second = laws.second(x, SHARE);
        let [membrane, bending] = laws.parts(x);
        let blocks = blocks(&second);
        for q in 0..VECTORS {
            for d in 0..3 {
                let moved = |step| laws.first(&stepped(x, q, d, step), SHARE);
                let [a, b, aa, bb] = [1e-3, -1e-3, 2e-3, -2e-3].map(moved);
                let slope = (8.0 * (a.0 - b.0) - aa.0 + bb.0) / 12e-3;
                assert!((slope - gradient[q][d]).abs() < 1e-8);
                let sum = SHARE.membrane * membrane[q][d] + SHARE.bending * bending[q][d];
                assert!((sum - gradient[q][d]).abs() < 1e-13);
                for p in 0..VECTORS {
                    for c in 0..3 {
                        let [a, b, aa, bb] = [&a, &b, &aa, &bb].map(|at| at.1[p][c]);
                        let slope = (8.0 * (a - b) - aa + bb) / 12e-3;
                        assert!((slope - blocks[p][q][c][d]).abs() < 1e-7);
                    }
                }
            }
        }
    }

    proptest! {
        #[test]
        fn derivatives_are_slopes(x in any_point()) {
            hold_together(&linear(), &x);
        }

        #[test]
        fn derivatives_are_slopes_of_rubber(laws in any_law(), x in any_point()) {
            hold_together(&laws, &calm(x));
        }

        #[test]
        fn the_law_answers_to_its_numbers(laws in any_law(), x in any_point()) {
            let x = calm(x);
            let by = laws.by_law(&x);
            let gradient = |rubber: f64, stiffer: f64| {
                let mut there = laws;
                there.law.neo_hooke += rubber;
                there.law.stiffening += stiffer;
                there.parts(&x)[0]
            };
            let pairs = [
                [gradient(1e-4, 0.0), gradient(-1e-4, 0.0)],
                [gradient(0.0, 1e-4), gradient(0.0, -1e-4)],
            ];
            for (by, [forth, back]) in by.iter().zip(pairs) {
                for p in 0..VECTORS {
                    for c in 0..3 {
                        let slope = (forth[p][c] - back[p][c]) / 2e-4;
                        prop_assert!((slope - by[p][c]).abs() < 1e-9);
                    }
                }
            }
        }

        #[test]
        fn a_rigid_turn_costs_nothing(angle in -3.0..3.0, laws in any_law(), bent in any_point()) {
            let (sin, cos) = f64::sin_cos(angle);
            let turn = |v: V3| [v[0], cos * v[1] - sin * v[2], sin * v[1] + cos * v[2]];
            let bent = calm(bent);
            let difference = laws.energy(&bent.map(turn), WHOLE) - laws.energy(&bent, WHOLE);
            prop_assert!(difference.abs() < 1e-14);
        }
    }

    fn stretched(x: f64, y: f64) -> Point {
        [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0; 3], [0.0; 3], [0.0; 3]]
    }

    #[test]
    fn known_states_have_their_energies() {
        let laws = linear();
        let flat = stretched(1.0, 1.0);
        assert_eq!(laws.energy(&flat, WHOLE), 0.0);

        let strain = (1.1f64 * 1.1 - 1.0) / 2.0;
        let expected = 0.5 * FILM.membrane_n_per_mm() * strain * strain;
        assert!((laws.energy(&stretched(1.1, 1.0), WHOLE) - expected).abs() < 1e-15);

        let mut twisted = flat;
        twisted[4][2] = 0.2;
        let expected = FILM.bending_n_mm() * (1.0 - FILM.poisson) * 0.2 * 0.2;
        assert!((laws.energy(&twisted, WHOLE) - expected).abs() < 1e-15);
    }

    /// Treloar's stresses (per area at rest) of uniaxial and equibiaxial tension: 2 (λ − λ⁻²) (C₁ +
    /// 2 C₂ I) and 2 (λ − λ⁻⁵) (C₁ + 2 C₂ I).
    #[test]
    fn rubber_has_its_stresses() {
        for stiffening in [0.0, 0.3] {
            let law = Law {
                neo_hooke: 1.0,
                stiffening,
            };
            let laws = Laws::new(&FILM, law);
            let c1 = FILM.youngs_mpa / 6.0;
            for stretch in [0.9f64, 1.01, 1.3, 2.0] {
                let free = stretch.powf(-0.5);
                let pull = laws.first(&stretched(stretch, free), WHOLE).1;
                let more = |i: f64| c1 * (1.0 + 2.0 * stiffening * i);
                let i = stretch.powi(2) + 2.0 / stretch - 3.0;
                let stress = 2.0 * (stretch - stretch.powi(-2)) * more(i);
                assert!((pull[0][0] - FILM.thickness_mm * stress).abs() < 1e-12);
                assert!(pull[1][1].abs() < 1e-12, "the sides are free");
                let pull = laws.first(&stretched(stretch, stretch), WHOLE).1;
                let i = 2.0 * stretch.powi(2) + stretch.powi(-4) - 3.0;
                let stress = 2.0 * (stretch - stretch.powi(-5)) * more(i);
                assert!((pull[0][0] - FILM.thickness_mm * stress).abs() < 1e-12);
            }
            // Young's modulus at rest.
            let stretch = 1.0 + 1e-6;
            let pull = laws.first(&stretched(stretch, stretch.powf(-0.5)), WHOLE).1;
            assert!((pull[0][0] / (FILM.thickness_mm * 1e-6) - FILM.youngs_mpa).abs() < 1e-5);
        }
    }
}
