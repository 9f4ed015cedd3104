//! What each contact reading allows the markers, where the readings differ, and what a tip does
//! that may be anywhere.
//!
//! A tip to which the film *sticks* tilts the force by up to 39°: one side of the film goes slack,
//! which strains and tapers the pattern and bends the images. One that *slips* shifts the pattern
//! by less, but comes to press off the middle. The figures in brackets are the largest on rendered
//! frames at QVGA and 800×600, both presets: |F| ≤ 0.25 N, |α| ≤ 12°, |β| ≤ 10°, the tip up to
//! 0.25 mm off the middle, friction ratios of 0.1 to 1.
//!
//! A tip *anywhere* makes patterns and images that have no symmetry. Its figures are the largest on
//! frames of the same sizes and presets, |F| of 5 to 250 mN, tangential force to 0.8 of the normal
//! one, places to 4 mm along x and y.

use hivtac_terms::conditions::ContactReading;

/// Limits of one kind of contact. A shift is in parts of the rest's half side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Strain of weighted centroids against this unit's own rest, as the displacement of one marker
    /// that makes it, px.
    pub displacement: f32,
    /// Strain by the square of the shift.
    pub strain_by_shift: f32,
    /// Strain by the change of taper, but for what one displaced marker makes of it.
    pub strain_by_taper: f32,
    /// Strain that is allowed whatever else there is.
    pub strain_always: f32,
    /// Change of taper.
    pub taper: f32,
    /// What a marker's width across the radius may be off, in parts of it.
    pub width: f32,
    /// The part of a marker's pixels that may fail the threshold beyond the usual.
    pub holes: f32,
    /// Hollowness beyond the usual, px².
    pub hollow: f32,
    /// Skew by the taper.
    pub skew_by_taper: f32,
    /// Lean by the taper and the square of the image's width.
    pub lean_by_taper: f32,
    /// Skew beyond the usual, whatever else there is.
    pub skew_always: f32,
    /// Difference of aspects by the shift.
    pub aspect_by_shift: f32,
    /// Difference of aspects beyond the usual, whatever else there is.
    pub aspect_always: f32,
    /// Difference of mean weights by the shift.
    pub density_by_shift: f32,
    /// Difference of the mean weights without the mask's edge, over that of the usual 0.015: px²
    /// over the square of the narrowest's width. `None` where it is not looked at.
    pub inner_density_area: Option<f32>,
}

/// Strain: 0.2 px (seen: 0.16, and 0.2 at four-fold noise) and 1.5 times the square of the shift
/// (seen: 1.3 times with the tip up to 0.25 mm off the middle, 1.5 times at 0.5 mm). Skew: the
/// taper. Aspect: the shift, as the film is steeper where an off-centre tip is. Taper: 0.1 (seen:
/// 0.066). Width: 0.0586 (seen: 0.03).
const FORCE: Reading = Reading {
    displacement: 0.2,
    strain_always: 0.0,
    taper: 0.1,
    width: 0.0586,
    holes: 0.0,
    hollow: 0.0,
    strain_by_shift: 1.5,
    strain_by_taper: 0.0,
    skew_by_taper: 1.0,
    lean_by_taper: 0.0,
    skew_always: 0.0,
    aspect_by_shift: 1.0,
    aspect_always: 0.0,
    density_by_shift: 0.0,
    inner_density_area: None,
};

/// A tip sticks up to a friction ratio of 0.8 and slides beyond: what [`SLIP`] allows, and what a
/// film that is dragged farther asks for. Strain: 0.375 of the taper, too. Lean: 0.011 of it. Mean
/// weights: 0.605 of the shift.
const STICK: Reading = Reading {
    strain_by_taper: 0.375,
    lean_by_taper: 0.011,
    density_by_shift: 0.605,
    ..SLIP
};

/// Strain: 0.25 px (seen: 0.22) and 3 times the square of the shift (seen: 2.7, at a friction ratio
/// of 0.1). Hollowness: 0.04 px² more (seen: 0.23 in all). Skew: 2.2 of the taper (seen: 2.2).
/// Lean: 0.0045 of it (seen: 0.0042). Aspect: 1.8 of the shift (seen: 1.73). Mean weights: 0.32 of
/// the shift (seen: 0.27), 18 px² (seen: 13.7, in 4 of 2,000 more).
const SLIP: Reading = Reading {
    displacement: 0.25,
    hollow: 0.04,
    strain_by_shift: 3.0,
    skew_by_taper: 2.2,
    lean_by_taper: 0.0045,
    aspect_by_shift: 1.8,
    density_by_shift: 0.32,
    inner_density_area: Some(18.0),
    ..FORCE
};

/// Strain: 0.075 (seen: 0.065). Taper: 0.15 (seen: 0.122). Width: 0.375 (4 in 1,000 frames of the
/// wide lens have more): the pattern's centre is far from the axis. Holes: 0.102 (seen: 0.07), as
/// much as a skewed image has less than its diameters say. Hollowness: 0.85 px² more (seen: 0.99 in
/// all at 800×600, 0.37 at QVGA). Skew: 3.5 of the taper (seen: 3.2), and 0.05: where a camera is
/// rolled or markers are glued beside their places the pattern may taper less. Lean: 0.042 of it
/// (seen: 0.036). Aspect: 1.348 of the shift (seen: 1.2), and 0.04 likewise. Mean weights: 0.82 of
/// it (seen: 0.73).
const ANYWHERE: Reading = Reading {
    strain_always: 0.075,
    taper: 0.15,
    width: 0.375,
    holes: 0.102,
    hollow: 0.85,
    skew_by_taper: 3.5,
    lean_by_taper: 0.042,
    skew_always: 0.05,
    aspect_by_shift: 1.348,
    aspect_always: 0.04,
    density_by_shift: 0.82,
    ..FORCE
};

impl Reading {
    /// Of a film that nothing touches.
    pub const UNTOUCHED: Reading = FORCE;

    /// The limits of a reading, or of a tip that may be anywhere.
    pub const fn of(contact: ContactReading, anywhere: bool) -> Reading {
        if anywhere {
            return ANYWHERE;
        }
        match contact {
            ContactReading::Force => FORCE,
            ContactReading::Stick => STICK,
            ContactReading::Slip => SLIP,
        }
    }
}
