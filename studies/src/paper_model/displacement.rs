//! Normal force: eqs. 5–17.

use super::domain::{finite, not_negative, positive};
use super::{OutOfDomain, Real};

/// Eq. 14, the equidistant fisheye: r_d = f·θ, mm on the image plane from the optical axis.
///
/// `focal_mm` is f > 0; `theta` is the angle between ray and optical axis, 0 to π.
///
/// # Errors
/// When f is not above 0 or θ is negative or no number.
pub fn image_radius_mm<T: Real>(focal_mm: T, theta: T) -> Result<T, OutOfDomain> {
    positive("f", focal_mm)?;
    not_negative("θ", theta)?;
    Ok(focal_mm * theta)
}

/// Eqs. 5–13: P'M'·sin φ, the distance of the pressed marker M' from the load's axis, mm.
///
/// M is given by the components PM_A and PM_B of PM along the diagonals to the two corners of its
/// quarter, mm, 0 or more; `half_side_mm` is a > 0; `depth_mm` is d = PP', 0 or more.
///
/// # Where the paper is wrong
/// Eq. 12 bounds this from below by PM, and eq. 13 calls what is left a small ε ≥ 0. But the bound
/// takes sin φ at its smallest and PM_A = PM_B at once, and both belong to the same direction. In
/// every direction the factors cancel:
///
/// > P'M' = √((2a² + d²) / 2a²) · √(PM² + 2·PM_A·PM_B·d² / (2a² + d²)) (eqs. 5–10),
/// > sin φ = √(2a² / (2a² + d² + d²·2·PM_A·PM_B / PM²)),
///
/// so that P'M'·sin φ = PM and **ε = 0 everywhere**: the model is affine and moves every point of
/// the film straight towards the camera. This function evaluates the two factors as they stand; its
/// tests hold |ε| ≤ 1e-15·PM. The 0.18 mm that the paper reads for ε from its finite elements is no
/// part of this model.
///
/// # Errors
/// When a length is outside its domain.
pub fn stretched_projection_mm<T: Real>(
    [pm_a, pm_b]: [T; 2],
    half_side_mm: T,
    depth_mm: T,
) -> Result<T, OutOfDomain> {
    positive("a", half_side_mm)?;
    not_negative("d", depth_mm)?;
    not_negative("PM_A", pm_a)?;
    not_negative("PM_B", pm_b)?;
    let two = T::of(2.0);
    let (pm2, cross) = (pm_a * pm_a + pm_b * pm_b, two * pm_a * pm_b);
    if pm2 == T::of(0.0) {
        return Ok(pm2);
    }
    let (flat, d2) = (two * half_side_mm * half_side_mm, depth_mm * depth_mm);
    let stretch = ((flat + d2) / flat).sqrt();
    let slant = stretch * (pm2 + cross * d2 / (flat + d2)).sqrt();
    let sin_phi = (flat / (flat + d2 + d2 * (cross / pm2))).sqrt();
    Ok(slant * sin_phi)
}

/// A marker under a normal force, in the symbols of eqs. 15–17.
///
/// ```
/// use hivtac_studies::paper_model::NormalPress;
///
/// let press = NormalPress { pm_mm: 5.257_f64, z_mm: 2.0, d_ph_mm: 10.0, epsilon_mm: 0.0 };
/// assert!((press.disp_n_mm(2.1)? - 0.2045).abs() < 1e-4);
/// # Ok::<(), hivtac_studies::paper_model::OutOfDomain>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalPress<T> {
    /// PM, the marker's distance from the load point on the film at rest, mm, 0 or more.
    pub pm_mm: T,
    /// z_m', the depth of the pressed marker, towards the camera, mm, 0 or more.
    pub z_mm: T,
    /// D_ph, the distance of the marker at rest from the pinhole along the optical axis, mm,
    /// above 0.
    pub d_ph_mm: T,
    /// ε(x_m, y_m), how much further outward the pressed marker is, mm, 0 or more (0 in the paper's
    /// own model).
    pub epsilon_mm: T,
}

