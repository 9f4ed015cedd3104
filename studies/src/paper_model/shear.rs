//! Shear force: eqs. 18–22.

use super::domain::{finite, not_negative, positive, up_to};
use super::{OutOfDomain, Real};

/// Eq. 21: disp_S = PP'·(PN − PM) / PN, how far a marker moves on the film when its centre is
/// dragged by PP', mm.
///
/// `pm_mm` is PM, 0 to PN; `pn_mm` is PN > 0, from the centre through the marker to the side of the
/// film, √2·a for markers on the diagonals; `shear_mm` is PP', 0 or more. Largest at PM = 0 (eq.
/// 22).
///
/// This is a length on the film, while disp_N is one on the image plane; eq. 24 adds them all the
/// same.
///
/// # Errors
/// When a length is outside its domain.
pub fn disp_s_mm<T: Real>(pm_mm: T, pn_mm: T, shear_mm: T) -> Result<T, OutOfDomain> {
    positive("PN", pn_mm)?;
    up_to("PM", pm_mm, pn_mm)?;
    not_negative("PP'", shear_mm)?;
    Ok(shear_mm * ((pn_mm - pm_mm) / pn_mm))
}

/// Eq. 19, corrected: the stretch of the two diagonals, [P'O / PO, P'C / PC], when the centre is
/// dragged by `shear_mm`.
///
/// In coordinates from the centre at rest, O = (−a, −a) and C = (−a, a) are the corners of the
/// marker's quarter; `shear_mm` is [σ_x, σ_y] as displacements (eq. 18). 1 + σ_O/E is the first, 1
/// − σ_C/E the second.
///
/// # Where the paper is wrong
/// Eq. 19 prints M'_C P'_y / M'_C P for M'_C P'_y / M_C P. With a = 14 mm and a drag of 5 mm along
/// y, the stretches are 1.1920 and 0.8406 for every M_O and M_C; as printed, the second would be
/// 0.7052 half-way along PC and 0.5168 a quarter along it, which no single σ_C fits.
///
/// # Errors
/// When a is not above 0 or a component is not finite.
pub fn shear_stretch<T: Real>(half_side_mm: T, shear_mm: [T; 2]) -> Result<[T; 2], OutOfDomain> {
    let corners = corners(half_side_mm, shear_mm)?;
    let rest = T::of(2.0).sqrt() * half_side_mm;
    Ok(corners.map(|corner| {
        let [dx, dy] = minus(corner, shear_mm);
        (dx * dx + dy * dy).sqrt() / rest
    }))
}

/// Eqs. 18–20, corrected: where the marker is after the centre was dragged by `shear_mm`, mm from
/// the centre at rest.
///
/// `fractions` are [PM_O / PO, PM_C / PC], each 0 or more and together at most 1: the marker at
/// rest is that far along the two diagonals of its quarter. Axes and shear as in [`shear_stretch`].
///
/// # Where the paper is wrong
/// Eq. 20 prints PM' = PM'_O + PM'_C for P'M' = P'M'_O + P'M'_C. Its displacement is then too large
/// by PP' itself: for a marker at R = 0.2655 on a diagonal, 1.7345·PP' for 0.7345·PP', which is
/// what eq. 21 says.
///
/// # Errors
/// When a is not above 0, a fraction is outside its domain or a component is not finite.
pub fn sheared_position_mm<T: Real>(
    fractions: [T; 2],
    half_side_mm: T,
    shear_mm: [T; 2],
) -> Result<[T; 2], OutOfDomain> {
    let [to_o, to_c] = corners(half_side_mm, shear_mm)?.map(|corner| minus(corner, shear_mm));
    let [o, c] = fractions;
    not_negative("PM_O / PO", o)?;
    not_negative("PM_C / PC", c)?;
    up_to("PM_O / PO + PM_C / PC", o + c, T::of(1.0))?;
    let along = |axis: usize| shear_mm[axis] + o * to_o[axis] + c * to_c[axis];
    Ok([along(0), along(1)])
}

/// O and C from the centre at rest, after checking what every function of the sheared film takes.
fn corners<T: Real>(half_side_mm: T, shear_mm: [T; 2]) -> Result<[[T; 2]; 2], OutOfDomain> {
    positive("a", half_side_mm)?;
    finite("σ_x", shear_mm[0])?;
    finite("σ_y", shear_mm[1])?;
    Ok([
        [-half_side_mm, -half_side_mm],
        [-half_side_mm, half_side_mm],
    ])
}

fn minus<T: Real>(a: [T; 2], b: [T; 2]) -> [T; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
