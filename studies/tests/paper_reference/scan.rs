//! R* by brute force, for any reading of Q.

/// Cells along each axis of z_m', PP' ∈ [0, a/2], and steps of R in [0, 1].
const CELLS: usize = 70;
const STEPS: usize = 1000;
/// a/2 and PN of the paper's design, mm.
const EXTENT_MM: f64 = 7.0;
const PN_MM: f64 = 14.0 * std::f64::consts::SQRT_2;

/// The mean over positive values, and with zeros, of the R where `quality(PM, normal, shear)` is
/// largest.
///
/// Good to three digits: R is a multiple of 0.001.
pub fn means(quality: impl Fn(f64, f64, f64) -> f64) -> [f64; 2] {
    let middle = |index: usize| (index as f64 + 0.5) / CELLS as f64 * EXTENT_MM;
    let (mut sum, mut positive) = (0.0, 0.0);
    for cell in 0..CELLS * CELLS {
        let (normal, shear) = (middle(cell % CELLS), middle(cell / CELLS));
        let best = best_step(|pm| quality(pm, normal, shear));
        sum += best as f64 / STEPS as f64;
        positive += f64::from(u8::from(best > 0));
    }
    [sum / positive, sum / (CELLS * CELLS) as f64]
}

/// The number of the first of the steps from PM = 0 to PN where `quality` is largest.
fn best_step(quality: impl Fn(f64) -> f64) -> usize {
    let (mut best, mut largest) = (0, f64::NEG_INFINITY);
    for step in 0..=STEPS {
        // The last step is a little short of PN, which each precision rounds in its own way.
        let value = quality(PN_MM * (step as f64 / STEPS as f64) * (1.0 - 1e-12));
        if value > largest {
            (best, largest) = (step, value);
        }
    }
    best
}
