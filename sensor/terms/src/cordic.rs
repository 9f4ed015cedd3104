//! Computes sine and cosine of an angle in integers, by rotation in ever smaller steps (CORDIC).
//!
//! Over every input, the error of [`sin_cos`] is at most 4 · 2⁻³⁰; the tests assert it.

use crate::fixed::Q;
use crate::units::MilliDegrees;

/// Rotations. The last turns by 2⁻³¹ rad = 2.7 · 10⁻⁵ m°.
const STEPS: usize = 32;
/// Fractional bits of the angle during the rotation: 1 m° = 2²⁰.
const ANGLE_BITS: u32 = 20;
const HALF_TURN: i64 = 180_000 << ANGLE_BITS;

/// atan(2⁻ⁱ) in m° · 2²⁰, rounded.
const STEP_ANGLES: [i64; STEPS] = [
    47_185_920_000,
    27_855_475_103,
    14_718_068_031,
    7_471_121_143,
    3_750_058_394,
    1_876_857_306,
    938_657_668,
    469_357_477,
    234_682_319,
    117_341_607,
    58_670_860,
    29_335_437,
    14_667_719,
    7_333_860,
    3_666_930,
    1_833_465,
    916_732,
    458_366,
    229_183,
    114_592,
    57_296,
    28_648,
    14_324,
    7_162,
    3_581,
    1_790,
    895,
    448,
    224,
    112,
    56,
    28,
];
/// Π cos(atan(2⁻ⁱ)) · 2⁶⁰, the inverse of the factor by which all steps together stretch a vector.
const GAIN_INVERSE: i64 = 700_114_967_507_363_239;

/// Returns (sin, cos) of an angle.
pub fn sin_cos(angle: MilliDegrees) -> (Q<30>, Q<30>) {
    let turns = i64::from(angle.0).rem_euclid(360_000) << ANGLE_BITS;
    // The steps reach ±99°: the other half of the circle is folded onto this one.
    let (mut left, flipped) = match turns {
        t if t <= HALF_TURN / 2 => (t, false),
        t if t <= HALF_TURN + HALF_TURN / 2 => (t - HALF_TURN, true),
        t => (t - 2 * HALF_TURN, false),
    };
    let (mut x, mut y) = (GAIN_INVERSE, 0);
    for (step, step_angle) in STEP_ANGLES.iter().enumerate() {
        if left > 0 {
            (x, y) = (x - (y >> step), y + (x >> step));
            left -= step_angle;
        } else {
            (x, y) = (x + (y >> step), y - (x >> step));
            left += step_angle;
        }
    }
    // At most 1, plus a few steps of rounding.
    let rounded = |value| Q::<60, i64>::from_bits(value).rounded_to().narrowed();
    let sign = if flipped { -1 } else { 1 };
    (rounded(y) * sign, rounded(x) * sign)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_those_of_their_formulas() {
        let mut gain = 1.0f64;
        for (step, angle) in STEP_ANGLES.iter().enumerate() {
            let tangent = (-(step as f64)).exp2();
            let exact = tangent.atan().to_degrees() * 1e3 * f64::from(1 << ANGLE_BITS);
            assert!((*angle as f64 - exact).abs() < 0.51, "step {step}");
            gain /= (1.0 + tangent * tangent).sqrt();
        }
        assert!((GAIN_INVERSE as f64 / (1i64 << 60) as f64 - gain).abs() < 1e-15);
    }

    #[test]
    fn every_thousandth_of_a_degree_is_met() {
        for angle in -180_000..=180_000 {
            let radians = (f64::from(angle) * 1e-3).to_radians();
            let (sin, cos) = sin_cos(MilliDegrees(angle));
            for (found, exact) in [(sin, radians.sin()), (cos, radians.cos())] {
                let error = f64::from(found.bits()) - exact * f64::from(1 << 30);
                assert!(error.abs() <= 4.0, "{angle} m°: {error}");
            }
        }
    }

    #[test]
    fn extreme_arguments() {
        for angle in [i32::MIN, i32::MAX] {
            let (sin, cos) = sin_cos(MilliDegrees(angle));
            let [sin, cos] = [sin, cos].map(|part| i64::from(part.bits()));
            assert_eq!((sin * sin + cos * cos + (1 << 59)) >> 60, 1);
        }
    }
}
