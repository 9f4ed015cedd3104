//! The closed form: a force from how far the markers move apart and how far they move together, by three curves.
//!
//! Every number is an integer, every rescaling rounds once, half up. With d_k the displacement of marker k from its rest,
//! Q16.16 px, and u_k the direction in which it rests from the pattern's middle (a unit vector, 2¹⁵ is one):
//!
//! 1. radius `r = (Σ d_k·u_k + 2¹⁶) >> 17` and shift `s = (Σ d_k + 2) >> 2`: means over the four markers, Q16.16 px;
//! 2. `q = min(|s|², 2³²)`, in 2⁻¹⁶ px²: `|s|²` of Q16.16 numbers, shifted right by 16, rounded;
//! 3. three curves by linear interpolation between knots a power of two apart: g(r) in µN, h(r) in 1/256 µN per px, and
//!    k(r) in 1/256 µN per px². Below the first knot, r = 0, they are what they are there; beyond the last knot they go on
//!    as between the last two, and the result says so;
//! 4. `F_x = (h·s_x) >> 24`, `F_y = (h·s_y) >> 24`, `F_z = −(g + (k·q) >> 24)`, in µN, limited to `i32`.

#[cfg(test)]
mod tests;

use crate::features::Features;

/// The most knots of a curve.
pub const MAX_KNOTS: usize = 257;
/// The widest distance of knots: 2²² steps of 2⁻¹⁶ px, 64 px.
pub const MAX_STEP_BITS: u8 = 22;
/// The largest |value| of a knot; keeps every product within 64 bits.
pub const LARGEST_KNOT: i32 = (1 << 30) - 1;
/// The largest |component| of a displacement: no two frames of up to 800 px are further apart.
const LARGEST_DISPLACEMENT: i64 = 800 << 16;
/// One, in a direction's components.
pub const ONE: i32 = 1 << 15;
const LARGEST_SQUARE: i64 = 1 << 32;

/// A closed form, borrowed from the bytes of its file.
#[derive(Clone, Copy, Debug)]
pub struct ClosedForm<'a> {
    /// (x, y) of u₀…u₃, −2¹⁵ to 2¹⁵.
    pub directions: [[i32; 2]; 4],
    /// The distance of knots is 2 to the power of this, in 2⁻¹⁶ px.
    pub step_bits: u8,
    /// g, h and k at each knot, one after the other, little-endian.
    pub(crate) knots: &'a [[u8; 12]],
}

/// Radius and shift of the markers: everything that the closed form sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motion {
    /// r, 2⁻¹⁶ px.
    pub radius: i32,
    /// s, 2⁻¹⁶ px.
    pub shift: [i32; 2],
}

impl Motion {
    /// Of markers at `features` that rest at `tare`.
    pub fn of(directions: &[[i32; 2]; 4], features: &Features, tare: &Features) -> Motion {
        let limited = |now: i32, rest: i32| {
            (i64::from(now) - i64::from(rest)).clamp(-LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT)
        };
        let (mut apart, mut together) = (0, [0; 2]);
        let markers = features
            .centroids
            .iter()
            .zip(&tare.centroids)
            .zip(directions);
        for ((now, rest), direction) in markers {
            let moved = [limited(now.0.0, rest.0.0), limited(now.1.0, rest.1.0)];
            for axis in 0..2 {
                apart += moved[axis] * i64::from(direction[axis]);
                together[axis] += moved[axis];
            }
        }
        Motion {
            radius: ((apart + (1 << 16)) >> 17) as i32,
            shift: together.map(|sum| ((sum + 2) >> 2) as i32),
        }
    }
}

impl ClosedForm<'_> {
    /// (F_x, F_y, F_z) in µN, and whether the radius lies beyond the last knot.
    pub fn force(&self, features: &Features, tare: &Features) -> ([i32; 3], bool) {
        let Motion { radius, shift } = Motion::of(&self.directions, features, tare);
        let ([g, h, k], beyond) = self.curves(radius);
        let [x, y] = shift.map(i64::from);
        let square = ((x * x + y * y + (1 << 15)) >> 16).min(LARGEST_SQUARE);
        let scaled = |product: i64| (product + (1 << 23)) >> 24;
        let limited = |value: i64| value.clamp(i64::from(-i32::MAX), i64::from(i32::MAX)) as i32;
        let force = [scaled(h * x), scaled(h * y), -(g + scaled(k * square))];
        (force.map(limited), beyond)
    }

    /// g, h and k at a radius, each below 2³¹ in size times what the radius is beyond the last knot.
    fn curves(&self, radius: i32) -> ([i64; 3], bool) {
        let radius = radius.max(0);
        let last = self.knots.len().saturating_sub(2);
        let index = ((radius >> self.step_bits) as usize).min(last);
        let part = i64::from(radius) - ((index as i64) << self.step_bits);
        let (from, to) = (self.knot(index), self.knot(index + 1));
        let half = (1 << self.step_bits) >> 1;
        let values = core::array::from_fn(|curve| {
            let rise = i64::from(to[curve]) - i64::from(from[curve]);
            let value = i64::from(from[curve]) + ((rise * part + half) >> self.step_bits);
            value.clamp(i64::from(-LARGEST_KNOT), i64::from(LARGEST_KNOT))
        });
        (values, part > 1 << self.step_bits)
    }

    /// g, h and k at a knot.
    pub(crate) fn knot(&self, index: usize) -> [i32; 3] {
        // A parsed closed form has at least two knots, and no index beyond them is asked for.
        let bytes = self.knots.get(index).copied().unwrap_or_default();
        core::array::from_fn(|curve| {
            let at = 4 * curve;
            i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        })
    }
}
