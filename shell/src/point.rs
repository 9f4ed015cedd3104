//! The energy of one point of the shell, with its first and second derivatives.
//!
//! A Kirchhoff–Love shell with Koiter's energy per unit of undeformed area,
//!
//! ψ = ½ Eᵀ A E + ½ Kᵀ D K,
//!
//! E = (ε₁₁, ε₂₂, 2ε₁₂) with Green's membrane strain ε = (a_α·a_β − δ_αβ)/2, K = (κ₁₁, κ₂₂, 2κ₁₂)
//! with the curvature κ_αβ = x,αβ · n of a film that rests flat, and the St Venant–Kirchhoff
//! plane-stress law A = E t/(1−ν²) · [1 ν 0; ν 1 0; 0 0 (1−ν)/2], D = A t²/12. Nothing is
//! linearized.

/// A vector in space.
pub type V3 = [f64; 3];
type M3 = [V3; 3];

/// The vectors that ψ depends on: a₁ = x,₁, a₂ = x,₂, x,₁₁, x,₂₂ and x,₁₂.
pub const VECTORS: usize = 5;
/// One vector for each of them.
pub type Point = [V3; VECTORS];
/// The second derivatives: a 3×3 block for each pair.
pub type Blocks = [[M3; VECTORS]; VECTORS];

/// What a film is made of: an isotropic elastic sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus, MPa (= N/mm²), > 0.
    pub youngs_mpa: f64,
    /// Poisson's ratio, −1 < ν ≤ 0.5.
    pub poisson: f64,
    /// Thickness, mm, > 0.
    pub thickness_mm: f64,
}

impl Material {
    /// Membrane stiffness E t/(1−ν²), N/mm.
    pub fn membrane_n_per_mm(&self) -> f64 {
        self.youngs_mpa * self.thickness_mm / (1.0 - self.poisson * self.poisson)
    }

    /// Bending stiffness E t³/(12 (1−ν²)), N·mm.
    pub fn bending_n_mm(&self) -> f64 {
        self.membrane_n_per_mm() * self.thickness_mm * self.thickness_mm / 12.0
    }

    /// [1 ν 0; ν 1 0; 0 0 (1−ν)/2], times `stiffness`.
    fn law(&self, stiffness: f64) -> M3 {
        let nu = self.poisson;
        [
            [stiffness, stiffness * nu, 0.0],
            [stiffness * nu, stiffness, 0.0],
            [0.0, 0.0, stiffness * (1.0 - nu) / 2.0],
        ]
    }
}

/// The membrane and bending laws of a material, ready for use.
#[derive(Clone, Copy, Debug)]
pub struct Laws {
    membrane: M3,
    bending: M3,
}

impl Laws {
    /// The laws of `material`.
    pub fn new(material: &Material) -> Laws {
        Laws {
            membrane: material.law(material.membrane_n_per_mm()),
            bending: material.law(material.bending_n_mm()),
        }
    }

    /// ψ at a point, N/mm.
    pub fn energy(&self, x: &Point) -> f64 {
        let (strain, curvature) = (strain(x), Surface::new(x).curvature(x));
        let of = |law: &M3, e: &V3| 0.5 * dot(e, &apply(law, e));
        of(&self.membrane, &strain) + of(&self.bending, &curvature)
    }

    /// ψ, its gradient and its second derivatives.
    pub fn derivatives(&self, x: &Point) -> (f64, Point, Blocks) {
        let surface = Surface::new(x);
        let (strain, curvature) = (strain(x), surface.curvature(x));
        let tension = apply(&self.membrane, &strain);
        let moment = apply(&self.bending, &curvature);
        let energy = 0.5 * (dot(&strain, &tension) + dot(&curvature, &moment));
        let (stretch, bend) = (strain_gradients(x), surface.curvature_gradients(x));

        let mut blocks = [[[[0.0; 3]; 3]; VECTORS]; VECTORS];
        add_products(&mut blocks, &stretch, &self.membrane);
        add_products(&mut blocks, &bend, &self.bending);
        add_tension(&mut blocks, &tension);
        surface.add_moment(&mut blocks, x, &moment);
        (energy, combine(&stretch, &tension, &bend, &moment), blocks)
    }
}

/// The unit normal of the deformed surface.
pub fn normal(a1: &V3, a2: &V3) -> V3 {
    let m = cross(a1, a2);
    let length = dot(&m, &m).sqrt();
    m.map(|part| part / length)
}

fn strain([a1, a2, ..]: &Point) -> V3 {
    [
        0.5 * (dot(a1, a1) - 1.0),
        0.5 * (dot(a2, a2) - 1.0),
        dot(a1, a2),
    ]
}

