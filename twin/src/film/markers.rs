//! The markers' places on the film at rest.

/// Distance of the markers' centres from the film's middle along x and along y, mm.
pub const MARKER_REST_MM: f64 = 3.717;
/// Radius of a marker, mm (the paper punches 1 mm discs out of red tape).
pub const MARKER_RADIUS_MM: f64 = 0.5;
/// Their centres by identity, mm: 0 upper left, 1 upper right, 2 lower right, 3 lower left in the
/// image.
pub const MARKER_CENTRES_MM: [[f64; 2]; 4] = [
    [-MARKER_REST_MM, -MARKER_REST_MM],
    [MARKER_REST_MM, -MARKER_REST_MM],
    [MARKER_REST_MM, MARKER_REST_MM],
    [-MARKER_REST_MM, MARKER_REST_MM],
];
