//! R*: where Q is largest.

use super::domain::{below, not_negative};
use super::{Design, OutOfDomain, PinholeDistance, Real};

/// Halvings of [0, PN] after which an `f64` root no longer changes, unless it is tiny beside PN.
const HALVINGS: u32 = 80;

impl<T: Real> Design<T> {
    /// R*(z_m', PP') = PM / PN at the PM in (0, PN] where Q is largest; `None` when Q has no
    /// maximum at a positive PM.
    ///
    /// `z_mm` is z_m', 0 to below the film's distance h; `shear_mm` is PP', 0 or more. There is no
    /// positive maximum while PP' ≥ 50·f·PN·z_m' / (h·(h − z_m')): Q then falls from PM = 0 on (or
    /// is 0 everywhere, at z_m' = PP' = 0). Just before that, R* rises from 0 as a square root
    /// does: R*² is what is computed accurately there. Against the reference table, |Δ(R*²)| ≤
    /// 2e-16 in `f64` and 1e-7 in `f32`; where R* ≥ 0.1, its relative error is at most 1e-15 and
    /// 1e-6.
    ///
    /// # Why it is the only maximum
    /// dQ/dPM = 50·f·z·N / S − PP' / PN, where N = h²·(D_ph − z) / D_ph − 2·PM² on the slant and
    /// h·(h − z) − PM² along the axis, S = (PM² + D_ph²)·(PM² + (D_ph − z)²). N falls and S rises
    /// with PM, so that 50·f·z·PN·N − PP'·S falls throughout and changes sign once at most. Its
    /// root is found by halving.
    ///
    /// # Where the paper is wrong
    /// The text below eq. 17 says that disp_N rises throughout [0, √2·a]. It peaks at N = 0: at R =
    /// 0.3571 for small z_m', 0.2985 at 3.5 mm and 0.2128 at 7 mm (slant D_ph; 0.5051, 0.4072 and
    /// 0.2766 with the axial one). R* is never beyond that peak. If disp_N did rise throughout,
    /// small shears would put the markers in the corners.
    ///
    /// # Errors
    /// When a value or a measure of the design is outside its domain. From z_m' = h on, disp_N
    /// grows up to the axis, where the marker would touch or pass the pinhole: Q has no maximum to
    /// ask for.
    pub fn best_r(&self, z_mm: T, shear_mm: T) -> Result<Option<T>, OutOfDomain> {
        self.check()?;
        below("z_m'", z_mm, self.film_distance_mm)?;
        not_negative("PP'", shear_mm)?;
        let (zero, pn) = (T::of(0.0), self.pn_mm());
        if self.slope(zero, z_mm, shear_mm) <= zero {
            return Ok(None);
        }
        if self.slope(pn, z_mm, shear_mm) >= zero {
            return Ok(Some(T::of(1.0)));
        }
        Ok(Some(self.sign_change(z_mm, shear_mm) / pn))
    }

    /// A positive multiple of dQ/dPM: 50·f·z·PN·N − PP'·S.
    fn slope(&self, pm: T, z: T, shear: T) -> T {
        let (d_ph, ahead) = (self.distance(pm), self.ahead(pm, z));
        let (pm2, h) = (pm * pm, self.film_distance_mm);
        let n = match self.d_ph {
            PinholeDistance::Slant => h * h * (ahead / d_ph) - T::of(2.0) * pm2,
            PinholeDistance::Axial => h * ahead - pm2,
        };
        let s = (pm2 + d_ph * d_ph) * (pm2 + ahead * ahead);
        self.normal_weight * self.focal_mm * z * self.pn_mm() * n - shear * s
    }

    /// The PM in (0, PN) at which `slope` turns from positive to negative.
    fn sign_change(&self, z: T, shear: T) -> T {
        let (mut low, mut high) = (T::of(0.0), self.pn_mm());
        for _ in 0..HALVINGS {
            let middle = (low + high) / T::of(2.0);
            if middle <= low || middle >= high {
                break;
            }
            if self.slope(middle, z, shear) > T::of(0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        (low + high) / T::of(2.0)
    }
}
