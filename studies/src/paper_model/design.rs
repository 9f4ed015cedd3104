//! The sensor's measures, D_ph and Q: eqs. 23 and 24.

use super::displacement::away_from_pinhole;
use super::domain::{not_negative, positive, up_to};
use super::{OutOfDomain, Real, disp_s_mm};
use hivtac_twin::{FILM_DISTANCE_MM, FOCAL_LENGTH_MM, HALF_SIDE_MM};

/// What D_ph is: the paper has it both ways, and the mean of R* depends on it (0.2609 or 0.3546).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PinholeDistance {
    /// Eq. 23: D_ph = √(PM² + h²), from the marker to the pinhole. Gives Figure 8, but PM / D_ph is
    /// then the sine and not the tangent of the ray's angle, and eqs. 15–17 take its arctangent all
    /// the same. At PM = 5.257 mm that is 24.95° for a ray at 27.73°.
    Slant,
    /// The text below eq. 15: D_ph = h, along the optical axis. What a camera does;
    /// [`Camera`](hivtac_twin::Camera) uses it.
    Axial,
}

/// A sensor's measures, as far as the model goes, and the weight in Q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design<T> {
    /// a, half the side of the square film between its fixed corners, mm, above 0.
    pub half_side_mm: T,
    /// f, mm, above 0.
    pub focal_mm: T,
    /// h, from the pinhole to the centre of the film at rest, mm, above 0.
    pub film_distance_mm: T,
    /// What disp_N counts in Q, above 0: 50 in eq. 24, "set manually".
    pub normal_weight: T,
    /// Which distance D_ph is.
    pub d_ph: PinholeDistance,
}

impl<T: Real> Design<T> {
    /// The paper's prototype: a = 14 mm, f = 2.1 mm, h = 10 mm, weight 50.
    pub fn paper(d_ph: PinholeDistance) -> Design<T> {
        Design {
            half_side_mm: T::of(HALF_SIDE_MM),
            focal_mm: T::of(FOCAL_LENGTH_MM),
            film_distance_mm: T::of(FILM_DISTANCE_MM),
            normal_weight: T::of(50.0),
            d_ph,
        }
    }

    /// PN = √2·a, from the centre to a corner: markers are on the diagonals. mm.
    pub fn pn_mm(&self) -> T {
        T::of(2.0).sqrt() * self.half_side_mm
    }

    /// Eq. 23 or its axial reading: D_ph of a marker at PM, mm. PM is 0 to PN.
    ///
    /// # Errors
    /// When PM or a measure of the design is outside its domain.
    pub fn d_ph_mm(&self, pm_mm: T) -> Result<T, OutOfDomain> {
        self.check_pm(pm_mm)?;
        Ok(self.distance(pm_mm))
    }

    /// Eq. 17 with this design's D_ph and ε = 0: disp_N, mm on the image plane. PM is 0 to PN; z_m'
    /// 0 or more.
    ///
    /// Accurate as [`NormalPress::disp_n_mm`](super::NormalPress::disp_n_mm); D_ph − z_m' is taken
    /// without the rounding error of D_ph.
    ///
    /// # Errors
    /// When a value is outside its domain, or when the pressed marker is the pinhole.
    pub fn disp_n_mm(&self, pm_mm: T, z_mm: T) -> Result<T, OutOfDomain> {
        self.check_pm(pm_mm)?;
        not_negative("z_m'", z_mm)?;
        let ahead = self.ahead(pm_mm, z_mm);
        away_from_pinhole(pm_mm, ahead, z_mm)?;
        let along = pm_mm * pm_mm + self.distance(pm_mm) * ahead;
        Ok(self.focal_mm * (z_mm * pm_mm).atan2(along))
    }

    /// Eq. 24: Q = 50·disp_N + disp_S, mm. PM is 0 to PN; z_m' and PP' are 0 or more.
    ///
    /// Largest relative error against the reference table: 5e-16 in `f64`, 3e-7 in `f32`.
    ///
    /// The two displacements are not alike: disp_N is on the image plane, disp_S on the film, which
    /// the lens shows about f / h = 0.21 times as large. z_m' and PP' are held while PM varies,
    /// though in the paper's own model the marker's depth z_m' falls from the press depth at PM = 0
    /// to 0 at PM = PN.
    ///
    /// # Errors
    /// As [`disp_n_mm`](Self::disp_n_mm) and [`disp_s_mm`].
    pub fn quality_mm(&self, pm_mm: T, z_mm: T, shear_mm: T) -> Result<T, OutOfDomain> {
        let normal = self.disp_n_mm(pm_mm, z_mm)?;
        let shear = disp_s_mm(pm_mm, self.pn_mm(), shear_mm)?;
        Ok(self.normal_weight * normal + shear)
    }

    /// D_ph, unchecked.
    pub(super) fn distance(&self, pm: T) -> T {
        let h = self.film_distance_mm;
        match self.d_ph {
            PinholeDistance::Slant => (pm * pm + h * h).sqrt(),
            PinholeDistance::Axial => h,
        }
    }

    /// D_ph − z, unchecked. On the slant as (PM² + h² − z²) / (D_ph + z), which does not inherit
    /// D_ph's rounding.
    pub(super) fn ahead(&self, pm: T, z: T) -> T {
        let h = self.film_distance_mm;
        match self.d_ph {
            PinholeDistance::Slant => (pm * pm + (h - z) * (h + z)) / (self.distance(pm) + z),
            PinholeDistance::Axial => h - z,
        }
    }

    /// Refuses measures outside their domains.
    pub(super) fn check(&self) -> Result<(), OutOfDomain> {
        positive("a", self.half_side_mm)?;
        positive("f", self.focal_mm)?;
        positive("the film's distance", self.film_distance_mm)?;
        positive("the weight of disp_N", self.normal_weight)
    }

    fn check_pm(&self, pm: T) -> Result<(), OutOfDomain> {
        self.check()?;
        up_to("PM", pm, self.pn_mm())
    }
}
