//! Holds the limits of each contact reading, and of a tip that may be anywhere.
//!
//! A tip to which the film *sticks* tilts the force by up to 39°. One side of the film goes slack,
//! which strains and tapers the pattern and bends the images. A tip that *slips* shifts the pattern
//! less, but moves off the middle. The largest values seen are from rendered frames at QVGA and
//! 800×600, both presets: |F| ≤ 0.25 N, |α| ≤ 12°, |β| ≤ 10°, the tip up to 0.25 mm off the middle,
//! friction ratios of 0.1 to 1.
//!
//! A tip *anywhere* makes patterns and images without symmetry. The largest values seen are from
//! frames of the same sizes and presets: |F| of 5 to 250 mN, tangential force up to 0.8 of the
//! normal one, places to 4 mm along x and y.
//!
//! Those frames show each dot as a plane disc. Frames of the full film show how a needle bends a
//! dot next to it (`hivtac-studies contacts --near-dots`, seeds 2, 11 and 12, 320×240).
//!
//! `FORCE` lists the limits of a tilted force. The tables of the others list only fields that
//! differ from the reading on which they are based.

use hivtac_terms::conditions::ContactReading;

/// A taper beyond which a tip presses hard near a dot and bends it.
pub const STEEP_TAPER: f32 = 0.08;

/// Limits of one kind of contact. A shift is relative to the half side at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Strain of weighted centroids against this unit's own rest, as the displacement of one marker
    /// that causes it, px.
    pub displacement: f32,
    /// Strain per square of the shift.
    pub strain_by_shift: f32,
    /// Strain per change of taper, without the taper that one displaced marker causes.
    pub strain_by_taper: f32,
    /// Strain that is always allowed.
    pub strain_always: f32,
    /// Change of taper.
    pub taper: f32,
    /// Relative deviation of a marker's width across the radius.
    pub width: f32,
    /// Additional part of a marker's pixels that may fail the threshold.
    pub holes: f32,
    /// Additional hollowness, px².
    pub hollow: f32,
    /// Skew per taper.
    pub skew_by_taper: f32,
    /// Lean per taper and square of the image's width.
    pub lean_by_taper: f32,
    /// More lean per taper beyond [`STEEP_TAPER`] and square of the image's width.
    pub lean_by_steep_taper: f32,
    /// Additional skew that is always allowed.
    pub skew_always: f32,
    /// Difference of aspects per shift.
    pub aspect_by_shift: f32,
    /// Additional difference of aspects that is always allowed.
    pub aspect_always: f32,
    /// Difference of mean weights per shift.
    pub density_by_shift: f32,
    /// Difference of mean weights without the mask's edge, in addition to the usual 0.015: px² over
    /// the square of the narrowest marker's width. `None` if it is not checked.
    pub inner_density_area: Option<f32>,
}

/// The limits of a tilted force.
///
/// | field | limit | largest seen |
/// |---|---|---|
/// | `displacement` | 0.2 px | 0.16; 0.2 at four-fold noise |
/// | `strain_by_shift` | 1.5 | 1.3 with the tip up to 0.25 mm off the middle; 1.5 at 0.5 mm |
/// | `taper` | 0.1 | 0.066 |
/// | `width` | 0.0586 | 0.03 |
/// | `skew_by_taper` | 1 | |
/// | `aspect_by_shift` | 1 | |
///
/// Aspects differ by the shift, because the film is steeper where an off-centre tip is.
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
    lean_by_steep_taper: 0.0,
    skew_always: 0.0,
    aspect_by_shift: 1.0,
    aspect_always: 0.0,
    density_by_shift: 0.0,
    inner_density_area: None,
};

/// A tip that sticks up to a friction ratio of 0.8 and slides beyond: the limits of [`SLIP`], and
/// more for a film that is dragged farther.
///
/// | field | limit |
/// |---|---|
/// | `strain_by_taper` | 0.375 |
/// | `lean_by_taper` | 0.011 |
/// | `density_by_shift` | 0.605 |
const STICK: Reading = Reading {
    strain_by_taper: 0.375,
    lean_by_taper: 0.011,
    density_by_shift: 0.605,
    ..SLIP
};

/// A tip that slips.
///
/// | field | limit | largest seen |
/// |---|---|---|
/// | `displacement` | 0.25 px | 0.22 |
/// | `hollow` | 0.04 px² more | 0.23 in all |
/// | `strain_by_shift` | 3 | 2.7, at a friction ratio of 0.1 |
/// | `skew_by_taper` | 2.2 | 2.2 |
/// | `lean_by_taper` | 0.0045 | 0.0042 |
/// | `aspect_by_shift` | 1.8 | 1.73 |
/// | `density_by_shift` | 0.32 | 0.27 |
/// | `inner_density_area` | 18 px² | 13.7; more in 4 of 2,000 frames |
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

/// A tip that may be anywhere.
///
/// | field | limit | largest seen |
/// |---|---|---|
/// | `strain_always` | 0.075 | 0.065 |
/// | `taper` | 0.15 | 0.122 |
/// | `width` | 0.375 | more in 4 of 1,000 frames of the wide lens |
/// | `holes` | 0.102 | 0.07 |
/// | `hollow` | 0.85 px² more | 0.99 in all at 800×600, 0.37 at QVGA |
/// | `skew_by_taper` | 3.5 | 3.2 |
/// | `lean_by_taper` | 0.042 | 0.036 of plane dots |
/// | `lean_by_steep_taper` | 0.1 | 0.081: needles beside a dot, which bend it |
/// | `skew_always` | 0.05 | |
/// | `aspect_by_shift` | 1.348 | 1.2 |
/// | `aspect_always` | 0.04 | |
/// | `density_by_shift` | 0.82 | 0.73 |
///
/// Widths deviate because the pattern's centre is far from the axis. `holes` covers a skewed image,
/// which has fewer pixels than its diameters suggest. `skew_always` and `aspect_always` cover a
/// rolled camera and markers glued off their places, where the pattern may taper less.
const ANYWHERE: Reading = Reading {
    strain_always: 0.075,
    taper: 0.15,
    width: 0.375,
    holes: 0.102,
    hollow: 0.85,
    skew_by_taper: 3.5,
    lean_by_taper: 0.042,
    lean_by_steep_taper: 0.1,
    skew_always: 0.05,
    aspect_by_shift: 1.348,
    aspect_always: 0.04,
    density_by_shift: 0.82,
    ..FORCE
};

impl Reading {
    /// The limits for an untouched film.
    pub const UNTOUCHED: Reading = FORCE;

    /// Returns the limits of a reading, or of a tip that may be anywhere.
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
