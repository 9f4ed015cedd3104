//! The Cramér–Rao bound of a force that is read from the centroids of four markers.

use anyhow::{Context, Result};
use hivtac_calibration::data::loads::norm;
use hivtac_twin::{Contact, Load, Scene};

use super::matrix::{cholesky, dot, forward, inverse};

/// Coordinates of the four centroids.
pub const COORDINATES: usize = 8;
/// Covariances of centroids, px².
pub type Noise = [[f64; COORDINATES]; COORDINATES];

/// Part of |F| by which a load is changed to see how the centroids follow.
const STEP: f64 = 0.01;

/// The true centroids under a load, px: x0, y0, x1, …
pub fn centroids(scene: &Scene, contact: Contact, force_n: [f64; 3]) -> Result<[f64; COORDINATES]> {
    let load = Load::from_vector(force_n)?.with_contact(contact)?;
    let truth = scene.truth_under(&load)?;
    let mut px = [0.0; COORDINATES];
    for (pair, marker) in px.chunks_exact_mut(2).zip(&truth.markers) {
        let marker = marker.context("a marker is out of sight")?;
        pair.copy_from_slice(&marker.centroid_px);
    }
    Ok(px)
}

/// ∂centroids/∂F, px/N, by central differences: how the centroids follow F_x, F_y, F_z.
pub fn jacobian(
    scene: &Scene,
    contact: Contact,
    force_n: [f64; 3],
) -> Result<[[f64; COORDINATES]; 3]> {
    let step = STEP * norm(force_n);
    let mut columns = [[0.0; COORDINATES]; 3];
    for (axis, column) in columns.iter_mut().enumerate() {
        let moved = |by: f64| {
            let mut force = force_n;
            force[axis] += by;
            centroids(scene, contact, force)
        };
        let (more, less) = (moved(step)?, moved(-step)?);
        *column = std::array::from_fn(|i| (more[i] - less[i]) / (2.0 * step));
    }
    Ok(columns)
}

/// The least mean squares that any unbiased reading can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Of the angle between found and true force, square radians, to first order.
    pub direction: f64,
    /// Of |F|, N².
    pub force: f64,
}

/// The bound for one force: (JᵀΣ⁻¹J)⁻¹ is the least covariance of F.
///
/// # Errors
/// When the noise or the Jacobian leaves a direction undetermined.
pub fn bound(
    noise: &Noise,
    jacobian: &[[f64; COORDINATES]; 3],
    force_n: [f64; 3],
) -> Result<Bound> {
    let whitening = cholesky(noise)?;
    let white = jacobian.map(|column| forward(&whitening, column));
    let information: [[f64; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| dot(&white[i], &white[j])));
    let covariance = inverse(&information)?;
    let size = norm(force_n);
    let unit = force_n.map(|part| part / size);
    let along = dot(&unit, &covariance.map(|row| dot(&row, &unit)));
    let whole: f64 = (0..3).map(|i| covariance[i][i]).sum();
    Ok(Bound {
        direction: (whole - along) / (size * size),
        force: along,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight independent looks at a line: by hand.
    #[test]
    fn the_bound_is_that_of_linear_regression() {
        let noise: Noise =
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.04 } else { 0.0 }));
        let mut jacobian = [[0.0; COORDINATES]; 3];
        for i in 0..4 {
            jacobian[0][2 * i] = 10.0;
            jacobian[1][2 * i + 1] = 10.0;
        }
        jacobian[2] = [50.0, 0.0, -50.0, 0.0, 50.0, 0.0, -50.0, 0.0];
        let bound = bound(&noise, &jacobian, [0.0, 0.0, -0.1]).unwrap();
        // σ² / Σ J²: 0.04 / 400 for F_x and F_y, 0.04 / 10,000 for F_z.
        assert!((bound.direction - 2.0 * 1e-4 / 0.01).abs() < 1e-12);
        assert!((bound.force - 4e-6).abs() < 1e-15);
    }

    /// A least-squares reading of noisy centroids of the scene comes as near to the truth as the
    /// bound, and no nearer.
    #[test]
    fn the_bound_is_reached_where_the_film_is_nearly_a_line() {
        use rand::{Rng, SeedableRng};
        let scene = hivtac_calibration::data::dataset::Recipe::default()
            .scene(0)
            .unwrap();
        let force = [0.01, -0.005, -0.12];
        let jacobian = jacobian(&scene, Contact::Force, force).unwrap();
        let noise: Noise =
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1e-4 } else { 0.0 }));
        let least = bound(&noise, &jacobian, force).unwrap();
        let normal: [[f64; 3]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|j| dot(&jacobian[i], &jacobian[j])));
        let inverse = inverse(&normal).unwrap();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        // The sum of twelve uniform numbers is nearly normal, with variance 1.
        let mut gauss = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let (mut sum, trials) = (0.0, 4000);
        for _ in 0..trials {
            let off: [f64; COORDINATES] = std::array::from_fn(|_| 0.01 * gauss());
            let side: [f64; 3] = std::array::from_fn(|i| dot(&jacobian[i], &off));
            let error = inverse.map(|row| dot(&row, &side));
            let found: [f64; 3] = std::array::from_fn(|i| force[i] + error[i]);
            sum += (norm(found) - norm(force)).powi(2);
        }
        let ratio = sum / f64::from(trials) / least.force;
        assert!((0.93..1.07).contains(&ratio), "{ratio}");
    }
}