impl<T: Real> NormalPress<T> {
    /// Eq. 15: r_M = f·arctan(PM / D_ph), mm on the image plane, `focal_mm` being f.
    ///
    /// The arctangent is a ray's angle only when D_ph is the distance along the optical axis, as
    /// the text below the equation says. Eq. 23 puts the slant distance there: see
    /// [`PinholeDistance`](super::PinholeDistance).
    ///
    /// # Errors
    /// When a length is outside its domain.
    pub fn r_m_mm(&self, focal_mm: T) -> Result<T, OutOfDomain> {
        self.check()?;
        image_radius_mm(focal_mm, self.pm_mm.atan2(self.d_ph_mm))
    }

    /// Eq. 16: r_M' = f·arctan((PM + ε) / (D_ph − z_m')), mm on the image plane.
    ///
    /// Taken with `atan2`: for z_m' > D_ph the marker is behind the pinhole and its angle is above
    /// 90°, where the one-argument arctangent is wrong by π.
    ///
    /// # Errors
    /// When a length is outside its domain, or when M' is the pinhole.
    pub fn r_m_pressed_mm(&self, focal_mm: T) -> Result<T, OutOfDomain> {
        self.check()?;
        let theta = (self.pm_mm + self.epsilon_mm).atan2(self.d_ph_mm - self.z_mm);
        image_radius_mm(focal_mm, theta)
    }

    /// Eq. 17: disp_N = r_M' − r_M, how far the marker is seen to move outward, mm on the image
    /// plane.
    ///
    /// Computed by the third line of eq. 17 with `atan2`. Largest relative error against the
    /// reference table, for z_m' from 1 nm to 100 mm (ten times D_ph), PM and ε from 0 or 1 nm, and
    /// at, just before and just beyond the pinhole: 4e-16 in `f64`, 3e-7 in `f32`.
    ///
    /// # Where the paper is wrong
    /// - *The lines of eq. 17 agree only for z_m' < D_ph.* With the one-argument arctangent the
    ///   second line is wrong by π·f for all z_m' > D_ph, the third for z_m' > D_ph + PM·(PM + ε) /
    ///   D_ph. With f = 2.1 mm, PM = 5.257 mm and D_ph = 10 mm, at z_m' = 11 mm the second line
    ///   gives −3.920 mm and the third 2.677 mm; at 13 mm they both give −3.226 mm; with `atan2`
    ///   both lines give 2.677 mm and 3.371 mm.
    /// - *The second line cannot be computed as it stands.* It subtracts two nearly equal angles.
    ///   In `f32`, at PM = 5.257 mm and z_m' = 1 nm, nothing is left of it with D_ph = 11.298 mm
    ///   (relative error 1), and about half with 10 mm (0.45).
    /// - *"Monotonically increasing in PM ∈ [0, √2·a]"* is not so: see
    ///   [`Design::best_r`](super::Design::best_r).
    ///
    /// # Errors
    /// When a length is outside its domain, or when M' is the pinhole.
    pub fn disp_n_mm(&self, focal_mm: T) -> Result<T, OutOfDomain> {
        self.check()?;
        positive("f", focal_mm)?;
        let NormalPress {
            pm_mm: pm,
            z_mm: z,
            d_ph_mm: d_ph,
            epsilon_mm: epsilon,
        } = *self;
        let across = z * pm + epsilon * d_ph;
        let along = pm * (pm + epsilon) + d_ph * (d_ph - z);
        Ok(focal_mm * across.atan2(along))
    }

    fn check(&self) -> Result<(), OutOfDomain> {
        not_negative("PM", self.pm_mm)?;
        not_negative("z_m'", self.z_mm)?;
        not_negative("ε", self.epsilon_mm)?;
        positive("D_ph", self.d_ph_mm)?;
        away_from_pinhole(
            self.pm_mm + self.epsilon_mm,
            self.d_ph_mm - self.z_mm,
            self.z_mm,
        )
    }
}

/// Refuses the pinhole itself: on the axis (`radius` 0) and at its depth (`ahead` 0), where no ray
/// has a direction.
pub(super) fn away_from_pinhole<T: Real>(radius: T, ahead: T, z: T) -> Result<(), OutOfDomain> {
    finite("PM + ε", radius)?;
    let zero = T::of(0.0);
    if radius == zero && ahead == zero {
        return Err(OutOfDomain {
            quantity: "z_m'",
            value: z.to_f64(),
            domain: "another depth: on the axis this one is the pinhole".to_owned(),
        });
    }
    Ok(())
}