/// ∂E/∂x for the three strains.
fn strain_gradients([a1, a2, ..]: &Point) -> [Point; 3] {
    let zero = [0.0; 3];
    [
        [*a1, zero, zero, zero, zero],
        [zero, *a2, zero, zero, zero],
        [*a2, *a1, zero, zero, zero],
    ]
}

/// What the curvatures need of the deformed surface.
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
    fn new([a1, a2, ..]: &Point) -> Surface {
        let m = cross(a1, a2);
        let area = dot(&m, &m).sqrt();
        let normal = m.map(|part| part / area);
        let swings = [skew(&a2.map(|part| -part)), skew(a1)];
        let turns = swings.map(|swing| scaled(&product(&across(&normal), &swing), 1.0 / area));
        Surface {
            area,
            normal,
            turns,
            swings,
        }
    }

    fn curvature(&self, [_, _, x11, x22, x12]: &Point) -> V3 {
        let n = &self.normal;
        [dot(x11, n), dot(x22, n), 2.0 * dot(x12, n)]
    }

    /// ∂K/∂x for the three curvatures.
    fn curvature_gradients(&self, x: &Point) -> [Point; 3] {
        let mut gradients = [[[0.0; 3]; VECTORS]; 3];
        for (i, gradient) in gradients.iter_mut().enumerate() {
            let twice = TWICE[i];
            for (slot, turn) in gradient.iter_mut().zip(&self.turns) {
                *slot = apply_transposed(turn, &x[2 + i]).map(|part| twice * part);
            }
            gradient[2 + i] = self.normal.map(|part| twice * part);
        }
        gradients
    }

    /// Adds Σ moment_i · ∂²K_i/∂x².
    fn add_moment(&self, blocks: &mut Blocks, x: &Point, moment: &V3) {
        let mut pull = [0.0; 3];
        for i in 0..3 {
            let weight = moment[i] * TWICE[i];
            for k in 0..2 {
                add_scaled(&mut blocks[2 + i][k], &self.turns[k], weight);
                add_scaled(&mut blocks[k][2 + i], &transposed(&self.turns[k]), weight);
            }
            for (sum, part) in pull.iter_mut().zip(&x[2 + i]) {
                *sum += weight * part;
            }
        }
        self.add_turning(blocks, x, &pull);
    }

    /// Adds the second derivative of pull · n by (a₁, a₂), of S/J with S = pull · (a₁ × a₂) and J =
    /// |a₁ × a₂|.
    fn add_turning(&self, blocks: &mut Blocks, [a1, a2, ..]: &Point, pull: &V3) {
        let (j, n) = (self.area, &self.normal);
        let s_over_j = dot(pull, n);
        let ds = [cross(a2, pull), cross(pull, a1)];
        let dj = [cross(a2, n), cross(n, a1)];
        let flat = across(n);
        for k in 0..2 {
            for l in 0..2 {
                let block = &mut blocks[k][l];
                add_outer(block, &ds[k], &dj[l], -1.0 / (j * j));
                add_outer(block, &dj[k], &ds[l], -1.0 / (j * j));
                add_outer(block, &dj[k], &dj[l], 2.0 * s_over_j / (j * j));
                let bent = product(
                    &transposed(&self.swings[k]),
                    &product(&flat, &self.swings[l]),
                );
                add_scaled(block, &bent, -s_over_j / (j * j));
            }
        }
        // The mixed second derivatives of v · (a₁ × a₂), for v = pull in S and v = n in J.
        let mixed: V3 = std::array::from_fn(|i| (pull[i] - s_over_j * n[i]) / j);
        add_scaled(&mut blocks[0][1], &skew(&mixed), -1.0);
        add_scaled(&mut blocks[1][0], &skew(&mixed), 1.0);
    }
}

/// K's third entry is 2κ₁₂.
const TWICE: V3 = [1.0, 1.0, 2.0];

/// Adds Σ tension_i · ∂²E_i/∂x².
fn add_tension(blocks: &mut Blocks, tension: &V3) {
    for i in 0..3 {
        blocks[0][0][i][i] += tension[0];
        blocks[1][1][i][i] += tension[1];
        blocks[0][1][i][i] += tension[2];
        blocks[1][0][i][i] += tension[2];
    }
}

/// Adds Σ law_ij · gradient_i ⊗ gradient_j.
fn add_products(blocks: &mut Blocks, gradients: &[Point; 3], law: &M3) {
    for p in 0..VECTORS {
        let weighted: [V3; 3] = std::array::from_fn(|j| {
            std::array::from_fn(|c| (0..3).map(|i| gradients[i][p][c] * law[i][j]).sum())
        });
        for q in 0..VECTORS {
            for j in 0..3 {
                add_outer(&mut blocks[p][q], &weighted[j], &gradients[j][q], 1.0);
            }
        }
    }
}

