//! The readings of the paper's Q that are not this crate's [`Design`], as the mean of R* that each
//! gives.

use hivtac_studies::paper_model::{Design, NormalPress, OutOfDomain, PinholeDistance};

use crate::scan;

/// a, f and ε's upper bound in the paper (what it reads from Figure 6), mm.
const HALF_SIDE_MM: f64 = 14.0;
const FOCAL_MM: f64 = 2.1;
pub const EPSILON_MM: f64 = 0.18;

/// Eq. 24 as it stands, by scanning it: a check of R* that shares nothing with its root.
pub fn as_printed(d_ph: PinholeDistance) -> [f64; 2] {
    let design = Design::paper(d_ph);
    scan::means(|pm, z, shear| must(design.quality_mm(pm, z, shear)))
}

/// z is the depth of the centre and the marker's falls off towards the corner, as the model's film
/// does.
pub fn depth_of_the_centre(d_ph: PinholeDistance) -> [f64; 2] {
    let design = Design::paper(d_ph);
    let pn = design.pn_mm();
    scan::means(|pm, z, shear| must(design.quality_mm(pm, z * (1.0 - pm / pn), shear)))
}

/// Every marker moves outward by ε = 0.18 mm, whatever the depth.
pub fn constant_epsilon(d_ph: PinholeDistance) -> [f64; 2] {
    let design = Design::paper(d_ph);
    scan::means(|pm, z, shear| {
        let press = NormalPress {
            pm_mm: pm,
            z_mm: z,
            d_ph_mm: must(design.d_ph_mm(pm)),
            epsilon_mm: EPSILON_MM,
        };
        50.0 * must(press.disp_n_mm(FOCAL_MM)) + shear * (1.0 - pm / design.pn_mm())
    })
}

/// disp_S is taken on the image plane too, at the lens's scale on its axis, f / h.
pub fn shear_as_seen(d_ph: PinholeDistance) -> Design<f64> {
    let paper = Design::paper(d_ph);
    Design {
        normal_weight: paper.normal_weight * paper.film_distance_mm / paper.focal_mm,
        ..paper
    }
}

/// The smallest and the largest mean over positive values that a grid of points with its edges
/// gives, for 5 to 101 points along each side.
pub fn over_grids(d_ph: PinholeDistance) -> [f64; 2] {
    let means = (5..=101).map(|points| on_a_grid(&Design::paper(d_ph), points));
    means.fold([f64::MAX, 0.0], |[low, high], mean| {
        [low.min(mean), high.max(mean)]
    })
}

fn on_a_grid(design: &Design<f64>, points: usize) -> f64 {
    let at = |index: usize| index as f64 / (points - 1) as f64 * (HALF_SIDE_MM / 2.0);
    let all = (0..points * points).map(|n| must(design.best_r(at(n % points), at(n / points))));
    let positive: Vec<f64> = all.flatten().collect();
    positive.iter().sum::<f64>() / positive.len() as f64
}

fn must<T>(value: Result<T, OutOfDomain>) -> T {
    value.unwrap_or_else(|why| panic!("{why}"))
}
