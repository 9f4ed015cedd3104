//! Angles and their sine and cosine in integers, by rotation in ever smaller steps (CORDIC).
//!
//! Against exact arithmetic, over every input: [`atan2`] is off by at most 0.51 m° (0.5 of it is the rounding to
//! whole m°), [`sin_cos`] by at most 4 · 2⁻³⁰. The tests assert these two figures.

use crate::units::MilliDegrees;

/// One in the results of [`sin_cos`].
pub const ONE_BITS: u32 = 30;

/// Rotations. The last turns by 2⁻³¹ rad = 2.7 · 10⁻⁵ m°.
const STEPS: usize = 32;
/// Fractional bits of an angle while it is turned: 1 m° = 2²⁰.
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
/// Π cos(atan(2⁻ⁱ)) · 2⁶⁰: what every rotation by all steps divides a length by.
const GAIN_INVERSE: i64 = 700_114_967_507_363_239;

/// The angle of (x, y) from the x axis towards y, −180,000 < angle ≤ 180,000 m°; 0 for (0, 0).
pub fn atan2(y: i64, x: i64) -> MilliDegrees {
    let (mut x, mut y) = normalize(x, y);
    let mut angle = 0;
    if x < 0 {
        angle = if y < 0 { -HALF_TURN } else { HALF_TURN };
        (x, y) = (-x, -y);
    }
    if (x, y) == (0, 0) {
        return MilliDegrees(0);
    }
    for (step, step_angle) in STEP_ANGLES.iter().enumerate() {
        if y > 0 {
            (x, y) = (x + (y >> step), y - (x >> step));
            angle += step_angle;
        } else {
            (x, y) = (x - (y >> step), y + (x >> step));
            angle -= step_angle;
        }
    }
    let rounded = round_angle(angle);
    MilliDegrees(if rounded == -180_000 {
        180_000
    } else {
        rounded
    })
}

/// (sin, cos) of an angle, with [`ONE_BITS`] fractional bits.
pub fn sin_cos(angle: MilliDegrees) -> (i64, i64) {
    let turns = i64::from(angle.0).rem_euclid(360_000) << ANGLE_BITS;
    // The steps reach ±99°: fold the other half of the circle onto this one.
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
    let round = |value: i64| (value + (1 << 29)) >> (60 - ONE_BITS);
    let sign = if flipped { -1 } else { 1 };
    (sign * round(y), sign * round(x))
}

/// Both shifted alike until the larger has 60 bits: small numbers then turn as precisely as large ones.
fn normalize(x: i64, y: i64) -> (i64, i64) {
    let magnitude = x.unsigned_abs() | y.unsigned_abs();
    match magnitude.leading_zeros() {
        64 => (0, 0),
        zeros if zeros >= 4 => (x << (zeros - 4), y << (zeros - 4)),
        zeros => (x >> (4 - zeros), y >> (4 - zeros)),
    }
}

fn round_angle(angle: i64) -> i32 {
    ((angle + (1 << (ANGLE_BITS - 1))) >> ANGLE_BITS) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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

    /// Error in m°, the short way round the circle.
    fn atan2_error(y: i64, x: i64) -> f64 {
        let exact = (y as f64).atan2(x as f64).to_degrees() * 1e3;
        let error = (f64::from(atan2(y, x).0) - exact).abs();
        error.min(360_000.0 - error)
    }

    #[test]
    fn every_thousandth_of_a_degree_is_met() {
        for angle in -180_000..=180_000 {
            let radians = (f64::from(angle) * 1e-3).to_radians();
            let (sin, cos) = sin_cos(MilliDegrees(angle));
            for (found, exact) in [(sin, radians.sin()), (cos, radians.cos())] {
                let error = found as f64 - exact * f64::from(1 << ONE_BITS);
                assert!(error.abs() <= 4.0, "{angle} m°: {error}");
            }
            let back = atan2(sin, cos).0;
            assert_eq!(back, if angle == -180_000 { 180_000 } else { angle });
        }
    }

    #[test]
    fn special_directions() {
        for size in [1, 3, 1 << 31, 1 << 62] {
            for (y, x, angle) in [
                (0, size, 0),
                (size, size, 45_000),
                (size, 0, 90_000),
                (size, -size, 135_000),
                (0, -size, 180_000),
                (-size, -size, -135_000),
                (-size, 0, -90_000),
                (-1, -(1 << 40), 180_000),
            ] {
                assert_eq!(atan2(y, x), MilliDegrees(angle), "({x}, {y})");
            }
        }
        assert_eq!(atan2(0, 0), MilliDegrees(0));
    }

    #[test]
    fn extreme_arguments() {
        for (y, x) in [
            (i64::MIN, i64::MIN),
            (i64::MAX, i64::MIN),
            (1, i64::MIN),
            (i64::MIN, 1),
        ] {
            assert!(atan2_error(y, x) <= 0.51, "({x}, {y})");
        }
        for angle in [i32::MIN, i32::MAX] {
            let (sin, cos) = sin_cos(MilliDegrees(angle));
            assert_eq!((sin * sin + cos * cos + (1 << 59)) >> 60, 1);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn atan2_is_within_its_bound(y: i64, x: i64, y_shift in 0u32..64, x_shift in 0u32..64) {
            prop_assert!(atan2_error(y >> y_shift, x >> x_shift) <= 0.51);
        }
    }
}