fn combine(stretch: &[Point; 3], tension: &V3, bend: &[Point; 3], moment: &V3) -> Point {
    std::array::from_fn(|p| {
        std::array::from_fn(|c| {
            (0..3)
                .map(|i| stretch[i][p][c] * tension[i] + bend[i][p][c] * moment[i])
                .sum()
        })
    })
}

/// a · b.
pub fn dot(a: &V3, b: &V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &V3, b: &V3) -> V3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The matrix of v ×.
fn skew(v: &V3) -> M3 {
    [[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]]
}

/// I − n nᵀ.
fn across(n: &V3) -> M3 {
    let mut matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    add_outer(&mut matrix, n, n, -1.0);
    matrix
}

fn apply(m: &M3, v: &V3) -> V3 {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

fn apply_transposed(m: &M3, v: &V3) -> V3 {
    std::array::from_fn(|c| m[0][c] * v[0] + m[1][c] * v[1] + m[2][c] * v[2])
}

fn product(a: &M3, b: &M3) -> M3 {
    a.map(|row| apply_transposed(b, &row))
}

fn transposed(m: &M3) -> M3 {
    std::array::from_fn(|r| std::array::from_fn(|c| m[c][r]))
}

fn scaled(m: &M3, factor: f64) -> M3 {
    m.map(|row| row.map(|part| part * factor))
}

fn add_scaled(sum: &mut M3, m: &M3, factor: f64) {
    for (row, add) in sum.iter_mut().zip(m) {
        for (slot, part) in row.iter_mut().zip(add) {
            *slot += factor * part;
        }
    }
}

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

    /// A surface stretched, sheared, turned and bent, and far from degenerate.
    fn any_point() -> impl Strategy<Value = Point> {
        prop::array::uniform5(prop::array::uniform3(-0.4..0.4)).prop_map(|mut x| {
            x[0][0] += 1.0;
            x[1][1] += 1.0;
            x
        })
    }

    fn stepped(x: &Point, p: usize, c: usize, step: f64) -> Point {
        let mut moved = *x;
        moved[p][c] += step;
        moved
    }

    proptest! {
        #[test]
        fn gradient_is_the_energys_slope(x in any_point()) {
            let laws = Laws::new(&FILM);
            let (energy, gradient, _) = laws.derivatives(&x);
            prop_assert!((energy - laws.energy(&x)).abs() < 1e-14);
            for p in 0..VECTORS {
                for c in 0..3 {
                    let at = |step| laws.energy(&stepped(&x, p, c, step));
                    let slope = (8.0 * (at(1e-3) - at(-1e-3)) - at(2e-3) + at(-2e-3)) / 12e-3;
                    prop_assert!((slope - gradient[p][c]).abs() < 1e-9);
                }
            }
        }

        #[test]
        fn blocks_are_the_gradients_slopes(x in any_point()) {
            let laws = Laws::new(&FILM);
            let (_, _, blocks) = laws.derivatives(&x);
            for q in 0..VECTORS {
                for d in 0..3 {
                    let at = |step| laws.derivatives(&stepped(&x, q, d, step)).1;
                    let (a, b, aa, bb) = (at(1e-3), at(-1e-3), at(2e-3), at(-2e-3));
                    for p in 0..VECTORS {
                        for c in 0..3 {
                            let slope = (8.0 * (a[p][c] - b[p][c]) - aa[p][c] + bb[p][c]) / 12e-3;
                            prop_assert!((slope - blocks[p][q][c][d]).abs() < 1e-8);
                        }
                    }
                }
            }
        }

        #[test]
        fn a_rigid_turn_costs_nothing(angle in -3.0..3.0, bent in any_point()) {
            let (sin, cos) = f64::sin_cos(angle);
            let turn = |v: V3| [v[0], cos * v[1] - sin * v[2], sin * v[1] + cos * v[2]];
            let laws = Laws::new(&FILM);
            let difference = laws.energy(&bent.map(turn)) - laws.energy(&bent);
            prop_assert!(difference.abs() < 1e-14);
        }
    }

    #[test]
    fn known_states_have_their_energies() {
        let laws = Laws::new(&FILM);
        let flat = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0; 3],
            [0.0; 3],
            [0.0; 3],
        ];
        assert_eq!(laws.energy(&flat), 0.0);

        let mut stretched = flat;
        stretched[0][0] = 1.1;
        let strain = (1.1f64 * 1.1 - 1.0) / 2.0;
        let expected = 0.5 * FILM.membrane_n_per_mm() * strain * strain;
        assert!((laws.energy(&stretched) - expected).abs() < 1e-15);

        let mut twisted = flat;
        twisted[4][2] = 0.2;
        let expected = FILM.bending_n_mm() * (1.0 - FILM.poisson) * 0.2 * 0.2;
        assert!((laws.energy(&twisted) - expected).abs() < 1e-15);
    }
}
